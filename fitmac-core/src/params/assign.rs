//! Single parameters by name and text, where there is no allocator for a file
//! format: the C interface.

use super::{OutOfRange, Params, PolicyGripper, WhileRebinding};

/// Why an assignment was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AssignError {
    /// There is no such parameter.
    UnknownKey,
    /// The text is no value of the parameter's type.
    NotAValue,
}

impl core::fmt::Display for AssignError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::UnknownKey => "there is no such parameter",
            Self::NotAValue => "the text is no value of the parameter's type",
        })
    }
}

impl core::error::Error for AssignError {}

impl Params {
    /// Sets one parameter: `gate.failure_streak` to `3`, `switches.hard_pick`
    /// to `false`, `out_of_range` to `refuse`. Keys and words are those of the
    /// configuration file. The range is checked by [`Params::validate`].
    ///
    /// # Errors
    /// If there is no such key, or the text is no value for it.
    pub fn assign(&mut self, key: &str, text: &str) -> Result<(), AssignError> {
        match key.split_once('.') {
            Some(("switches", name)) => self.assign_switch(name, text),
            Some((stage, name)) => self.assign_stage(stage, name, text),
            None => self.assign_choice(key, text),
        }
    }

    fn assign_switch(&mut self, name: &str, text: &str) -> Result<(), AssignError> {
        let slot = match name {
            "target_corrector" => &mut self.switches.target_corrector,
            "execution_corrector" => &mut self.switches.execution_corrector,
            "hard_pick" => &mut self.switches.hard_pick,
            "hard_place" => &mut self.switches.hard_place,
            _ => return Err(AssignError::UnknownKey),
        };
        *slot = text.parse().map_err(|_| AssignError::NotAValue)?;
        Ok(())
    }

    fn assign_choice(&mut self, key: &str, text: &str) -> Result<(), AssignError> {
        match (key, text) {
            ("out_of_range", "clamp") => self.out_of_range = OutOfRange::Clamp,
            ("out_of_range", "refuse") => self.out_of_range = OutOfRange::Refuse,
            ("while_rebinding", "hold") => self.while_rebinding = WhileRebinding::Hold,
            ("while_rebinding", "base_acts") => self.while_rebinding = WhileRebinding::BaseActs,
            ("policy_gripper", "minus_one_open") => {
                self.policy_gripper = PolicyGripper::MinusOneOpen;
            }
            ("policy_gripper", "one_open") => self.policy_gripper = PolicyGripper::OneOpen,
            ("out_of_range" | "while_rebinding" | "policy_gripper", _) => {
                return Err(AssignError::NotAValue);
            }
            _ => return Err(AssignError::UnknownKey),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_can_be_set_by_its_name() {
        for info in Params::TABLES.iter().copied().flatten() {
            let mut params = Params::default();
            let mut key = heapless_key(info.stage, info.name);
            let text = if info.max == info.max as u32 as f64 {
                "7"
            } else {
                "7.5"
            };
            assert_eq!(
                params.assign(key.as_str(), text),
                Ok(()),
                "{}",
                key.as_str()
            );
            assert_ne!(
                params,
                Params::default(),
                "{} has 7 as its default",
                key.as_str()
            );
            key.push("x");
            assert_eq!(
                params.assign(key.as_str(), "7"),
                Err(AssignError::UnknownKey)
            );
        }
    }

    #[test]
    fn words_and_switches_are_those_of_the_file() {
        let mut params = Params::default();
        for (key, text) in [
            ("switches.target_corrector", "false"),
            ("switches.execution_corrector", "false"),
            ("switches.hard_pick", "false"),
            ("switches.hard_place", "false"),
            ("out_of_range", "refuse"),
            ("while_rebinding", "base_acts"),
            ("policy_gripper", "one_open"),
        ] {
            let before = params;
            assert_eq!(
                params.assign(key, "perhaps"),
                Err(AssignError::NotAValue),
                "{key}"
            );
            assert_eq!(params.assign(key, text), Ok(()), "{key}");
            assert_ne!(params, before, "{key}");
        }
        for key in [
            "",
            ".",
            "gate",
            "gate.",
            "switches.all",
            "gate.failure_streak.x",
        ] {
            assert_eq!(
                params.assign(key, "1"),
                Err(AssignError::UnknownKey),
                "{key}"
            );
        }
        assert_eq!(
            params.assign("gate.failure_streak", "-1"),
            Err(AssignError::NotAValue)
        );
        assert_eq!(
            params.assign("gate.confidence", "high"),
            Err(AssignError::NotAValue)
        );
    }

    /// A key without an allocator.
    struct Key([u8; 96], usize);

    impl Key {
        fn push(&mut self, text: &str) {
            self.0[self.1..self.1 + text.len()].copy_from_slice(text.as_bytes());
            self.1 += text.len();
        }

        fn as_str(&self) -> &str {
            core::str::from_utf8(&self.0[..self.1]).expect("keys are ASCII")
        }
    }

    fn heapless_key(stage: &str, name: &str) -> Key {
        let mut key = Key([0; 96], 0);
        key.push(stage);
        key.push(".");
        key.push(name);
        key
    }
}
