//! Chains from URDF files; feature `std`.
//!
//! Reads geometry only: links, joints, their transforms, axes and limits. Meshes are never opened,
//! but their paths are checked, so that a description that points out of its package is refused
//! before something else follows the path.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::vec::Vec;

use crate::chain::{Chain, ChainError, Joint, JointKind, JointLimits};
use crate::rotation::{Matrix3, mat_mul, mat_vec, matrix_from_rpy};
use crate::vector::{Vector3, add};

/// Why a URDF gives no chain. Every text names what is wrong and what to do.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        reason: std::io::Error,
    },
    /// The text is not a URDF.
    #[error("not a URDF: {reason}")]
    Malformed {
        /// The parser's reason.
        reason: String,
    },
    /// No link has this name.
    #[error("there is no link {link:?}; the links are: {known}")]
    NoSuchLink {
        /// The name asked for.
        link: String,
        /// The names there are.
        known: String,
    },
    /// The tip is not below the base.
    #[error(
        "{tip:?} is not moved by joints below {base:?}: name a link nearer to the root as base"
    )]
    NotConnected {
        /// The base link.
        base: String,
        /// The tip link.
        tip: String,
    },
    /// Two joints lead to the same link, or joints form a loop.
    #[error(
        "link {link:?} has more than one parent, or is its own ancestor: a URDF must be a tree"
    )]
    NotATree {
        /// The link.
        link: String,
    },
    /// A joint on the way is of a kind that a chain cannot have.
    #[error("joint {joint:?} is {kind}, which a chain cannot have: take a base beyond it")]
    UnsupportedJoint {
        /// The joint.
        joint: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A joint on the way follows another one.
    #[error(
        "joint {joint:?} mimics {follows:?}: a chain has independent joints only; take a tip before it"
    )]
    MimicJoint {
        /// The joint.
        joint: String,
        /// The one it follows.
        follows: String,
    },
    /// The numbers of a joint cannot be used.
    #[error("joint {joint:?}: {reason}")]
    Joint {
        /// The joint, or the tip link for what follows the last joint.
        joint: String,
        /// What is wrong with it.
        reason: ChainError,
    },
    /// The chain has another number of joints than asked for.
    #[error("the chain from {base:?} to {tip:?} has {found} joints, not {wanted}")]
    JointCount {
        /// The base link.
        base: String,
        /// The tip link.
        tip: String,
        /// How many joints it has.
        found: usize,
        /// How many were asked for.
        wanted: usize,
    },
    /// A mesh or texture path leads out of its package.
    #[error("link {link:?}: the path {path:?} leads out of its package; keep files inside it")]
    PathEscapes {
        /// The link.
        link: String,
        /// The path.
        path: String,
    },
}

/// A serial part of a robot, fixed joints folded, with the names of what moves.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfChain {
    /// The base link.
    pub base: String,
    /// The tip link.
    pub tip: String,
    /// Names of the joints in order.
    pub joint_names: Vec<String>,
    /// The joints in order. A limit of 0 on the speed, which many files carry where none is
    /// known, counts as no limit.
    pub joints: Vec<Joint>,
    tip_rotation: Matrix3,
    tip_translation: Vector3,
}

impl UrdfChain {
    /// Reads the chain from link `base` to link `tip` from a file.
    ///
    /// # Errors
    /// See [`UrdfError`].
    pub fn read(path: &Path, base: &str, tip: &str) -> Result<Self, UrdfError> {
        let text = std::fs::read_to_string(path).map_err(|reason| UrdfError::Read {
            path: path.to_path_buf(),
            reason,
        })?;
        Self::parse(&text, base, tip)
    }

    /// Reads the chain from link `base` to link `tip` from the text of a URDF.
    ///
    /// # Errors
    /// See [`UrdfError`].
    pub fn parse(text: &str, base: &str, tip: &str) -> Result<Self, UrdfError> {
        let robot = urdf_rs::read_from_string(text).map_err(|reason| UrdfError::Malformed {
            reason: reason.to_string(),
        })?;
        check_paths(&robot)?;
        for link in [base, tip] {
            if !robot.links.iter().any(|l| l.name == link) {
                let known: Vec<&str> = robot.links.iter().map(|l| l.name.as_str()).collect();
                let link = link.to_string();
                return Err(UrdfError::NoSuchLink {
                    link,
                    known: known.join(", "),
                });
            }
        }
        let way = way(&robot, base, tip)?;
        Self::fold(&way, base, tip)
    }

    /// The chain with its number of joints.
    ///
    /// # Errors
    /// [`UrdfError::JointCount`] where it has another number of joints, [`UrdfError::Joint`]
    /// where the numbers of one cannot be used.
    pub fn to_chain<const N: usize>(&self) -> Result<Chain<N>, UrdfError> {
        let joints: &[Joint; N] =
            self.joints
                .as_slice()
                .try_into()
                .map_err(|_| UrdfError::JointCount {
                    base: self.base.clone(),
                    tip: self.tip.clone(),
                    found: self.joints.len(),
                    wanted: N,
                })?;
        Chain::new(joints, &self.tip_rotation, self.tip_translation).map_err(|reason| {
            let (ChainError::Axis { joint }
            | ChainError::Transform { joint }
            | ChainError::Limits { joint }) = reason;
            let name = self.joint_names.get(joint).unwrap_or(&self.tip);
            UrdfError::Joint {
                joint: name.clone(),
                reason,
            }
        })
    }

    /// Folds fixed joints into the transforms of those that move.
    fn fold(way: &[&urdf_rs::Joint], base: &str, tip: &str) -> Result<Self, UrdfError> {
        let mut chain = Self {
            base: base.to_string(),
            tip: tip.to_string(),
            joint_names: Vec::new(),
            joints: Vec::new(),
            tip_rotation: crate::rotation::IDENTITY3,
            tip_translation: [0.0; 3],
        };
        for joint in way {
            let [roll, pitch, yaw] = *joint.origin.rpy;
            let xyz = *joint.origin.xyz;
            let rotation = mat_mul(&chain.tip_rotation, &matrix_from_rpy(roll, pitch, yaw));
            let translation = add(chain.tip_translation, mat_vec(&chain.tip_rotation, xyz));
            (chain.tip_rotation, chain.tip_translation) = (rotation, translation);
            let Some(kind) = moving_kind(joint)? else {
                continue;
            };
            chain.joint_names.push(joint.name.clone());
            chain.joints.push(Joint {
                rotation,
                translation,
                axis: *joint.axis.xyz,
                kind,
                limits: limits(joint),
            });
            (chain.tip_rotation, chain.tip_translation) = (crate::rotation::IDENTITY3, [0.0; 3]);
        }
        Ok(chain)
    }
}

/// The joints from `base` to `tip`, in order.
fn way<'a>(
    robot: &'a urdf_rs::Robot,
    base: &str,
    tip: &str,
) -> Result<Vec<&'a urdf_rs::Joint>, UrdfError> {
    let mut parents: HashMap<&str, &urdf_rs::Joint> = HashMap::new();
    for joint in &robot.joints {
        if parents.insert(&joint.child.link, joint).is_some() {
            return Err(UrdfError::NotATree {
                link: joint.child.link.clone(),
            });
        }
    }
    let mut way = Vec::new();
    let mut link = tip;
    while link != base {
        let Some(joint) = parents.get(link) else {
            return Err(UrdfError::NotConnected {
                base: base.to_string(),
                tip: tip.to_string(),
            });
        };
        // More steps than joints: the way leads in a circle.
        if way.len() >= robot.joints.len() {
            return Err(UrdfError::NotATree {
                link: link.to_string(),
            });
        }
        way.push(*joint);
        link = &joint.parent.link;
    }
    way.reverse();
    Ok(way)
}

fn moving_kind(joint: &urdf_rs::Joint) -> Result<Option<JointKind>, UrdfError> {
    let unsupported = |kind| {
        Err(UrdfError::UnsupportedJoint {
            joint: joint.name.clone(),
            kind,
        })
    };
    let kind = match joint.joint_type {
        urdf_rs::JointType::Fixed => return Ok(None),
        urdf_rs::JointType::Revolute | urdf_rs::JointType::Continuous => JointKind::Revolute,
        urdf_rs::JointType::Prismatic => JointKind::Prismatic,
        urdf_rs::JointType::Floating => return unsupported("floating"),
        urdf_rs::JointType::Planar => return unsupported("planar"),
        urdf_rs::JointType::Spherical => return unsupported("spherical"),
    };
    match &joint.mimic {
        Some(mimic) => Err(UrdfError::MimicJoint {
            joint: joint.name.clone(),
            follows: mimic.joint.clone(),
        }),
        None => Ok(Some(kind)),
    }
}

fn limits(joint: &urdf_rs::Joint) -> JointLimits {
    let urdf_rs::JointLimit {
        lower,
        upper,
        velocity,
        ..
    } = joint.limit;
    let velocity = if velocity == 0.0 {
        f64::INFINITY
    } else {
        velocity
    };
    if joint.joint_type == urdf_rs::JointType::Continuous {
        JointLimits {
            velocity,
            ..JointLimits::NONE
        }
    } else {
        JointLimits {
            lower,
            upper,
            velocity,
        }
    }
}

/// Refuses mesh paths that lead out of their package.
fn check_paths(robot: &urdf_rs::Robot) -> Result<(), UrdfError> {
    for link in &robot.links {
        let shapes = link.visual.iter().map(|v| &v.geometry);
        for shape in shapes.chain(link.collision.iter().map(|c| &c.geometry)) {
            if let urdf_rs::Geometry::Mesh { filename, .. } = shape
                && escapes(filename)
            {
                let (link, path) = (link.name.clone(), filename.clone());
                return Err(UrdfError::PathEscapes { link, path });
            }
        }
    }
    Ok(())
}

/// Whether `..` leads above the start: above the package's folder for `package://`, above the
/// folder of the URDF for a relative path.
fn escapes(path: &str) -> bool {
    let (inside, floor) = match path.split_once("://") {
        Some((_, rest)) => (rest, 1),
        None => (path, 0),
    };
    let mut depth = 0_i64;
    for part in inside.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                depth -= 1;
                if depth < floor {
                    return true;
                }
            }
            _ => depth += 1,
        }
    }
    false
}

#[cfg(test)]
mod tests;
