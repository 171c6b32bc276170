//! `fitmac otg`.

use kinematics::otg::{Input, Limits, State, Synchronisation, Target, Trajectory};
use serde::{Deserialize, Serialize};

use super::arm::answer_lines;
use crate::exit::{BadInput, Exit};

/// Arguments of `otg`.
#[derive(clap::Args)]
#[command(after_help = "Reads a line for each motion, of 1 to 12 axes:
{\"current\": {\"position\": [..], \"velocity\": [..], \"acceleration\": [..]},
 \"target\": {\"position\": [..], \"velocity\": [..]},
 \"limits\": {\"velocity\": [..], \"acceleration\": [..], \"jerk\": [..]}}
Velocities and accelerations are 0 where they are left out. Writes {\"duration\": s,
\"synchronised\": true, \"samples\": [{\"time\": s, \"position\": [..], \"velocity\": [..],
\"acceleration\": [..]}, ..]} for each; the last sample is the end.

Examples:
  echo '{\"current\": {\"position\": [0]}, \"target\": {\"position\": [1]}, \"limits\":
    {\"velocity\": [1], \"acceleration\": [2], \"jerk\": [10]}}' | tr -d '\\n' | fitmac otg --step 0.1
  fitmac otg --step 0.001 < motions.jsonl > samples.jsonl")]
pub(crate) struct Args {
    /// Time between samples in seconds.
    #[arg(long, default_value_t = 0.001, value_name = "SECONDS")]
    step: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    current: Kinematic,
    target: KinematicTarget,
    limits: AxisLimits,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Kinematic {
    position: Vec<f64>,
    velocity: Option<Vec<f64>>,
    acceleration: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KinematicTarget {
    position: Vec<f64>,
    velocity: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisLimits {
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    jerk: Vec<f64>,
}

#[derive(Serialize)]
struct Reply {
    duration: f64,
    synchronised: bool,
    samples: Vec<Sample>,
}

#[derive(Serialize)]
struct Sample {
    time: f64,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
}

/// Most samples of one motion.
const SAMPLES_MAX: f64 = 1e6;

/// Answers every line.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    if !(args.step > 0.0 && args.step.is_finite()) {
        return Err(BadInput("--step: give a positive time in seconds".into()).into());
    }
    answer_lines(|question: Question| dispatch(&question, args.step))?;
    Ok(Exit::Done)
}

fn dispatch(question: &Question, step: f64) -> Result<Reply, BadInput> {
    macro_rules! with_axes {
        ($($n:literal)*) => {
            match question.current.position.len() {
                $($n => plan::<$n>(question, step),)*
                n => Err(BadInput(format!("current.position: {n} axes; from 1 to 12 can be planned"))),
            }
        };
    }
    with_axes!(1 2 3 4 5 6 7 8 9 10 11 12)
}

fn axes<const N: usize>(name: &str, values: &[f64]) -> Result<[f64; N], BadInput> {
    values.try_into().map_err(|_| {
        BadInput(format!(
            "{name}: {} numbers, but current.position has {N}",
            values.len()
        ))
    })
}

fn or_zero<const N: usize>(name: &str, values: Option<&Vec<f64>>) -> Result<[f64; N], BadInput> {
    values.map_or(Ok([0.0; N]), |values| axes(name, values))
}

fn plan<const N: usize>(question: &Question, step: f64) -> Result<Reply, BadInput> {
    let Question {
        current,
        target,
        limits,
    } = question;
    let state = State::<N> {
        position: axes("current.position", &current.position)?,
        velocity: or_zero("current.velocity", current.velocity.as_ref())?,
        acceleration: or_zero("current.acceleration", current.acceleration.as_ref())?,
    };
    let input = Input {
        target: Target::Reach {
            position: axes("target.position", &target.position)?,
            velocity: or_zero("target.velocity", target.velocity.as_ref())?,
        },
        limits: Limits {
            velocity: axes("limits.velocity", &limits.velocity)?,
            acceleration: axes("limits.acceleration", &limits.acceleration)?,
            jerk: axes("limits.jerk", &limits.jerk)?,
        },
    };
    let motion = Trajectory::plan(&state, &input).map_err(|e| BadInput(e.to_string()))?;
    let duration = motion.duration_s();
    if duration / step > SAMPLES_MAX {
        return Err(BadInput(format!(
            "{duration} s in steps of {step} s are more than a million samples: take a longer --step"
        )));
    }
    let mut times: Vec<f64> = (0..)
        .map(|k| f64::from(k) * step)
        .take_while(|t| *t < duration)
        .collect();
    times.push(duration);
    let sample = |time: f64| {
        let State {
            position,
            velocity,
            acceleration,
        } = motion.at(time);
        Sample {
            time,
            position: position.to_vec(),
            velocity: velocity.to_vec(),
            acceleration: acceleration.to_vec(),
        }
    };
    Ok(Reply {
        duration,
        synchronised: motion.synchronisation() == Synchronisation::Time,
        samples: times.into_iter().map(sample).collect(),
    })
}
