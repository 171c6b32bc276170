//! The core's parameters as text: how a trace carries them, and how a replay
//! changes one.

use fitmac_core::{Params, ValidParams};
use toml::{Table, Value};

/// Parameters that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// It is no TOML, or a key or a type is wrong.
    #[error("{origin}: {detail}")]
    Text {
        /// Where the text comes from.
        origin: String,
        /// What the parser says: line, key, what it expected.
        detail: String,
    },
    /// Values are out of range, or contradict each other.
    #[error("{origin}: {}", .violations.join("; "))]
    Values {
        /// Where the text comes from.
        origin: String,
        /// Every violation.
        violations: Vec<String>,
    },
}

/// Parameters from text (TOML). Keys that it doesn't name have their default.
///
/// # Errors
/// If the text is misspelt or out of range.
pub fn parse(origin: &str, text: &str) -> Result<ValidParams, ConfigError> {
    let params = toml::from_str(text).map_err(|e| ConfigError::Text {
        origin: origin.into(),
        detail: e.to_string(),
    })?;
    validate(origin, params)
}

/// The parameters as text that [`parse`] reads back.
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

fn validate(origin: &str, params: Params) -> Result<ValidParams, ConfigError> {
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
    fn mistakes_are_named_with_their_place() {
        let says = |text: &str| parse("robot.toml", text).expect_err("wrong").to_string();
        let misspelt = says("[gate]\nfailure_streek = 2\n");
        assert!(misspelt.contains("failure_streek") && misspelt.contains("robot.toml"));
        assert!(misspelt.contains("line 2"), "{misspelt}");
        assert!(says("[gate]\nfailure_streak = \"two\"\n").contains("failure_streak"));
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
}
