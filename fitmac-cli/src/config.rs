//! The controller's configuration: a profile, a TOML file over it, single
//! settings over both.
//!
//! The file has the core's parameters as the core nests them (`[gate]`,
//! `failure_streak = 3`) and, at the top, `profile`. A key that does not exist
//! is refused.

#[cfg(test)]
mod tests;

use std::{fs::File, io::Read, path::PathBuf, str::FromStr};

use anyhow::{Context, bail};
use fitmac_core::{Params, ValidParams, params::Switches};
use serde::Deserialize;
use toml::{Table, Value, de::DeTable};

use crate::exit::BadInput;

/// Largest configuration file.
const SIZE_MAX: u64 = 64 << 10;

/// A named set of parameters that a file or settings change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, clap::ValueEnum)]
pub(crate) enum Profile {
    /// Do no harm: intervenes on firm evidence only.
    #[default]
    Guarded,
    /// As published.
    Paper,
}

impl Profile {
    fn params(self) -> Params {
        match self {
            Self::Guarded => Params::guarded(),
            Self::Paper => Params::paper(),
        }
    }
}

impl FromStr for Profile {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        clap::ValueEnum::from_str(name, false)
            .map_err(|_| format!("profile is {name:?}, allowed are \"guarded\" and \"paper\""))
    }
}

/// Arguments of every command that has a controller.
#[derive(Clone, Debug, Default, clap::Args)]
#[group(id = "configuration")]
pub(crate) struct Args {
    /// A TOML file of parameters (`fitmac config` prints one).
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// What the parameters start from, unless the file says it.
    #[arg(long)]
    profile: Option<Profile>,
    /// One parameter, as gate.failure_streak=4; wins over the file. Repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    settings: Vec<String>,
    /// Switch all corrections off: the policy's actions pass through.
    #[arg(long)]
    backbone_only: bool,
}

impl Args {
    /// The parameters that the arguments ask for, checked.
    ///
    /// # Errors
    /// [`BadInput`] that names the file, the key and the remedy.
    pub(crate) fn load(&self) -> anyhow::Result<ValidParams> {
        let mut params = self
            .parse()
            .map_err(|error| BadInput(format!("{error:#}")))?;
        if self.backbone_only {
            params.switches = Switches::BACKBONE_ONLY;
        }
        let valid = params.validate();
        valid.map_err(|violations| BadInput(violations.to_string()).into())
    }

    fn parse(&self) -> anyhow::Result<Params> {
        let mut file = match &self.config {
            Some(path) => {
                let text = read(path)?;
                checked_table(&text).with_context(|| path.display().to_string())?
            }
            None => Table::new(),
        };
        let said = match file.remove("profile") {
            Some(Value::String(name)) => Some(name.parse().map_err(anyhow::Error::msg)?),
            Some(_) => bail!("profile must be a string"),
            None => None,
        };
        let profile = said.or(self.profile).unwrap_or_default();
        let mut table = Table::try_from(profile.params()).context("the profile as a table")?;
        overlay(&mut table, file);
        for setting in &self.settings {
            let (key, value) = parse_setting(setting)?;
            set(&mut table, &key, value).with_context(|| format!("--set {setting}"))?;
        }
        let settings = self.settings.join(" ");
        Params::deserialize(table).with_context(|| format!("--set {settings}"))
    }
}

/// The text of a file that is small enough to be a configuration.
fn read(path: &PathBuf) -> anyhow::Result<String> {
    let shown = path.display();
    let file = File::open(path).with_context(|| format!("{shown} cannot be opened"))?;
    let mut text = String::new();
    file.take(SIZE_MAX + 1)
        .read_to_string(&mut text)
        .with_context(|| format!("{shown} cannot be read as UTF-8 text"))?;
    if text.len() as u64 > SIZE_MAX {
        bail!("{shown} is larger than 64 KiB: no configuration is");
    }
    Ok(text)
}

/// The file's table, with every key and type checked while line numbers are at
/// hand.
fn checked_table(text: &str) -> anyhow::Result<Table> {
    let mut parsed = DeTable::parse(text)?;
    parsed.get_mut().remove("profile");
    Params::deserialize(toml::Deserializer::from(parsed)).map_err(|mut error| {
        error.set_input(Some(text));
        error
    })?;
    Ok(text.parse()?)
}

/// Puts every value of `from` into `into`, table by table.
fn overlay(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Table(into)), Value::Table(from)) => overlay(into, from),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

/// Splits `gate.failure_streak=4`. A value that is no TOML value is a string.
fn parse_setting(setting: &str) -> anyhow::Result<(Vec<&str>, Value)> {
    let Some((key, text)) = setting.split_once('=') else {
        bail!("--set {setting}: write KEY=VALUE, as gate.failure_streak=4");
    };
    let text = text.trim();
    let value = format!("value = {text}").parse::<Table>().ok();
    let value = value.and_then(|mut table| table.remove("value"));
    let value = value.unwrap_or_else(|| Value::String(text.to_owned()));
    Ok((key.trim().split('.').collect(), value))
}

/// Sets one value that must exist.
fn set(table: &mut Table, key: &[&str], value: Value) -> anyhow::Result<()> {
    let (last, path) = key.split_last().context("the key is empty")?;
    let mut place = table;
    for part in path {
        let known = names(place, true);
        place = match place.get_mut(*part) {
            Some(Value::Table(inner)) => inner,
            _ => bail!("there is no table `{part}`; there are: {known}"),
        };
    }
    match (place.get(*last), value) {
        (None, _) => bail!(
            "there is no key `{last}`; there are: {}",
            names(place, false)
        ),
        // 1 stands for 1.0.
        (Some(Value::Float(_)), Value::Integer(whole)) => {
            place.insert((*last).to_owned(), Value::Float(whole as f64));
        }
        (Some(_), value) => {
            place.insert((*last).to_owned(), value);
        }
    }
    Ok(())
}

fn names(table: &Table, tables_only: bool) -> String {
    let shown = table
        .iter()
        .filter(|(_, value)| value.is_table() || !tables_only);
    shown
        .map(|(key, _)| key.as_str())
        .collect::<Vec<_>>()
        .join(", ")
}
