//! Named configurations of the controller.

use fitmac_core::params::Switches;
use fitmac_core::{Params, ValidParams};

use crate::error::SimError;
use crate::perception::{PerceptionParams, PoseSource};

/// The thinnest thing that is held in the suites is a bowl's rim of 5 mm; closed on nothing, the
/// pads of this gripper read less than 2 mm.
const THINNEST_HELD_M: f64 = 0.003;

/// Which parts of the controller may act, and what else differs from the profile.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Config {
    name: String,
}

/// The policy alone.
const BASE: &str = "base";
/// The names of the switch settings (the paper's ablations).
const SWITCHES: [(&str, Switches); 6] = [
    (BASE, Switches::BACKBONE_ONLY),
    ("full", Switches::FULL),
    (
        "wo-target",
        Switches {
            target_corrector: false,
            ..Switches::FULL
        },
    ),
    (
        "wo-execution",
        Switches {
            execution_corrector: false,
            ..Switches::FULL
        },
    ),
    (
        "wo-hard-pick",
        Switches {
            hard_pick: false,
            ..Switches::FULL
        },
    ),
    (
        "wo-hard-place",
        Switches {
            hard_place: false,
            ..Switches::FULL
        },
    ),
];

impl Config {
    /// Reads a configuration: a name, or a name and parameters that differ, as in
    /// `full+gate.failure_streak=2`.
    ///
    /// # Errors
    /// [`SimError::Unknown`] for another name, [`SimError::Invalid`] for a parameter that does
    /// not exist or is out of range.
    pub fn parse(text: &str) -> Result<Self, SimError> {
        let config = Self {
            name: text.to_owned(),
        };
        params_for(&config, Profile::Guarded, 8)?;
        Ok(config)
    }

    /// As it was read.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether the policy plays alone: there is no controller.
    #[must_use]
    pub fn is_base(&self) -> bool {
        self.name == BASE
    }

    fn parts(&self) -> impl Iterator<Item = &str> {
        self.name.split('+')
    }
}

/// The parameters that a configuration starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Profile {
    /// Do no harm.
    Guarded,
    /// As published.
    Paper,
}

impl Profile {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Guarded, Self::Paper];

    /// The name that tables and command lines use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Guarded => "guarded",
            Self::Paper => "paper",
        }
    }

    /// The profile of that name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(name: &str) -> Result<Self, SimError> {
        let names = Self::ALL.iter().map(|p| p.name());
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| SimError::unknown("profile", name, names))
    }
}

/// What the controller sees of the objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Vision {
    /// The simulator's own poses.
    Truth,
    /// A modelled perception.
    Modelled,
}

impl Vision {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Truth, Self::Modelled];

    /// The name that tables and command lines use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Modelled => "modelled",
        }
    }

    /// The perception of that name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(name: &str) -> Result<Self, SimError> {
        let names = Self::ALL.iter().map(|p| p.name());
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| SimError::unknown("perception", name, names))
    }

    /// The pose source.
    ///
    /// # Errors
    /// As for [`PerceptionParams::embedded`].
    pub fn source(self) -> Result<PoseSource, SimError> {
        Ok(match self {
            Self::Truth => PoseSource::Truth,
            Self::Modelled => PoseSource::Modelled(PerceptionParams::embedded()?),
        })
    }
}

/// Who plans and grounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Knowledge {
    /// The project's own planner and grounder, from the instruction and what perception tells.
    Agents,
    /// The simulator's answer: the upper bound of grounding.
    Simulator,
}

impl Knowledge {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Agents, Self::Simulator];

    /// The name that tables and command lines use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Agents => "agents",
            Self::Simulator => "simulator",
        }
    }

    /// The knowledge of that name.
    ///
    /// # Errors
    /// [`SimError::Unknown`], listing the names that exist.
    pub fn by_name(name: &str) -> Result<Self, SimError> {
        let names = Self::ALL.iter().map(|k| k.name());
        Self::ALL
            .into_iter()
            .find(|k| k.name() == name)
            .ok_or_else(|| SimError::unknown("knowledge", name, names))
    }
}

/// The controller's parameters for a configuration and a policy that plays `open_loop` actions of
/// a chunk.
///
/// # Errors
/// As for [`Config::parse`].
pub fn params_for(
    config: &Config,
    profile: Profile,
    open_loop: u32,
) -> Result<ValidParams, SimError> {
    let mut params = match profile {
        Profile::Guarded => Params::guarded(),
        Profile::Paper => Params::paper(),
    };
    params.chunk.open_loop_steps = open_loop;
    params.gripper.empty_width_m = params.gripper.empty_width_m.min(THINNEST_HELD_M);
    let mut parts = config.parts();
    let name = parts.next().unwrap_or_default();
    let known = SWITCHES.iter().map(|(known, _)| *known);
    params.switches = SWITCHES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, switches)| *switches)
        .ok_or_else(|| SimError::unknown("configuration", name, known))?;
    for assignment in parts {
        assign(&mut params, assignment)?;
    }
    params.validate().map_err(|violations| {
        SimError::invalid(
            format!("configuration `{}`", config.name),
            violations.to_string(),
        )
    })
}

/// Changes one of the parameters, as in `gate.failure_streak=2`.
fn assign(params: &mut Params, assignment: &str) -> Result<(), SimError> {
    let wrong = |problem: String| SimError::invalid(format!("`{assignment}`"), problem);
    let (key, value) = assignment
        .split_once('=')
        .ok_or_else(|| wrong("an assignment reads stage.parameter=value".to_owned()))?;
    params.assign(key, value).map_err(|e| wrong(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configurations_switch_and_assign() {
        let full = Config::parse("full").unwrap();
        let base = Config::parse("base").unwrap();
        let open = |c: &Config| *params_for(c, Profile::Guarded, 5).unwrap().get();
        assert_eq!(open(&full).switches, Switches::FULL);
        assert!(open(&base).switches.none());
        assert_eq!(open(&full).chunk.open_loop_steps, 5);
        let two = Config::parse("full+gate.failure_streak=2").unwrap();
        assert_eq!(open(&two).gate.failure_streak, 2);
        let mut back = open(&two);
        back.gate.failure_streak = open(&full).gate.failure_streak;
        assert_eq!(back, open(&full), "nothing else changes");
    }

    #[test]
    fn mistakes_are_named() {
        let error = |text: &str| Config::parse(text).unwrap_err().to_string();
        assert!(error("half").contains("wo-hard-pick"));
        assert!(error("full+gate.failures=2").contains("no such parameter"));
        assert!(error("full+gate.failure_streak=x").contains("gate.failure_streak=x"));
        assert!(error("full+gate").contains("stage.parameter=value"));
        assert!(error("full+gate.failure_streak=0").contains("failure_streak"));
    }
}
