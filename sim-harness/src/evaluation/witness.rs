//! What an onlooker who sees the truth notes of an episode: where the policy went wrong by
//! itself, and how the episode failed in the end.

use super::record::Failure;
use crate::panda::GRIPPER_OPEN_M;
use crate::pose::{Pose, distance_m, distance_xy_m};
use crate::predicate::Goal;
use crate::scene::{PlacedObject, TABLE_CENTRE_M, TABLE_HALF_M};
use crate::sim::{Owner, Sim};

/// A rise of the target's centre that counts as lifted, m.
const LIFTED_M: f64 = 0.03;
/// Narrower than this, closed pads hold nothing, m.
const EMPTY_M: f64 = 0.003;
/// Farther than this from its start an object was taken somewhere, m.
const TAKEN_M: f64 = 0.05;
/// Cosine of the tilt at which an object that stood has fallen.
const FALLEN: f64 = 0.7;

/// Follows what happens to the target.
#[derive(Clone, Debug)]
pub(super) struct Witness {
    goal: Goal,
    start: Vec<Pose>,
    touched: bool,
    lifted: bool,
    held: bool,
    dropped: bool,
    onset: Option<u64>,
}

/// What the controller was about, as far as it decides how a failure is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Controlled {
    /// A correction was running in the end.
    pub(super) correcting: bool,
    /// A failure was diagnosed and nothing was ever corrected.
    pub(super) refused: bool,
}

impl Witness {
    pub(super) fn new(goal: Goal, sim: &Sim) -> Self {
        Self {
            goal,
            start: sim.objects().iter().map(|o| o.pose).collect(),
            touched: false,
            lifted: false,
            held: false,
            dropped: false,
            onset: None,
        }
    }

    /// Policy step at which the policy alone went wrong.
    pub(super) fn onset(&self) -> Option<u64> {
        self.onset
    }

    /// Looks once a policy step, at its start; `closing` is the gripper's new command. True at
    /// the onset of a failure of the policy, as long as nobody else has acted.
    pub(super) fn look(&mut self, sim: &Sim, step: u64, closing: bool, policy_acts: bool) -> bool {
        let target = self.goal.object();
        let start = usize::from(target)
            .checked_sub(1)
            .and_then(|i| self.start.get(i));
        let (Some(object), Some(start)) = (sim.object(target), start) else {
            return false;
        };
        let held = sim.touches(Owner::Object(target), Owner::Finger);
        self.touched |= held;
        self.lifted |= held && object.pose.position_m[2] > start.position_m[2] + LIFTED_M;
        let lost = self.lifted && self.held && !held;
        if held || lost {
            self.dropped = lost && closing;
        }
        let fails = policy_acts && self.onset.is_none() && self.fails(sim, closing, lost);
        self.held = held;
        if fails {
            self.onset = Some(step);
        }
        fails
    }

    fn fails(&self, sim: &Sim, closing: bool, lost: bool) -> bool {
        let width_m = sim.robot().gripper_width_m;
        let own = [self.goal.object(), self.goal.destination()];
        let took_another = closing
            && width_m < GRIPPER_OPEN_M - 0.01
            && sim.held().is_some_and(|id| !own.contains(&id));
        let empty = closing && width_m < EMPTY_M;
        took_another || empty || (lost && !self.goal.holds(sim))
    }

    /// Distance between the centres of object and destination, m; 0 if one is missing.
    pub(super) fn distance_m(&self, sim: &Sim) -> f64 {
        let pose = |id: u16| sim.object(id).map(|o| o.pose.position_m);
        match (pose(self.goal.object()), pose(self.goal.destination())) {
            (Some(a), Some(b)) => distance_m(a, b),
            _ => 0.0,
        }
    }

    /// How an episode failed.
    pub(super) fn classify(&self, sim: &Sim, controlled: Controlled) -> Failure {
        let target = self.goal.object();
        let Some(object) = sim.object(target) else {
            return Failure::OffTable;
        };
        let in_hand = self.lifted && sim.touches(Owner::Object(target), Owner::Finger);
        match () {
            () if off_table(object.pose.position_m, sim) => Failure::OffTable,
            () if self.goal.holds(sim) => Failure::NotSettled,
            () if self.another_is_there(sim) => Failure::WrongObject,
            () if !in_hand && object.pose.uprightness() < FALLEN => Failure::KnockedOver,
            () if controlled.correcting || in_hand => Failure::Timeout,
            () if controlled.refused => Failure::GateClosed,
            () if self.dropped => Failure::Dropped,
            () if self.lifted => Failure::MissedPlace,
            () if self.touched => Failure::MissedGrasp,
            () => Failure::NeverReached,
        }
    }

    fn another_is_there(&self, sim: &Sim) -> bool {
        let own = [self.goal.object(), self.goal.destination()];
        let other = |o: &&PlacedObject| !own.contains(&o.id);
        sim.scene().objects().iter().filter(other).any(|o| {
            let taken = sim
                .object(o.id)
                .is_some_and(|now| distance_xy_m(now.pose.position_m, o.pose.position_m) > TAKEN_M);
            taken && self.goal.with_object(o.id).holds(sim)
        })
    }
}

fn off_table([x, y, z]: [f64; 3], sim: &Sim) -> bool {
    (x - TABLE_CENTRE_M[0]).abs() > TABLE_HALF_M[0]
        || (y - TABLE_CENTRE_M[1]).abs() > TABLE_HALF_M[1]
        || z < sim.scene().arena.surface_m - 0.05
}
