//! `fitmac fk`.

use serde::{Deserialize, Serialize};

use super::arm::{self, ArmArgs, JacobianFrame};
use crate::exit::Exit;

/// Arguments of `fk`.
#[derive(clap::Args)]
#[command(
    after_help = "Reads a line {\"q\": [..]} (rad, m) for each configuration, writes
{\"position\": [3], \"rotation\": [9, row-major], \"jacobian\": [6 rows]} for each: the tip in the
base link's frame; the Jacobian's rows are linear (m/s), then angular velocity (rad/s).

Examples:
  echo '{\"q\": [0, -0.785, 0, -2.356, 0, 1.571, 0.785]}' | fitmac fk
  fitmac fk --urdf ur5.urdf --base base_link --tip tool0 < q.jsonl
  fitmac fk --urdf arm.urdf --base base --tip hand --jacobian body < q.jsonl"
)]
pub(crate) struct Args {
    #[command(flatten)]
    arm: ArmArgs,
    /// What the Jacobian refers to.
    #[arg(long, value_enum, default_value_t = JacobianFrame::Base)]
    jacobian: JacobianFrame,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    q: Vec<f64>,
}

#[derive(Serialize)]
struct Reply {
    position: [f64; 3],
    rotation: [f64; 9],
    jacobian: Vec<Vec<f64>>,
}

/// Answers every line.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let arm = arm::load(&args.arm)?;
    arm::answer_lines(|question: Question| {
        let forward = arm.solve(&question.q, args.jacobian)?;
        Ok(Reply {
            position: forward.position,
            rotation: forward.rotation,
            jacobian: forward.jacobian,
        })
    })?;
    Ok(Exit::Done)
}
