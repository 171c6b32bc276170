//! Why a correction ends.

use super::*;
use crate::{
    message::StateSample,
    params::Params,
    signals::{Signals, TargetView},
    stand::{hand, surface, target},
};

/// What a query of a correction with this budget gives, in a scene changed by `change`.
fn query(routine: Routine, budget: u32, change: impl FnOnce(&mut Scene<'_>)) -> Step {
    let params = Params::guarded();
    let sample = StateSample::default();
    let signals = Signals {
        target: Some(target([0.4, 0.0, 0.1])),
        destination: Some(surface([0.5, 0.2, 0.0])),
        ..hand([0.4, 0.0, 0.3], GripperState::Holding)
    };
    let mut scene = Scene {
        destination_object: 3,
        ..Scene::new(&params, &sample, &signals)
    };
    let mut active = Active::begin(&scene, routine, budget);
    change(&mut scene);
    active.step(&scene)
}

fn acts(step: Step) -> bool {
    matches!(step, Step::Act { .. })
}

#[test]
fn a_correction_ends_once_the_phase_no_longer_fits_it() {
    let incompatible = Step::Bottom(reason::PHASE_INCOMPATIBLE);
    for &phase in Phase::ALL {
        let in_phase = |routine| query(routine, 100, |scene| scene.phase = phase);
        let complete = phase == Phase::Complete;
        let pick = in_phase(Routine::Pick);
        assert!(
            if complete {
                pick == incompatible
            } else {
                acts(pick)
            },
            "{phase}"
        );
        let place = in_phase(Routine::Place);
        let ended = complete || phase == Phase::Stabilise;
        assert!(
            if ended {
                place == incompatible
            } else {
                acts(place)
            },
            "{phase}"
        );
    }
}

#[test]
fn success_a_lost_lock_and_a_lost_target_end_it_in_this_order() {
    for routine in [Routine::Pick, Routine::Place] {
        let success = query(routine, 100, |scene| {
            scene.success = true;
            scene.lock_valid = false;
        });
        assert_eq!(success, Step::Bottom(reason::CORRECTED));
        let lost = query(routine, 100, |scene| scene.lock_valid = false);
        assert_eq!(lost, Step::Bottom(reason::VALIDITY_LOST));
        let unseen = hand([0.4, 0.0, 0.3], GripperState::Holding);
        let params = Params::guarded();
        let sample = StateSample::default();
        let seen = Signals {
            target: Some(target([0.4, 0.0, 0.1])),
            ..unseen
        };
        let mut active = Active::begin(&Scene::new(&params, &sample, &seen), routine, 100);
        let step = active.step(&Scene::new(&params, &sample, &unseen));
        assert_eq!(step, Step::Bottom(reason::VALIDITY_LOST));
    }
}

#[test]
fn a_pick_leaves_the_place_its_share_of_the_budget() {
    let params = Params::guarded();
    let sample = StateSample::default();
    let signals = Signals {
        target: Some(target([0.4, 0.0, 0.1])),
        ..hand([0.4, 0.0, 0.3], GripperState::Open)
    };
    let p = &params.recovery;
    let begun = |destination_object, routine, left| {
        let scene = Scene {
            destination_object,
            ..Scene::new(&params, &sample, &signals)
        };
        let active = Active::begin(&scene, routine, left);
        (active.budget, active.reserve)
    };
    let (pick, place) = (p.pick_budget, p.place_budget);
    assert_eq!(begun(3, Routine::Pick, 1000), (pick + place, place));
    assert_eq!(begun(3, Routine::Pick, pick + 7), (pick + 7, 7));
    assert_eq!(begun(3, Routine::Pick, pick), (pick, 0));
    assert_eq!(begun(3, Routine::Pick, 5), (5, 0));
    assert_eq!(begun(0, Routine::Pick, 1000), (pick, 0));
    assert_eq!(begun(3, Routine::Place, 1000), (place, 0));
    // And the pick ends where the share begins.
    let scene = Scene {
        destination_object: 3,
        ..Scene::new(&params, &sample, &signals)
    };
    let mut active = Active::begin(&scene, Routine::Pick, pick + 7);
    for left in (7..pick + 7).rev() {
        assert!(acts(active.step(&scene)));
        assert_eq!(active.budget(), left);
    }
    let spent = Step::Bottom(reason::BUDGET_EXHAUSTED);
    assert_eq!(active.step(&scene), spent);
}

/// How the correction grips a hand that stands like this.
fn grips(active: &Active, state: GripperState) -> Grip {
    let params = Params::guarded();
    let sample = StateSample::default();
    let signals = hand([0.4, 0.0, 0.3], state);
    active.grip(&Scene::new(&params, &sample, &signals))
}

/// A correction just begun with the target so far away, its underside this high over the
/// destination's surface.
fn begun(routine: Routine, state: GripperState, distance_m: f64, above_m: f64) -> Active {
    let params = Params::guarded();
    let sample = StateSample::default();
    let signals = Signals {
        target: Some(TargetView {
            distance_m,
            ..target([0.4, 0.0, above_m])
        }),
        destination: Some(surface([0.4, 0.0, 0.0])),
        ..hand([0.4, 0.0, above_m], state)
    };
    let scene = Scene {
        destination_object: 3,
        ..Scene::new(&params, &sample, &signals)
    };
    let mut active = Active::begin(&scene, routine, 100);
    assert!(acts(active.step(&scene)));
    active
}

#[test]
fn a_hand_that_is_held_still_neither_drops_what_it_carries_nor_grips_what_it_let_go() {
    use GripperState::{Closing, Empty, Holding, Open};
    // High above the destination, and as high as it is let go: the view says that it touches.
    let carry_m = Params::guarded().recovery.carry_m;
    let carries = begun(Routine::Place, Holding, 0.0, 0.5 * carry_m);
    assert_eq!(carries.running().sub_phase(), SubPhase::LiftCarry);
    let let_go = begun(Routine::Place, Holding, 0.0, carry_m);
    assert_eq!(let_go.running().sub_phase(), SubPhase::ReleaseReady);
    // Above a target that is far, and closed on one that is in the hand.
    let hovers = begun(Routine::Pick, Open, 1.0, 0.0);
    assert_eq!(hovers.running().sub_phase(), SubPhase::ApproachHover);
    let tests = begun(Routine::Pick, Holding, 0.0, 0.0);
    assert_eq!(tests.running().sub_phase(), SubPhase::LiftTest);
    for state in [Open, Closing, Holding, Empty] {
        let as_it_stands = if state == Open {
            Grip::Open
        } else {
            Grip::Close
        };
        assert_eq!(grips(&carries, state), Grip::Close, "{state:?}");
        assert_eq!(grips(&let_go, state), as_it_stands, "{state:?}");
        assert_eq!(grips(&hovers, state), as_it_stands, "{state:?}");
        assert_eq!(grips(&tests, state), Grip::Close, "{state:?}");
    }
}
