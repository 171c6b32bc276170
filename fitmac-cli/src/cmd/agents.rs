//! `fitmac agents`: planner and grounder on shared memory.
//!
//! They read the instruction and the looks of things from the scene card, and
//! the poses from the state samples. They ground the first subtask as soon as
//! something is seen, and again whenever the controller asks.

use std::{path::PathBuf, time::Duration};

use anyhow::Context;
use fitmac_agents::{
    grounder::{self, Destination, Grounding},
    planner::{self, Relation, TaskPlan},
    scene::{Detection, Scene, Table},
};
use fitmac_core::{
    message::{
        CANDIDATE_CAPACITY, Candidate, GroundingRecord, ObjectSample, Plan, RebindRequest,
        StateSample,
    },
    wire::{DestinationKind, GraspClass, PlaceRelation, Provenance},
};
use fitmac_rt::{
    clock, endpoint::AgentsEndpoint, instance::Instance, message::PromptText, port::Session,
    transport::Ipc,
};
use sim_harness::pose::Pose;

use crate::{
    card::Card,
    crew::{Interrupt, Report},
    exit::{BadInput, Exit},
};

/// How often the agents look for something to do.
const LOOK: Duration = Duration::from_millis(2);
/// Half the table that the scenes stand on, m.
const TABLE_HALF_M: [f64; 2] = [0.4, 0.55];
/// Its centre, base frame, m.
const TABLE_CENTRE_M: [f64; 2] = [0.45, 0.0];

/// Arguments of `agents`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:
  fitmac agents --instance cell --card scene.json

Rules only: no model is asked. `fitmac help sim` shows the whole set of processes.")]
pub(crate) struct Args {
    /// The running system to join.
    #[arg(long, default_value = "default")]
    instance: String,
    /// The scene card that `fitmac sim` writes: the instruction, what things look like.
    #[arg(long, value_name = "FILE")]
    card: PathBuf,
    /// The instruction, instead of the card's.
    #[arg(long, value_name = "TEXT")]
    instruction: Option<String>,
}

/// Plans, then grounds until it is asked to end.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let interrupt = Interrupt::listen()?;
    let card = Card::wait_for(&args.card)?;
    let instruction = args.instruction.as_ref().unwrap_or(&card.instruction);
    let plan = planner::plan(instruction).map_err(|error| BadInput(error.to_string()))?;
    let instance = Instance::named(&args.instance)?;
    let transport = Ipc::join(&instance)?;
    let session = Session::start();
    let mut endpoint = AgentsEndpoint::connect(&transport, session)?;
    let message = Plan {
        id: session.0,
        subtask_count: u32::try_from(plan.subtasks.len()).context("the plan is too long")?,
        confidence_permille: (plan.confidence.clamp(0.0, 1.0) * 1000.0) as u32,
    };
    endpoint.send_plan(clock::now_ns(), &message)?;
    let mut grounding = Groundings {
        card,
        plan,
        epoch: 0,
    };
    Report::Ready.send();
    let mut state: Option<StateSample> = None;
    while !interrupt.asked() {
        if let Some(sample) = endpoint.poll_state() {
            let is_first = state.is_none();
            state = Some(*sample);
            if is_first {
                grounding.send(&mut endpoint, sample_of(&state)?, 0, Provenance::Rules)?;
            }
        }
        match (endpoint.poll_rebind(), &state) {
            (Some(request), Some(_)) => {
                grounding.answer(&mut endpoint, sample_of(&state)?, &request)?;
            }
            _ => std::thread::sleep(LOOK),
        }
    }
    Ok(Exit::Done)
}

fn sample_of(state: &Option<StateSample>) -> anyhow::Result<&StateSample> {
    state.as_ref().context("no state sample has arrived")
}

/// What the grounder has said so far.
struct Groundings {
    card: Card,
    plan: TaskPlan,
    /// The newest epoch.
    epoch: u64,
}

impl Groundings {
    /// Looks again, as the controller asks.
    fn answer(
        &mut self,
        endpoint: &mut AgentsEndpoint<Ipc>,
        sample: &StateSample,
        request: &RebindRequest,
    ) -> anyhow::Result<()> {
        self.epoch = self.epoch.max(request.epoch);
        // The first look at a subtask confirms nothing.
        let provenance = if request.suspect == 0 {
            Provenance::Rules
        } else {
            Provenance::Recheck
        };
        self.send(endpoint, sample, request.subtask, provenance)
    }

    /// Grounds a subtask in what is seen now, and says so.
    fn send(
        &mut self,
        endpoint: &mut AgentsEndpoint<Ipc>,
        sample: &StateSample,
        subtask: u32,
        provenance: Provenance,
    ) -> anyhow::Result<()> {
        let index = usize::try_from(subtask).unwrap_or(usize::MAX);
        let Some(step) = self.plan.subtasks.get(index) else {
            eprintln!("fitmac: the controller asks for subtask {subtask}, which is not planned");
            return Ok(());
        };
        self.epoch += 1;
        let prompt_id = u32::try_from(self.epoch).unwrap_or(u32::MAX);
        let scene = seen(sample, &self.card);
        let grounding = grounder::ground(step, &scene, &grounder::Context::default());
        let mut record = record(&grounding, sample);
        record.stamp_ns = sample.stamp_ns;
        record.epoch = self.epoch;
        record.subtask = subtask;
        record.prompt_id = prompt_id;
        record.provenance = provenance.code();
        let prompt = PromptText::new(prompt_id, subtask, self.epoch, &step.text)?;
        let now_ns = clock::now_ns();
        endpoint.send_prompt(now_ns, &prompt)?;
        endpoint.send_grounding(now_ns, &mut record)?;
        eprintln!(
            "grounding {}: {}, kappa {:.2}",
            self.epoch, grounding.reason, record.confidence
        );
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
        let detection = Detection {
            id: object.id,
            label: look.label.clone(),
            confidence: object.confidence,
            position_m: object.position_m,
            size_m: extent_m(object),
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

/// Extents along the base axes of a box that is turned, m.
fn extent_m(object: &ObjectSample) -> [f64; 3] {
    let pose = Pose {
        position_m: object.position_m,
        orientation: object.orientation,
    };
    let turn = pose.isometry().rotation.to_rotation_matrix();
    std::array::from_fn(|row| {
        2.0 * (0..3)
            .map(|k| turn[(row, k)].abs() * object.half_extent_m[k])
            .sum::<f64>()
    })
}

/// The grounder's answer as a message.
fn record(grounding: &Grounding, sample: &StateSample) -> GroundingRecord {
    let mut record = GroundingRecord {
        target: grounding
            .selected()
            .map_or(0, |candidate| candidate.seen.id),
        confidence: grounding.confidence,
        ..GroundingRecord::default()
    };
    for (slot, candidate) in record.candidates.iter_mut().zip(&grounding.candidates) {
        *slot = Candidate {
            id: candidate.seen.id,
            compatible: 1,
            reserved: [0; 5],
            confidence: candidate.weight,
        };
    }
    let count = grounding.candidates.len().min(CANDIDATE_CAPACITY);
    record.candidate_count = u8::try_from(count).unwrap_or(u8::MAX);
    match &grounding.destination {
        Destination::None => record.destination_kind = DestinationKind::Unresolved.code(),
        Destination::Relational { .. } => {
            record.destination_kind = DestinationKind::Relational.code();
        }
        Destination::Direct(anchor) => {
            record.destination_kind = DestinationKind::Direct.code();
            record.destination = anchor.id;
            let inside = anchor.relation == Relation::In;
            let relation = if inside {
                PlaceRelation::In
            } else {
                PlaceRelation::On
            };
            record.relation = relation.code();
            record.region_offset_m = in_frame_of(sample, anchor.id, anchor.region_offset_m);
            record.region_half_extent_m = anchor.region_half_extent_m;
        }
    }
    record
}

/// A vector along the base axes, in the frame of an object.
fn in_frame_of(sample: &StateSample, id: u16, vector_m: [f64; 3]) -> [f64; 3] {
    let Some(object) = sample.objects.iter().find(|object| object.id == id) else {
        return vector_m;
    };
    let pose = Pose {
        position_m: object.position_m,
        orientation: object.orientation,
    };
    pose.isometry()
        .rotation
        .inverse_transform_vector(&vector_m.into())
        .into()
}
