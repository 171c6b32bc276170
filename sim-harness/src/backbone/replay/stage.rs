//! The stages of a remembered motion.

use nalgebra::Vector3;

use super::luck::End;
use crate::action::{POLICY_STEP_S, POSITION_SCALE_M};
use crate::backbone::Observation;
use crate::backbone::motion::PointMass;
use crate::panda::GRIPPER_OPEN_M;

/// The tool is at a waypoint within this distance, m.
const ARRIVED_M: f64 = 0.008;
/// On the way between high waypoints, m.
const PASSED_M: f64 = 0.02;
/// Policy steps for which the gripper is commanded shut before the lift.
const CLOSE_STEPS: u32 = 9;
/// Policy steps for which the object is held still above its place.
const POISE_STEPS: u32 = 4;
/// Policy steps for which the gripper is commanded open before the retreat.
const OPEN_STEPS: u32 = 6;
/// Narrower than open by this much: something else than an open gripper, m.
const NOT_OPEN_M: f64 = 0.010;
/// Farther than this from where a stage belongs, the stage is not believed, m.
const LOST_M: f64 = 0.06;
/// Farther off than this to the side, the descent waits, m.
const FUNNEL_M: f64 = 0.010;
/// Height above the grasp at which it waits: above what is grasped by its sides, m.
const FUNNEL_HEIGHT_M: f64 = 0.070;
/// Amplitude of the tremor of a policy that has come to its end, m.
const DITHER_M: f64 = 0.005;

/// Where the motion stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Approach,
    Descend,
    Settle {
        steps: u32,
    },
    Close {
        steps: u32,
    },
    Lift,
    Transport,
    Lower,
    Poise {
        steps: u32,
    },
    Open {
        steps: u32,
    },
    Retreat,
    /// Over; after so many steps of it.
    Done {
        steps: u32,
    },
}

/// The waypoints of one query, corrected by what is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waypoints {
    pub(super) hover: Vector3<f64>,
    pub(super) grasp: Vector3<f64>,
    pub(super) carry: Vector3<f64>,
    pub(super) release: Vector3<f64>,
    pub(super) retreat: Vector3<f64>,
    /// Height above the grasp at which the gripper closes too early, if it does.
    pub(super) premature_m: Option<f64>,
    /// Whether it stops above the target.
    pub(super) stalls: bool,
    /// Whether it lets go on the way.
    pub(super) drops: bool,
    pub(super) close_wait: u32,
}

impl Stage {
    /// Translation in action units and gripper command.
    pub(super) fn drive(
        self,
        mass: &PointMass,
        w: &Waypoints,
        speed: f64,
        end: End,
    ) -> (Vector3<f64>, f64) {
        let here = mass.position_m;
        let (waypoint, gripper) = match self {
            Self::Approach => (w.hover, -1.0),
            Self::Descend => (w.funnelled(here), -1.0),
            Self::Settle { .. } => (w.grasp, -1.0),
            Self::Close { .. } => (w.grasp, 1.0),
            // Straight up from wherever the grasp was.
            Self::Lift => (Vector3::new(here.x, here.y, w.carry.z), 1.0),
            Self::Transport => (w.carry, 1.0),
            Self::Lower | Self::Poise { .. } => (w.release, 1.0),
            Self::Open { .. } => (w.release, -1.0),
            Self::Retreat => (w.retreat, -1.0),
            Self::Done { steps } => return (end.drive(steps), -1.0),
        };
        (mass.towards(waypoint, speed), gripper)
    }

    /// The stage after one more policy step, seen from the predicted motion.
    pub(super) fn advance(self, mass: &PointMass, w: &Waypoints) -> Self {
        let away = |from: Vector3<f64>| (mass.position_m - from).norm();
        let away_xy = |from: Vector3<f64>| (mass.position_m - from).xy().norm();
        let above = mass.position_m.z - w.grasp.z;
        match self {
            Self::Approach if away(w.hover) < PASSED_M && w.stalls => Self::Done { steps: 0 },
            Self::Approach if away(w.hover) < PASSED_M => Self::Descend,
            Self::Descend if w.premature_m.is_some_and(|height| above < height) => {
                Self::Close { steps: 0 }
            }
            Self::Descend if away(w.grasp) < ARRIVED_M => Self::Settle { steps: 0 },
            Self::Settle { steps } if steps >= w.close_wait => Self::Close { steps: 0 },
            Self::Settle { steps } => Self::Settle { steps: steps + 1 },
            Self::Close { steps } if steps >= CLOSE_STEPS => Self::Lift,
            Self::Close { steps } => Self::Close { steps: steps + 1 },
            Self::Lift if w.carry.z - mass.position_m.z < PASSED_M => Self::Transport,
            Self::Transport if w.drops && away_xy(w.carry) < w.halfway() => Self::Open { steps: 0 },
            Self::Transport if away_xy(w.carry) < ARRIVED_M => Self::Lower,
            Self::Lower if away(w.release) < ARRIVED_M => Self::Poise { steps: 0 },
            Self::Poise { steps } if steps >= POISE_STEPS => Self::Open { steps: 0 },
            Self::Poise { steps } => Self::Poise { steps: steps + 1 },
            Self::Open { steps } if steps >= OPEN_STEPS => Self::Retreat,
            Self::Open { steps } => Self::Open { steps: steps + 1 },
            Self::Retreat if away(w.retreat) < PASSED_M => Self::Done { steps: 0 },
            Self::Done { steps } => Self::Done {
                steps: steps.saturating_add(1),
            },
            same => same,
        }
    }

    /// The stage that the scene shows: the planned one, unless it can't be.
    pub(super) fn resynchronised(self, observation: &Observation, w: &Waypoints) -> Self {
        let here = Vector3::from(observation.robot.tcp.position_m);
        let closed = observation.robot.gripper_width_m < GRIPPER_OPEN_M - NOT_OPEN_M;
        let near = |from: Vector3<f64>| (here - from).xy().norm() < LOST_M;
        match self {
            // Somebody closed the gripper: there is something to carry.
            Self::Approach | Self::Descend | Self::Settle { .. } | Self::Done { .. } if closed => {
                Self::Lift
            }
            Self::Descend | Self::Settle { .. } | Self::Close { .. } if !near(w.grasp) => {
                Self::Approach
            }
            // Somebody opened it on the way.
            Self::Lift | Self::Transport | Self::Lower | Self::Poise { .. } if !closed => {
                if near(w.release) {
                    Self::Retreat
                } else {
                    Self::Approach
                }
            }
            Self::Lower | Self::Poise { .. } if !near(w.release) => Self::Transport,
            Self::Open { .. } if !near(w.release) && !w.drops => Self::Transport,
            as_planned => as_planned,
        }
    }
}

impl Waypoints {
    /// The grasp, or the point above it from which the tool goes down once it is lined up; a tool
    /// that is lower already is not raised.
    fn funnelled(&self, here: Vector3<f64>) -> Vector3<f64> {
        let off_m = (here - self.grasp).xy().norm();
        let wait_z = (self.grasp.z + FUNNEL_HEIGHT_M).min(here.z);
        let z = if off_m > FUNNEL_M {
            wait_z.max(self.grasp.z)
        } else {
            self.grasp.z
        };
        Vector3::new(self.grasp.x, self.grasp.y, z)
    }

    /// Half of the way that the object is carried, m.
    fn halfway(&self) -> f64 {
        0.5 * (self.carry - self.grasp).xy().norm()
    }
}

impl End {
    fn drive(self, steps: u32) -> Vector3<f64> {
        match self {
            Self::Hold => Vector3::zeros(),
            Self::Push(direction) => direction,
            Self::Dither { rate_hz } => {
                let angle = core::f64::consts::TAU * rate_hz * POLICY_STEP_S * f64::from(steps);
                Vector3::new(libm::sin(angle) * DITHER_M / POSITION_SCALE_M, 0.0, 0.0)
            }
        }
    }
}
