//! The planner's nine keys, as JSON.

use serde::{Deserialize, Serialize};

use super::types::{Action, Relation, SUBTASK_CAPACITY, Subtask, TaskPlan};

/// A plan in the published schema: nine keys, all present.
///
/// With several steps, `plan` lists all of them and the other keys describe
/// the first; each step's text gives its own object when it is planned again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerOutput {
    /// The instruction in canonical words.
    pub canonical_instruction: String,
    /// The steps in order, one to eight sentences.
    pub plan: Vec<String>,
    /// What the first step does.
    pub action: Action,
    /// The object that it acts on, without articles.
    pub target_object: String,
    /// Where that object is, as in "next to the ramekin"; empty if not said.
    pub source_phrase: String,
    /// The object that it goes to, as in "plate"; empty if none.
    pub destination: String,
    /// The preposition as written; empty if none.
    pub destination_prep: String,
    /// The canonical relation to the destination.
    pub destination_relation: Option<Relation>,
    /// Probability that all of this is right, in [0, 1].
    pub confidence: f64,
}

/// Longest text in a field of a model's answer, bytes.
const FIELD_CAP: usize = 512;

/// A model's answer that breaks the schema or says what the instruction doesn't.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SchemaError {
    /// No JSON object with exactly the expected keys.
    #[error("answer breaks the schema: {0}")]
    Json(String),
    /// A key's value is out of range.
    #[error("{key}: {problem}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
    /// A name that the instruction doesn't contain.
    #[error("{key} names \"{word}\", which isn't in the instruction")]
    Invented {
        /// The key.
        key: &'static str,
        /// The word.
        word: String,
    },
}

impl PlannerOutput {
    /// The schema's view of a plan.
    #[must_use]
    pub fn from_plan(plan: &TaskPlan) -> Self {
        let steps = plan.subtasks.iter().map(|step| step.text.clone()).collect();
        let first = plan.subtasks.first();
        let goal = first.and_then(|step| step.destination.as_ref());
        Self {
            canonical_instruction: plan.canonical_instruction.clone(),
            plan: steps,
            action: first.map_or(Action::Unknown, |step| step.action),
            target_object: first.map_or_else(String::new, |step| step.target.clone()),
            source_phrase: first
                .and_then(|step| step.source.as_ref())
                .map_or_else(String::new, super::types::SpatialPhrase::text),
            destination: goal.map_or_else(String::new, |goal| goal.references.join(" and ")),
            destination_prep: first.map_or_else(String::new, |step| step.destination_prep.clone()),
            destination_relation: goal.map(|goal| goal.relation),
            confidence: plan.confidence,
        }
    }

    /// Reads a model's answer: JSON only, exactly the nine keys, values in
    /// range, and no name that `instruction` doesn't contain.
    ///
    /// # Errors
    /// [`SchemaError`] names the key and the violation.
    pub fn from_model(answer: &str, instruction: &str) -> Result<Self, SchemaError> {
        let output: Self = serde_json::from_str(answer.trim())
            .map_err(|error| SchemaError::Json(error.to_string()))?;
        output.check_ranges()?;
        let normalised = super::lexer::normalise(instruction);
        let words: Vec<&str> = normalised.split_ascii_whitespace().collect();
        for (key, text) in [
            ("target_object", &output.target_object),
            ("destination", &output.destination),
        ] {
            check_words(key, text, &words)?;
        }
        check_words("source_phrase", &output.source_phrase, &words)?;
        for step in &output.plan {
            check_words("plan", step, &words)?;
        }
        Ok(output)
    }

    fn check_ranges(&self) -> Result<(), SchemaError> {
        let value = |key, problem| Err(SchemaError::Value { key, problem });
        if !(0.0..=1.0).contains(&self.confidence) {
            return value("confidence", "must be between 0 and 1");
        }
        if self.plan.is_empty() || self.plan.len() > SUBTASK_CAPACITY {
            return value("plan", "must have one to eight steps");
        }
        if self.action != Action::Unknown && self.target_object.trim().is_empty() {
            return value("target_object", "must not be empty");
        }
        if self.action == Action::PickAndPlace
            && (self.destination.trim().is_empty() || self.destination_relation.is_none())
        {
            return value("destination", "must not be empty for pick_and_place");
        }
        let texts = [
            &self.canonical_instruction,
            &self.target_object,
            &self.source_phrase,
            &self.destination,
            &self.destination_prep,
        ];
        if texts
            .into_iter()
            .chain(&self.plan)
            .any(|text| text.len() > FIELD_CAP)
        {
            return value("plan", "texts must not exceed 512 bytes");
        }
        Ok(())
    }

    /// The plan that this output stands for. The first step comes from the
    /// keys, the others from the rules' reading of their sentences; one that
    /// the rules can't read is left to the base policy.
    #[must_use]
    pub fn into_plan(self) -> TaskPlan {
        let mut subtasks: Vec<Subtask> =
            self.plan.iter().skip(1).map(|step| reread(step)).collect();
        subtasks.insert(0, self.first_step());
        TaskPlan {
            canonical_instruction: self.canonical_instruction,
            subtasks,
            confidence: self.confidence,
            doubts: Vec::new(),
        }
    }

    fn first_step(&self) -> Subtask {
        let text = self.plan.first().cloned().unwrap_or_default();
        let clean = |text: &str| {
            let text = super::lexer::normalise(text);
            let words = text.split_ascii_whitespace();
            words
                .filter(|word| !ARTICLES.contains(word))
                .collect::<Vec<_>>()
                .join(" ")
        };
        // The rules read the phrase into a relation; one that they can't read
        // is dropped rather than guessed.
        let carrier = format!("pick up the {} {}", self.target_object, self.source_phrase);
        let source = match self.source_phrase.trim() {
            "" => None,
            _ => reread(&carrier).source,
        };
        let destination = self
            .destination_relation
            .map(|relation| super::SpatialPhrase {
                relation,
                negated: false,
                references: match relation.arity() {
                    2 => self.destination.split(" and ").map(clean).collect(),
                    1 => vec![clean(&self.destination)],
                    _ => Vec::new(),
                },
                qualifier: None,
            });
        Subtask {
            text,
            action: self.action,
            target: clean(&self.target_object),
            source,
            destination,
            destination_prep: self.destination_prep.clone(),
        }
    }
}

const ARTICLES: &[&str] = &["the", "a", "an"];

fn reread(step: &str) -> Subtask {
    let plan = super::plan(step).ok();
    match plan.map(|plan| plan.subtasks) {
        Some(mut steps) if steps.len() == 1 => steps.remove(0),
        _ => TaskPlan::unknown(step, 0.0, Vec::new()).subtasks.remove(0),
    }
}

/// Words that a canonical sentence may add.
const FRAME: &str = "the a an and of it to in on at up place pick put move next between left right \
    front behind centre center under nearest farthest from not inside top then that is into onto \
    open close turn off push beside near middle out grasp drawer";

fn check_words(key: &'static str, text: &str, instruction: &[&str]) -> Result<(), SchemaError> {
    let text = super::lexer::normalise(text);
    for word in text.split_ascii_whitespace() {
        let punctuation = word.chars().all(|c| !c.is_alphanumeric());
        let known = punctuation
            || instruction.contains(&word)
            || FRAME.split_ascii_whitespace().any(|frame| frame == word)
            || instruction
                .iter()
                .any(|plural| super::lexicon::singular(plural) == Some(word));
        if !known {
            return Err(SchemaError::Invented {
                key,
                word: word.to_owned(),
            });
        }
    }
    Ok(())
}
