//! Every recovery, closed loop, in the toy world: each must end in success.
//! A failing test prints the table of decisions.

use fitmac_core::{
    Controller, Params,
    message::{Input, StateSample, TraceRecord},
    params::Switches,
    reason,
    wire::{DestinationKind, Diagnosis, Mode, Provenance, Route, SubPhase},
};
use fitmac_core_tests::world::{
    Agent, Answer, BASKET, Behaviour, CAN, OTHER, PLATE, Policy, Scene, Session, Verifier, table,
};
use kinematics::rotation::UnitQuaternion;

const STEPS: u64 = 400;

fn profiles() -> [(&'static str, Params); 2] {
    [("guarded", Params::guarded()), ("paper", Params::paper())]
}

fn scenes() -> [Scene; 4] {
    [
        Scene::can_to_plate(),
        Scene::bowl_to_plate(),
        Scene::box_to_plate(),
        Scene::can_to_basket(),
    ]
}

fn session(params: Params, scene: &Scene, behaviour: Behaviour) -> Session {
    let agent = Agent::knowing(scene);
    Session::new(params, scene.clone(), Policy::new(behaviour), agent)
}

fn decisions(session: &Session) -> String {
    let rows = table::changes(&session.queries);
    let rows: Vec<_> = rows.into_iter().map(table::row).collect();
    format!("{}\n{}", table::HEADING, rows.join("\n"))
}

/// Runs to success and returns the records.
fn succeeds(name: &str, mut session: Session) -> Session {
    let done = session.run(STEPS);
    assert!(done, "{name}: not done\n{}", decisions(&session));
    session
}

fn took(session: &Session, route: Route) -> usize {
    let is = |r: &&TraceRecord| r.route == route.code();
    session.queries.iter().filter(is).count()
}

#[test]
fn every_way_to_fail_ends_in_success_with_every_object_in_both_profiles() {
    for (profile, params) in profiles() {
        for scene in scenes() {
            for behaviour in [
                Behaviour::WrongObject(OTHER),
                Behaviour::StallsAbove(0.05),
                Behaviour::StallsAbove(0.15),
                Behaviour::MissesPlace([0.12, 0.0]),
                Behaviour::MissesPlace([0.0, -0.14]),
                Behaviour::Dithers,
                Behaviour::Replays([0.0, 0.1]),
                Behaviour::Replays([-0.08, 0.05]),
                Behaviour::Frozen,
            ] {
                let name = format!(
                    "{profile}, {behaviour:?}, {} on {}",
                    scene.target, scene.destination
                );
                let end = succeeds(&name, session(params, &scene, behaviour));
                assert!(
                    end.controller.state().episode().correction_queries() > 0,
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn a_competent_policy_is_left_alone() {
    for (profile, params) in profiles() {
        for scene in scenes() {
            for verifier in [Verifier::Absent, Verifier::Successes, Verifier::Both] {
                let name = format!("{profile}, {} on {}", scene.target, scene.destination);
                let mut session = session(params, &scene, Behaviour::Competent);
                session.verifier = verifier;
                let mut end = succeeds(&name, session);
                // And also afterwards, when it has nothing left to do.
                end.run_until(200, |_| false);
                let episode = end.controller.state().episode();
                assert_eq!(
                    episode.correction_queries(),
                    0,
                    "{name}\n{}",
                    decisions(&end)
                );
                assert_eq!(took(&end, Route::Execution), 0, "{name}");
                assert!(
                    end.scene.is_done(&end.world),
                    "{name}: it stays where it is"
                );
            }
        }
    }
}

#[test]
fn with_nothing_switched_on_every_failure_stays_one() {
    for behaviour in [
        Behaviour::WrongObject(OTHER),
        Behaviour::StallsAbove(0.05),
        Behaviour::MissesPlace([0.12, 0.0]),
        Behaviour::Dithers,
        Behaviour::Replays([0.0, 0.1]),
        Behaviour::Frozen,
    ] {
        let params = Params {
            switches: Switches::BACKBONE_ONLY,
            ..Params::guarded()
        };
        let name = format!("{behaviour:?}");
        let mut session = session(params, &Scene::can_to_plate(), behaviour);
        assert!(
            !session.run(STEPS),
            "{name} is no failure\n{}",
            decisions(&session)
        );
        assert_eq!(session.controller.state().episode().correction_queries(), 0);
    }
}

#[test]
fn a_wrong_first_binding_is_looked_at_again_and_the_policy_obeys() {
    for (profile, params) in profiles() {
        let scene = Scene::can_to_plate();
        // The first rule takes the other can; a second look finds the right one.
        let agent = Agent::new([
            Answer::Target {
                id: OTHER,
                kappa: 0.28,
                provenance: Provenance::Rules,
            },
            Answer::Target {
                id: CAN,
                kappa: 0.9,
                provenance: Provenance::Recheck,
            },
        ]);
        let session = Session::new(params, scene, Policy::new(Behaviour::Competent), agent);
        let end = succeeds(profile, session);
        assert_eq!(
            end.controller.state().episode().rebinds(),
            1,
            "{}",
            decisions(&end)
        );
        assert_eq!(end.controller.state().episode().correction_queries(), 0);
    }
}

#[test]
fn an_approach_to_another_object_doubts_the_binding_before_it_doubts_the_execution() {
    for (profile, params) in profiles() {
        let scene = Scene::can_to_plate();
        let agent = Agent::new([
            Answer::Target {
                id: CAN,
                kappa: 0.6,
                provenance: Provenance::Rules,
            },
            Answer::Target {
                id: CAN,
                kappa: 0.9,
                provenance: Provenance::Recheck,
            },
        ]);
        let policy = Policy::new(Behaviour::WrongObject(OTHER));
        let end = succeeds(profile, Session::new(params, scene, policy, agent));
        let acted: Vec<_> = end
            .queries
            .iter()
            .filter(|r| {
                r.diagnosis == Diagnosis::TargetCorrection.code()
                    || r.route == Route::Execution.code()
            })
            .map(|r| (r.diagnosis, r.route))
            .collect();
        assert_eq!(
            acted.last(),
            Some(&(Diagnosis::PickFailure.code(), Route::Execution.code())),
            "{profile}\n{}",
            decisions(&end)
        );
        assert_eq!(
            end.rebinds, 2,
            "{profile}: it was asked for, and asked again"
        );
        let epoch = end.controller.state().subtask().lock().epoch();
        assert_eq!(
            epoch,
            2,
            "{profile}: the answer was used\n{}",
            decisions(&end)
        );
    }
}

#[test]
fn agents_that_find_nothing_are_asked_twice_and_then_heard_when_they_speak() {
    for (profile, params) in profiles() {
        let nothing = Answer::Target {
            id: 0,
            kappa: 0.0,
            provenance: Provenance::Rules,
        };
        let scene = Scene::can_to_plate();
        let policy = Policy::new(Behaviour::Frozen);
        let mut session = Session::new(params, scene, policy, Agent::new([nothing]));
        session.run_until(60, |_| false);
        assert_eq!(session.rebinds, 2, "{profile}\n{}", decisions(&session));
        session
            .agent
            .volunteer(session.world.now_ns(), CAN, &session.scene);
        assert!(session.run(STEPS), "{profile}\n{}", decisions(&session));
        assert_eq!(session.rebinds, 2);
    }
}

#[test]
fn agents_that_never_answer_a_second_time_do_not_stop_the_recovery() {
    for (profile, params) in profiles() {
        let agent = Agent::new([
            Answer::Target {
                id: CAN,
                kappa: 0.6,
                provenance: Provenance::Rules,
            },
            Answer::Silence,
        ]);
        let policy = Policy::new(Behaviour::WrongObject(OTHER));
        succeeds(
            profile,
            Session::new(params, Scene::can_to_plate(), policy, agent),
        );
    }
}

#[test]
fn agents_that_never_answer_at_all_leave_the_base_policy_in_charge() {
    for (profile, params) in profiles() {
        let agent = Agent::new([Answer::Silence]);
        let policy = Policy::new(Behaviour::Competent);
        let end = succeeds(
            profile,
            Session::new(params, Scene::can_to_plate(), policy, agent),
        );
        assert_eq!(
            end.controller.state().episode().correction_queries(),
            0,
            "{profile}"
        );
    }
}

#[test]
fn a_weak_grasp_is_tried_again_with_another_descent() {
    for (profile, params) in profiles() {
        for scene in scenes() {
            let mut session = session(params, &scene, Behaviour::Frozen);
            session.world.plant.weak_grasps = 2;
            let end = succeeds(profile, session);
            let reopened = end
                .queries
                .iter()
                .filter(|r| r.sub_phase == SubPhase::Reopen.code());
            assert!(reopened.count() >= 2, "{profile}\n{}", decisions(&end));
        }
    }
}

#[test]
fn an_object_that_slips_out_of_the_hand_is_picked_up_again() {
    for (profile, params) in profiles() {
        for behaviour in [Behaviour::Competent, Behaviour::Frozen] {
            for scene in scenes() {
                let mut session = session(params, &scene, behaviour.clone());
                session.world.plant.drop_above_m = Some(0.15);
                let name = format!("{profile}, {behaviour:?}, {}", scene.target);
                let end = succeeds(&name, session);
                assert_eq!(end.world.plant.drop_above_m, None, "{name}: it did slip");
            }
        }
    }
}

#[test]
fn a_hand_that_arrives_tilted_is_levelled_in_the_guarded_profile_only() {
    for (profile, params) in profiles() {
        let scene = Scene::box_to_plate();
        let mut session = session(params, &scene, Behaviour::Frozen);
        let tilt = UnitQuaternion::from_rotation_vector([0.3, 0.0, 0.0]);
        let tilted = tilt * session.world.orientation();
        session.world.set_orientation(tilted);
        let end = succeeds(profile, session);
        let turned = end.queries.iter().any(|r| r.action[3..6] != [0.0; 3]);
        assert_eq!(turned, profile == "guarded", "{profile}");
        let hand = end.world.orientation().rotate([0.0, 0.0, 1.0]);
        assert_eq!(
            hand[2] < -0.995,
            profile == "guarded",
            "{profile}: {hand:?}"
        );
    }
}

#[test]
fn an_arm_that_freezes_at_a_joint_limit_backs_out() {
    for (profile, params) in profiles() {
        let mut scene = Scene::can_to_plate();
        // The plate lies as far out as the arm reaches while the can is high.
        if let Some(plate) = scene.world.body_mut(PLATE) {
            plate.position_m = [0.62, 0.0, 0.01];
        }
        scene.world.plant.reach_m = 0.625;
        let session = session(params, &scene, Behaviour::Frozen);
        let end = succeeds(profile, session);
        assert!(end.controller.state().episode().correction_queries() > 0);
    }
}

/// True while a place is pending that has not let go.
fn is_carrying(session: &Session) -> bool {
    let state = session.controller.state();
    state.subtask().recovery().is_placing() && state.subtask().estimator().is_lifted()
}

#[test]
fn an_arm_that_freezes_while_it_carries_backs_out_with_its_hand_closed() {
    for (profile, params) in profiles() {
        let scene = Scene::can_to_plate();
        let mut session = session(params, &scene, Behaviour::Frozen);
        assert!(session.run_until(STEPS, is_carrying), "{profile}");
        session.run_until(4, |_| false);
        let reach = |session: &Session| {
            let [x, y, _] = session.world.ee_m();
            x.hypot(y)
        };
        // The limit is here now: it neither comes nearer to the plate nor lets go.
        let limit_m = reach(&session);
        session.world.plant.reach_m = limit_m;
        let backed = session.run_until(60, |s| reach(s) < limit_m - 0.02);
        assert!(backed, "{profile}\n{}", decisions(&session));
        assert!(is_carrying(&session), "{profile}: it still holds the can");
        session.world.plant.reach_m = 0.9;
        succeeds(profile, session);
    }
}

#[test]
fn what_slips_from_a_place_is_left_where_no_pick_may_follow() {
    for (profile, mut params) in profiles() {
        params.switches.hard_pick = false;
        let scene = Scene::can_to_plate();
        let mut session = session(params, &scene, Behaviour::MissesPlace([0.12, 0.0]));
        if !session.run_until(STEPS, is_carrying) {
            // Without a monitor of the destination nothing is noticed before it is let go.
            assert_eq!(profile, "paper");
            continue;
        }
        // It slips, and the fingers meet.
        session.world.plant.weak_grasps = 1;
        session.world.plant.drop_above_m = Some(0.0);
        let ended = session.run_until(20, |s| {
            !s.controller.state().subtask().recovery().is_pending()
        });
        assert!(ended, "{profile}: no pick follows\n{}", decisions(&session));
        let reasons = session.controller.state().decision().reasons;
        assert_ne!(reasons & reason::VALIDITY_LOST, 0, "{profile}");
    }
}

/// Runs with poses that are renewed every `period` ticks and are `delay` ticks old when they come.
/// True if the task was done.
fn with_poses(scene: &Scene, behaviour: Behaviour, period: usize, delay: usize) -> bool {
    let params = Params::guarded().validate().expect("the profile is valid");
    let mut controller = Controller::new(params);
    let mut world = scene.world.clone();
    let mut policy = Policy::new(behaviour);
    let mut agent = Agent::knowing(scene);
    let mut seen: Vec<StateSample> = Vec::new();
    for tick in 0..5000_usize {
        world.advance(4_000_000);
        let now_ns = world.now_ns();
        let mut sample = world.sample();
        seen.push(sample);
        let from = tick.saturating_sub(delay);
        sample.objects = seen[from - from % period].objects;
        let (chunk, grounding) = (policy.poll(now_ns), agent.poll(now_ns));
        let output = controller.tick(
            now_ns,
            &Input {
                state: Some(&sample),
                chunk: chunk.as_ref(),
                grounding: grounding.as_ref(),
                ..Input::default()
            },
        );
        world.apply(&output.command);
        if let Some(query) = &output.query {
            policy.ask(query, &world, scene);
        }
        if let Some(request) = &output.rebind {
            agent.ask(now_ns, request, scene);
        }
        if scene.is_done(&world) {
            return true;
        }
    }
    false
}

#[test]
fn poses_that_come_seldom_or_late_are_enough() {
    for scene in [Scene::can_to_plate(), Scene::can_to_basket()] {
        for behaviour in [Behaviour::Frozen, Behaviour::StallsAbove(0.05)] {
            for (period, delay) in [(1, 0), (20, 0), (1, 15), (20, 5), (15, 40)] {
                let done = with_poses(&scene, behaviour.clone(), period, delay);
                assert!(
                    done,
                    "{behaviour:?}, every {period} ticks, {delay} ticks late"
                );
            }
        }
    }
}

#[test]
fn a_destination_that_only_a_relation_describes_is_left_to_the_base_policy() {
    for (profile, params) in profiles() {
        let mut agent = Agent::knowing(&Scene::can_to_plate());
        agent.destination = DestinationKind::Relational;
        let policy = Policy::new(Behaviour::MissesPlace([0.12, 0.0]));
        let mut session = Session::new(params, Scene::can_to_plate(), policy, agent);
        session.verifier = Verifier::Absent;
        assert!(!session.run(STEPS), "geometry can't place it");
        assert_eq!(
            session.controller.state().episode().correction_queries(),
            0,
            "{profile}: what may lie right is left alone\n{}",
            decisions(&session)
        );
    }
}

#[test]
fn a_relational_destination_that_the_verifier_denies_is_picked_up_again() {
    for (profile, params) in profiles() {
        let mut agent = Agent::knowing(&Scene::can_to_plate());
        agent.destination = DestinationKind::Relational;
        let policy = Policy::new(Behaviour::MissesPlace([0.12, 0.0]));
        let mut session = Session::new(params, Scene::can_to_plate(), policy, agent);
        session.verifier = Verifier::Both;
        session.run(STEPS);
        let last = session
            .queries
            .iter()
            .filter(|r| r.route == Route::Execution.code());
        assert!(last.count() > 0, "{profile}\n{}", decisions(&session));
        let placed = session
            .queries
            .iter()
            .any(|r| r.sub_phase == SubPhase::MoveAbove.code());
        assert!(!placed, "{profile}: it never places by geometry");
    }
}

#[test]
fn a_container_takes_the_object_below_its_rim() {
    for (profile, params) in profiles() {
        let end = succeeds(
            profile,
            session(params, &Scene::can_to_basket(), Behaviour::Frozen),
        );
        let released = end
            .queries
            .iter()
            .find(|r| r.sub_phase == SubPhase::ReleaseReady.code())
            .expect("it was released by the recovery");
        let rim = end
            .world
            .body(BASKET)
            .map_or(0.0, |b| b.position_m[2] + b.half_extent_m[2]);
        assert!(released.target_position_m[2] - 0.04 < rim, "{profile}");
    }
}

#[test]
fn a_policy_that_dies_and_comes_back_is_waited_for() {
    for (profile, params) in profiles() {
        let mut session = session(params, &Scene::can_to_plate(), Behaviour::Competent);
        session.run_until(30, |_| false);
        session.policy.restart();
        assert!(session.run(STEPS), "{profile}\n{}", decisions(&session));
        let stopped = session.events.iter().any(|e| e.mode == Mode::Stop.code());
        assert!(!stopped, "{profile}");
    }
}

#[test]
fn what_was_let_go_in_its_place_may_roll_for_long() {
    let scene = Scene::can_to_basket();
    let mut session = session(Params::guarded(), &scene, Behaviour::Competent);
    session.verifier = Verifier::Absent;
    assert!(session.run(STEPS));
    let start = session.world.body(CAN).map(|b| b.position_m);
    let start = start.expect("the scene has a can");
    // A jolt every 13 policy steps: too often to count as rest, too seldom to count as progress.
    let jolt = 13 * 50_000_000 / session.tick_ns;
    for tick in 0..20 * jolt {
        if tick % jolt == 0
            && let Some(can) = session.world.body_mut(CAN)
        {
            let side = if (tick / jolt).is_multiple_of(2) {
                0.012
            } else {
                0.0
            };
            can.position_m[0] = start[0] + side;
        }
        session.tick();
    }
    assert_eq!(
        session.controller.state().episode().correction_queries(),
        0,
        "{}",
        decisions(&session)
    );
}

#[test]
fn a_faint_binding_that_the_policy_agrees_with_is_placed() {
    let scene = Scene::can_to_plate();
    let faint = |provenance| Answer::Target {
        id: CAN,
        kappa: 0.05,
        provenance,
    };
    for (agreed, saved) in [(Params::guarded().lock.agreed, true), (0.0, false)] {
        let mut params = Params::guarded();
        params.lock.agreed = agreed;
        let agent = Agent::new([
            faint(Provenance::Rules),
            faint(Provenance::Recheck),
            faint(Provenance::Recheck),
        ]);
        let policy = Policy::new(Behaviour::MissesPlace([0.12, 0.0]));
        let mut session = Session::new(params, scene.clone(), policy, agent);
        let done = session.run(STEPS);
        assert_eq!(done, saved, "agreed {agreed}\n{}", decisions(&session));
    }
}

#[test]
fn what_is_put_on_a_surface_touches_it_before_it_is_let_go() {
    let height = |params: Params| {
        let behaviour = Behaviour::MissesPlace([0.12, 0.0]);
        let end = succeeds("touch", session(params, &Scene::can_to_plate(), behaviour));
        let opens = |r: &&TraceRecord| r.sub_phase == SubPhase::ReleaseReady.code();
        let record = end.queries.iter().find(opens);
        record.expect("it opens").destination_distance_m
    };
    let (touching, published) = (height(Params::guarded()), height(Params::paper()));
    assert!(
        touching < 0.008 && published > 0.012,
        "{touching} {published}"
    );
}
