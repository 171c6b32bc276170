//! Jerk-limited motion, generated anew whenever the target or the limits change.
//!
//! The method is that of Berscheid and Kröger, "Jerk-limited Real-time Trajectory Generation with
//! Arbitrary Target States" (2021): extremal profiles, the durations that each axis cannot have,
//! the shortest common duration, and then a motion of that duration for every axis. The last step
//! differs: the motion is a mixture of the two extremal profiles of the common duration. As every
//! limit bounds a convex set the mixture keeps it, and no equation is left that could fail.
//!
//! The whole face is [`Input`], [`Output`] and [`Otg::update`]:
//!
//! ```
//! use kinematics::otg::{Input, Limits, Otg, State, Status, Target};
//!
//! let mut otg = Otg::new(State::at_rest([0.0, 0.0, 0.3]));
//! let input = Input {
//!     target: Target::Reach { position: [0.4, -0.1, 0.2], velocity: [0.0; 3] },
//!     limits: Limits { velocity: [0.5; 3], acceleration: [2.0; 3], jerk: [20.0; 3] },
//! };
//! let mut ticks = 0;
//! while otg.update(&input, 0.001).status != Status::Reached {
//!     ticks += 1;
//! }
//! assert_eq!(otg.state().position, [0.4, -0.1, 0.2]);
//! # assert!(ticks > 1000 && ticks < 1200, "{ticks}");
//! ```

mod axis;
mod family;
mod input;
mod profile;
mod trajectory;

pub use input::{Input, LIMIT_MIN, Limits, MAGNITUDE_MAX, Quantity, Refusal, State, Target};
pub use trajectory::{Synchronisation, Trajectory};

/// What a tick yields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<const N: usize> {
    /// The setpoint of this tick.
    pub state: State<N>,
    /// Where the motion stands.
    pub status: Status,
    /// Seconds from this tick to the end of the motion; 0 once it is reached.
    pub remaining_s: f64,
}

/// Where a motion stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// Under way.
    Moving(Synchronisation),
    /// The target state has been reached; a target velocity is kept, so that the position goes on.
    /// After [`Target::Stop`]: at rest.
    Reached,
    /// The input cannot be followed. The axes come to rest within the last accepted limits, or
    /// hold where there have been none.
    Refused(Refusal),
}

/// The generator: an input goes in every tick, a setpoint comes out. A plain value: a copy is a
/// snapshot, and reset is construction.
#[derive(Clone, Debug, PartialEq)]
pub struct Otg<const N: usize> {
    state: State<N>,
    plan: Plan<N>,
    time_s: f64,
}

/// What the generator follows.
#[derive(Clone, Debug, PartialEq)]
enum Plan<const N: usize> {
    /// Nothing has been asked for yet.
    None,
    /// The trajectory to an accepted input.
    Follow {
        input: Input<N>,
        trajectory: Trajectory<N>,
    },
    /// On the way to rest after a refused input, within the limits of `last`.
    Abandon {
        last: Input<N>,
        trajectory: Trajectory<N>,
    },
}

impl<const N: usize> Otg<N> {
    /// A generator whose axes are in `state`.
    #[must_use]
    pub fn new(state: State<N>) -> Self {
        Self {
            state,
            plan: Plan::None,
            time_s: 0.0,
        }
    }

    /// The setpoint of the last tick.
    #[must_use]
    pub fn state(&self) -> State<N> {
        self.state
    }

    /// The motion being followed, if there is one; it began `elapsed` seconds before this tick.
    #[must_use]
    pub fn trajectory(&self) -> Option<(&Trajectory<N>, f64)> {
        match &self.plan {
            Plan::None => None,
            Plan::Follow { trajectory, .. } | Plan::Abandon { trajectory, .. } => {
                Some((trajectory, self.time_s))
            }
        }
    }

    /// Moves on by `dt_s` seconds towards the target of `input`, within its limits.
    ///
    /// With the input of the last tick this samples the planned motion; with a new one it plans
    /// again from the present setpoint first. Bounded work, no allocation, and never NaN: an input
    /// or time step that is not finite and in range is [`Status::Refused`].
    pub fn update(&mut self, input: &Input<N>, dt_s: f64) -> Output<N> {
        let refusal = self.take(input);
        // Not a step in time: the setpoint stays.
        if !(0.0..=DT_MAX_S).contains(&dt_s) {
            return Output {
                state: self.state,
                status: Status::Refused(Refusal::TimeStep),
                remaining_s: self.remaining_s(),
            };
        }
        self.time_s += dt_s;
        let status = match &self.plan {
            Plan::None => Status::Reached,
            Plan::Follow { trajectory, .. } | Plan::Abandon { trajectory, .. } => {
                self.state = trajectory.at(self.time_s);
                if self.time_s >= trajectory.duration_s() {
                    Status::Reached
                } else {
                    Status::Moving(trajectory.synchronisation())
                }
            }
        };
        Output {
            state: self.state,
            status: refusal.map_or(status, Status::Refused),
            remaining_s: self.remaining_s(),
        }
    }

    fn remaining_s(&self) -> f64 {
        self.trajectory()
            .map_or(0.0, |(t, elapsed)| (t.duration_s() - elapsed).max(0.0))
    }

    /// Makes the plan fit the input.
    fn take(&mut self, input: &Input<N>) -> Option<Refusal> {
        if let Plan::Follow {
            input: followed, ..
        } = &self.plan
            && followed == input
        {
            return None;
        }
        match Trajectory::plan(&self.state, input) {
            Ok(trajectory) => {
                self.plan = Plan::Follow {
                    input: *input,
                    trajectory,
                };
                self.time_s = 0.0;
                None
            }
            Err(refusal) => {
                self.abandon();
                Some(refusal)
            }
        }
    }

    fn abandon(&mut self) {
        let plan = match &self.plan {
            Plan::Abandon { .. } => return,
            Plan::None => {
                // No limits to stop within: hold the position.
                let held = State::at_rest(self.state.position);
                Plan::Abandon {
                    last: Input::hold(),
                    trajectory: Trajectory::constant(&held),
                }
            }
            Plan::Follow { input, .. } => {
                let last = Input {
                    target: Target::Stop,
                    ..*input
                };
                match Trajectory::plan(&self.state, &last) {
                    Ok(trajectory) => Plan::Abandon { last, trajectory },
                    Err(_) => Plan::Abandon {
                        last,
                        trajectory: Trajectory::constant(&self.state),
                    },
                }
            }
        };
        self.plan = plan;
        self.time_s = 0.0;
    }
}

/// Longest accepted time step in seconds: a longer pause is not a tick.
pub const DT_MAX_S: f64 = 10.0;

#[cfg(test)]
mod tests;
