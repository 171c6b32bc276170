//! Kinematics of the Panda.

use kinematics::{
    panda::{ACCELERATION_LIMITS, JERK_LIMITS, JOINTS, LIMITS, Panda, READY, chain},
    pose::Pose,
    pose_ik::{Answer, Candidate, Search, solve},
    rotation::UnitQuaternion,
};
use pyo3::{exceptions::PyValueError, prelude::*};

fn refused(error: impl core::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("q: {error}"))
}

/// Position (m) and orientation (w, x, y, z) of the Panda's tool centre point
/// in the base frame, at joint positions in rad.
#[pyfunction]
pub(crate) fn panda_forward(q: [f64; JOINTS]) -> PyResult<([f64; 3], [f64; 4])> {
    let pose = chain().map_err(refused)?.tip(&q).map_err(refused)?.pose();
    Ok((pose.position, pose.orientation.wxyz()))
}

/// The geometric Jacobian (6 x 7: linear above angular) of the Panda's tool
/// centre point in the base frame, at joint positions in rad.
#[pyfunction]
pub(crate) fn panda_jacobian(q: [f64; JOINTS]) -> PyResult<[[f64; JOINTS]; 6]> {
    let solution = chain().map_err(refused)?.solve(&q).map_err(refused)?;
    Ok(solution.jacobian.rows())
}

/// Whether the target is reached; joint positions (rad); distance (m) and angle
/// (rad) to it; steps.
type Found = (bool, [f64; JOINTS], f64, f64, u32);

/// Joint positions for a pose of the tool centre point; `None` if it is out of
/// reach.
#[pyfunction]
#[pyo3(signature = (position, orientation, seed, restarts, position_tolerance_m, rotation_tolerance_rad))]
pub(crate) fn panda_inverse(
    position: [f64; 3],
    orientation: [f64; 4],
    seed: [f64; JOINTS],
    restarts: u16,
    position_tolerance_m: f64,
    rotation_tolerance_rad: f64,
) -> PyResult<Option<Found>> {
    let orientation = UnitQuaternion::from_wxyz(orientation).ok_or_else(|| {
        PyValueError::new_err("pose.orientation: it is not finite, or of length 0")
    })?;
    let search = Search {
        restarts,
        position_tolerance_m,
        rotation_tolerance_rad,
        ..Search::default()
    };
    let answer = solve(&Panda, &Pose::new(position, orientation), &seed, &search);
    let found = |reached: bool, candidate: Candidate<JOINTS>| {
        Some((
            reached,
            candidate.q,
            candidate.position_error_m,
            candidate.rotation_error_rad,
            candidate.steps,
        ))
    };
    match answer.map_err(|error| PyValueError::new_err(error.to_string()))? {
        Answer::Reached(candidate) => Ok(found(true, candidate)),
        Answer::NotReached(candidate) => Ok(found(false, candidate)),
        Answer::OutOfReach => Ok(None),
    }
}

/// Least and greatest joint positions (rad), greatest velocities, accelerations
/// and jerks (rad/s, rad/s^2, rad/s^3), and the ready posture (rad).
#[pyfunction]
pub(crate) fn panda_constants() -> [[f64; JOINTS]; 6] {
    [
        LIMITS.map(|limit| limit.lower),
        LIMITS.map(|limit| limit.upper),
        LIMITS.map(|limit| limit.velocity),
        ACCELERATION_LIMITS,
        JERK_LIMITS,
        READY,
    ]
}
