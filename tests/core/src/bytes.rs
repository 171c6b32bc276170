//! Raw bytes as input for the core: what a fuzzer writes is read as parameters,
//! time steps, disturbances of the toy world, and messages.
//!
//! A zero byte is one policy step in good order, so that a few of them already
//! lead into a correction; other bytes lose, alter or wholly replace a message,
//! number by number, with any bits at all.

use fitmac_core::{
    Controller, Params, ValidParams,
    message::{
        ActionChunk, CriticReport, GroundingRecord, OBJECT_CAPACITY, ObjectSample, Plan,
        StateSample, VerifierReport,
    },
    params::{OutOfRange, PolicyGripper, Switches, WhileRebinding},
};

use crate::{
    swarm::{Broken, Glimpse, Seen, Told, Watch},
    world::{Agent, Behaviour, OTHER, Policy, Scene, World},
};

/// Most ticks of one input.
const TICKS: u32 = 800;

/// What an input led to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Run {
    /// Ticks.
    pub ticks: u32,
    /// Queries.
    pub queries: u32,
    /// Ticks within a correction.
    pub correcting: u32,
}

/// Feeds a controller with what the bytes say; each tick is checked.
///
/// # Errors
/// The number of the tick at which an invariant broke, and which.
pub fn run(bytes: &[u8]) -> Result<Run, (u32, Broken)> {
    let mut source = Source::new(bytes);
    let mut controller = Controller::new(source.params);
    let params = *source.params.get();
    let mut watch = Watch::default();
    let mut run = Run::default();
    while run.ticks < TICKS
        && let Some(told) = source.tick()
    {
        let before = Glimpse::of(controller.state());
        let output = controller.tick(told.now_ns, &told.input());
        let seen = Seen {
            seed: 0,
            params: &params,
            before: &before,
            told: &told,
            output: &output,
            after: controller.state(),
        };
        watch.look(&seen).map_err(|broken| (run.ticks, broken))?;
        source.hear(&output);
        run.ticks += 1;
        run.queries += u32::from(output.trace.is_some());
        run.correcting += u32::from(output.command.sub_phase != 0);
    }
    Ok(run)
}

/// A source of ticks.
struct Source<'a> {
    params: ValidParams,
    bytes: Bytes<'a>,
    scene: Scene,
    world: World,
    policy: Policy,
    agent: Agent,
    now_ns: u64,
    step_ns: u64,
}

impl<'a> Source<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let mut bytes = Bytes(bytes);
        let params = params(&mut bytes);
        let pick = bytes.next().unwrap_or(0);
        let scene = match pick & 3 {
            0 => Scene::can_to_plate(),
            1 => Scene::bowl_to_plate(),
            2 => Scene::box_to_plate(),
            _ => Scene::can_to_basket(),
        };
        let mut policy = Policy::new(behaviour(pick >> 2));
        let step_ms = params.get().clock.step_ms;
        policy.step_ms = step_ms;
        policy.gripper = params.get().policy_gripper.convention();
        policy.delay_ns = 0;
        let mut agent = Agent::knowing(&scene);
        agent.delay_ns = 0;
        Self {
            params,
            bytes,
            world: scene.world.clone(),
            policy,
            agent,
            scene,
            now_ns: 1_000_000_000,
            step_ns: u64::from(step_ms) * 1_000_000,
        }
    }

    /// The next tick; `None` when the bytes are used up.
    fn tick(&mut self) -> Option<Told> {
        let how = self.bytes.next()?;
        let dt_ns = match how & 3 {
            0 => self.step_ns,
            1 => self.step_ns / 2,
            2 => 4_000_000,
            _ => self.odd_time(),
        };
        self.now_ns = self.now_ns.wrapping_add(dt_ns);
        self.world.advance(dt_ns.min(self.step_ns * 4));
        if how & 4 != 0 {
            self.disturb();
        }
        let mut told = Told {
            now_ns: self.now_ns,
            state: Some(self.world.sample()),
            chunk: self.policy.poll(self.world.now_ns()),
            grounding: self.agent.poll(self.world.now_ns()),
            ..Told::default()
        };
        told.shift(self.now_ns.wrapping_sub(self.world.now_ns()));
        if how & 8 != 0 {
            alter(&mut self.bytes, &mut told.state, STATE_LANES, state_lane);
        }
        if how & 16 != 0 {
            alter(&mut self.bytes, &mut told.chunk, CHUNK_LANES, chunk_lane);
        }
        if how & 32 != 0 {
            let record = &mut told.grounding;
            alter(&mut self.bytes, record, GROUNDING_LANES, grounding_lane);
        }
        if how & 64 != 0 {
            self.say(&mut told);
        }
        Some(told)
    }

    fn hear(&mut self, output: &fitmac_core::message::Output) {
        self.world.apply(&output.command);
        if let Some(query) = &output.query {
            self.policy.ask(query, &self.world, &self.scene);
        }
        if let Some(request) = &output.rebind {
            self.agent.ask(self.world.now_ns(), request, &self.scene);
        }
    }

    /// A leap, a standstill, or a step back.
    fn odd_time(&mut self) -> u64 {
        let how = self.bytes.next().unwrap_or(0);
        match how {
            0 => 0,
            1..128 => u64::from(how) * 4_000_000,
            128..192 => 0_u64.wrapping_sub(u64::from(how - 127) * 1_000_000),
            _ => self.bytes.u64_raw(),
        }
    }

    fn disturb(&mut self) {
        let how = self.bytes.next().unwrap_or(0);
        let ids: Vec<_> = self.world.bodies.iter().map(|b| b.id).collect();
        let id = ids[usize::from(how >> 4) % ids.len()];
        match how & 7 {
            0 => self.world.hidden.push(id),
            1 => self.world.hidden.clear(),
            2 => self.world.plant.weak_grasps = u32::from(how >> 4),
            3 => self.world.plant.drop_above_m = Some(0.02 * f64::from(how >> 4)),
            4 => self.policy.restart(),
            5 => self.policy.behaviour = behaviour(how >> 4),
            6 => self.world.plant.reach_m = 0.4 + 0.03 * f64::from(how >> 4),
            _ => {
                let by = [self.bytes.small(), self.bytes.small()];
                if let Some(body) = self.world.body_mut(id) {
                    body.position_m[0] += by[0];
                    body.position_m[1] += by[1];
                }
            }
        }
    }

    /// Plan, verifier, critic, operator; grounding without a question.
    fn say(&mut self, told: &mut Told) {
        let b = &mut self.bytes;
        match b.next().unwrap_or(0) {
            0 => told.request = b.next().unwrap_or(0),
            1 => {
                told.plan = Some(Plan {
                    id: u64::from(b.next().unwrap_or(0)),
                    subtask_count: u32::from(b.next().unwrap_or(1)),
                    confidence_permille: u32::from(b.next().unwrap_or(250)) * 4,
                });
            }
            2 => {
                told.verifier = Some(VerifierReport {
                    sequence: b.u64_near(0),
                    stamp_ns: self.now_ns,
                    subtask: u32::from(b.next().unwrap_or(0) & 3),
                    verdict: b.next().unwrap_or(0),
                    reserved: [0; 3],
                });
            }
            3 => {
                told.critic = Some(CriticReport {
                    sequence: b.u64_near(0),
                    stamp_ns: self.now_ns,
                    subtask: u32::from(b.next().unwrap_or(0) & 3),
                    label: b.next().unwrap_or(0),
                    reserved: [0; 3],
                    confidence: b.f64_near(0.5),
                });
            }
            4 => {
                let kappa = b.f64_near(0.5);
                self.agent.observe_again(self.world.now_ns(), kappa);
            }
            _ => {
                let id = u16::from(b.next().unwrap_or(0) & 7);
                self.agent.volunteer(self.world.now_ns(), id, &self.scene);
            }
        }
    }
}

fn behaviour(how: u8) -> Behaviour {
    match how & 7 {
        0 => Behaviour::Frozen,
        1 => Behaviour::Competent,
        2 => Behaviour::StallsAbove(0.05),
        3 => Behaviour::WrongObject(OTHER),
        4 => Behaviour::MissesPlace([0.12, 0.0]),
        5 => Behaviour::Dithers,
        _ => Behaviour::StallsAbove(0.0),
    }
}

fn params(bytes: &mut Bytes<'_>) -> ValidParams {
    let (how, more) = (bytes.next().unwrap_or(0), bytes.next().unwrap_or(0));
    let mut p = if how & 1 == 0 {
        Params::guarded()
    } else {
        Params::paper()
    };
    if how & 2 != 0 {
        p.while_rebinding = WhileRebinding::BaseActs;
    }
    if how & 4 != 0 {
        p.out_of_range = OutOfRange::Refuse;
    }
    if how & 8 != 0 {
        p.policy_gripper = PolicyGripper::OneOpen;
    }
    p.switches = Switches {
        target_corrector: how & 16 == 0,
        execution_corrector: how & 32 == 0,
        hard_pick: how & 64 == 0,
        hard_place: how & 128 == 0,
    };
    p.clock.settle_steps = u32::from(more & 1);
    if more & 2 != 0 {
        p.clock.step_ms = 20;
    }
    if more & 4 != 0 {
        p.gate.failure_streak = 1;
        p.gate.confidence_streak = 1;
        p.gate.cool_down_steps = 0;
        p.gate.rescue_min_step = 0;
        p.patience.approach_steps = 4;
    }
    if more & 8 != 0 {
        p.recovery.pick_budget = 12;
        p.recovery.place_budget = 9;
        p.recovery.episode_budget = 30;
    }
    if more & 16 != 0 {
        p.chunk.query_lead_steps = 2;
    }
    p.validate().unwrap_or_else(|v| panic!("{v}"))
}

/// Loses a message, alters some of its numbers, or makes all of it from bytes.
fn alter<T: Default>(
    bytes: &mut Bytes<'_>,
    message: &mut Option<T>,
    lanes: u8,
    lane: fn(&mut Bytes<'_>, &mut T, u8),
) {
    let how = bytes.next().unwrap_or(0);
    match how {
        0 => *message = None,
        255 => {
            let whole = message.insert(T::default());
            (0..lanes).for_each(|n| lane(bytes, whole, n));
        }
        _ => {
            let altered = message.get_or_insert_default();
            for _ in 0..=how & 3 {
                let n = bytes.next().unwrap_or(0) % lanes;
                lane(bytes, altered, n);
            }
        }
    }
}

const STATE_LANES: u8 = 32 + 2 * OBJECT_LANES;
const OBJECT_LANES: u8 = 15;

fn state_lane(b: &mut Bytes<'_>, s: &mut StateSample, n: u8) {
    let i = usize::from(n);
    match n {
        0..7 => s.joint_position_rad[i] = b.f64_near(s.joint_position_rad[i]),
        7..14 => s.joint_velocity_rad_s[i - 7] = b.f64_near(0.0),
        14..17 => s.ee_position_m[i - 14] = b.f64_near(s.ee_position_m[i - 14]),
        17..21 => s.ee_orientation[i - 17] = b.f64_near(s.ee_orientation[i - 17]),
        21..24 => s.ee_velocity_m_s[i - 21] = b.f64_near(0.0),
        24 => s.gripper_width_m = b.f64_near(s.gripper_width_m),
        25 => s.sequence = b.u64_near(s.sequence),
        26 => s.session = b.u64_near(s.session),
        27 => s.stamp_ns = b.u64_near(s.stamp_ns),
        28 => s.applied_command = b.u64_near(s.applied_command),
        29..31 => s.object_count = b.count(OBJECT_CAPACITY),
        31 => s.ee_orientation = turned(b),
        _ => {
            let object = (n - 32) / OBJECT_LANES;
            let lane = (n - 32) % OBJECT_LANES;
            object_lane(b, &mut s.objects[usize::from(object)], lane);
        }
    }
}

fn object_lane(b: &mut Bytes<'_>, o: &mut ObjectSample, n: u8) {
    let i = usize::from(n);
    match n {
        0 => o.id = u16::from(b.next().unwrap_or(0)),
        1 => o.grasp_class = b.next().unwrap_or(0),
        2 => o.visible = b.next().unwrap_or(0),
        3 => o.stamp_ns = b.u64_near(o.stamp_ns),
        4..7 => o.position_m[i - 4] = b.f64_near(o.position_m[i - 4]),
        7 => o.orientation = turned(b),
        8..11 => o.half_extent_m[i - 8] = b.f64_near(o.half_extent_m[i - 8]),
        11 => o.confidence = b.f64_near(o.confidence),
        _ => o.orientation[i - 11] = b.f64_near(o.orientation[i - 11]),
    }
}

const CHUNK_LANES: u8 = 36;

fn chunk_lane(b: &mut Bytes<'_>, c: &mut ActionChunk, n: u8) {
    match n {
        0 => c.sequence = b.u64_near(c.sequence),
        1 => c.session = b.u64_near(c.session),
        2 => c.observation_ns = b.u64_near(c.observation_ns),
        3 => c.stamp_ns = b.u64_near(c.stamp_ns),
        4 => c.query_id = b.u64_near(c.query_id),
        5 => c.epoch = b.u64_near(c.epoch),
        6 => c.subtask = u32::from(b.next().unwrap_or(0)),
        7 => c.horizon = b.count(64),
        8 => c.action_space = b.next().unwrap_or(0),
        9 => c.frame = b.next().unwrap_or(0),
        10 => c.gripper = b.next().unwrap_or(0),
        _ => {
            let (slot, lane) = (usize::from(n - 11) / 7, usize::from(n - 11) % 7);
            c.actions[slot][lane] = b.f64_near(f64::from(c.actions[slot][lane])) as f32;
        }
    }
}

const GROUNDING_LANES: u8 = 27;

fn grounding_lane(b: &mut Bytes<'_>, g: &mut GroundingRecord, n: u8) {
    let i = usize::from(n);
    match n {
        0 => g.sequence = b.u64_near(g.sequence),
        1 => g.session = b.u64_near(g.session),
        2 => g.stamp_ns = b.u64_near(g.stamp_ns),
        3 => g.epoch = b.u64_near(g.epoch),
        4 => g.subtask = u32::from(b.next().unwrap_or(0)),
        5 => g.prompt_id = u32::from(b.next().unwrap_or(0)),
        6 => g.target = u16::from(b.next().unwrap_or(0)),
        7 => g.destination = u16::from(b.next().unwrap_or(0)),
        8 => g.destination_kind = b.next().unwrap_or(0),
        9 => g.relation = b.next().unwrap_or(0),
        10 => g.provenance = b.next().unwrap_or(0),
        11 => g.candidate_count = b.next().unwrap_or(0),
        12 => g.confidence = b.f64_near(g.confidence),
        13..16 => g.region_offset_m[i - 13] = b.f64_near(g.region_offset_m[i - 13]),
        16..19 => g.region_half_extent_m[i - 16] = b.f64_near(g.region_half_extent_m[i - 16]),
        19..23 => g.candidates[i - 19].id = u16::from(b.next().unwrap_or(0)),
        _ => g.candidates[i - 23].compatible = b.next().unwrap_or(0),
    }
}

/// A unit quaternion.
fn turned(b: &mut Bytes<'_>) -> [f64; 4] {
    let [x, y, z] = [(); 3].map(|()| 50.0 * b.small());
    let turn = kinematics::rotation::UnitQuaternion::from_rotation_vector([x, y, z]);
    turn.wxyz()
}

/// The bytes that are left.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    /// Eight bytes; zeros after the end.
    fn u64_raw(&mut self) -> u64 {
        u64::from_le_bytes([(); 8].map(|()| self.next().unwrap_or(0)))
    }

    /// -0.128 to 0.127.
    fn small(&mut self) -> f64 {
        f64::from(self.next().unwrap_or(0).cast_signed()) * 1e-3
    }

    fn count(&mut self, most: usize) -> u32 {
        match self.next().unwrap_or(0) {
            255 => self.u64_raw() as u32,
            n => u32::from(n) % (most as u32 + 2),
        }
    }

    fn u64_near(&mut self, old: u64) -> u64 {
        const ODD: [u64; 6] = [0, 1, u64::MAX, u64::MAX - 1, 1 << 63, (1 << 63) - 1];
        match self.next().unwrap_or(0) {
            255 => self.u64_raw(),
            n @ 240..246 => ODD[usize::from(n - 240)],
            n @ 200..240 => old.wrapping_sub(u64::from(n - 199) * 50_000_000),
            n @ 160..200 => old.wrapping_add(u64::from(n - 159) * 50_000_000),
            n => old.wrapping_add_signed(i64::from(n) - 80),
        }
    }

    fn f64_near(&mut self, old: f64) -> f64 {
        const ODD: [f64; 10] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            1.0,
            f64::MIN_POSITIVE / 4.0,
            f64::MAX,
            -1e300,
            1e-300,
        ];
        match self.next().unwrap_or(0) {
            255 => f64::from_bits(self.u64_raw()),
            n @ 240..250 => ODD[usize::from(n - 240)],
            n @ 200..240 => f64::from(n - 200) * 0.05 - 1.0,
            n => old + (f64::from(n) - 100.0) * 1e-3,
        }
    }
}
