//! The attempt: events that a single look cannot tell from noise. Each is
//! noticed at a policy step and latched until the next query.

use kinematics::vector;

use crate::{
    evidence,
    message::ObjectId,
    monitor::History,
    params::{Evidence as EvidenceParams, Params},
    phase::{Carry, PhaseEstimator, is_pick},
    signals::{GripperState, Signals},
    wire::{PlaceRelation, Verdict},
};

/// Whether the gripper acted in this attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hand {
    /// Not seen open yet: a gripper that starts closed tells nothing.
    Unseen,
    /// Seen open.
    Opened,
    /// Seen open, then closed: the attempt has acted.
    Closed,
}

/// What is remembered of the running attempt.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    id: u64,
    steps: u32,
    hand: Hand,
    wrong_approach: Option<WrongApproach>,
    straying_steps: u32,
    /// Nearest that the carried target came to its destination, m.
    nearest_xy_m: Option<f64>,
    rest_steps: u32,
    held_other: Option<Held>,
    latched: u64,
}

/// Another instance than the target that is approached.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WrongApproach {
    id: ObjectId,
    nearest_m: f64,
    steps: u32,
}

/// Growth of the distance over its least that ends an approach, m: more than
/// the noise of a pose, less than a change of mind.
const RECEDING_M: f64 = 0.02;

/// An object, not the target, that seems to be in the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    id: ObjectId,
    z_at_grasp_m: f64,
}

impl Attempt {
    pub(crate) const fn first() -> Self {
        Self::numbered(1)
    }

    const fn numbered(id: u64) -> Self {
        Self {
            id,
            steps: 0,
            hand: Hand::Unseen,
            wrong_approach: None,
            straying_steps: 0,
            nearest_xy_m: None,
            rest_steps: 0,
            held_other: None,
            latched: 0,
        }
    }

    /// The attempt's number within the episode, from 1.
    #[must_use]
    pub const fn id(&self) -> u64 {
        self.id
    }

    /// Policy steps since it began.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// The gripper closed in this attempt: it is too late to say that nothing
    /// was done yet.
    #[must_use]
    pub const fn has_acted(&self) -> bool {
        matches!(self.hand, Hand::Closed)
    }

    /// The object, other than the target, that seems to be in the hand, and
    /// the height of its centre when it was grasped, m.
    #[must_use]
    pub fn held_other(&self) -> Option<(ObjectId, f64)> {
        self.held_other.map(|h| (h.id, h.z_at_grasp_m))
    }

    /// A new attempt begins; evidence that awaits a query stays.
    pub(crate) fn next(&mut self) {
        *self = Self {
            latched: self.latched,
            ..Self::numbered(self.id.saturating_add(1))
        };
    }

    /// Evidence noticed since the last query.
    pub(crate) const fn latched(&self) -> u64 {
        self.latched
    }

    /// The query has used the evidence.
    pub(crate) fn clear_latched(&mut self) {
        self.latched = 0;
    }

    /// Judges one policy step.
    pub(crate) fn step(
        &mut self,
        params: &Params,
        signals: &Signals,
        estimator: &PhaseEstimator,
        history: &History,
        verdict: Verdict,
    ) {
        self.steps = self.steps.saturating_add(1);
        let picking = is_pick(estimator.phase());
        let mut bits = self.watch_hand(signals, picking);
        if picking {
            bits |= self.watch_approach(&params.evidence, signals);
            bits |= moving_away(&params.evidence, signals, history);
            bits |= self.watch_other(params, signals);
        }
        bits |= self.watch_carry(&params.evidence, signals, estimator);
        bits |= self.watch_release(&params.evidence, signals, estimator, history, verdict);
        self.latched |= bits;
    }

    fn watch_hand(&mut self, signals: &Signals, picking: bool) -> u64 {
        let state = signals.gripper.state;
        let empty_after_close =
            state == GripperState::Empty && self.hand != Hand::Unseen && picking;
        self.hand = match (self.hand, state) {
            (_, GripperState::Open) if self.hand == Hand::Unseen => Hand::Opened,
            (Hand::Opened, GripperState::Holding | GripperState::Empty) => Hand::Closed,
            (hand, _) => hand,
        };
        if empty_after_close {
            evidence::EMPTY_GRASP
        } else {
            0
        }
    }

    /// Another instance is nearer than the lock, near, and not receding.
    fn watch_approach(&mut self, params: &EvidenceParams, signals: &Signals) -> u64 {
        let (Some(target), Some(other)) = (&signals.target, &signals.other) else {
            self.wrong_approach = None;
            return 0;
        };
        let nearer = other.distance_m < target.distance_m - params.wrong_target_margin_m
            && other.distance_m < params.wrong_target_distance_m;
        let before = self
            .wrong_approach
            .filter(|a| a.id == other.id && other.distance_m < a.nearest_m + RECEDING_M);
        let approach = nearer.then(|| WrongApproach {
            id: other.id,
            nearest_m: before.map_or(other.distance_m, |a| a.nearest_m.min(other.distance_m)),
            steps: before.map_or(0, |a| a.steps).saturating_add(1),
        });
        self.wrong_approach = approach;
        if approach.is_some_and(|a| a.steps >= params.wrong_target_steps) {
            evidence::WRONG_TARGET
        } else {
            0
        }
    }

    /// An object that rises with the closed hand, and is not the target.
    fn watch_other(&mut self, params: &Params, signals: &Signals) -> u64 {
        let near = signals.other.filter(|o| {
            signals.gripper.state == GripperState::Holding
                && o.distance_m < params.gripper.held_radius_m
                && signals.target.is_none_or(|t| o.distance_m < t.distance_m)
        });
        let Some(other) = near else {
            self.held_other = None;
            return 0;
        };
        let z = other.position_m[2];
        match self.held_other {
            Some(held) if held.id == other.id => {
                let risen = z - held.z_at_grasp_m > params.phase.lifted_m;
                if risen {
                    evidence::WRONG_OBJECT_HELD
                } else {
                    0
                }
            }
            _ => {
                self.held_other = Some(Held {
                    id: other.id,
                    z_at_grasp_m: z,
                });
                0
            }
        }
    }

    /// The lifted target falls from the hand, or is taken elsewhere: lowered
    /// away from its destination, or carried away from it.
    fn watch_carry(
        &mut self,
        params: &EvidenceParams,
        signals: &Signals,
        estimator: &PhaseEstimator,
    ) -> u64 {
        let (Carry::Lifted { top_z_m, grip_z_m }, Some(target)) =
            (estimator.carry(), &signals.target)
        else {
            self.straying_steps = 0;
            self.nearest_xy_m = None;
            return 0;
        };
        let z = target.position_m[2];
        let fell = signals.ee_m[2] - z - grip_z_m > params.dropped_m;
        let strays = signals.destination.is_some_and(|d| {
            let nearest_m = self
                .nearest_xy_m
                .map_or(d.distance_xy_m, |n| n.min(d.distance_xy_m));
            self.nearest_xy_m = Some(nearest_m);
            let lowered = top_z_m - z > params.wrong_destination_drop_m
                && d.distance_xy_m > params.wrong_destination_xy_m;
            lowered || d.distance_xy_m - nearest_m > params.wrong_destination_away_m
        });
        self.straying_steps = if strays {
            self.straying_steps.saturating_add(1)
        } else {
            0
        };
        let mut bits = if fell { evidence::DROPPED } else { 0 };
        let patience = params.wrong_destination_steps;
        if patience > 0 && self.straying_steps >= patience {
            bits |= evidence::WRONG_DESTINATION;
        }
        bits
    }

    /// The released target came to rest: in its region or not.
    fn watch_release(
        &mut self,
        params: &EvidenceParams,
        signals: &Signals,
        estimator: &PhaseEstimator,
        history: &History,
        verdict: Verdict,
    ) -> u64 {
        if estimator.carry() != Carry::Released {
            self.rest_steps = 0;
            return 0;
        }
        self.rest_steps = if at_rest(params, history) {
            self.rest_steps.saturating_add(1)
        } else {
            0
        };
        if self.rest_steps < params.rest_steps {
            return 0;
        }
        match verdict {
            Verdict::Fail => evidence::VERIFIER_NEGATIVE,
            Verdict::Success => 0,
            Verdict::Unknown => match in_region(signals) {
                Some(false) => evidence::VERIFIER_NEGATIVE | evidence::MISPLACED,
                Some(true) | None => 0,
            },
        }
    }

    /// The target was released in its region and rests there.
    #[must_use]
    pub fn is_placed(&self, params: &EvidenceParams, signals: &Signals) -> bool {
        self.rest_steps >= params.rest_steps && in_region(signals) == Some(true)
    }
}

/// The distance to the target grew, with an open gripper.
fn moving_away(params: &EvidenceParams, signals: &Signals, history: &History) -> u64 {
    let then = history
        .ago(params.moving_away_steps)
        .and_then(|s| s.target_distance_m);
    match (then, &signals.target) {
        (Some(then), Some(now))
            if signals.gripper.state == GripperState::Open
                && now.distance_m - then > params.moving_away_m =>
        {
            evidence::MOVING_AWAY
        }
        _ => 0,
    }
}

/// The target's mean speed over the steps at hand is that of a thing at rest.
fn at_rest(params: &EvidenceParams, history: &History) -> bool {
    const SPAN: u32 = 4;
    let (Some(now), Some(then)) = (
        history.ago(0).and_then(|s| s.object_m),
        history.ago(SPAN).and_then(|s| s.object_m),
    ) else {
        return false;
    };
    vector::distance(now, then) < params.rest_distance_m
}

/// Whether the target lies in its destination region; `None` without a direct
/// destination.
#[must_use]
pub fn in_region(signals: &Signals) -> Option<bool> {
    let (target, destination) = (signals.target.as_ref()?, signals.destination.as_ref()?);
    let [dx, dy, _] = vector::sub(target.position_m, destination.position_m);
    let [hx, hy, depth] = destination.half_extent_m;
    let inside = dx.abs() <= hx && dy.abs() <= hy;
    let level = match destination.relation {
        // On the surface, not beside or below it, and not held above it.
        PlaceRelation::On => destination.clearance_m > -0.02 && destination.clearance_m < 0.03,
        // Its centre below the rim.
        PlaceRelation::In => {
            let below = destination.position_m[2] - target.position_m[2];
            below > 0.0 && below < depth + target.half_height_m
        }
    };
    Some(inside && level)
}

#[cfg(test)]
mod tests;
