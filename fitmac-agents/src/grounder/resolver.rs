//! A vision-language model's choice among the grounder's candidates.
//!
//! The model may only choose an index. It can't add a candidate, move one or
//! override a plain answer of the rules, and its confidence is capped.

use serde::Deserialize;

use crate::canvas::{Canvas, Colour};
use crate::model::{ModelError, Question, prompts};
use crate::planner::{PlannerOutput, TaskPlan};

use super::{Grounding, LEAD_RATIO, Seen, Verdict};

/// The resolver's answer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResolverOutput {
    /// Index into the candidates, from 0.
    pub selected_index: usize,
    /// The model's confidence, 0 to 1.
    pub confidence: f64,
    /// Why; for the trace only, never parsed.
    pub reason: String,
}

/// Longest reason that is kept, bytes.
const REASON_CAP: usize = 256;

/// Kappa of a model's choice among equals is at most this.
const CHOICE_CAP: f64 = 0.85;

/// Kappa of a model's choice that no relation supports is at most this.
const UNSUPPORTED_CAP: f64 = 0.5;

impl ResolverOutput {
    /// Reads an answer for `candidates` candidates.
    ///
    /// # Errors
    /// [`ModelError::Schema`] says what is wrong.
    pub fn parse(answer: &str, candidates: usize) -> Result<Self, ModelError> {
        let schema = |problem: &str| Err(ModelError::Schema(problem.to_owned()));
        let output: Self = serde_json::from_str(answer.trim())
            .map_err(|error| ModelError::Schema(error.to_string()))?;
        if output.selected_index >= candidates {
            return schema("selected_index is no candidate");
        }
        if !(0.0..=1.0).contains(&output.confidence) {
            return schema("confidence must be between 0 and 1");
        }
        if output.reason.len() > REASON_CAP {
            return schema("reason is longer than 256 bytes");
        }
        Ok(output)
    }
}

/// The question for the model, with the annotated image if there is one.
#[must_use]
pub fn question(
    plan: &TaskPlan,
    step: usize,
    instruction: &str,
    grounding: &Grounding,
    image: Option<&Canvas>,
) -> Question {
    let single = TaskPlan {
        subtasks: plan.subtasks.get(step).cloned().into_iter().collect(),
        ..plan.clone()
    };
    let schema = PlannerOutput::from_plan(&single);
    let names = |list: &[Seen]| -> serde_json::Value {
        list.iter().map(|seen| seen.label.as_str()).collect()
    };
    let candidates: serde_json::Value = grounding
        .candidates
        .iter()
        .enumerate()
        .map(|(index, candidate)| {
            serde_json::json!({
                "index": index,
                "label": candidate.seen.label,
                "box_px": candidate.seen.box_px,
            })
        })
        .collect();
    let user = prompts::fill(
        prompts::GROUNDER_USER,
        &[
            ("instruction", instruction.into()),
            ("canonical_instruction", schema.canonical_instruction.into()),
            ("target_object", schema.target_object.into()),
            ("source_phrase", schema.source_phrase.into()),
            ("references", names(&grounding.references)),
            ("candidates", candidates),
            ("context", names(&grounding.context)),
        ],
    );
    let png = image.and_then(|image| annotate(image, grounding).png().ok());
    Question {
        system: prompts::GROUNDER,
        user,
        png,
    }
}

/// The image with candidates in red and numbered, references in green, context
/// in blue.
#[must_use]
pub fn annotate(image: &Canvas, grounding: &Grounding) -> Canvas {
    let mut image = image.clone();
    let mut draw = |seen: &Seen, colour: Colour, tag: Option<usize>| {
        let Some(area) = seen.box_px else { return };
        let [x, y, width, height] = area.map(|value| value.clamp(-16384.0, 16384.0));
        let at = [x as i32, y as i32];
        image.frame(at, [width.max(1.0) as u32, height.max(1.0) as u32], colour);
        if let Some(tag) = tag {
            image.tag(&tag.to_string(), [at[0], (at[1] - 17).max(0)], colour);
        }
    };
    // Candidates last: their frames and numbers stay on top.
    grounding
        .context
        .iter()
        .for_each(|seen| draw(seen, Colour::BLUE, None));
    grounding
        .references
        .iter()
        .for_each(|seen| draw(seen, Colour::GREEN, None));
    for (index, candidate) in grounding.candidates.iter().enumerate() {
        draw(&candidate.seen, Colour::RED, Some(index));
    }
    image
}

impl Grounding {
    /// Takes the model's choice where the rules leave one open. False if the
    /// rules have decided, or if the chosen one is plainly worse than another.
    pub fn apply(&mut self, choice: &ResolverOutput) -> bool {
        let Some(chosen) = self.candidates.get(choice.selected_index) else {
            return false;
        };
        let best = self.candidates.iter().map(|c| c.weight).fold(0.0, f64::max);
        let cap = match self.verdict {
            Verdict::Resolved | Verdict::NotFound => return false,
            Verdict::Ambiguous if chosen.weight * LEAD_RATIO < best => return false,
            Verdict::Ambiguous => CHOICE_CAP,
            Verdict::Unsatisfied => UNSUPPORTED_CAP,
        };
        self.selected_index = Some(choice.selected_index);
        self.confidence = choice.confidence.min(cap);
        self.reason = format!("chosen by the model: {}", choice.reason.escape_default());
        true
    }
}
