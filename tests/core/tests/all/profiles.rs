//! The two profiles: what the paper's leaves out, and nothing else.

use fitmac_core::{Params, params::WhileRebinding};

#[test]
fn the_paper_profile_differs_from_the_guarded_one_in_what_the_paper_does_not_have() {
    let mut expected = Params::guarded();
    // While a target is looked for again, the base policy acts.
    expected.while_rebinding = WhileRebinding::BaseActs;
    // No monitor of reversals, nor of a destination that is passed.
    expected.progress.reversals = 0;
    expected.evidence.wrong_destination_steps = 0;
    // A recovery moves and never turns (equation 9), at the height of its waypoint at once.
    expected.recovery.level_rad = 0.0;
    expected.recovery.align_yaw_rad = 0.0;
    expected.recovery.rise_under_way_m = 0.0;
    // It lets go at a height, not at a touch.
    expected.recovery.touch_queries = 0;
    // Plans are believed, poses are not smoothed, a faint binding stays faint.
    expected.gate.plan_confidence = 0.0;
    expected.tracking.gain = 1.0;
    expected.lock.agreed = 0.0;
    assert_eq!(Params::paper(), expected);
    let guarded = Params::guarded();
    assert_eq!(guarded.while_rebinding, WhileRebinding::Hold);
    assert_ne!(Params::paper(), guarded);
}
