//! The prompts, one file and version each.

/// System prompt of the planner.
pub const PLANNER: &str = include_str!("../../prompts/planner.v1.txt");
/// System prompt of the grounder.
pub const GROUNDER: &str = include_str!("../../prompts/grounder.v1.txt");
/// User prompt of the grounder.
pub const GROUNDER_USER: &str = include_str!("../../prompts/grounder-user.v1.txt");
/// System prompt of the critic.
pub const CRITIC: &str = include_str!("../../prompts/critic.v1.txt");

/// Fills `{{key}}` in a template, in one pass: a value that looks like a key
/// stays as it is. Every value is quoted as JSON, so that a label can neither
/// end its line nor pass for the prompt's own words.
#[must_use]
pub fn fill(template: &str, values: &[(&str, serde_json::Value)]) -> String {
    let mut out = String::with_capacity(template.len() + 256);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let Some((key, tail)) = after.split_once("}}") else {
            break;
        };
        let value = values.iter().find(|(name, _)| *name == key);
        out.push_str(&value.map_or_else(String::new, |(_, value)| value.to_string()));
        rest = tail;
    }
    out.push_str(rest);
    out
}
