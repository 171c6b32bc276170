//! Kinematics of the Panda.

use kinematics::panda::{JOINTS, chain};
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
