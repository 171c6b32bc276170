//! Every step of a place, at the limits that end it.

use super::*;
use crate::{
    message::{ObjectSample, StateSample},
    params::Params,
    signals::Signals,
    stand::{hand, surface, target},
};

use GripperState::{Closing, Empty, Holding, Open};

/// Limits that a binary fraction meets exactly.
fn params() -> Params {
    let mut params = Params::guarded();
    let p = &mut params.recovery;
    (p.carry_m, p.clearance_m, p.hover_z_m) = (1.0, 0.5, 0.125);
    (p.rise_under_way_m, p.align_on_m, p.align_in_m) = (0.25, 0.0625, 0.125);
    (p.release_on_m, p.release_in_m, p.touch_queries) = (0.03125, 0.0625, 2);
    (p.release_hold, p.retreat_m) = (3, 0.5);
    (p.settle, p.verify, p.settle_up) = (2, 3, 0.25);
    params
}

/// A query of the place: a target right below the hand, a destination so far aside and below.
#[derive(Clone, Copy)]
struct Look {
    params: Params,
    ee_m: Vector3,
    state: GripperState,
    target: TargetView,
    destination: DestinationView,
    blocked: bool,
}

impl Look {
    fn new(ee_m: Vector3, xy_m: f64, clearance_m: f64) -> Self {
        let [x, y, z] = ee_m;
        Self {
            params: params(),
            ee_m,
            state: Holding,
            target: TargetView {
                half_height_m: 0.25,
                ..target([x, y, z - 0.25])
            },
            destination: DestinationView {
                distance_xy_m: xy_m,
                clearance_m,
                ..surface([x + xy_m, y, 0.0])
            },
            blocked: false,
        }
    }

    fn into(mut self, relation: PlaceRelation) -> Self {
        self.destination.relation = relation;
        self
    }

    /// What the place does, `None` if it goes on to another step.
    fn step_among(&self, place: &mut Place, sample: &StateSample) -> Option<Outcome> {
        let signals = Signals {
            target: Some(self.target),
            destination: Some(self.destination),
            ..hand(self.ee_m, self.state)
        };
        let scene = Scene {
            blocked: self.blocked,
            destination_object: 3,
            ..Scene::new(&self.params, sample, &signals)
        };
        match place.step(&scene, &self.target, &self.destination) {
            Flow::Done(outcome) => Some(outcome),
            Flow::Again => None,
        }
    }

    /// Where it moves, and its grip; `None` if it goes on to another step.
    fn moves(&self, place: &mut Place) -> Option<(Vector3, Grip)> {
        match self.step_among(place, &StateSample::default())? {
            Outcome::Act(motion) => Some((motion.waypoint_m, motion.grip)),
            _ => panic!("it moves"),
        }
    }

    fn step(&self, place: &mut Place) -> Option<Outcome> {
        self.step_among(place, &StateSample::default())
    }
}

/// A place that holds its object right below the hand.
fn place(step: Step) -> Place {
    Place {
        step,
        grip_m: [0.0, 0.0, -0.25],
    }
}

#[test]
fn a_place_begins_with_the_object_where_it_hangs() {
    let look = Look::new([1.0, 0.0, 2.0], 0.5, 0.5);
    let signals = hand(look.ee_m, Holding);
    let sample = StateSample::default();
    let scene = Scene::new(&look.params, &sample, &signals);
    assert_eq!(Place::begin(&scene, &look.target), place(Step::LiftCarry));
}

#[test]
fn what_shifts_in_the_hand_or_leaves_it_is_dropped_until_it_was_let_go() {
    let dropped = |step, state, shift_m| {
        let mut look = Look::new([0.0, 0.0, 2.0], 0.0, 1.0);
        look.state = state;
        look.target.position_m[0] += shift_m;
        matches!(look.step(&mut place(step)), Some(Outcome::Dropped))
    };
    for step in [
        Step::LiftCarry,
        Step::MoveAbove,
        Step::Lower { touching: 0 },
    ] {
        assert!(!dropped(step, Holding, SLIP_M - 1e-6));
        assert!(dropped(step, Holding, SLIP_M));
        assert!(dropped(step, Empty, 0.0));
        assert!(!dropped(step, Closing, 0.0));
        assert!(place(step).is_carrying());
    }
    let at_m = [0.0; 3];
    for step in [
        Step::ReleaseReady { at_m },
        Step::ReleaseHold { queries: 0, at_m },
        Step::Settle { queries: 0 },
    ] {
        assert!(!dropped(step, Empty, 1.0));
        assert!(!place(step).is_carrying());
    }
}

#[test]
fn it_rises_until_the_underside_clears_the_destination() {
    // The underside hangs half a metre below the hand: a metre above the surface is 1.5.
    let rises = |z: f64, xy_m: f64, blocked| {
        let look = Look {
            blocked,
            ..Look::new([0.0, 0.0, z], xy_m, 1.0)
        };
        let mut lift = place(Step::LiftCarry);
        let moved = look.moves(&mut lift);
        assert_eq!(moved.is_none(), lift.step == Step::MoveAbove);
        moved
    };
    let up = Some(([0.0, 0.0, 1.5], Grip::Close));
    assert_eq!(rises(1.0, 0.125, false), up);
    assert_eq!(rises(1.374, 0.125, false), up);
    assert_eq!(rises(1.375, 0.125, false), None);
    assert_eq!(rises(1.0, 0.125, true), None, "blocked");
    // On a long way the rest is made under way.
    assert_eq!(rises(1.251, LONG_WAY_M + 1e-3, false), None);
    assert_eq!(rises(1.25, LONG_WAY_M + 1e-3, false), up);
    assert_eq!(rises(1.251, LONG_WAY_M, false), up);
}

#[test]
fn it_rises_over_what_stands_on_the_way_but_not_over_what_it_carries_or_goes_to() {
    let mut sample = StateSample {
        object_count: 1,
        ..StateSample::default()
    };
    let mut goal = |id, x, half_z| {
        sample.objects[0] = ObjectSample {
            id,
            position_m: [x, 0.0, 0.0],
            orientation: [1.0, 0.0, 0.0, 0.0],
            half_extent_m: [0.125, 0.125, half_z],
            ..ObjectSample::default()
        };
        let look = Look::new([0.0, 0.0, 1.0], 2.0, 0.5);
        match look.step_among(&mut place(Step::LiftCarry), &sample) {
            Some(Outcome::Act(motion)) => motion.waypoint_m[2],
            _ => panic!("it rises"),
        }
    };
    assert_eq!(goal(2, 1.0, 2.0), 3.0, "its top, half a metre, what hangs");
    assert_eq!(goal(2, 1.0, 0.25), 1.5, "the destination is what counts");
    assert_eq!(goal(2, 5.0, 2.0), 1.5, "beyond");
    assert_eq!(goal(1, 1.0, 2.0), 1.5, "the target");
    assert_eq!(goal(3, 1.0, 2.0), 1.5, "the destination");
}

#[test]
fn it_travels_until_it_is_aligned() {
    let travels = |xy_m: f64, relation| {
        let mut above = place(Step::MoveAbove);
        let moved = Look::new([0.0, 0.0, 1.5], xy_m, 1.0)
            .into(relation)
            .moves(&mut above);
        assert_eq!(moved.is_none(), above.step == Step::Lower { touching: 0 });
        moved
    };
    assert_eq!(travels(0.0625, PlaceRelation::On), None);
    let over = Some(([0.063, 0.0, 1.5], Grip::Close));
    assert_eq!(travels(0.063, PlaceRelation::On), over);
    assert_eq!(travels(0.125, PlaceRelation::In), None);
    assert!(travels(0.126, PlaceRelation::In).is_some());
}

/// A query of lowering: what it moves to, and the step that follows.
fn lowers(look: &Look, touching: u32) -> (Option<(Vector3, Grip)>, Step) {
    let mut lower = place(Step::Lower { touching });
    (look.moves(&mut lower), lower.step)
}

#[test]
fn on_a_surface_it_opens_when_it_touches_or_was_low_for_long_enough() {
    let at_m = [0.0, 0.0, 1.0];
    let on = |xy_m, clearance_m| Look::new(at_m, xy_m, clearance_m);
    let ready = (Some((at_m, Grip::Open)), Step::ReleaseReady { at_m });
    assert_eq!(lowers(&on(0.0, 0.0), 0), ready, "it touches");
    assert_eq!(lowers(&on(0.0, 0.03125), 2), ready, "for long enough");
    let down = |clearance_m: f64, touching| {
        let z = 1.0 - TOUCH_M - clearance_m;
        (Some(([0.0, 0.0, z], Grip::Close)), Step::Lower { touching })
    };
    assert_eq!(lowers(&on(0.0, 0.03125), 1), down(0.03125, 2));
    assert_eq!(lowers(&on(0.0, 0.0313), 5), down(0.0313, 0), "not low");
    let mut at_once = on(0.0, 0.03125);
    at_once.params.recovery.touch_queries = 0;
    assert_eq!(lowers(&at_once, 0), ready, "as published");
    at_once = on(0.0, 0.5);
    at_once.params.recovery.touch_queries = 0;
    let z = 1.0 + TOUCH_M - 0.5;
    assert_eq!(lowers(&at_once, 0).0, Some(([0.0, 0.0, z], Grip::Close)));
}

#[test]
fn in_a_container_it_opens_below_the_rim() {
    let at_m = [0.0, 0.0, 1.0];
    let within = |xy_m, clearance_m| Look::new(at_m, xy_m, clearance_m).into(PlaceRelation::In);
    let opens = |look: &Look| lowers(look, 0).1 == Step::ReleaseReady { at_m };
    assert!(opens(&within(0.0, -0.0625 + TOUCH_M)));
    assert!(!opens(&within(0.0, -0.0624 + TOUCH_M)));
    assert!(opens(&within(0.125, -0.0625)) && !opens(&within(0.126, -0.0625)));
    let down = lowers(&within(0.0, 0.5), 0).0;
    assert_eq!(down, Some(([0.0, 0.0, 1.0 - 0.0625 - 0.5], Grip::Close)));
}

#[test]
fn what_drifts_while_it_is_lowered_is_brought_back() {
    let at_m = [0.0, 0.0, 1.0];
    let on = |xy_m| lowers(&Look::new(at_m, xy_m, 0.0), 0);
    assert_eq!(on(0.0625).1, Step::ReleaseReady { at_m });
    assert_eq!(on(0.063).1, Step::Lower { touching: 1 }, "not aligned");
    assert_eq!(on(0.125).1, Step::Lower { touching: 1 });
    assert_eq!(on(0.126), (None, Step::MoveAbove));
    let corrects = on(0.125).0.map(|(at, _)| at[0]);
    assert_eq!(corrects, Some(0.125));
}

#[test]
fn an_arm_that_is_blocked_near_the_surface_has_landed() {
    let at_m = [0.0, 0.0, 1.0];
    let opens = |clearance_m, blocked| {
        let look = Look {
            blocked,
            ..Look::new(at_m, 0.0, clearance_m)
        };
        lowers(&look, 0).1 == Step::ReleaseReady { at_m }
    };
    assert!(opens(0.03125 + 0.0399, true) && !opens(0.03125 + 0.04, true));
    assert!(!opens(0.03125 + 0.0399, false));
}

#[test]
fn the_hand_stands_while_it_opens_then_rises_then_settles() {
    let at_m = [0.5, 0.25, 1.0];
    let mut look = Look::new([0.5, 0.25, 1.0], 0.0, 0.0);
    let stays = Some((at_m, Grip::Open));
    look.state = Open;
    let mut open = place(Step::ReleaseReady { at_m });
    assert_eq!(look.moves(&mut open), None);
    for queries in 1..3 {
        assert_eq!(open.step, Step::ReleaseHold { queries, at_m });
        assert_eq!(look.moves(&mut open), stays);
    }
    assert_eq!(look.moves(&mut open), None);
    let goal_m = [0.5, 0.25, 1.5];
    assert_eq!(open.step, Step::Retreat { queries: 0, goal_m });
    // Fingers that do not open are waited for, to an end.
    look.state = Closing;
    let mut slow = place(Step::ReleaseHold { queries: 0, at_m });
    for _ in 0..OPEN_QUERIES {
        assert_eq!(look.moves(&mut slow), stays);
    }
    assert_eq!(look.moves(&mut slow), None);
    assert_eq!(slow.step, Step::Retreat { queries: 0, goal_m });
}

#[test]
fn a_retreat_ends_near_its_goal_or_in_time() {
    let goal_m = [0.5, 0.25, 1.5];
    let up = Some((goal_m, Grip::Open));
    let mut rises = place(Step::Retreat { queries: 0, goal_m });
    for _ in 0..RETREAT_QUERIES {
        assert_eq!(
            Look::new([0.5, 0.25, 1.374], 0.0, 0.0).moves(&mut rises),
            up
        );
    }
    let at = |z| Look::new([0.5, 0.25, z], 0.0, 0.0);
    assert_eq!(at(1.374).moves(&mut rises), None);
    assert_eq!(rises.step, Step::Settle { queries: 0 });
    let mut there = place(Step::Retreat { queries: 0, goal_m });
    assert_eq!(at(1.375).moves(&mut there), None);
}

#[test]
fn it_settles_upwards_then_waits_for_the_outcome_and_ends() {
    let ups = |clearance_m| {
        let look = Look::new([0.0, 0.0, 1.0], 0.0, clearance_m);
        let mut settle = place(Step::Settle { queries: 0 });
        let mut ups = [None; 6];
        for up in &mut ups {
            *up = match look.step(&mut settle) {
                Some(Outcome::Rise(up)) => Some(up),
                Some(Outcome::Finished) => None,
                _ => panic!("it settles"),
            };
        }
        ups
    };
    let (up, still) = (Some(0.25), Some(0.0));
    assert_eq!(ups(0.0), [up, up, still, still, still, None]);
    // What lies wrong needs no waiting.
    assert_eq!(ups(0.5), [up, up, None, None, None, None]);
}
