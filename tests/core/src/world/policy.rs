//! A scripted policy that answers queries with chunks, well or badly.
//!
//! It plans by trying its own script in a copy of the world, so that a chunk
//! is what a policy that knows the plant would send.

use fitmac_core::{
    message::{ACTION_DIM, Action, ActionChunk, ObjectId, PolicyQuery},
    wire::{ActionFrame, ActionSpace, GripperConvention, PlaceRelation},
};
use kinematics::vector::{self, Vector3};

use super::{Scene, World};

/// How the policy behaves.
#[derive(Clone, Debug, PartialEq)]
pub enum Behaviour {
    /// Picks the object that its prompt names and places it.
    Competent,
    /// Picks this object, whatever it is told.
    WrongObject(ObjectId),
    /// Comes to within this height above its target, and stops there.
    StallsAbove(f64),
    /// Picks well, but lowers and lets go this far beside the destination, m.
    MissesPlace([f64; 2]),
    /// Swings to and fro above the table, without end.
    Dithers,
    /// Plays what was right when its target stood this far away, m, and never looks.
    Replays([f64; 2]),
    /// Sends zeros.
    Frozen,
}

/// A scripted policy.
#[derive(Clone, Debug)]
pub struct Policy {
    /// How it behaves.
    pub behaviour: Behaviour,
    /// Actions in a chunk.
    pub horizon: u32,
    /// Time to answer, ns.
    pub delay_ns: u64,
    /// Share of the action box that its motions use.
    pub speed: f64,
    /// Duration of its steps, ms.
    pub step_ms: u32,
    /// What its gripper number means.
    pub gripper: GripperConvention,
    session: u64,
    sequence: u64,
    due: Option<(u64, ActionChunk)>,
    memory: Option<Vec<Action>>,
    asked: u64,
}

/// A replayed episode is this long, steps.
const REPLAY_STEPS: usize = 220;

impl Policy {
    /// A policy that answers with eight actions within 30 ms.
    #[must_use]
    pub const fn new(behaviour: Behaviour) -> Self {
        Self {
            behaviour,
            horizon: 8,
            delay_ns: 30_000_000,
            speed: 1.0,
            step_ms: 50,
            gripper: GripperConvention::MinusOneOpen,
            session: 1,
            sequence: 0,
            due: None,
            memory: None,
            asked: 0,
        }
    }

    /// The process is restarted: a new session, numbers begin anew.
    pub fn restart(&mut self) {
        self.session += 1;
        self.sequence = 0;
        self.due = None;
    }

    /// Queries heard so far.
    #[must_use]
    pub const fn asked(&self) -> u64 {
        self.asked
    }

    /// Hears a query; what it sees is `world` as it is now.
    pub fn ask(&mut self, query: &PolicyQuery, world: &World, scene: &Scene) {
        self.asked += 1;
        self.sequence += 1;
        let mut chunk = ActionChunk {
            sequence: self.sequence,
            session: self.session,
            observation_ns: world.now_ns(),
            stamp_ns: world.now_ns() + self.delay_ns,
            query_id: query.query_id,
            epoch: query.epoch,
            subtask: query.subtask,
            prompt_id: query.prompt_id,
            horizon: self.horizon,
            action_space: ActionSpace::OscPoseDelta.code(),
            frame: ActionFrame::Base.code(),
            gripper: self.gripper.code(),
            ..ActionChunk::default()
        };
        let plan = self.plan(query, world, scene);
        for (slot, action) in chunk.actions.iter_mut().zip(plan) {
            *slot = action.map(|x| x as f32);
            if self.gripper == GripperConvention::OneOpen {
                let [.., grip] = slot;
                *grip = if *grip > 0.0 { 0.0 } else { 1.0 };
            }
        }
        self.due = Some((chunk.stamp_ns, chunk));
    }

    /// A chunk that is due by now.
    pub fn poll(&mut self, now_ns: u64) -> Option<ActionChunk> {
        match self.due {
            Some((due_ns, chunk)) if due_ns <= now_ns => {
                self.due = None;
                Some(chunk)
            }
            _ => None,
        }
    }

    fn plan(&mut self, query: &PolicyQuery, world: &World, scene: &Scene) -> Vec<Action> {
        let n = self.horizon as usize;
        if let Behaviour::Replays(moved_m) = self.behaviour {
            let memory = self
                .memory
                .get_or_insert_with(|| remember(moved_m, self.step_ms, world, scene));
            let played = query.policy_step as usize;
            let mut rest: Vec<Action> = memory.iter().skip(played).take(n).copied().collect();
            rest.resize(n, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
            return rest;
        }
        let target = match self.behaviour {
            Behaviour::WrongObject(id) => id,
            _ if query.prompt_id != 0 => ObjectId::try_from(query.prompt_id).unwrap_or(0),
            _ => scene.target,
        };
        let task = Task {
            target,
            destination: scene.destination,
            relation: scene.relation,
            behaviour: &self.behaviour,
            speed: self.speed,
            step_ms: self.step_ms,
            step: query.policy_step,
        };
        rollout(&task, world.clone(), n)
    }
}

/// What the script works on.
#[derive(Clone, Copy)]
struct Task<'a> {
    target: ObjectId,
    destination: ObjectId,
    relation: PlaceRelation,
    behaviour: &'a Behaviour,
    speed: f64,
    step_ms: u32,
    step: u64,
}

/// The whole episode as it would go if the target stood `moved_m` away, from
/// the end of the ten settling steps on.
fn remember(moved_m: [f64; 2], step_ms: u32, world: &World, scene: &Scene) -> Vec<Action> {
    let mut imagined = world.clone();
    if let Some(body) = imagined.body_mut(scene.target) {
        body.position_m[0] += moved_m[0];
        body.position_m[1] += moved_m[1];
    }
    let task = Task {
        target: scene.target,
        destination: scene.destination,
        relation: scene.relation,
        behaviour: &Behaviour::Competent,
        speed: 1.0,
        step_ms,
        step: 0,
    };
    let settle = vec![[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]; 10];
    let mut episode = settle;
    episode.extend(rollout(&task, imagined, REPLAY_STEPS));
    episode
}

fn rollout(task: &Task<'_>, mut world: World, n: usize) -> Vec<Action> {
    let mut task = *task;
    let mut actions = Vec::with_capacity(n);
    // Who does not look need not imagine.
    let blind = matches!(task.behaviour, Behaviour::Dithers | Behaviour::Frozen);
    for _ in 0..n {
        let action = act(&task, &world);
        if !blind {
            world.start(&action);
            for _ in 0..5 {
                world.advance(u64::from(task.step_ms) * 1_000_000 / 5);
            }
        }
        task.step += 1;
        actions.push(action);
    }
    actions
}

/// One action of the script: what to do follows from the state of the world
/// alone.
fn act(task: &Task<'_>, world: &World) -> Action {
    match task.behaviour {
        Behaviour::Dithers => {
            let x = if (task.step / 2).is_multiple_of(2) {
                0.8
            } else {
                -0.8
            };
            return [x, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        }
        Behaviour::Frozen => return [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0],
        _ => {}
    }
    let (Some(target), Some(destination)) = (world.body(task.target), world.body(task.destination))
    else {
        return [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    };
    if world.held() == task.target {
        return place(task, world, destination.position_m);
    }
    if world.is_placed(task.target, task.destination) {
        return towards(task, world, [0.45, 0.0, 0.30], -1.0);
    }
    let half = target.half_extent_m;
    let mut grasp = target.position_m;
    if target.class == fitmac_core::wire::GraspClass::Bowl {
        grasp[1] += half[1] - 0.005;
        grasp[2] += half[2] - 0.015;
    }
    pick(task, world, grasp)
}

fn pick(task: &Task<'_>, world: &World, grasp_m: Vector3) -> Action {
    let [x, y, z] = world.ee_m();
    let [gx, gy, gz] = grasp_m;
    let off = (gx - x).hypot(gy - y);
    let near = off < 0.012 && z - gz < 0.012;
    if near {
        let closed_on_nothing = world.is_closing() && world.width_m() < 0.001;
        let reopening = !world.is_closing() && world.width_m() < 0.07;
        let grip = if closed_on_nothing || reopening {
            -1.0
        } else {
            1.0
        };
        return [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, grip];
    }
    let above = match task.behaviour {
        Behaviour::StallsAbove(height_m) => *height_m,
        _ if off < 0.012 => 0.0,
        _ => 0.10,
    };
    if matches!(task.behaviour, Behaviour::StallsAbove(_)) && off < 0.012 && z - gz - above < 0.01 {
        return [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    }
    towards(task, world, [gx, gy, gz + above], -1.0)
}

fn place(task: &Task<'_>, world: &World, destination_m: Vector3) -> Action {
    const CARRY_M: f64 = 0.20;
    let [x, y, z] = world.ee_m();
    let [mut gx, mut gy, gz] = destination_m;
    if let Behaviour::MissesPlace([dx, dy]) = task.behaviour {
        gx += dx;
        gy += dy;
    }
    let off = (gx - x).hypot(gy - y);
    let Some(body) = world.body(task.target) else {
        return [0.0; ACTION_DIM];
    };
    let hangs = z - (body.position_m[2] - body.half_extent_m[2]);
    let release_z = match task.relation {
        PlaceRelation::On => gz + 0.02 + hangs,
        PlaceRelation::In => gz + 0.04 + hangs,
    };
    if off > 0.02 && z < CARRY_M {
        return towards(task, world, [x, y, CARRY_M + 0.05], 1.0);
    }
    if off > 0.02 {
        return towards(task, world, [gx, gy, CARRY_M + 0.05], 1.0);
    }
    if z > release_z {
        return towards(task, world, [gx, gy, release_z - 0.02], 1.0);
    }
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]
}

/// Towards a place, as fast as the policy moves.
fn towards(task: &Task<'_>, world: &World, goal_m: Vector3, grip: f64) -> Action {
    let [dx, dy, dz] = vector::sub(goal_m, world.ee_m());
    let unit = |d: f64| (d / 0.05).clamp(-task.speed, task.speed);
    [unit(dx), unit(dy), unit(dz), 0.0, 0.0, 0.0, grip]
}
