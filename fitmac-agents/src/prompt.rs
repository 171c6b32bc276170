//! The sentence that the policy is given.

use serde::{Deserialize, Serialize};

use crate::planner::{Action, Relation, SpatialPhrase, Subtask};

/// Whose way of speaking a prompt follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Backbone {
    /// OpenVLA and OpenVLA-OFT: lower case, no full stop; the server adds its
    /// own frame around it.
    #[default]
    OpenVla,
    /// pi0, pi0-FAST and pi0.5: the same words as LIBERO's tasks.
    Pi,
}

/// Builds the policy's prompt for a subtask, in LIBERO's words where it has
/// them. A subtask that wasn't understood keeps the user's words.
#[must_use]
pub fn policy_prompt(subtask: &Subtask, backbone: Backbone) -> String {
    if subtask.action == Action::Unknown {
        return subtask.text.clone();
    }
    let text = match (&subtask.source, &subtask.destination) {
        (Some(source), Some(destination)) if is_centre(source) => format!(
            "pick up the {} from {} center and place it {}",
            subtask.target,
            source.references.first().map_or("table", String::as_str),
            destination.text()
        ),
        _ => subtask.text.clone(),
    };
    match backbone {
        Backbone::OpenVla => text.to_lowercase(),
        Backbone::Pi => text,
    }
}

fn is_centre(source: &SpatialPhrase) -> bool {
    source.relation == Relation::AtCentre && !source.negated
}
