use super::*;

fn record(query: u64) -> TraceRecord {
    TraceRecord {
        stamp_ns: 0,
        query,
        policy_step: 10 + 8 * query,
        evidence: 0,
        reasons: 0,
        epoch: 1,
        attempt: 1,
        phase_steps: 0,
        budget: 0,
        effective_horizon: 8,
        attempt_steps: 0,
        subtask: 0,
        detail: 0,
        target: 2,
        other: 0,
        kind: EventKind::Query.code(),
        phase: Phase::Approach.code(),
        diagnosis: Diagnosis::None.code(),
        route: Route::Base.code(),
        mode: Mode::Normal.code(),
        sub_phase: SubPhase::Idle.code(),
        verdict: Verdict::Unknown.code(),
        failure_streak: 0,
        confidence_streak: 0,
        redescents: 0,
        gripper_closed: 0,
        lifted: 0,
        kappa: 0.95,
        target_distance_m: 0.2,
        destination_distance_m: 0.3,
        gripper_width_m: 0.08,
        ee_position_m: [0.0; 3],
        target_position_m: [0.0; 3],
        waypoint_m: [f64::NAN; 3],
        base_action: [0.0; 7],
        action: [0.0; 7],
    }
}

fn names() -> Names {
    [(1, "ketchup_1"), (2, "milk_1")]
        .map(|(id, name)| (id, name.to_owned()))
        .into()
}

/// Approaches the wrong thing, is corrected, carries, succeeds.
fn episode() -> Vec<TraceRecord> {
    let mut records: Vec<TraceRecord> = (0..10).map(record).collect();
    records[2].evidence = evidence::PROGRESS;
    for record in &mut records[4..] {
        record.evidence = evidence::WRONG_TARGET;
        record.other = 1;
        record.diagnosis = Diagnosis::PickFailure.code();
        record.route = Route::Pending.code();
        record.sub_phase = SubPhase::ApproachHover.code();
        record.budget = 59;
        record.reasons = reason::STRONG_EVIDENCE;
    }
    records[4].route = Route::Execution.code();
    for record in &mut records[7..] {
        record.evidence = 0;
        record.other = 0;
        record.phase = Phase::Transport.code();
        record.sub_phase = SubPhase::LiftCarry.code();
        record.lifted = 1;
    }
    records
}

#[test]
fn the_timeline_has_the_first_row_each_change_and_the_last_row() {
    let rows = rows(&episode(), &names());
    let queries: Vec<u64> = rows.iter().map(|row| row.query).collect();
    assert_eq!(queries, [0, 4, 5, 7, 9]);
}

#[test]
fn a_row_tells_what_table_19_tells() {
    let rows = rows(&episode(), &names());
    let first = &rows[0];
    assert_eq!((first.step, &*first.phase), (10, "Pick approach"));
    assert_eq!(first.event, "target is milk_1");
    assert_eq!(first.decision, "none; base");
    assert_eq!(first.state, "locked on milk_1, kappa 0.95");
    let wrong = &rows[1];
    assert_eq!(wrong.event, "wrong target; at ketchup_1");
    assert_eq!(wrong.decision, "pick failure; execution correction");
    assert_eq!(
        wrong.state,
        "approach hover, budget 59; locked on milk_1, kappa 0.95; strong evidence"
    );
    let carried = &rows[3];
    assert_eq!(
        (&*carried.phase, &*carried.event),
        ("Place transport", "target lifted")
    );
}

#[test]
fn evidence_while_a_correction_runs_is_no_news() {
    let mut records = episode();
    records[6].evidence |= evidence::STALL;
    assert_eq!(rows(&records, &names()), rows(&episode(), &names()));
}

#[test]
fn a_change_of_mode_has_no_row_of_its_own() {
    let mut records = episode();
    let mut changed = records[9];
    changed.kind = EventKind::ModeChanged.code();
    changed.mode = Mode::Stop.code();
    records.push(changed);
    assert_eq!(rows(&records, &names()), rows(&episode(), &names()));
}

#[test]
fn what_is_unknown_is_shown_as_such() {
    let mut odd = record(0);
    odd.phase = 99;
    odd.target = 7;
    let row = &rows(&[odd], &names())[0];
    assert_eq!(
        (&*row.phase, &*row.state),
        ("unknown 99", "locked on object 7, kappa 0.95")
    );
    assert!(rows(&[], &names()).is_empty());
}

#[test]
fn a_narrow_table_wraps_and_keeps_every_column() {
    let table = table(&rows(&episode(), &names()), 90).to_string();
    assert!(
        table.lines().all(|line| line.chars().count() <= 90),
        "{table}"
    );
    for column in ["Query", "Step", "Phase", "Event", "Diagnosis", "Controller"] {
        assert!(table.contains(column), "{table}");
    }
}
