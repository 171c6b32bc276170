//! Every step of a pick, at the limits that end it.

use super::*;
use crate::{
    message::{ObjectSample, StateSample},
    params::Params,
    signals::Signals,
    stand::{hand, target},
};

/// Limits that a binary fraction meets exactly.
fn params() -> Params {
    let mut params = Params::guarded();
    params.phase.grasp_xy_m = 0.25;
    params.phase.approach_distance_m = 0.5;
    params.gripper.open_width_m = 0.08;
    params.grasp.tall_m = 8.0;
    params.grasp.floor_m = 0.0;
    let p = &mut params.recovery;
    (p.hover_m, p.hover_xy_m, p.hover_z_m) = (1.0, 0.125, 0.25);
    (p.grasp_xy_m, p.grasp_z_m) = (0.0625, 0.125);
    (p.clearance_m, p.close_min, p.close_max) = (0.5, 3, 6);
    (p.lift_test_m, p.lift_pass_m, p.lift_follow_m) = (0.5, 0.25, 0.125);
    (p.lift_queries, p.lift_timeout) = (2, 5);
    (p.level_rad, p.align_yaw_rad) = (0.0, 0.0);
    params
}

/// A query of the pick.
#[derive(Clone, Copy)]
struct Look {
    ee_m: [f64; 3],
    state: GripperState,
    target: TargetView,
    blocked: bool,
    held_other_rise_m: Option<f64>,
}

impl Look {
    const fn at(ee_m: [f64; 3], state: GripperState) -> Self {
        Self {
            ee_m,
            state,
            target: target([0.0; 3]),
            blocked: false,
            held_other_rise_m: None,
        }
    }

    fn see<T>(&self, sample: &StateSample, look: impl FnOnce(&Scene<'_>, &TargetView) -> T) -> T {
        let params = params();
        let signals = Signals {
            target: Some(self.target),
            ..hand(self.ee_m, self.state)
        };
        let scene = Scene {
            blocked: self.blocked,
            held_other_rise_m: self.held_other_rise_m,
            ..Scene::new(&params, sample, &signals)
        };
        look(&scene, &self.target)
    }

    fn begin(&self) -> Pick {
        self.see(&StateSample::default(), |scene, _| Pick::begin(scene, 2))
    }

    /// What the pick does, `None` if it goes on to another step.
    fn step(&self, pick: &mut Pick) -> Option<Outcome> {
        self.see(&StateSample::default(), |scene, target| {
            match pick.step(scene, target) {
                Flow::Done(outcome) => Some(outcome),
                Flow::Again => None,
            }
        })
    }

    /// Where it moves, and its grip; `None` if it goes on to another step.
    fn moves(&self, pick: &mut Pick) -> Option<([f64; 3], Grip)> {
        match self.step(pick) {
            Some(Outcome::Act(motion)) => Some((motion.waypoint_m, motion.grip)),
            _ => None,
        }
    }
}

fn pick(step: Step) -> Pick {
    Pick {
        step,
        redescents_left: 2,
        side: None,
    }
}

use GripperState::{Closing, Empty, Holding, Open};

#[test]
fn a_pick_begins_with_what_the_hand_has() {
    let begun = |state, distance_m, rise_m| {
        let mut look = Look::at([0.0, 0.0, 2.0], state);
        look.target.distance_m = distance_m;
        look.held_other_rise_m = rise_m;
        look.begin().step
    };
    assert_eq!(begun(Open, 0.1, None), Step::Hover { turning: 0 });
    let test = Step::LiftTest {
        ee_z_m: 2.0,
        object_z_m: 0.0,
        queries: 0,
        following: 0,
    };
    assert_eq!(begun(Holding, 0.249, None), test);
    let set_down = |goal_z_m| Step::SetDown {
        goal_z_m,
        lowering: 0,
        opening: 0,
    };
    assert_eq!(begun(Holding, 0.25, None), set_down(2.0));
    assert_eq!(begun(Empty, 0.1, None), set_down(2.0));
    assert_eq!(begun(Holding, 1.0, Some(0.5)), set_down(1.5));
    assert_eq!(begun(Holding, 1.0, Some(-0.5)), set_down(2.0));
}

#[test]
fn what_is_held_is_set_down_before_the_hand_opens() {
    let mut held = pick(Step::SetDown {
        goal_z_m: 1.0,
        lowering: 0,
        opening: 0,
    });
    for _ in 0..SET_DOWN_QUERIES {
        let down = Look::at([0.5, 0.0, 1.126], Holding).moves(&mut held);
        assert_eq!(down, Some(([0.5, 0.0, 1.0], Grip::Close)));
    }
    // Low enough, or long enough: it opens where it is, for so long at most.
    let mut low = pick(Step::SetDown {
        goal_z_m: 1.0,
        lowering: 0,
        opening: 0,
    });
    for (waiting, z) in [(&mut held, 1.126), (&mut low, 1.125)] {
        for _ in 0..OPEN_QUERIES {
            let open = Look::at([0.5, 0.0, z], Holding).moves(waiting);
            assert_eq!(open, Some(([0.5, 0.0, z], Grip::Open)));
        }
        assert_eq!(Look::at([0.5, 0.0, z], Holding).moves(waiting), None);
        assert_eq!(waiting.step, Step::Hover { turning: 0 });
    }
    let mut open = pick(Step::SetDown {
        goal_z_m: 1.0,
        lowering: 0,
        opening: 0,
    });
    assert_eq!(Look::at([0.5, 0.0, 1.0], Open).moves(&mut open), None);
    assert_eq!(open.step, Step::Hover { turning: 0 });
}

#[test]
fn a_descent_begins_above_the_target_with_an_open_hand() {
    let hovers = |ee_m, state| {
        let mut hover = pick(Step::Hover { turning: 0 });
        let moved = Look::at(ee_m, state).moves(&mut hover);
        assert_eq!(moved.is_none(), hover.step == Step::Descend);
        moved
    };
    let above = Some(([0.0, 0.0, 1.0], Grip::Open));
    for (ee_m, there) in [
        ([0.125, 0.0, 1.0], true),
        ([0.126, 0.0, 1.0], false),
        ([0.0, 0.125, 1.25], true),
        ([0.0, 0.0, 1.251], false),
        ([0.0, 0.0, 0.75], true),
        ([0.0, 0.0, 0.749], false),
    ] {
        let expected = if there { None } else { above };
        assert_eq!(hovers(ee_m, Open), expected, "{ee_m:?}");
        assert_eq!(hovers(ee_m, Closing), above, "{ee_m:?}");
    }
}

#[test]
fn the_way_to_the_hover_leads_over_what_stands_between() {
    // A box between the hand and the target, its top two metres high: half a metre more is clear.
    let mut sample = StateSample {
        object_count: 1,
        ..StateSample::default()
    };
    sample.objects[0] = ObjectSample {
        id: 2,
        position_m: [2.0, 0.0, 1.0],
        orientation: [1.0, 0.0, 0.0, 0.0],
        half_extent_m: [0.25, 0.25, 1.0],
        ..ObjectSample::default()
    };
    let way_past = |sample: &StateSample, ee_m| {
        let mut hover = pick(Step::Hover { turning: 0 });
        let outcome = Look::at(ee_m, Open).see(sample, |scene, target| hover.step(scene, target));
        match outcome {
            Flow::Done(Outcome::Act(motion)) => motion.waypoint_m,
            _ => panic!("it hovers"),
        }
    };
    let way = |ee_m| way_past(&sample, ee_m);
    assert_eq!(way([4.0, 0.0, 2.374]), [4.0, 0.0, 2.5], "up first");
    assert_eq!(way([4.0, 0.0, 2.375]), [0.0, 0.0, 2.5], "then over");
    assert_eq!(way([0.501, 0.0, 1.0]), [0.0, 0.0, 1.0], "the box is behind");
    assert_eq!(way([0.5, 0.0, 3.0]), [0.0, 0.0, 1.0], "then down");
    assert_eq!(way([0.0, 4.0, 0.0]), [0.0, 0.0, 1.0], "nothing on the way");
    // The same box beside the target: from half a metre on the hand is near and goes down.
    let mut beside = sample;
    beside.objects[0].position_m[0] = 0.25;
    assert_eq!(way_past(&beside, [0.501, 0.0, 3.0]), [0.0, 0.0, 2.5]);
    assert_eq!(way_past(&beside, [0.5, 0.0, 3.0]), [0.0, 0.0, 1.0]);
    sample.objects[0].id = 1;
    let mut hover = pick(Step::Hover { turning: 0 });
    let look = Look::at([4.0, 0.0, 0.0], Open);
    match look.see(&sample, |scene, target| hover.step(scene, target)) {
        Flow::Done(Outcome::Act(m)) => assert_eq!(m.waypoint_m, [0.0, 0.0, 1.0], "the target"),
        _ => panic!("it hovers"),
    }
}

#[test]
fn a_tilted_hand_is_turned_for_so_many_queries_at_most() {
    let mut params = params();
    params.recovery.level_rad = 0.1;
    // Tilted by half a radian from straight down.
    let tilt = kinematics::rotation::UnitQuaternion::from_rotation_vector([0.5, 0.0, 0.0]);
    let down = kinematics::rotation::UnitQuaternion::from_wxyz([0.0, 1.0, 0.0, 0.0]);
    let sample = StateSample {
        ee_orientation: (tilt * down.expect("a unit")).wxyz(),
        ..StateSample::default()
    };
    let signals = Signals {
        target: Some(target([0.0; 3])),
        ..hand([0.0, 0.0, 1.0], Open)
    };
    let scene = Scene::new(&params, &sample, &signals);
    let mut hover = pick(Step::Hover { turning: 0 });
    for turning in 1..=TURN_QUERIES {
        match hover.step(&scene, &target([0.0; 3])) {
            Flow::Done(Outcome::Act(motion)) => {
                assert!((motion.rotation_rad[0] + 0.5).abs() < 1e-9, "{motion:?}");
            }
            _ => panic!("it turns"),
        }
        assert_eq!(hover.step, Step::Hover { turning });
    }
    assert!(matches!(hover.step(&scene, &target([0.0; 3])), Flow::Again));
    assert_eq!(hover.step, Step::Descend, "it will not be levelled");
}

#[test]
fn a_descent_closes_at_the_grasp_point_or_where_it_is_blocked() {
    let descends = |ee_m, blocked| {
        let mut descend = pick(Step::Descend);
        let look = Look {
            blocked,
            ..Look::at(ee_m, Open)
        };
        (look.moves(&mut descend), descend.step)
    };
    let down = Some(([0.0; 3], Grip::Open));
    let close = Step::Close { queries: 0 };
    assert_eq!(descends([0.0625, 0.0, 0.125], false), (None, close));
    assert_eq!(descends([0.0625, 0.0, -0.125], false), (None, close));
    assert_eq!(descends([0.063, 0.0, 0.0], false), (down, Step::Descend));
    assert_eq!(descends([0.0, 0.0, 0.126], false), (down, Step::Descend));
    assert_eq!(descends([0.0, 0.0, -0.126], false), (down, Step::Descend));
    assert_eq!(descends([0.0, 0.0, 0.5], true), (None, close));
    assert_eq!(descends([0.25, 0.0, 0.5], false), (down, Step::Descend));
    let hover = Step::Hover { turning: 0 };
    assert_eq!(descends([0.251, 0.0, 0.5], true), (None, hover));
}

#[test]
fn closing_ends_when_the_pads_stand_or_time_is_up() {
    let closes = |queries, state| {
        let mut close = pick(Step::Close { queries });
        let look = Look::at([0.0, 0.0, 1.0], state);
        (look.moves(&mut close), close)
    };
    let still = Some(([0.0, 0.0, 1.0], Grip::Close));
    let test = Step::LiftTest {
        ee_z_m: 1.0,
        object_z_m: 0.0,
        queries: 0,
        following: 0,
    };
    let (moved, close) = closes(2, Holding);
    assert_eq!((moved, close.step), (still, Step::Close { queries: 3 }));
    let (moved, close) = closes(3, Closing);
    assert_eq!((moved, close.step), (still, Step::Close { queries: 4 }));
    assert_eq!(closes(3, Holding).1.step, test);
    assert_eq!(closes(5, Closing).1.step, Step::Close { queries: 6 });
    assert_eq!(closes(6, Closing).1.step, test);
    let (moved, again) = closes(3, Empty);
    let reopen = Step::Reopen {
        queries: 0,
        goal_z_m: 1.5,
    };
    assert_eq!(
        (moved, again.step, again.redescents_left),
        (None, reopen, 1)
    );
}

/// A lift test that began with the hand and the object a metre high.
fn lift_test(queries: u32, following: u32) -> Pick {
    pick(Step::LiftTest {
        ee_z_m: 1.0,
        object_z_m: 1.0,
        queries,
        following,
    })
}

#[test]
fn an_object_is_carried_when_it_rose_with_the_hand_for_long_enough() {
    let passes = |hand: f64, object: f64| {
        let mut test = lift_test(0, 1);
        let mut look = Look::at([0.0, 0.0, 1.0 + hand], Holding);
        look.target.position_m[2] = 1.0 + object;
        matches!(look.step(&mut test), Some(Outcome::Carried))
    };
    assert!(passes(0.375, 0.375));
    assert!(!passes(0.25, 0.25), "no more than the limit");
    assert!(passes(0.251, 0.251));
    assert!(passes(0.499, 0.375) && !passes(0.5, 0.375), "it lags");
    assert!(passes(0.376, 0.5) && !passes(0.375, 0.5), "it runs ahead");
    let mut test = lift_test(0, 0);
    let mut look = Look::at([0.0, 0.0, 1.5], Holding);
    look.target.position_m[2] = 1.5;
    assert_eq!(look.moves(&mut test), Some(([0.0, 0.0, 1.5], Grip::Close)));
    assert!(matches!(look.step(&mut test), Some(Outcome::Carried)));
}

#[test]
fn a_lift_test_starts_its_count_anew_and_fails_in_the_end() {
    let mut test = lift_test(0, 1);
    let look = Look::at([0.0, 0.0, 1.0], Holding);
    let up = Some(([0.0, 0.0, 1.5], Grip::Close));
    assert_eq!(look.moves(&mut test), up);
    assert_eq!(test, lift_test(1, 0));
    let mut late = lift_test(4, 0);
    assert_eq!(look.moves(&mut late), up);
    assert_eq!(look.moves(&mut late), None);
    assert_eq!(late.sub_phase(), SubPhase::Reopen);
    let mut empty = lift_test(0, 0);
    assert_eq!(Look::at([0.0; 3], Empty).moves(&mut empty), None);
    assert_eq!(empty.sub_phase(), SubPhase::Reopen);
}

#[test]
fn each_further_try_takes_the_other_side_and_none_is_made_too_many() {
    let mut tries = Pick {
        side: Some(Side::Positive),
        ..lift_test(0, 0)
    };
    let empty = Look::at([0.0; 3], Empty);
    for (left, side) in [(1, Side::Negative), (0, Side::Positive)] {
        tries.step = lift_test(0, 0).step;
        assert!(empty.step(&mut tries).is_none());
        assert_eq!((tries.redescents_left(), tries.side), (left, Some(side)));
    }
    tries.step = lift_test(0, 0).step;
    assert!(matches!(empty.step(&mut tries), Some(Outcome::Failed)));
}

#[test]
fn a_hand_opens_where_it_is_before_it_rises() {
    let mut reopen = pick(Step::Reopen {
        queries: 0,
        goal_z_m: 1.5,
    });
    let half_open = Look::at([0.5, 0.25, 1.0], Closing);
    for query in 0..OPEN_QUERIES {
        let z = if query < OPEN_QUERIES / 2 { 1.0 } else { 1.5 };
        let expected = Some(([0.5, 0.25, z], Grip::Open));
        assert_eq!(half_open.moves(&mut reopen), expected, "{query}");
    }
    assert_eq!(half_open.moves(&mut reopen), None);
    assert_eq!(reopen.step, Step::Hover { turning: 0 });
    let mut open = pick(Step::Reopen {
        queries: 0,
        goal_z_m: 1.5,
    });
    assert_eq!(Look::at([0.0; 3], Open).moves(&mut open), None);
}

#[test]
fn a_hand_is_closing_while_it_closes_and_tests() {
    for (step, closing) in [
        (Step::Hover { turning: 0 }, false),
        (Step::Descend, false),
        (Step::Close { queries: 0 }, true),
        (lift_test(0, 0).step, true),
    ] {
        assert_eq!(pick(step).is_closing(), closing, "{step:?}");
    }
}
