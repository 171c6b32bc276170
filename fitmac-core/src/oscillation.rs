//! The reversal monitor. Equation 5 is a disjunction, so an arm that swings to
//! and fro makes "progress" for ever; here its turns are counted instead.

use kinematics::vector::{self, Vector3};

use crate::params::Progress;

/// Most steps of the window.
const WINDOW: u32 = 64;

/// Motion that has a direction, m: slower turning points, where an arm with a
/// lag nearly stands still, have none.
const STRIDE_M: f64 = 0.004;

/// Turns within the window, and how far the arm got in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Oscillation {
    /// One bit a step, newest last: the arm turned back.
    turns: u64,
    from_m: Option<Vector3>,
    heading_m: Option<Vector3>,
    /// The distance one to two windows ago, and at the start of this window.
    starts_m: [Option<f64>; 2],
    window_steps: u32,
}

impl Oscillation {
    pub(crate) const fn new() -> Self {
        Self {
            turns: 0,
            from_m: None,
            heading_m: None,
            starts_m: [None; 2],
            window_steps: 0,
        }
    }

    /// Judges one policy step: the end effector's place and its distance to
    /// where it should get. True if it keeps turning back and gets nowhere.
    pub(crate) fn step(
        &mut self,
        params: &Progress,
        ee_m: Vector3,
        distance_m: Option<f64>,
    ) -> bool {
        if params.reversals == 0 {
            return false;
        }
        let turned = self.turns_back(ee_m);
        let mask = u64::MAX >> (WINDOW - params.reversal_window_steps.clamp(1, WINDOW));
        self.turns = ((self.turns << 1) | u64::from(turned)) & mask;
        if self.window_steps == 0 {
            let [_, last] = self.starts_m;
            self.starts_m = [last, distance_m];
        }
        self.window_steps = if self.window_steps.saturating_add(1) >= params.reversal_window_steps {
            0
        } else {
            self.window_steps.saturating_add(1)
        };
        // A window that has just begun says nothing about how far one got.
        let [before, start] = self.starts_m;
        let (Some(start_m), Some(now_m)) = (before.or(start), distance_m) else {
            return false;
        };
        self.turns.count_ones() >= params.reversals && start_m - now_m < params.reversal_net_m
    }

    /// A stride in the opposite direction of the last one.
    fn turns_back(&mut self, ee_m: Vector3) -> bool {
        let Some(from_m) = self.from_m else {
            self.from_m = Some(ee_m);
            return false;
        };
        let stride_m = vector::sub(ee_m, from_m);
        if vector::norm(stride_m) < STRIDE_M {
            return false;
        }
        self.from_m = Some(ee_m);
        let before = self.heading_m.replace(stride_m);
        before.is_some_and(|b| vector::dot(b, stride_m) < 0.0)
    }
}

#[cfg(test)]
mod tests;
