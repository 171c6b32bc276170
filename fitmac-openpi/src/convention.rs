//! What the user declares about the policy, and the check of its actions against that.

use fitmac_core::{
    message::{ACTION_DIM, CHUNK_CAPACITY},
    wire::{ActionFrame, ActionSpace, GripperConvention},
};

use crate::refusal::Refusal;

/// How far a component of a sound action may lie from 0, before the core's own clamp or refusal
/// at 1. A policy's output is unbounded: openpi maps a normalised output back by the quantiles of
/// the training data, and overshoots a little. Poses in metres, joint angles or pixels do not stay
/// within this for long.
pub const MAGNITUDE_MAX: f64 = 1.5;
/// How far a gripper number may lie outside of the declared interval.
pub const GRIPPER_SLACK: f64 = 0.5;

/// What the policy's actions mean. The server does not say: the user declares it, every answer is
/// checked against it as far as numbers can tell, and every chunk carries it to the core, which
/// refuses what it is not set up for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conventions {
    /// How the seven numbers of an action are meant.
    pub action_space: ActionSpace,
    /// The frame of the increments.
    pub frame: ActionFrame,
    /// What the gripper's number means.
    pub gripper: GripperConvention,
    /// Actions in an answer, 1 to [`CHUNK_CAPACITY`] (openpi's LIBERO policies: pi0 50, pi0-FAST
    /// and pi0.5 10).
    pub horizon: usize,
}

/// A declared horizon that no chunk can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("horizon is {0}; a chunk holds 1 to {CHUNK_CAPACITY} actions")]
pub struct HorizonError(pub usize);

impl Conventions {
    /// Those of openpi's LIBERO policies, with answers of `horizon` actions.
    #[must_use]
    pub const fn libero(horizon: usize) -> Self {
        Self {
            action_space: ActionSpace::OscPoseDelta,
            frame: ActionFrame::Base,
            gripper: GripperConvention::MinusOneOpen,
            horizon,
        }
    }

    /// Checks the declaration itself.
    ///
    /// # Errors
    /// [`HorizonError`] if no chunk can hold so many actions, or there are none.
    pub const fn validate(&self) -> Result<(), HorizonError> {
        match self.horizon {
            1..=CHUNK_CAPACITY => Ok(()),
            horizon => Err(HorizonError(horizon)),
        }
    }

    /// Checks the actions of an answer, and gives them as the wire has them.
    ///
    /// # Errors
    /// The first violation: [`Refusal::Horizon`], [`Refusal::NotFinite`], [`Refusal::OutOfRange`],
    /// [`Refusal::GripperConvention`].
    pub fn check(&self, rows: &[[f64; ACTION_DIM]]) -> Result<Vec<[f32; ACTION_DIM]>, Refusal> {
        if rows.len() != self.horizon {
            return Err(Refusal::Horizon {
                actions: rows.len(),
                declared: self.horizon,
            });
        }
        for (row, action) in rows.iter().enumerate() {
            self.check_action(row, action)?;
        }
        // Finite and small by now: the narrower type only rounds.
        Ok(rows.iter().map(|action| action.map(|x| x as f32)).collect())
    }

    fn check_action(&self, row: usize, action: &[f64; ACTION_DIM]) -> Result<(), Refusal> {
        if let Some(column) = action.iter().position(|x| !x.is_finite()) {
            let value = action[column];
            return Err(Refusal::NotFinite { row, column, value });
        }
        let [increments @ .., gripper] = action;
        match self.action_space {
            ActionSpace::OscPoseDelta => {
                let wide = |x: &f64| x.abs() > MAGNITUDE_MAX;
                if let Some(column) = increments.iter().position(wide) {
                    let value = increments[column];
                    return Err(Refusal::OutOfRange { row, column, value });
                }
            }
        }
        let (least, greatest) = match self.gripper {
            GripperConvention::MinusOneOpen => (-1.0, 1.0),
            GripperConvention::OneOpen => (0.0, 1.0),
        };
        if *gripper < least - GRIPPER_SLACK || *gripper > greatest + GRIPPER_SLACK {
            return Err(Refusal::GripperConvention {
                row,
                value: *gripper,
                declared: self.gripper.name(),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];

    fn name(conventions: Conventions, rows: &[[f64; 7]]) -> &'static str {
        conventions.check(rows).map_or_else(|r| r.name(), |_| "ok")
    }

    #[test]
    fn sound_actions_pass_with_their_values() {
        let action = [0.25, -0.5, 1.0, 0.0, 1.25, -1.25, 1.0];
        let checked = Conventions::libero(2).check(&[action, STILL]).unwrap();
        assert_eq!(checked[0], [0.25, -0.5, 1.0, 0.0, 1.25, -1.25, 1.0]);
        assert_eq!(checked.len(), 2);
    }

    #[test]
    fn each_violation_has_its_name() {
        let with = |column: usize, value: f64| {
            let mut action = STILL;
            action[column] = value;
            [action]
        };
        let libero = Conventions::libero(1);
        let raw = Conventions {
            gripper: GripperConvention::OneOpen,
            ..libero
        };
        assert_eq!(name(libero, &[]), "horizon");
        assert_eq!(name(libero, &[STILL, STILL]), "horizon");
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            (0..7).for_each(|column| assert_eq!(name(libero, &with(column, value)), "not_finite"));
        }
        assert_eq!(name(libero, &with(5, -1.51)), "out_of_range");
        assert_eq!(name(libero, &with(6, 1.6)), "gripper_convention");
        assert_eq!(name(raw, &with(6, -1.0)), "gripper_convention");
        assert_eq!(name(raw, &with(6, 0.02)), "ok");
    }

    #[test]
    fn a_horizon_that_no_chunk_has_is_refused() {
        assert_eq!(Conventions::libero(0).validate(), Err(HorizonError(0)));
        assert_eq!(Conventions::libero(65).validate(), Err(HorizonError(65)));
        assert_eq!(Conventions::libero(64).validate(), Ok(()));
    }
}
