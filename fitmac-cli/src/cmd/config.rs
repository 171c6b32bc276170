//! `fitmac config`: the parameters, as a file and as a reference.

use fitmac_core::{Params, params::ParamInfo};

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
        print!("{}", reference());
    } else {
        print!("{}", toml::to_string(args.config.load()?.get())?);
    }
    Ok(Exit::Done)
}

/// Every numeric parameter, a table a stage.
fn reference() -> String {
    let mut text = "# Parameters\n\nPrinted by `fitmac config --reference`.\n".to_owned();
    for stage in Params::TABLES {
        if let Some(first) = stage.first() {
            text.push_str(&format!(
                "\n## {}\n\n| parameter | default | range | unit | what it does |\n\
                 |---|---|---|---|---|\n",
                first.stage
            ));
        }
        for ParamInfo {
            stage,
            name,
            unit,
            default,
            min,
            max,
            doc,
        } in *stage
        {
            let doc = doc.trim();
            text.push_str(&format!(
                "| `{stage}.{name}` | {default} | {min} to {max} | {unit} | {doc} |\n"
            ));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_names_every_number_of_the_file() {
        let table = toml::Table::try_from(Params::guarded()).unwrap();
        let reference = reference();
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
        assert_eq!(names, reference.matches("\n| `").count());
        assert!(names > 50, "{names}");
    }
}
