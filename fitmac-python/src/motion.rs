//! Jerk-limited motion.

use kinematics::otg::{Input, Limits, State, Synchronisation, Target, Trajectory};
use pyo3::{exceptions::PyValueError, prelude::*};

/// A planned motion of some number of axes.
trait Planned: Send + Sync {
    fn duration_s(&self) -> f64;
    fn synchronised(&self) -> bool;
    /// Positions, velocities, accelerations.
    fn at(&self, time_s: f64) -> [Vec<f64>; 3];
}

impl<const N: usize> Planned for Trajectory<N> {
    fn duration_s(&self) -> f64 {
        Trajectory::duration_s(self)
    }

    fn synchronised(&self) -> bool {
        self.synchronisation() == Synchronisation::Time
    }

    fn at(&self, time_s: f64) -> [Vec<f64>; 3] {
        let state = Trajectory::at(self, time_s);
        [state.position, state.velocity, state.acceleration].map(Vec::from)
    }
}

/// A motion of 1 to 12 axes.
#[pyclass(frozen)]
pub(crate) struct Motion {
    planned: Box<dyn Planned>,
}

/// What to plan: start, target, limits, each of one length.
struct Question {
    start: [Vec<f64>; 3],
    target: [Vec<f64>; 2],
    limits: [Vec<f64>; 3],
}

fn plan<const N: usize>(question: &Question) -> PyResult<Box<dyn Planned>> {
    let axes = |values: &Vec<f64>| -> PyResult<[f64; N]> {
        let found = values.as_slice().try_into();
        found.map_err(|_| PyValueError::new_err(format!("an argument has not {N} numbers")))
    };
    let [position, velocity, acceleration] = &question.start;
    let start = State::<N> {
        position: axes(position)?,
        velocity: axes(velocity)?,
        acceleration: axes(acceleration)?,
    };
    let [position, velocity] = &question.target;
    let target = Target::Reach {
        position: axes(position)?,
        velocity: axes(velocity)?,
    };
    let [velocity, acceleration, jerk] = &question.limits;
    let limits = Limits {
        velocity: axes(velocity)?,
        acceleration: axes(acceleration)?,
        jerk: axes(jerk)?,
    };
    let planned = Trajectory::plan(&start, &Input { target, limits });
    let planned = planned.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(Box::new(planned))
}

#[pymethods]
impl Motion {
    #[new]
    #[expect(
        clippy::too_many_arguments,
        reason = "start, target and limits of a motion"
    )]
    fn new(
        position: Vec<f64>,
        velocity: Vec<f64>,
        acceleration: Vec<f64>,
        target: Vec<f64>,
        target_velocity: Vec<f64>,
        velocity_max: Vec<f64>,
        acceleration_max: Vec<f64>,
        jerk_max: Vec<f64>,
    ) -> PyResult<Self> {
        let axes = position.len();
        let question = Question {
            start: [position, velocity, acceleration],
            target: [target, target_velocity],
            limits: [velocity_max, acceleration_max, jerk_max],
        };
        macro_rules! with_axes {
            ($($n:literal)*) => {
                match axes {
                    $($n => plan::<$n>(&question),)*
                    n => Err(PyValueError::new_err(format!(
                        "position: {n} axes; from 1 to 12 can be planned"
                    ))),
                }
            };
        }
        let planned = with_axes!(1 2 3 4 5 6 7 8 9 10 11 12)?;
        Ok(Self { planned })
    }

    /// From the start to the target, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.planned.duration_s()
    }

    /// Whether all axes arrive at the same time.
    #[getter]
    fn synchronised(&self) -> bool {
        self.planned.synchronised()
    }

    /// Positions, velocities and accelerations at a time from 0 on, s.
    fn at(&self, time_s: f64) -> [Vec<f64>; 3] {
        self.planned.at(time_s)
    }
}
