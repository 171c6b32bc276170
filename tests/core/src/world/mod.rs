//! A toy world without physics: enough of a table, an arm and a hand to run
//! the core in a closed loop within milliseconds.
//!
//! The arm is a point that follows its goal with a first-order lag; the goal is
//! the measured place plus the increment, taken anew whenever a policy step
//! starts, as in LIBERO. The fingers run at a constant speed and stop at what
//! stands between them. What they hold moves with the hand; what they let go
//! falls to the highest support below.

mod agent;
mod body;
mod policy;
mod scene;
mod session;
pub mod table;

pub use agent::{Agent, Answer};
pub use body::{Body, Support};
pub use policy::{Behaviour, Policy};
pub use scene::{BASKET, BOWL, BOX, CAN, OTHER, PLATE, Scene};
pub use session::{Session, Verifier};

use fitmac_core::{
    message::{Action, Command, JOINT_COUNT, ObjectId, ObjectSample, StateSample},
    recovery::geometry::JOINT_LIMITS_RAD,
};
use kinematics::{
    rotation::UnitQuaternion,
    vector::{self, Vector3},
};

/// A hand that points straight down, its fingers closing along y.
pub const DOWN: [f64; 4] = [0.0, 1.0, 0.0, 0.0];

/// What makes the arm and the hand what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Time constant of the arm, s. LIBERO's controller covers about a quarter
    /// of an increment within a policy step of 50 ms, which is 0.16 s.
    pub lag_s: f64,
    /// Speed of the gripper's width, m/s: a full swing takes 8 policy steps.
    pub finger_m_s: f64,
    /// Width of the open gripper, m.
    pub open_m: f64,
    /// Height of the table, m.
    pub table_z_m: f64,
    /// Increment of one unit of translation, m.
    pub translation_m: f64,
    /// Increment of one unit of rotation, rad.
    pub rotation_rad: f64,
    /// So many closures hold nothing, whatever stands between the fingers.
    pub weak_grasps: u32,
    /// The hand loses what it holds this high above the table, once, m.
    pub drop_above_m: Option<f64>,
    /// The arm can't get further out than this from the base's axis, m; it is
    /// then at a joint limit.
    pub reach_m: f64,
}

impl Default for Plant {
    fn default() -> Self {
        Self {
            lag_s: 0.16,
            finger_m_s: 0.2,
            open_m: 0.08,
            table_z_m: 0.0,
            translation_m: 0.05,
            rotation_rad: 0.5,
            weak_grasps: 0,
            drop_above_m: None,
            reach_m: 0.9,
        }
    }
}

/// What the fingers hold.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    id: ObjectId,
    /// Its centre relative to the tool centre point, base frame, m.
    offset_m: Vector3,
    width_m: f64,
}

/// The state of the toy world.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// What the arm and the hand are like.
    pub plant: Plant,
    /// The objects.
    pub bodies: Vec<Body>,
    /// Objects that the pose source does not see now.
    pub hidden: Vec<ObjectId>,
    now_ns: u64,
    sequence: u64,
    applied_command: u64,
    policy_step: u64,
    ee_m: Vector3,
    orientation: UnitQuaternion,
    goal_m: Vector3,
    goal_orientation: UnitQuaternion,
    width_m: f64,
    closing: bool,
    held: Option<Held>,
}

impl World {
    /// An arm at rest at `ee_m`, open.
    #[must_use]
    pub fn new(plant: Plant, ee_m: Vector3, bodies: Vec<Body>) -> Self {
        let down = UnitQuaternion::from_wxyz(DOWN).unwrap_or(UnitQuaternion::IDENTITY);
        Self {
            width_m: plant.open_m,
            plant,
            bodies,
            hidden: Vec::new(),
            now_ns: 0,
            sequence: 0,
            applied_command: 0,
            policy_step: 0,
            ee_m,
            orientation: down,
            goal_m: ee_m,
            goal_orientation: down,
            closing: false,
            held: None,
        }
    }

    /// Time, ns.
    #[must_use]
    pub const fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Takes over time and counters of the world that this one replaces.
    pub fn go_on_from(&mut self, before: &Self) {
        self.now_ns = before.now_ns;
        self.sequence = before.sequence;
        self.applied_command = before.applied_command;
        self.policy_step = before.policy_step;
    }

    /// Tool centre point, m.
    #[must_use]
    pub const fn ee_m(&self) -> Vector3 {
        self.ee_m
    }

    /// Puts the arm at rest somewhere else.
    pub fn place(&mut self, ee_m: Vector3) {
        self.ee_m = ee_m;
        self.goal_m = ee_m;
    }

    /// The hand's orientation.
    #[must_use]
    pub const fn orientation(&self) -> UnitQuaternion {
        self.orientation
    }

    /// Sets the hand's orientation, as if it had been left like that.
    pub fn set_orientation(&mut self, orientation: UnitQuaternion) {
        self.orientation = orientation;
        self.goal_orientation = orientation;
    }

    /// Distance between the fingers, m.
    #[must_use]
    pub const fn width_m(&self) -> f64 {
        self.width_m
    }

    /// True if the fingers were told to close.
    #[must_use]
    pub const fn is_closing(&self) -> bool {
        self.closing
    }

    /// What the fingers hold; 0 for nothing.
    #[must_use]
    pub fn held(&self) -> ObjectId {
        self.held.map_or(0, |h| h.id)
    }

    /// The object `id`.
    #[must_use]
    pub fn body(&self, id: ObjectId) -> Option<&Body> {
        self.bodies.iter().find(|b| b.id == id)
    }

    /// The object `id`, to change it behind the controller's back.
    pub fn body_mut(&mut self, id: ObjectId) -> Option<&mut Body> {
        self.bodies.iter_mut().find(|b| b.id == id)
    }

    /// True if `id` was let go within the support `on` and lies there.
    #[must_use]
    pub fn is_placed(&self, id: ObjectId, on: ObjectId) -> bool {
        let (Some(body), Some(support)) = (self.body(id), self.body(on)) else {
            return false;
        };
        let bottom = body.position_m[2] - body.half_extent_m[2];
        let at_rest = support
            .height_below(body.position_m)
            .is_some_and(|h| (bottom - h).abs() < 1e-6);
        self.held() != id && at_rest
    }

    /// The robot takes a command: its goal moves when a policy step starts.
    pub fn apply(&mut self, command: &Command) {
        self.applied_command = command.sequence;
        if command.policy_step != self.policy_step {
            self.policy_step = command.policy_step;
            self.start(&command.action);
        }
    }

    /// An action starts.
    pub fn start(&mut self, action: &Action) {
        let [x, y, z, rx, ry, rz, grip] = *action;
        let step = vector::scale([x, y, z], self.plant.translation_m);
        self.goal_m = vector::add(self.ee_m, step);
        if [rx, ry, rz] != [0.0; 3] {
            let turn = vector::scale([rx, ry, rz], self.plant.rotation_rad);
            self.goal_orientation = UnitQuaternion::from_rotation_vector(turn) * self.orientation;
        }
        self.closing = grip > 0.0;
    }

    /// Time goes on by `dt_ns`.
    pub fn advance(&mut self, dt_ns: u64) {
        self.now_ns += dt_ns;
        self.sequence += 1;
        let dt_s = dt_ns as f64 * 1e-9;
        self.move_arm(dt_s);
        self.move_fingers(dt_s);
        self.carry();
        self.fall(dt_s);
    }

    fn move_arm(&mut self, dt_s: f64) {
        let share = 1.0 - (-dt_s / self.plant.lag_s).exp();
        let mut next = vector::lerp(self.ee_m, self.goal_m, share);
        let reach = next[0].hypot(next[1]);
        if reach > self.plant.reach_m {
            let inwards = self.plant.reach_m / reach;
            next = [next[0] * inwards, next[1] * inwards, self.ee_m[2]];
        }
        next[2] = next[2].max(self.lowest(next));
        self.ee_m = next;
        let turn = (self.goal_orientation * self.orientation.inverse()).to_rotation_vector();
        self.orientation =
            UnitQuaternion::from_rotation_vector(vector::scale(turn, share)) * self.orientation;
    }

    /// How low the tool centre point gets at a place: the fingertips or what
    /// they hold stand on something.
    fn lowest(&self, at_m: Vector3) -> f64 {
        let tips = self.plant.table_z_m + 0.005;
        let Some(held) = &self.held else {
            return tips;
        };
        let half = self.body(held.id).map_or(0.0, |b| b.half_extent_m[2]);
        let centre = vector::add(at_m, held.offset_m);
        tips.max(self.support_below(held.id, centre) + half - held.offset_m[2])
    }

    /// The highest support below a point.
    fn support_below(&self, id: ObjectId, at_m: Vector3) -> f64 {
        self.bodies
            .iter()
            .filter(|b| b.id != id)
            .filter_map(|b| b.height_below(at_m))
            .fold(self.plant.table_z_m, f64::max)
    }

    fn move_fingers(&mut self, dt_s: f64) {
        let step = self.plant.finger_m_s * dt_s;
        if !self.closing {
            self.width_m = (self.width_m + step).min(self.plant.open_m);
            if self.held.is_some_and(|h| self.width_m > h.width_m + 0.001) {
                self.held = None;
            }
            return;
        }
        if let Some(held) = self.held {
            self.width_m = (self.width_m - step).max(held.width_m);
            return;
        }
        let next = (self.width_m - step).max(0.0);
        let between = self
            .bodies
            .iter()
            .filter_map(|b| {
                Some((
                    b.id,
                    b.grip_width(self.ee_m, self.orientation)?,
                    b.position_m,
                ))
            })
            .find(|&(_, width, _)| width <= self.width_m && width >= next);
        match between {
            Some((id, width_m, centre)) if self.plant.weak_grasps == 0 => {
                self.width_m = width_m;
                self.held = Some(Held {
                    id,
                    offset_m: vector::sub(centre, self.ee_m),
                    width_m,
                });
            }
            Some(_) => {
                self.plant.weak_grasps -= 1;
                self.width_m = next;
            }
            None => self.width_m = next,
        }
    }

    fn carry(&mut self) {
        let Some(held) = self.held else {
            return;
        };
        let centre = vector::add(self.ee_m, held.offset_m);
        if let Some(body) = self.body_mut(held.id) {
            body.position_m = centre;
        }
        let above = self.ee_m[2] - self.plant.table_z_m;
        if self.plant.drop_above_m.is_some_and(|h| above > h) {
            self.plant.drop_above_m = None;
            self.held = None;
        }
    }

    fn fall(&mut self, dt_s: f64) {
        const FALL_M_S: f64 = 1.0;
        let held = self.held();
        let landings: Vec<f64> = self
            .bodies
            .iter()
            .map(|b| self.support_below(b.id, b.position_m) + b.half_extent_m[2])
            .collect();
        for (body, landing) in self.bodies.iter_mut().zip(landings) {
            if body.id != held && body.support == Support::None && body.position_m[2] > landing {
                body.position_m[2] = (body.position_m[2] - FALL_M_S * dt_s).max(landing);
            }
        }
    }

    /// What the robot and a perfect pose source report now.
    #[must_use]
    pub fn sample(&self) -> StateSample {
        let mut joints = JOINT_LIMITS_RAD.map(|[lower, upper]| 0.5 * (lower + upper));
        if self.ee_m[0].hypot(self.ee_m[1]) > self.plant.reach_m - 1e-3 {
            joints[3] = JOINT_LIMITS_RAD[3][1];
        }
        let mut sample = StateSample {
            sequence: self.sequence,
            session: 1,
            stamp_ns: self.now_ns,
            applied_command: self.applied_command,
            joint_position_rad: joints,
            joint_velocity_rad_s: [0.0; JOINT_COUNT],
            ee_position_m: self.ee_m,
            ee_orientation: self.orientation.wxyz(),
            gripper_width_m: self.width_m,
            object_count: 0,
            ..StateSample::default()
        };
        let seen = self.bodies.iter().filter(|b| !self.hidden.contains(&b.id));
        for (slot, body) in sample.objects.iter_mut().zip(seen) {
            *slot = ObjectSample {
                id: body.id,
                grasp_class: body.class.code(),
                visible: 1,
                stamp_ns: self.now_ns,
                position_m: body.position_m,
                orientation: [1.0, 0.0, 0.0, 0.0],
                half_extent_m: body.half_extent_m,
                confidence: 1.0,
                ..ObjectSample::default()
            };
            sample.object_count += 1;
        }
        sample
    }
}
