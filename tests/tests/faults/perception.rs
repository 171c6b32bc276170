//! B. Robot state, objects, perception.

use fitmac_core::{
    message::StateSample,
    reason,
    wire::{Mode, SubPhase},
};
use fitmac_core_tests::world::{CAN, OTHER, PLATE};
use fitmac_tests::cell::{AgentsState, Cell, Heard, PolicyState, RobotState};

use crate::{STOP_MAX_M, assert_sound, holds, moving, note, now_ns, stop_distance_m, stops};

#[test]
fn b1_a_state_that_ceases_is_a_hold_and_then_a_stop() {
    let cell = moving(&[]);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.mute = true);
    let hold = cell.wait("hold", since, holds(reason::STATE_STALE));
    cell.wait("stop", since, stops(reason::STATE_STALE));
    let far_m = stop_distance_m(&cell, since, STOP_MAX_M);
    robot.with(|robot| robot.mute = false);
    // Latched: sound samples alone don't end it.
    let sound = cell.wait("a later command", now_ns() + 200_000_000, |_| true);
    assert_eq!(sound.mode(), Mode::Stop);
    note(
        "b1_a_state_that_ceases_is_a_hold_and_then_a_stop",
        since,
        &hold,
        Some(far_m),
    );
    cell.close();
}

/// Samples are broken from now on: each is refused by name, and the state that
/// ages is a hold; sound ones end it.
fn broken(test: &str, refusal: &str, break_it: impl FnMut(&mut StateSample) + Send + 'static) {
    let cell = moving(&["--set", "state.stop_age_ms=10000"]);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.spoil = Some(Box::new(break_it)));
    let hold = cell.wait("hold", since, holds(reason::STATE_STALE));
    let far_m = stop_distance_m(&cell, since, STOP_MAX_M);
    cell.wait_for_count(&format!("refused.{refusal}"));
    robot.with(|robot| robot.spoil = None);
    cell.wait("actions", now_ns(), Heard::acts);
    assert_sound(&cell, since);
    note(test, since, &hold, Some(far_m));
    cell.close();
}

#[test]
fn b2_a_nan_in_the_state_is_refused() {
    broken("b2_a_nan_in_the_state_is_refused", "not_finite", |s| {
        s.ee_position_m[1] = f64::NAN
    });
}

#[test]
fn b3_a_jump_is_dropped_and_then_believed() {
    let cell = moving(&[]);
    let since = now_ns();
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.spoil = Some(Box::new(|s| s.ee_position_m[0] += 0.3)));
    let jumped = cell.wait("notice", since, |h| h.says(reason::STATE_JUMP));
    assert!(jumped.mode() < Mode::Hold);
    assert!(cell.wait_for_count("refused.jump") >= 5);
    cell.wait("actions", now_ns(), Heard::acts);
    assert_sound(&cell, since);
    note(
        "b3_a_jump_is_dropped_and_then_believed",
        since,
        &jumped,
        None,
    );
    cell.close();
}

#[test]
fn b4_an_orientation_that_is_none_is_refused() {
    broken(
        "b4_an_orientation_that_is_none_is_refused",
        "quaternion",
        |s| {
            s.ee_orientation = [0.0, 0.9, 0.0, 0.0];
        },
    );
}

/// A cell in which a recovery acts, as the policy does nothing.
fn recovering(state: RobotState, agents: AgentsState) -> Cell {
    let mut cell = Cell::empty();
    cell.add_robot(state);
    cell.add_policy(PolicyState::idle());
    cell.add_agents(agents);
    cell.start(&[]);
    cell
}

fn corrects(heard: &Heard) -> bool {
    heard
        .command
        .sub_phase()
        .is_some_and(|s| s != SubPhase::Idle)
}

/// A recovery that loses its ground ends at once, and the base policy acts.
fn cancelled(test: &str, begins: impl Fn(&Cell, &Heard) -> bool, break_it: impl FnOnce(&Cell)) {
    let cell = recovering(RobotState::default(), AgentsState::default());
    cell.wait("a recovery", 0, |h| corrects(h) && begins(&cell, h));
    let since = now_ns();
    break_it(&cell);
    let ended = cell.wait("an end", since, |h| !corrects(h));
    assert!(ended.mode() < Mode::Hold, "{ended:?}");
    let why = reason::VALIDITY_LOST | reason::NO_ACTION;
    assert_ne!(ended.command.reasons & why, 0, "{ended:?}");
    assert_sound(&cell, since);
    note(test, since, &ended, None);
    cell.close();
}

fn hide(cell: &Cell, id: u16) {
    let robot = cell.robot.as_ref().expect("a thread");
    robot.with(|robot| robot.world.hidden.push(id));
}

#[test]
fn b5_a_lost_target_ends_the_recovery() {
    cancelled(
        "b5_a_lost_target_ends_the_recovery",
        |_, _| true,
        |cell| hide(cell, CAN),
    );
}

/// Sends a grounding record beside what is asked.
fn say(cell: &Cell, change: impl FnOnce(&mut fitmac_core::message::GroundingRecord)) {
    let agents = cell.agents.as_ref().expect("a thread");
    agents.with(|agents| {
        let mut record = agents.newest.expect("they have answered");
        record.stamp_ns = now_ns();
        change(&mut record);
        agents.besides.push_back(record);
    });
}

#[test]
fn b6_a_detector_that_flaps_does_not_move_the_lock() {
    let cell = recovering(RobotState::default(), AgentsState::default());
    cell.wait("a recovery", 0, corrects);
    let since = now_ns();
    for epoch in 1..=8 {
        say(&cell, |record| {
            record.epoch += epoch;
            record.target = [OTHER, CAN][epoch as usize % 2];
        });
    }
    // The arm stays on its way to the first target: it grasps that one.
    let robot = cell.robot.as_ref().expect("a thread");
    let closed = cell.wait("a grasp", since, |_| robot.with(|r| r.world.held() != 0));
    assert_eq!(robot.with(|r| r.world.held()), CAN);
    note(
        "b6_a_detector_that_flaps_does_not_move_the_lock",
        since,
        &closed,
        None,
    );
    cell.close();
}

#[test]
fn b7_without_a_target_the_base_policy_acts() {
    let since = now_ns();
    let cell = recovering(RobotState::default(), AgentsState::clueless());
    // Long enough for a recovery if there were a target: it stalls for 16
    // steps, and the gate wants three failures.
    let late = cell.wait("sixty steps", since, |h| h.command.policy_step > 60);
    assert!(cell.commands_since(since).iter().all(|h| !corrects(h)));
    assert!(late.mode() < Mode::Hold);
    note(
        "b7_without_a_target_the_base_policy_acts",
        late.sent_ns,
        &late,
        None,
    );
    cell.close();
}

#[test]
fn b8_an_empty_grasp_is_seen_and_tried_again() {
    let mut state = RobotState::default();
    state.world.plant.weak_grasps = 1;
    let cell = recovering(state, AgentsState::default());
    let robot = cell.robot.as_ref().expect("a thread");
    let empty = cell.wait("an empty grasp", 0, |_| {
        robot.with(|r| r.world.plant.weak_grasps == 0)
    });
    let again = cell.wait("another try", empty.sent_ns, |h| {
        corrects(h) && h.command.action[6] < 0.0
    });
    cell.wait("a grasp", again.sent_ns, |_| {
        robot.with(|r| r.world.held() == CAN)
    });
    note(
        "b8_an_empty_grasp_is_seen_and_tried_again",
        empty.sent_ns,
        &again,
        None,
    );
    cell.close();
}

#[test]
fn b9_a_gripper_that_measures_nothing_is_refused() {
    broken(
        "b9_a_gripper_that_measures_nothing_is_refused",
        "not_finite",
        |s| {
            s.gripper_width_m = f64::NAN;
        },
    );
}

#[test]
fn b10_a_grounding_that_is_withdrawn_ends_the_recovery() {
    cancelled(
        "b10_a_grounding_that_is_withdrawn_ends_the_recovery",
        |_, _| true,
        |cell| {
            say(cell, |record| record.confidence = 0.05);
        },
    );
}

#[test]
fn b11_a_destination_that_is_lost_ends_the_transport() {
    let carries = |_: &Cell, heard: &Heard| heard.command.sub_phase() == Some(SubPhase::MoveAbove);
    cancelled(
        "b11_a_destination_that_is_lost_ends_the_transport",
        carries,
        |cell| {
            hide(cell, PLATE);
        },
    );
}

#[test]
fn b12_millimetres_are_refused() {
    broken("b12_millimetres_are_refused", "implausible", |s| {
        s.ee_position_m = s.ee_position_m.map(|x| x * 1000.0);
    });
}

#[test]
fn b13_a_target_out_of_the_workspace_is_not_followed() {
    let test = "b13_a_target_out_of_the_workspace_is_not_followed";
    cancelled(
        test,
        |_, _| true,
        |cell| {
            let robot = cell.robot.as_ref().expect("a thread");
            robot.with(|robot| {
                let held = robot.world.held();
                if let Some(body) = robot.world.body_mut(CAN)
                    && held == 0
                {
                    body.position_m = [1.5, 0.0, 0.04];
                }
            });
        },
    );
}
