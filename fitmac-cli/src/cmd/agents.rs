//! `fitmac agents`: planner and grounder on shared memory.
//!
//! They read the instruction and the looks of things from the scene card, and
//! the poses from the state samples.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::Context;
use fitmac_agents::{
    model::{CallRecord, Calls, Role},
    scene::{Detection, Scene, Table},
    service::{AgentService, Event, ServiceParams},
};
use fitmac_core::{message::StateSample, wire::GraspClass};
use fitmac_rt::{
    clock,
    endpoint::AgentsEndpoint,
    instance::Instance,
    message::{ModelCall, ModelRole, PromptText},
    port::Session,
    signals::Signals,
    transport::Ipc,
};
use sim_harness::pose::Pose;

use super::{leave_control_core, plan::ModelArgs};
use crate::{
    card::Card,
    crew::Report,
    exit::{BadInput, Exit},
};

/// How often the agents look for something to do.
const LOOK: Duration = Duration::from_millis(2);
/// How often they look at the scene.
const SCENE_EVERY: Duration = Duration::from_millis(100);
/// Centre of the table that the scenes stand on, base frame, m.
const TABLE_CENTRE_M: [f64; 2] = [0.45, 0.0];
/// Half of it, m.
const TABLE_HALF_M: [f64; 2] = [0.4, 0.55];

/// Arguments of `agents`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:
  fitmac agents --instance cell --card scene.json
  fitmac agents --instance cell --card scene.json --model-url http://127.0.0.1:8000/v1 --model qwen

Rules first: a model, if one is named, is asked where the rules are unsure, in threads of its
own; what becomes of a call stands in the controller's trace (`fitmac trace events FILE`).
`fitmac help sim` shows the whole set of processes.")]
pub(crate) struct Args {
    /// The running system to join.
    #[arg(long, default_value = "default")]
    instance: String,
    /// The scene card that `fitmac sim` writes: the instruction, what things look like.
    #[arg(long, value_name = "FILE")]
    card: PathBuf,
    #[command(flatten)]
    model: ModelArgs,
    /// The instruction, instead of the card's.
    #[arg(long, value_name = "TEXT")]
    instruction: Option<String>,
}

/// Plans, then grounds until it is asked to end.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let signals = Signals::listen()?;
    leave_control_core();
    let card = Card::wait_for(&args.card)?;
    let instruction = args
        .instruction
        .as_ref()
        .unwrap_or(&card.instruction)
        .clone();
    let calls = args.model.chat()?.map(Calls::new);
    let instance = Instance::named(&args.instance)?;
    let transport = Ipc::join(&instance)?;
    let session = Session::start();
    let mut agents = Agents {
        endpoint: AgentsEndpoint::connect(&transport, session)?,
        service: AgentService::new(
            ServiceParams {
                session: session.0,
                ..ServiceParams::default()
            },
            calls,
        ),
        card,
        subtask: 0,
    };
    let planned = agents.service.on_instruction(clock::now_ns(), &instruction);
    planned.map_err(|error| BadInput(error.to_string()))?;
    agents.speak()?;
    Report::Ready.send();
    let mut seen: Option<Instant> = None;
    while !signals.stop_requested() {
        let due = seen.is_none_or(|seen| seen.elapsed() >= SCENE_EVERY);
        if due && agents.look()? {
            seen = Some(Instant::now());
        }
        agents.endpoint.refresh()?;
        agents.listen();
        agents.speak()?;
        std::thread::sleep(LOOK);
    }
    Ok(Exit::Done)
}

/// The service with its ends.
struct Agents {
    endpoint: AgentsEndpoint<Ipc>,
    service: AgentService,
    card: Card,
    /// The subtask that the controller is at.
    subtask: u32,
}

impl Agents {
    /// Shows the service the newest scene; says whether there was one.
    fn look(&mut self) -> anyhow::Result<bool> {
        let Some(sample) = self.endpoint.poll_state() else {
            return Ok(false);
        };
        let scene = seen(sample, &self.card);
        self.service
            .on_scene(clock::now_ns(), &scene, None)
            .context("the scene as seen")?;
        Ok(true)
    }

    /// Sends a call's record to the trace; a call that failed is also said.
    fn recorded(&mut self, call: &CallRecord) -> anyhow::Result<()> {
        let role = match call.role {
            Role::Planner => ModelRole::Planner,
            Role::Resolver => ModelRole::Resolver,
            Role::Critic => ModelRole::Critic,
        };
        if call.outcome != "ok" {
            let role = role.name();
            eprintln!(
                "fitmac agents: the model didn't help the {role}: {}",
                call.outcome
            );
        }
        let message = ModelCall::new(role, self.subtask, call.asked_ns, call.latency_ns)
            .ended(call.outcome, call.attempts);
        self.endpoint.send_model_call(clock::now_ns(), &message)?;
        Ok(())
    }

    /// Hears what the controller asks.
    fn listen(&mut self) {
        while let Some(request) = self.endpoint.poll_rebind() {
            let now_ns = clock::now_ns();
            if request.subtask != self.subtask {
                self.subtask = request.subtask;
                self.service.on_subtask(now_ns, request.subtask);
            }
            self.service.on_rebind_request(now_ns, &request);
        }
    }

    /// Says what there is to say. A prompt goes out before the record that
    /// names it.
    fn speak(&mut self) -> anyhow::Result<()> {
        for event in self.service.poll(clock::now_ns()) {
            let now_ns = clock::now_ns();
            match event {
                Event::Plan(plan) => self.endpoint.send_plan(now_ns, &plan)?,
                Event::Prompt { id, text } => {
                    let prompt = PromptText::new(id, self.subtask, 0, &text)?;
                    self.endpoint.send_prompt(now_ns, &prompt)?;
                }
                Event::Grounding(mut record) => {
                    self.endpoint.send_grounding(now_ns, &mut record)?;
                }
                Event::Critic(mut report) => self.endpoint.send_critic(now_ns, &mut report)?,
                Event::Call(call) => self.recorded(&call)?,
            }
        }
        Ok(())
    }
}

/// The scene as a detector with a clear view reports it.
fn seen(sample: &StateSample, card: &Card) -> Scene {
    let (mut objects, mut fixtures) = (Vec::new(), Vec::new());
    let count = usize::try_from(sample.object_count).unwrap_or(usize::MAX);
    for object in sample.objects.iter().take(count) {
        let Some(look) = card.look(object.id) else {
            continue;
        };
        let is_fixture = GraspClass::try_from(object.grasp_class) == Ok(GraspClass::Fixture);
        let pose = Pose {
            position_m: object.position_m,
            orientation: object.orientation,
        };
        let detection = Detection {
            id: object.id,
            label: look.label.clone(),
            confidence: object.confidence,
            position_m: object.position_m,
            size_m: pose.extent_m(object.half_extent_m),
            orientation: Some(object.orientation),
            box_px: None,
            colour: None,
            parts: Vec::new(),
        };
        if is_fixture {
            &mut fixtures
        } else {
            &mut objects
        }
        .push(detection);
    }
    let [x, y] = TABLE_CENTRE_M;
    Scene {
        stamp_ns: sample.stamp_ns,
        camera: None,
        table: Some(Table {
            centre_m: [x, y, card.surface_m],
            half_extent_m: TABLE_HALF_M,
        }),
        objects,
        fixtures,
    }
}
