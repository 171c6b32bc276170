//! Success: LIBERO's predicates, plus release and rest.

use crate::object::Shape;
use crate::pose::distance_xy_m;
use crate::sim::{Owner, Sim};

/// How far an object may lie off the centre of what it should be on, m (LIBERO's `On`).
const ON_TOLERANCE_M: f64 = 0.03;
/// Half extent of the space that counts as inside a basket, m (LIBERO's contain region).
const CONTAIN_HALF_M: [f64; 3] = [0.061, 0.061, 0.069];
/// How far below that space an object's centre may lie, m.
const CONTAIN_BELOW_M: f64 = 0.01;
/// An object slower than this is at rest, m/s.
const REST_SPEED_M_S: f64 = 0.010;
/// For how many policy steps the goal must hold, released and at rest.
pub const REST_STEPS: u32 = 10;

/// What a task asks for. Objects are ids of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// The object lies in the container.
    In {
        /// What is moved.
        object: u16,
        /// What it goes into.
        container: u16,
    },
    /// The object stands on the support, centred.
    On {
        /// What is moved.
        object: u16,
        /// What it goes onto.
        support: u16,
    },
}

impl Goal {
    /// What is moved.
    #[must_use]
    pub fn object(self) -> u16 {
        match self {
            Self::In { object, .. } | Self::On { object, .. } => object,
        }
    }

    /// Where it goes.
    #[must_use]
    pub fn destination(self) -> u16 {
        match self {
            Self::In { container, .. } => container,
            Self::On { support, .. } => support,
        }
    }

    /// The same for another object.
    #[must_use]
    pub fn with_object(self, object: u16) -> Self {
        match self {
            Self::In { container, .. } => Self::In { object, container },
            Self::On { support, .. } => Self::On { object, support },
        }
    }

    /// LIBERO's predicate: holds as soon as the object is in its place, held or not.
    #[must_use]
    pub fn holds(self, sim: &Sim) -> bool {
        let (Some(object), Some(destination)) =
            (sim.object(self.object()), sim.object(self.destination()))
        else {
            return false;
        };
        match self {
            Self::In { container, .. } => {
                let local = destination
                    .pose
                    .isometry()
                    .inverse_transform_point(&nalgebra::Point3::from(object.pose.position_m));
                let half = contain_half_m(sim, container);
                local.x.abs() <= half[0]
                    && local.y.abs() <= half[1]
                    && local.z <= half[2]
                    && local.z >= -half[2] - CONTAIN_BELOW_M
            }
            Self::On { object: o, support } => {
                let (a, b) = (object.pose.position_m, destination.pose.position_m);
                distance_xy_m(a, b) < ON_TOLERANCE_M
                    && a[2] >= b[2]
                    && sim.touches(Owner::Object(o), Owner::Object(support))
            }
        }
    }
}

/// LIBERO's contain region, but never beyond a smaller container's walls.
fn contain_half_m(sim: &Sim, container: u16) -> [f64; 3] {
    let Some(placed) = sim.scene().by_id(container) else {
        return [0.0; 3];
    };
    let outer = placed.kind.half_extent_m();
    let wall = match placed.kind.shape {
        Shape::Basket { wall_m, .. } => wall_m,
        _ => 0.0,
    };
    [
        CONTAIN_HALF_M[0].min(outer[0] - wall),
        CONTAIN_HALF_M[1].min(outer[1] - wall),
        CONTAIN_HALF_M[2].min(outer[2]),
    ]
}

/// Judges an episode: the goal must hold with the object released and at rest, for a while.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judge {
    goal: Goal,
    calm_steps: u32,
}

impl Judge {
    /// A judge who has seen nothing yet.
    #[must_use]
    pub fn new(goal: Goal) -> Self {
        Self {
            goal,
            calm_steps: 0,
        }
    }

    /// The goal that is judged.
    #[must_use]
    pub fn goal(&self) -> Goal {
        self.goal
    }

    /// Looks once, at the end of a policy step; true once the goal held, released and at rest,
    /// for [`REST_STEPS`] looks in a row.
    pub fn look(&mut self, sim: &Sim) -> bool {
        let calm = self.goal.holds(sim) && self.released(sim) && self.at_rest(sim);
        self.calm_steps = if calm {
            self.calm_steps.saturating_add(1)
        } else {
            0
        };
        self.calm_steps >= REST_STEPS
    }

    fn released(&self, sim: &Sim) -> bool {
        !sim.touches(Owner::Object(self.goal.object()), Owner::Finger)
    }

    fn at_rest(&self, sim: &Sim) -> bool {
        sim.object(self.goal.object()).is_some_and(|o| {
            let [x, y, z] = o.velocity_m_s;
            libm::sqrt(x * x + y * y + z * z) < REST_SPEED_M_S
        })
    }
}
