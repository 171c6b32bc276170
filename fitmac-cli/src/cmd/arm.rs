//! What `fk` and `ik` share: an arm of any number of joints, and JSON lines in and out.

use std::io::{BufRead, BufWriter, Write};
use std::path::PathBuf;

use anyhow::Context;
use kinematics::arm::Arm;
use kinematics::chain::{Chain, Solution};
use kinematics::panda::Panda;
use kinematics::pose::Pose;
use kinematics::pose_ik::{self, Answer, Candidate, Search};
use kinematics::urdf::UrdfChain;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::exit::BadInput;

/// Which arm.
#[derive(clap::Args)]
pub(crate) struct ArmArgs {
    /// The arm's URDF; without it the Panda, from panda_link0 to panda_hand_tcp.
    #[arg(long, value_name = "FILE", requires = "base", requires = "tip")]
    urdf: Option<PathBuf>,
    /// Link in whose frame everything is given.
    #[arg(long, value_name = "LINK", requires = "urdf")]
    base: Option<String>,
    /// Link whose frame is the tip.
    #[arg(long, value_name = "LINK", requires = "urdf")]
    tip: Option<String>,
}

/// An answer of [`AnyArm::solve`]: rotation, position, and the Jacobian's rows.
pub(crate) struct Forward {
    pub(crate) position: [f64; 3],
    pub(crate) rotation: [f64; 9],
    pub(crate) jacobian: Vec<Vec<f64>>,
}

/// What the Jacobian refers to.
#[derive(Clone, Copy, clap::ValueEnum)]
pub(crate) enum JacobianFrame {
    /// Axes of the base, reference point at the tip.
    Base,
    /// Axes of the tip, reference point at the tip.
    Body,
    /// Axes of the base, reference point at the base's origin.
    Spatial,
}

/// An arm of any number of joints.
pub(crate) trait AnyArm {
    /// Middles of the joint ranges.
    fn middle(&self) -> Vec<f64>;
    fn solve(&self, q: &[f64], frame: JacobianFrame) -> Result<Forward, BadInput>;
    fn invert(&self, target: &Pose, seed: &[f64], search: &Search) -> Result<Answered, BadInput>;
}

/// An answer of [`AnyArm::invert`].
pub(crate) enum Answered {
    Reached(Found),
    NotReached(Found),
    OutOfReach,
}

pub(crate) struct Found {
    pub(crate) q: Vec<f64>,
    pub(crate) position_error: f64,
    pub(crate) rotation_error: f64,
    pub(crate) steps: u32,
}

/// The arm of these arguments.
pub(crate) fn load(args: &ArmArgs) -> anyhow::Result<Box<dyn AnyArm>> {
    let (Some(urdf), Some(base), Some(tip)) = (&args.urdf, &args.base, &args.tip) else {
        return Ok(Box::new(OfSize::<_, 7>(Panda)));
    };
    let bad = |error: kinematics::urdf::UrdfError| BadInput(error.to_string());
    let chain = UrdfChain::read(urdf, base, tip).map_err(bad)?;
    macro_rules! with_joints {
        ($($n:literal)*) => {
            match chain.joints.len() {
                $($n => Box::new(OfSize::<Chain<$n>, $n>(chain.to_chain().map_err(bad)?)),)*
                n => return Err(BadInput(format!(
                    "{}: {n} joints between {base:?} and {tip:?}; from 1 to 12 can be computed with",
                    urdf.display()
                )).into()),
            }
        };
    }
    Ok(with_joints!(1 2 3 4 5 6 7 8 9 10 11 12))
}

struct OfSize<A, const N: usize>(A);

fn coordinates<const N: usize>(name: &str, q: &[f64]) -> Result<[f64; N], BadInput> {
    q.try_into().map_err(|_| {
        BadInput(format!(
            "{name}: {} numbers, but the arm has {N} joints",
            q.len()
        ))
    })
}

impl<A: Arm<N>, const N: usize> AnyArm for OfSize<A, N> {
    fn middle(&self) -> Vec<f64> {
        self.0.limits().iter().map(|limit| limit.middle()).collect()
    }

    fn solve(&self, q: &[f64], frame: JacobianFrame) -> Result<Forward, BadInput> {
        let q = coordinates("q", q)?;
        let Solution { tip, jacobian } =
            self.0.solve(&q).map_err(|e| BadInput(format!("q: {e}")))?;
        let jacobian = match frame {
            JacobianFrame::Base => jacobian,
            JacobianFrame::Body => jacobian.in_body(&tip.rotation),
            JacobianFrame::Spatial => jacobian.at_base_origin(tip.position),
        };
        let [a, b, c] = tip.rotation;
        Ok(Forward {
            position: tip.position,
            rotation: [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]],
            jacobian: jacobian.rows().iter().map(|row| row.to_vec()).collect(),
        })
    }

    fn invert(&self, target: &Pose, seed: &[f64], search: &Search) -> Result<Answered, BadInput> {
        let seed = coordinates("seed", seed)?;
        let found = |candidate: Candidate<N>| Found {
            q: candidate.q.to_vec(),
            position_error: candidate.position_error_m,
            rotation_error: candidate.rotation_error_rad,
            steps: candidate.steps,
        };
        let answer = pose_ik::solve(&self.0, target, &seed, search);
        Ok(match answer.map_err(|e| BadInput(e.to_string()))? {
            Answer::Reached(candidate) => Answered::Reached(found(candidate)),
            Answer::NotReached(candidate) => Answered::NotReached(found(candidate)),
            Answer::OutOfReach => Answered::OutOfReach,
        })
    }
}

/// Answers every line of JSON on standard input with one on standard output; empty lines are
/// skipped. The first line that cannot be answered ends it, by number and reason.
pub(crate) fn answer_lines<Question: DeserializeOwned, Reply: Serialize>(
    mut answer: impl FnMut(Question) -> Result<Reply, BadInput>,
) -> anyhow::Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    for (index, line) in std::io::stdin().lock().lines().enumerate() {
        let number = index + 1;
        let line = line.with_context(|| BadInput(format!("line {number} cannot be read")))?;
        if line.trim().is_empty() {
            continue;
        }
        let reply = serde_json::from_str(&line)
            .map_err(|error| BadInput(error.to_string()))
            .and_then(&mut answer)
            .map_err(|error| BadInput(format!("line {number}: {error}")));
        let reply = match reply {
            Ok(reply) => reply,
            Err(error) => {
                out.flush()?;
                return Err(error.into());
            }
        };
        let written = serde_json::to_writer(&mut out, &reply)
            .map_err(std::io::Error::from)
            .and_then(|()| out.write_all(b"\n"));
        match written {
            // The reader has had enough: `| head`.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
            other => other?,
        }
    }
    match out.flush() {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}
