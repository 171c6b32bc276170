//! Parameters that are assigned, and relations between them at their limits.

use fitmac_core::{Params, params::PolicyGripper};

#[test]
fn an_assignment_that_fails_says_why() {
    let mut params = Params::guarded();
    let mut says = |key: &str, text: &str| params.assign(key, text).map_err(|e| e.to_string());
    let unknown = Err("there is no such parameter".to_owned());
    let no_value = Err("the text is no value of the parameter's type".to_owned());
    for key in [
        "gate.nothing",
        "nothing.at_all",
        "switches.nothing",
        "nothing",
    ] {
        assert_eq!(says(key, "1"), unknown, "{key}");
    }
    for key in [
        "gate.failure_streak",
        "switches.hard_pick",
        "policy_gripper",
    ] {
        assert_eq!(says(key, "perhaps"), no_value, "{key}");
    }
}

#[test]
fn a_choice_can_be_assigned_and_taken_back() {
    for (key, other, own) in [
        ("out_of_range", "refuse", "clamp"),
        ("while_rebinding", "base_acts", "hold"),
        ("policy_gripper", "one_open", "minus_one_open"),
    ] {
        let mut params = Params::guarded();
        assert_eq!(params.assign(key, other), Ok(()), "{key}");
        assert_ne!(params, Params::guarded(), "{key}");
        assert_eq!(params.assign(key, own), Ok(()), "{key}");
        assert_eq!(params, Params::guarded(), "{key}");
    }
    let mut params = Params::guarded();
    assert_eq!(params.assign("policy_gripper", "one_open"), Ok(()));
    assert_eq!(params.policy_gripper, PolicyGripper::OneOpen);
}

/// Every relation: a parameter, the one above it, two values that are next to each other, and
/// whether the two may be equal.
const RELATIONS: [(&str, &str, [&str; 2], bool); 16] = [
    ("state.hold_age_ms", "state.stop_age_ms", ["8", "9"], false),
    (
        "chunk.hold_after_ms",
        "chunk.stop_after_ms",
        ["80", "81"],
        false,
    ),
    (
        "chunk.refusals_hold",
        "chunk.refusals_stop",
        ["4", "5"],
        false,
    ),
    (
        "chunk.query_lead_steps",
        "chunk.open_loop_steps",
        ["4", "5"],
        false,
    ),
    ("recovery.close_min", "recovery.close_max", ["4", "5"], true),
    (
        "recovery.lift_pass_m",
        "recovery.lift_test_m",
        ["0.1", "0.101"],
        false,
    ),
    (
        "recovery.lift_queries",
        "recovery.lift_timeout",
        ["4", "5"],
        false,
    ),
    (
        "recovery.grasp_xy_m",
        "recovery.hover_xy_m",
        ["0.05", "0.051"],
        true,
    ),
    (
        "recovery.release_on_m",
        "recovery.carry_m",
        ["0.05", "0.051"],
        false,
    ),
    (
        "phase.grasp_xy_m",
        "phase.approach_distance_m",
        ["0.05", "0.051"],
        true,
    ),
    (
        "shaping.velocity_m_s",
        "filter.velocity_m_s",
        ["0.5", "0.501"],
        true,
    ),
    (
        "shaping.acceleration_m_s2",
        "filter.acceleration_m_s2",
        ["0.5", "0.501"],
        true,
    ),
    ("shaping.jerk_m_s3", "filter.jerk_m_s3", ["50", "51"], true),
    (
        "filter.workspace_min_x_m",
        "filter.workspace_max_x_m",
        ["0.5", "0.501"],
        false,
    ),
    (
        "filter.workspace_min_y_m",
        "filter.workspace_max_y_m",
        ["0.5", "0.501"],
        false,
    ),
    (
        "filter.workspace_min_z_m",
        "filter.workspace_max_z_m",
        ["0.5", "0.501"],
        false,
    ),
];

/// Parameters with these values, and whether the relation that begins with `stage.name` is broken.
fn breaks(stage: &str, name: &str, values: [(&str, &str); 2]) -> bool {
    let mut params = Params::guarded();
    for (key, value) in values {
        assert_eq!(params.assign(key, value), Ok(()), "{key}");
    }
    let of_it = |text: &str| text.starts_with(name) && text.contains(" must ");
    params.validate().is_err_and(|found| {
        found
            .iter()
            .any(|v| v.stage == stage && of_it(v.name) && v.min.is_nan())
    })
}

#[test]
fn a_relation_holds_up_to_its_limit_and_not_beyond() {
    for (low, high, [less, more], may_be_equal) in RELATIONS {
        let (stage, name) = low.split_once('.').expect("a stage and a name");
        let broken = |x, y| breaks(stage, name, [(low, x), (high, y)]);
        assert!(!broken(less, more), "{low}");
        assert!(broken(more, less), "{low}");
        assert_eq!(broken(less, less), !may_be_equal, "{low}");
    }
}

#[test]
fn an_empty_hand_is_narrower_than_a_closed_one() {
    // Binary fractions, so that half of the open width is met exactly.
    let broken = |empty_m| {
        let mut params = Params::guarded();
        params.gripper.open_width_m = 0.0625;
        params.gripper.closed_ratio = 0.5;
        params.gripper.empty_width_m = empty_m;
        params
            .validate()
            .is_err_and(|found| found.iter().any(|v| v.name.contains("the closed width")))
    };
    assert!(!broken(0.03125_f64.next_down()));
    assert!(broken(0.03125));
}

#[test]
fn every_violation_is_told_in_one_sentence() {
    let mut params = Params::guarded();
    params.gate.confidence = 2.0;
    let one = params.validate().expect_err("out of range").to_string();
    assert_eq!(one, "gate.confidence is 2, allowed is 0 to 1");
    params.state.hold_age_ms = params.state.stop_age_ms;
    let two = params.validate().expect_err("out of range").to_string();
    let relation = "state: hold_age_ms must be below stop_age_ms (500)";
    assert_eq!(two, format!("{one}; {relation}"));
}
