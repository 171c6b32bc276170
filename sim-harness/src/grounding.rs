//! The project's own planner and grounder, looking through a pose source.

use fitmac_agents::bind::{self, RecordHeader};
use fitmac_agents::grounder::{self, Context};
use fitmac_agents::planner::{self, TaskPlan};
use fitmac_agents::scene::{Detection, Part, Scene as SeenScene, Table};
use fitmac_core::message::{GroundingRecord, Plan};
use fitmac_core::wire::Provenance;

use crate::agents::{Agents, Occasion, View};
use crate::error::SimError;
use crate::perception::Sighting;
use crate::scene::{PlacedObject, TABLE_CENTRE_M, TABLE_HALF_M};

/// Confidence of a pose that the newest frame did not show, as a share of the last one.
const UNSEEN_SHARE: f64 = 0.7;
/// The prompt that names the grounded target; prompt 0 is the instruction as given.
const GROUNDED_PROMPT: u32 = 1;

/// Plans and grounds by rules, without a model.
///
/// "The bowl next to the ramekin" is the one that stood there when the instruction was given: once
/// the robot has lifted it, the relation no longer holds. Relations are therefore read off the
/// places in which things were first seen, and fresh evidence on a lock is about the locked
/// instance alone: whether it is still there and still goes by its name.
#[derive(Clone, Debug, Default)]
pub struct RuleAgents {
    plan: Option<TaskPlan>,
    prompt: Option<String>,
    /// Where things were first seen, by id.
    first_seen: Vec<Sighting>,
    /// The newest binding and the detector's confidence in its target then.
    bound: Option<(GroundingRecord, f64)>,
}

impl RuleAgents {
    /// Agents that have read nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Agents for RuleAgents {
    fn plan(&mut self, instruction: &str) -> Plan {
        // What can't be read at all leaves control with the base policy.
        let plan = planner::plan(instruction)
            .unwrap_or_else(|_| TaskPlan::unknown(instruction, 0.0, Vec::new()));
        let told = bind::plan(1, &plan);
        self.plan = Some(plan);
        self.prompt = None;
        told
    }

    fn ground(
        &mut self,
        view: &View<'_>,
        subtask: u32,
        epoch: u64,
        occasion: Occasion,
    ) -> Option<GroundingRecord> {
        self.remember(view);
        match (occasion, self.bound) {
            (Occasion::Again, Some((bound, confidence))) => Some(GroundingRecord {
                epoch,
                ..self.still(view, &bound, confidence)
            }),
            _ => self.bind(view, subtask, epoch, occasion),
        }
    }

    fn prompt(&self, prompt_id: u32) -> Option<&str> {
        self.prompt
            .as_deref()
            .filter(|_| prompt_id == GROUNDED_PROMPT)
    }
}

impl RuleAgents {
    fn remember(&mut self, view: &View<'_>) {
        for sighting in view.sightings {
            if !self.first_seen.iter().any(|s| s.id == sighting.id) {
                self.first_seen.push(*sighting);
            }
        }
    }

    /// Looks for the target and the destination.
    fn bind(
        &mut self,
        view: &View<'_>,
        subtask: u32,
        epoch: u64,
        occasion: Occasion,
    ) -> Option<GroundingRecord> {
        let plan = self.plan.as_ref()?;
        let step = plan.subtasks.get(usize::try_from(subtask).ok()?)?;
        let places: Vec<Sighting> = view
            .sightings
            .iter()
            .map(|now| Sighting {
                pose: self.first_pose(now),
                ..*now
            })
            .collect();
        let then = View {
            sightings: &places,
            ..*view
        };
        let grounding = grounder::ground(step, &seen_scene(&then), &Context::default());
        let again = matches!(occasion, Occasion::Rebind { suspect } if suspect != 0);
        if again {
            self.prompt = Some(step.text.clone());
        }
        // The sequence number, session and stamp are the caller's.
        let header = RecordHeader {
            sequence: 0,
            session: 0,
            stamp_ns: 0,
            epoch,
            subtask,
            prompt_id: if again { GROUNDED_PROMPT } else { 0 },
            provenance: if again {
                Provenance::Recheck
            } else {
                Provenance::Rules
            },
        };
        let record = bind::record(&header, &grounding);
        let target = view.sightings.iter().find(|s| s.id == record.target);
        self.bound = target.map(|t| (record, t.confidence));
        Some(record)
    }

    fn first_pose(&self, now: &Sighting) -> crate::pose::Pose {
        self.first_seen
            .iter()
            .find(|s| s.id == now.id)
            .map_or(now.pose, |s| s.pose)
    }

    /// The binding as it looks now: as sure as it was, weighed with how well the target is seen,
    /// and compatible as long as the target goes by the name that it was bound by.
    fn still(&self, view: &View<'_>, bound: &GroundingRecord, seen_then: f64) -> GroundingRecord {
        let mut record = *bound;
        let Some(now) = view.sightings.iter().find(|s| s.id == bound.target) else {
            return record;
        };
        let share = (now.confidence / seen_then.max(0.01)).min(1.0);
        record.confidence = bound.confidence * share;
        let label = |id: u16| view.scene.by_id(id).map(|o| o.kind.label.as_str());
        let renamed = label(now.named_as) != label(now.id);
        if let Some(candidate) = record.candidates.iter_mut().find(|c| c.id == bound.target) {
            candidate.compatible &= u8::from(!renamed);
        }
        record
    }
}

/// What a pose source knows, as the grounder reads it.
#[must_use]
pub fn seen_scene(view: &View<'_>) -> SeenScene {
    let (mut objects, mut fixtures) = (Vec::<Detection>::new(), Vec::<Detection>::new());
    let mut parts = Vec::new();
    for sighting in view.sightings {
        let Some(placed) = view.scene.by_id(sighting.id) else {
            continue;
        };
        let detection = detection(view, placed, sighting);
        match &placed.kind.part_of {
            Some(whole) => parts.push((whole, detection)),
            None if placed.kind.fixed => fixtures.push(detection),
            None => objects.push(detection),
        }
    }
    for (whole, part) in parts {
        if let Some(fixture) = fixtures.iter_mut().find(|f| f.label == *whole) {
            fixture.parts.push(Part {
                name: part.label,
                position_m: part.position_m,
                size_m: part.size_m,
            });
        }
    }
    let [x, y] = TABLE_CENTRE_M;
    SeenScene {
        stamp_ns: view.now_ns,
        camera: None,
        table: Some(Table {
            centre_m: [x, y, view.scene.arena.surface_m],
            half_extent_m: TABLE_HALF_M,
        }),
        objects,
        fixtures,
    }
}

fn detection(view: &View<'_>, placed: &PlacedObject, sighting: &Sighting) -> Detection {
    let named = view.scene.by_id(sighting.named_as).unwrap_or(placed);
    let share = if sighting.visible { 1.0 } else { UNSEEN_SHARE };
    Detection {
        id: sighting.id,
        label: named.kind.label.clone(),
        confidence: share * sighting.confidence,
        position_m: sighting.pose.position_m,
        size_m: sighting.pose.extent_m(placed.kind.half_extent_m()),
        orientation: Some(sighting.pose.orientation),
        box_px: None,
        colour: None,
        parts: Vec::new(),
    }
}

/// Checks that the planner and grounder single out the objects that a task means, in a scene as it
/// was put together.
///
/// # Errors
/// [`SimError::Invalid`], saying what was chosen instead.
pub fn check_grounding(
    scene: &crate::scene::Scene,
    instruction: &str,
    target: &str,
    destination: &str,
) -> Result<(), SimError> {
    let sightings: Vec<Sighting> = scene
        .objects()
        .iter()
        .map(|o| Sighting {
            id: o.id,
            named_as: o.id,
            pose: o.pose,
            stamp_ns: 0,
            visible: true,
            confidence: 0.95,
        })
        .collect();
    let view = View {
        now_ns: 0,
        scene,
        sightings: &sightings,
    };
    let mut agents = RuleAgents::new();
    let plan = agents.plan(instruction);
    let wrong = |what: String| SimError::invalid(format!("`{instruction}`"), what);
    if plan.subtask_count != 1 || plan.confidence_permille < 500 {
        return Err(wrong(format!("planned as {plan:?}")));
    }
    let record = agents
        .ground(&view, 0, 1, Occasion::First)
        .ok_or_else(|| wrong("not grounded".to_owned()))?;
    let name = |id: u16| scene.by_id(id).map_or("nothing", |o| &o.name).to_owned();
    let (found, place) = (name(record.target), name(record.destination));
    if found != target || place != destination {
        return Err(wrong(format!(
            "grounded {found} to {place}, kappa {:.2}",
            record.confidence
        )));
    }
    Ok(())
}
