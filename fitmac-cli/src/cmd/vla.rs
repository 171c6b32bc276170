//! `fitmac vla`: a policy on shared memory, a surrogate or one behind a server.
//!
//! A surrogate answers queries with chunks of actions, after as long as its model
//! would take. It sees what a camera would show, the robot's own state and a
//! prompt.

mod mirror;
mod openpi;

use std::{
    collections::BTreeMap,
    path::PathBuf,
    time::{Duration, Instant},
};

use fitmac_core::{
    message::{ActionChunk, PolicyQuery, StateSample},
    wire::{ActionFrame, ActionSpace, GraspClass, GripperConvention},
};
use fitmac_rt::{
    clock, endpoint::PolicyEndpoint, instance::Instance, message::PromptText, port::Session,
    signals::Signals, transport::Ipc,
};
use sim_harness::{
    backbone::{Chunk, Observation, Registry, SeenObject},
    object::ObjectClass,
    pose::Pose,
    sim::RobotState,
    suite::Suite,
};

use super::leave_control_core;
use crate::{
    card::Card,
    crew::Report,
    exit::{BadInput, Exit},
};

/// How often the policy looks for a query: a hundredth of a policy step.
const LOOK: Duration = Duration::from_micros(500);

/// Arguments of `vla`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  fitmac vla --instance cell --card scene.json --seed 3
  fitmac vla --instance cell --card scene.json --openpi ws://127.0.0.1:8000 --openpi-horizon 10

Without --openpi the policy is a surrogate that replays what it memorised of a suite's training
scenes; it looks at the scene, not at the words. `fitmac help sim` shows the
whole set of processes.")]
pub(crate) struct Args {
    /// The running system to join.
    #[arg(long, default_value = "default")]
    instance: String,
    /// The scene card that `fitmac sim` writes: what things look like.
    #[arg(long, value_name = "FILE")]
    card: PathBuf,
    /// The suite that the policy was trained on.
    #[arg(long, default_value = "object")]
    suite: String,
    /// Which surrogate: openvla-like, pi0-like, pi05-like, bc (learned), blind-replay, chaos, and
    /// controls (oracle, hold, random).
    #[arg(long, default_value = "openvla-like")]
    backbone: String,
    /// Draws the policy's noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    openpi: openpi::Args,
}

/// Answers queries until it is asked to end.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let signals = Signals::listen()?;
    leave_control_core();
    if let Some(remote) = openpi::Remote::of(&args.openpi, &args.suite)? {
        return remote.run(Card::wait_for(&args.card)?, &args.instance, &signals);
    }
    let suite = Suite::embedded(&args.suite).map_err(|error| BadInput(error.to_string()))?;
    let registry = Registry::embedded()?;
    let mut backbone = registry
        .build(&args.backbone, &suite)
        .map_err(|error| BadInput(error.to_string()))?;
    backbone.reset(args.seed);
    let card = Card::wait_for(&args.card)?;
    let instance = Instance::named(&args.instance)?;
    let transport = Ipc::join(&instance)?;
    let mut endpoint = PolicyEndpoint::connect(&transport, Session::start())?;
    let mut view = View {
        card,
        prompts: BTreeMap::new(),
        state: None,
    };
    Report::Ready.send();
    while !signals.stop_requested() {
        view.refresh(&mut endpoint);
        let Some(query) = endpoint.poll_query() else {
            std::thread::sleep(LOOK);
            continue;
        };
        // The state that the query was made of may have come with it.
        view.refresh(&mut endpoint);
        let started = Instant::now();
        let Some((observation, observed_ns)) = view.observe(&query) else {
            continue; // no state yet: the controller asks again
        };
        let answer = backbone.infer(&observation);
        // A model takes its time; ours has to be made to.
        let latency = Duration::from_secs_f64(answer.latency_s.clamp(0.0, 60.0));
        wait(latency.saturating_sub(started.elapsed()), &signals);
        for _ in 0..answer.copies {
            let mut chunk = wrap(&answer, observed_ns);
            endpoint.send_chunk(clock::now_ns(), &query, &mut chunk)?;
        }
    }
    Ok(Exit::Done)
}

/// Sleeps, unless we are asked to end.
fn wait(duration: Duration, signals: &Signals) {
    let until = Instant::now() + duration;
    while let Some(left) = until.checked_duration_since(Instant::now()) {
        if signals.stop_requested() {
            return;
        }
        std::thread::sleep(left.min(Duration::from_millis(20)));
    }
}

/// What the policy has seen and heard.
struct View {
    card: Card,
    prompts: BTreeMap<u32, PromptText>,
    state: Option<StateSample>,
}

impl View {
    fn refresh(&mut self, endpoint: &mut PolicyEndpoint<Ipc>) {
        while let Some(prompt) = endpoint.poll_prompt() {
            self.prompts.insert(prompt.prompt_id, prompt);
        }
        if let Some(state) = endpoint.poll_state() {
            self.state = Some(*state);
        }
    }

    /// What the policy is told for a query: its prompt, or what the operator said.
    fn prompt(&self, query: &PolicyQuery) -> &str {
        let prompt = self.prompts.get(&query.prompt_id);
        let text = prompt.and_then(|prompt| prompt.text().ok());
        text.unwrap_or(&self.card.instruction)
    }

    /// What a query is answered from, and when it was seen.
    fn observe(&self, query: &PolicyQuery) -> Option<(Observation, u64)> {
        let state = self.state.as_ref()?;
        let count = usize::try_from(state.object_count).unwrap_or(usize::MAX);
        let objects = state.objects.iter().take(count).filter_map(|object| {
            let look = self.card.look(object.id)?;
            Some(SeenObject {
                label: look.label.clone(),
                class: object_class(object.grasp_class)?,
                colour: look.colour,
                half_extent_m: object.half_extent_m,
                pose: Pose {
                    position_m: object.position_m,
                    orientation: object.orientation,
                },
            })
        });
        let observation = Observation {
            prompt: self.prompt(query).to_owned(),
            policy_step: query.policy_step,
            robot: robot(state),
            surface_m: self.card.surface_m,
            surface_colour: self.card.surface_colour,
            objects: objects.collect(),
        };
        Some((observation, state.stamp_ns))
    }
}

fn robot(state: &StateSample) -> RobotState {
    RobotState {
        time_s: state.stamp_ns as f64 * 1e-9,
        joint_position_rad: state.joint_position_rad,
        joint_velocity_rad_s: state.joint_velocity_rad_s,
        tcp: Pose {
            position_m: state.ee_position_m,
            orientation: state.ee_orientation,
        },
        tcp_velocity_m_s: state.ee_velocity_m_s,
        tcp_angular_velocity_rad_s: [0.0; 3],
        gripper_width_m: state.gripper_width_m,
    }
}

fn object_class(code: u8) -> Option<ObjectClass> {
    Some(match GraspClass::try_from(code).ok()? {
        GraspClass::Box => ObjectClass::Box,
        GraspClass::Can => ObjectClass::Can,
        GraspClass::Bottle => ObjectClass::Bottle,
        GraspClass::Bowl => ObjectClass::Bowl,
        GraspClass::Fixture => ObjectClass::Fixture,
    })
}

/// The answer as a message. One that is too long keeps its horizon, and is refused for it.
fn wrap(answer: &Chunk, observed_ns: u64) -> ActionChunk {
    let mut chunk = ActionChunk {
        observation_ns: observed_ns,
        horizon: u32::try_from(answer.actions.len()).unwrap_or(u32::MAX),
        action_space: ActionSpace::OscPoseDelta.code(),
        frame: ActionFrame::Base.code(),
        gripper: GripperConvention::MinusOneOpen.code(),
        ..ActionChunk::default()
    };
    for (slot, action) in chunk.actions.iter_mut().zip(&answer.actions) {
        *slot = action.map(|component| component as f32);
    }
    chunk
}
