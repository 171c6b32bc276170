//! `fitmac ik`.

use kinematics::pose::Pose;
use kinematics::pose_ik::Search;
use kinematics::rotation::UnitQuaternion;
use serde::{Deserialize, Serialize};

use super::arm::{self, Answered, ArmArgs, Found};
use crate::exit::{BadInput, Exit};

/// Arguments of `ik`.
#[derive(clap::Args)]
#[command(
    after_help = "Reads a line {\"position\": [3], \"rotation\": [9, row-major]} for each target,
or \"quaternion\": [w, x, y, z] in place of \"rotation\"; \"seed\": [..] says where to search from
(default: the middle of the joint ranges). Writes {\"status\": \"reached\", \"q\": [..],
\"position_error\": m, \"rotation_error\": rad, \"steps\": n} for each, with status
\"not_reached\" for the nearest that was found, or {\"status\": \"out_of_reach\"}.

Examples:
  echo '{\"position\": [0.5, 0, 0.4], \"quaternion\": [0, 1, 0, 0]}' | fitmac ik
  fitmac ik --urdf ur5.urdf --base base_link --tip tool0 < poses.jsonl"
)]
pub(crate) struct Args {
    #[command(flatten)]
    arm: ArmArgs,
    /// Accepted distance in metres and angle in radians.
    #[arg(long, default_value_t = 1e-6, value_name = "NUMBER")]
    tolerance: f64,
    /// Further starts where the search from the seed gets stuck.
    #[arg(long, default_value_t = Search::default().restarts, value_name = "COUNT")]
    restarts: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Question {
    position: [f64; 3],
    rotation: Option<[f64; 9]>,
    quaternion: Option<[f64; 4]>,
    seed: Option<Vec<f64>>,
}

#[derive(Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
enum Reply {
    Reached(Solution),
    NotReached(Solution),
    OutOfReach,
}

#[derive(Serialize)]
struct Solution {
    q: Vec<f64>,
    position_error: f64,
    rotation_error: f64,
    steps: u32,
}

impl From<Found> for Solution {
    fn from(found: Found) -> Self {
        let Found {
            q,
            position_error,
            rotation_error,
            steps,
        } = found;
        Self {
            q,
            position_error,
            rotation_error,
            steps,
        }
    }
}

/// Answers every line.
pub(crate) fn run(args: &Args) -> anyhow::Result<Exit> {
    let arm = arm::load(&args.arm)?;
    let search = Search {
        restarts: args.restarts,
        position_tolerance_m: args.tolerance,
        rotation_tolerance_rad: args.tolerance,
        ..Search::default()
    };
    arm::answer_lines(|question: Question| {
        let target = Pose::new(question.position, orientation(&question)?);
        let seed = question.seed.unwrap_or_else(|| arm.middle());
        Ok(match arm.invert(&target, &seed, &search)? {
            Answered::Reached(found) => Reply::Reached(found.into()),
            Answered::NotReached(found) => Reply::NotReached(found.into()),
            Answered::OutOfReach => Reply::OutOfReach,
        })
    })?;
    Ok(Exit::Done)
}

fn orientation(question: &Question) -> Result<UnitQuaternion, BadInput> {
    match (question.rotation, question.quaternion) {
        (Some([a, b, c, d, e, f, g, h, i]), None) => {
            UnitQuaternion::from_matrix(&[[a, b, c], [d, e, f], [g, h, i]])
                .ok_or_else(|| BadInput("rotation: not a rotation matrix within 1e-6".into()))
        }
        (None, Some(wxyz)) => UnitQuaternion::from_wxyz(wxyz)
            .ok_or_else(|| BadInput("quaternion: not finite, or of length 0".into())),
        _ => Err(BadInput(
            "give either \"rotation\" or \"quaternion\"".into(),
        )),
    }
}
