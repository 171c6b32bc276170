//! The core's parameters as text: TOML files, and single assignments.

use std::{fs::File, io, io::Read, path::Path};

use fitmac_core::{Params, ValidParams};
use toml::{Table, Value};

/// Longest configuration file, bytes.
const SIZE_MAX: u64 = 64 << 10;

/// Parameters that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{origin} cannot be read: {source}")]
    Io {
        /// The file.
        origin: String,
        /// Why.
        source: io::Error,
    },
    /// The file is too long to be a configuration.
    #[error("{0} is longer than {SIZE_MAX} bytes: this is no FIT-MAC configuration")]
    TooLong(String),
    /// It is no TOML, or a key or a type is wrong.
    #[error("{origin}: {detail}")]
    Text {
        /// The file or the argument.
        origin: String,
        /// What the parser says: line, key, what it expected.
        detail: String,
    },
    /// There is no such profile.
    #[error("{origin}: there is no profile `{name}`; there are `guarded` and `paper`")]
    Profile {
        /// The file or the argument.
        origin: String,
        /// What was asked for.
        name: String,
    },
    /// Values are out of range, or contradict each other.
    #[error("{origin}: {}", .violations.join("; "))]
    Values {
        /// The file or the argument.
        origin: String,
        /// Every violation.
        violations: Vec<String>,
    },
}

/// The parameters of a named profile.
///
/// # Errors
/// If there is no such profile.
pub fn profile(origin: &str, name: &str) -> Result<Params, ConfigError> {
    match name {
        "guarded" => Ok(Params::guarded()),
        "paper" => Ok(Params::paper()),
        _ => Err(ConfigError::Profile {
            origin: origin.into(),
            name: name.escape_default().to_string(),
        }),
    }
}

/// Reads parameters from a file. Keys that it doesn't name keep the value of
/// the file's `profile` (`guarded` if it names none).
///
/// # Errors
/// If the file is unreadable, misspelt or out of range.
pub fn load(path: &Path) -> Result<ValidParams, ConfigError> {
    let origin = path.display().to_string();
    let mut text = String::new();
    let n = File::open(path)
        .and_then(|file| file.take(SIZE_MAX + 1).read_to_string(&mut text))
        .map_err(|source| ConfigError::Io {
            origin: origin.clone(),
            source,
        })?;
    if n as u64 > SIZE_MAX {
        return Err(ConfigError::TooLong(origin));
    }
    parse(&origin, &text)
}

/// Parameters from text, as [`load`] reads them from a file.
///
/// # Errors
/// If the text is misspelt or out of range.
pub fn parse(origin: &str, text: &str) -> Result<ValidParams, ConfigError> {
    let bad = |detail: String| ConfigError::Text {
        origin: origin.into(),
        detail,
    };
    let mut table: Table = toml::from_str(text).map_err(|e| bad(e.to_string()))?;
    let base = match table.remove("profile") {
        None => Params::default(),
        Some(Value::String(name)) => profile(origin, &name)?,
        Some(_) => return Err(bad("profile must be text: `guarded` or `paper`".into())),
    };
    // Once by itself, for the place of a misspelt key.
    if !text.contains("profile") {
        toml::from_str::<Params>(text).map_err(|e| bad(e.to_string()))?;
    }
    let mut merged = to_table(&base).map_err(bad)?;
    merge(&mut merged, table);
    let params: Params = Value::Table(merged)
        .try_into()
        .map_err(|e: toml::de::Error| bad(e.to_string()))?;
    validate(origin, params)
}

/// The parameters as a configuration file that [`parse`] reads back.
///
/// # Panics
/// Never: parameters are numbers and names.
#[must_use]
pub fn to_text(params: &ValidParams) -> String {
    toml::to_string_pretty(params.get()).expect("numbers and names can be written")
}

/// The parameters with assignments like `gate.failure_streak=2` applied.
///
/// # Errors
/// If a key does not exist, a value has the wrong type, or the result is out
/// of range.
pub fn assign<S: AsRef<str>>(
    params: &ValidParams,
    assignments: &[S],
) -> Result<ValidParams, ConfigError> {
    let origin = assignments
        .iter()
        .map(AsRef::as_ref)
        .collect::<Vec<_>>()
        .join(" ");
    let bad = |detail: String| ConfigError::Text {
        origin: origin.clone(),
        detail,
    };
    let mut table = to_table(params.get()).map_err(bad)?;
    for assignment in assignments {
        assign_one(&mut table, assignment.as_ref()).map_err(bad)?;
    }
    let changed: Params = Value::Table(table)
        .try_into()
        .map_err(|e: toml::de::Error| bad(e.to_string()))?;
    validate(&origin, changed)
}

fn assign_one(table: &mut Table, assignment: &str) -> Result<(), String> {
    let (path, text) = assignment
        .split_once('=')
        .ok_or_else(|| "write it as key=value, like gate.failure_streak=2".to_owned())?;
    let value = parse_value(text.trim());
    let mut keys: Vec<&str> = path.trim().split('.').collect();
    let last = keys.pop().unwrap_or_default();
    let mut place = table;
    for key in keys {
        place = match place.get_mut(key) {
            Some(Value::Table(inner)) => inner,
            _ => return Err(format!("there is no stage `{key}`")),
        };
    }
    let known = place.keys().cloned().collect::<Vec<_>>().join(", ");
    let slot = place
        .get_mut(last)
        .ok_or_else(|| format!("there is no `{last}` in it; there are {known}"))?;
    // A whole number is a fine value for a parameter with a fraction.
    *slot = match (&slot, value) {
        (Value::Float(_), Value::Integer(n)) => Value::Float(n as f64),
        (_, value) => value,
    };
    Ok(())
}

/// A TOML value, or a bare word as text.
fn parse_value(text: &str) -> Value {
    toml::from_str::<Table>(&format!("v = {text}"))
        .ok()
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

fn to_table(params: &Params) -> Result<Table, String> {
    Table::try_from(params).map_err(|e| e.to_string())
}

fn merge(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(over)) => merge(inner, over),
            (Some(Value::Float(slot)), Value::Integer(n)) => *slot = n as f64,
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Checks parameters.
///
/// # Errors
/// Every violation at once; `origin` says where the parameters come from.
pub fn validate(origin: &str, params: Params) -> Result<ValidParams, ConfigError> {
    params.validate().map_err(|found| ConfigError::Values {
        origin: origin.into(),
        violations: found.iter().map(ToString::to_string).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        for params in [Params::guarded(), Params::paper()] {
            let valid = params.validate().expect("the profiles are valid");
            let text = to_text(&valid);
            assert_eq!(parse("x", &text).expect("reads back"), valid);
        }
    }

    #[test]
    fn a_file_changes_what_it_names_and_keeps_the_profile() {
        let got = parse("x", "profile = \"paper\"\n[gate]\nfailure_streak = 2\n").expect("valid");
        let mut expected = Params::paper();
        expected.gate.failure_streak = 2;
        assert_eq!(*got.get(), expected);
        let whole = parse("x", "[gate]\nconfidence = 1\n").expect("a whole number is a number");
        assert_eq!(whole.get().gate.confidence, 1.0);
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let says = |text: &str| parse("robot.toml", text).expect_err("wrong").to_string();
        let misspelt = says("[gate]\nfailure_streek = 2\n");
        assert!(misspelt.contains("failure_streek") && misspelt.contains("robot.toml"));
        assert!(misspelt.contains("line 2"), "{misspelt}");
        assert!(says("[gate]\nfailure_streak = \"two\"\n").contains("failure_streak"));
        assert!(says("profile = \"brave\"").contains("guarded"));
        assert!(says("profile = 3").contains("guarded"));
        let both = says("[gate]\nfailure_streak = 0\nconfidence = nan\n");
        assert!(both.contains("gate.failure_streak") && both.contains("gate.confidence"));
    }

    #[test]
    fn an_assignment_changes_one_value() {
        let base = Params::default().validate().expect("valid");
        let got = assign(
            &base,
            &[
                "gate.failure_streak=2",
                "switches.hard_pick = false",
                "gate.confidence=0",
            ],
        )
        .expect("valid");
        let mut expected = Params::default();
        expected.gate.failure_streak = 2;
        expected.gate.confidence = 0.0;
        expected.switches.hard_pick = false;
        assert_eq!(*got.get(), expected);
        let word = assign(&base, &["while_rebinding=base_acts"]).expect("a bare word is text");
        assert_ne!(word, base);
        for (bad, says) in [
            ("gate.streak=2", "failure_streak"),
            ("door.streak=2", "door"),
            ("gate.failure_streak", "key=value"),
            ("gate.failure_streak=many", "failure_streak"),
            ("gate.failure_streak=0", "gate.failure_streak"),
        ] {
            let error = assign(&base, &[bad]).expect_err("wrong").to_string();
            assert!(error.contains(says), "{bad}: {error}");
        }
    }

    #[test]
    fn a_file_that_is_no_configuration_is_not_read_to_its_end() {
        let dir = tempfile::tempdir().expect("a directory");
        let path = dir.path().join("big.toml");
        std::fs::write(&path, "#".repeat(SIZE_MAX as usize + 1)).expect("writes");
        assert!(matches!(load(&path), Err(ConfigError::TooLong(_))));
        assert!(matches!(
            load(&dir.path().join("none.toml")),
            Err(ConfigError::Io { .. })
        ));
    }
}
