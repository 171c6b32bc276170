//! `fitmac config`: the parameters, as a file and as a reference.

use anyhow::Context;
use fitmac_core::{Params, params::ParamInfo};
use toml::{Table, Value};

use crate::{config, exit::Exit};

/// Arguments of `config`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac config > cell.toml                every parameter, to edit
  fitmac config --config cell.toml         check a file, print what it makes
  fitmac config --profile paper --set gate.failure_streak=4
  fitmac config --reference                unit, range, default and reason of each

Exit status: 0 if the parameters are valid, 2 if not; every violation is named.")]
pub(crate) struct Args {
    #[command(flatten)]
    config: config::Args,
    /// Print the reference of all parameters as Markdown instead.
    #[arg(long, conflicts_with_all = ["configuration"])]
    reference: bool,
}

/// Prints the parameters that the arguments ask for.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    if args.reference {
        print!("{}", reference()?);
    } else {
        print!("{}", toml::to_string(args.config.load()?.get())?);
    }
    Ok(Exit::Done)
}

/// Every parameter: the choices first, then the numbers, a table a stage.
fn reference() -> anyhow::Result<String> {
    let [guarded, paper] = [Params::guarded(), Params::paper()].map(Table::try_from);
    let (guarded, paper) = (guarded?, paper?);
    let mut text = "# Parameters\n\nPrinted by `fitmac config --reference`. `fitmac config` \
                    prints them as a file; a file may leave out what it does not change, and may \
                    begin with `profile = \"paper\"`.\n\n## Choices\n\n\
                    | parameter | guarded | paper |\n|---|---|---|\n"
        .to_owned();
    for (key, value) in choices("", &guarded) {
        let in_paper = lookup(&paper, &key).unwrap_or(value);
        text.push_str(&format!("| `{key}` | {value} | {in_paper} |\n"));
    }
    for stage in Params::TABLES {
        if let Some(first) = stage.first() {
            text.push_str(&format!(
                "\n## {}\n\n| parameter | guarded | paper | range | unit | what it does |\n\
                 |---|---|---|---|---|---|\n",
                first.stage
            ));
        }
        for ParamInfo {
            stage,
            name,
            unit,
            min,
            max,
            doc,
            ..
        } in *stage
        {
            let key = format!("{stage}.{name}");
            let [guarded, paper] = [&guarded, &paper].map(|table| lookup(table, &key));
            let (guarded, paper) = guarded.zip(paper).context("a parameter is in no file")?;
            let doc = doc.trim();
            text.push_str(&format!(
                "| `{key}` | {guarded} | {paper} | {min} to {max} | {unit} | {doc} |\n"
            ));
        }
    }
    Ok(text)
}

/// The parameters that are no numbers, by their dotted keys.
fn choices<'a>(path: &str, table: &'a Table) -> Vec<(String, &'a Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) => found.extend(choices(&format!("{path}{key}."), inner)),
            Value::Integer(_) | Value::Float(_) => {}
            other => found.push((format!("{path}{key}"), other)),
        }
    }
    found
}

fn lookup<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        None => table.get(key),
        Some((stage, name)) => lookup(table.get(stage)?.as_table()?, name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_names_every_number_of_the_file() {
        let table = Table::try_from(Params::guarded()).unwrap();
        let reference = reference().unwrap();
        let mut names = 0;
        for (stage, value) in &table {
            for (name, value) in value.as_table().into_iter().flatten() {
                if value.is_integer() || value.is_float() {
                    assert!(
                        reference.contains(&format!("| `{stage}.{name}` |")),
                        "{stage}.{name}"
                    );
                    names += 1;
                }
            }
        }
        let choices = choices("", &table);
        assert_eq!(names + choices.len(), reference.matches("\n| `").count());
        assert!(names > 50 && choices.len() > 4, "{names}, {choices:?}");
    }
}
