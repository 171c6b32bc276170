//! What leaves the core.

use fitmac_core::{
    message::Command,
    params::Filter,
    reason,
    wire::{Mode, Phase, Route, SubPhase},
};

use super::{Broken, require};
use crate::swarm::Seen;

/// Room for the rounding of sums and products of limits.
const ROUNDING: f64 = 1e-6;

pub(super) fn codes(command: &Command) -> Result<Mode, Broken> {
    let known = Route::try_from(command.route).is_ok()
        && Phase::try_from(command.phase).is_ok()
        && SubPhase::try_from(command.sub_phase).is_ok();
    match command.mode() {
        Some(mode) if known => Ok(mode),
        _ => Err(Broken {
            invariant: "every code is known",
            found: format!("{command:?}"),
        }),
    }
}

pub(super) fn numbers(command: &Command) -> Result<(), Broken> {
    let all = [
        &command.action[..],
        &command.setpoint_position_m,
        &command.setpoint_velocity_m_s,
        &command.setpoint_acceleration_m_s2,
        &command.setpoint_orientation,
    ];
    require(
        all.iter().all(|n| n.iter().all(|x| x.is_finite())),
        "1: every number is finite",
        || format!("{command:?}"),
    )?;
    require(
        command.action.iter().all(|a| a.abs() <= 1.0),
        "8: an action lies in the action box",
        || format!("{:?}", command.action),
    )?;
    let norm: f64 = command.setpoint_orientation.iter().map(|q| q * q).sum();
    require(
        (norm - 1.0).abs() < ROUNDING,
        "an orientation is a unit quaternion",
        || format!("{:?}", command.setpoint_orientation),
    )
}

pub(super) fn flags_and_reasons(seen: &Seen<'_>, mode: Mode) -> Result<(), Broken> {
    let command = &seen.output.command;
    let clamped = command.flags & Command::CLAMPED != 0;
    require(
        clamped == (command.reasons & reason::ACTION_CLAMPED != 0),
        "8: the flag stands if and only if the action was clamped",
        || format!("{command:?}"),
    )?;
    let plain = mode == Mode::Normal && command.route == Route::Base.code();
    require(
        plain == (command.reasons == 0),
        "69: there are reasons if and only if mode or route is not the plain one",
        || format!("{mode}, route {}: {:#x}", command.route, command.reasons),
    )
}

/// In a fault nothing moves, and the gripper stays.
pub(super) fn standstill(seen: &Seen<'_>, mode: Mode) -> Result<(), Broken> {
    let (action, before) = (&seen.output.command.action, &seen.before.action);
    require(
        mode < Mode::Hold || action[..6] == [0.0; 6] && action[6] == before[6],
        "9: a hold has no increment and keeps the gripper",
        || format!("{action:?} after {before:?}"),
    )
}

/// One command follows the other.
pub(super) fn succession(command: &Command, last: &Command) -> Result<(), Broken> {
    require(
        command.sequence == last.sequence.wrapping_add(1),
        "11: each tick gives one command, numbered one higher than the last",
        || format!("{} after {}", command.sequence, last.sequence),
    )?;
    let step = command.policy_step.wrapping_sub(last.policy_step);
    require(step <= 1, "at most one action starts in a tick", || {
        format!("step {} after {}", command.policy_step, last.policy_step)
    })?;
    require(
        step == 1 || command.action == last.action,
        "an action stands until the next one starts",
        || format!("{:?} after {:?}", command.action, last.action),
    )
}

/// 10: speed, acceleration and jerk of the setpoint, `dt_ns` after the last.
pub(super) fn limits(
    f: &Filter,
    command: &Command,
    last: &Command,
    dt_ns: u64,
) -> Result<(), Broken> {
    const INVARIANT: &str = "10: the setpoint keeps its limits against the last command";
    // The first setpoint of all is where the arm stands; before it, a hold or a
    // stop shows the origin.
    if last.setpoint_position_m == [0.0; 3] {
        return Ok(());
    }
    let dt_s = dt_ns as f64 * 1e-9;
    for axis in 0..3 {
        let change = |of: fn(&Command) -> [f64; 3]| (of(command)[axis] - of(last)[axis]).abs();
        let most = |limit: f64| limit * dt_s * (1.0 + ROUNDING) + 1e-9;
        let dp = change(|c| c.setpoint_position_m);
        let dv = change(|c| c.setpoint_velocity_m_s);
        let da = change(|c| c.setpoint_acceleration_m_s2);
        let speed = command.setpoint_velocity_m_s[axis].abs();
        // Accelerations are differences of speeds: between ticks a nanosecond apart, their rounding
        // counts.
        let before = last.setpoint_velocity_m_s[axis].abs();
        let rounding = f64::EPSILON * (speed + before) / dt_s.max(1e-9);
        // The speed limit may cut an acceleration off at once.
        let jerk_ok = da <= most(f.jerk_m_s3) + rounding || speed > 0.999 * f.velocity_m_s;
        let within = speed <= f.velocity_m_s + ROUNDING
            && command.setpoint_acceleration_m_s2[axis].abs() <= f.acceleration_m_s2 + ROUNDING
            && dp <= most(f.velocity_m_s)
            && dv <= most(f.acceleration_m_s2)
            && jerk_ok;
        require(within, INVARIANT, || {
            format!("axis {axis}: {dp} m, {dv} m/s, {da} m/s^2 in {dt_s} s")
        })?;
    }
    Ok(())
}
