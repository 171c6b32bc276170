//! The lock: which instance is the target, how sure we are, and whether what
//! is seen still agrees (`g_t`, `kappa_t` and `Inconsistent` of equation 7).
//!
//! The lock moves in one place only, `Lock::commit`, which the controller
//! calls in a query whose route is target correction.

use kinematics::vector::{self, Vector3};

use crate::{
    evidence,
    intake::{age_ns, confidence, ms_to_ns, robot},
    message::{Candidate, GroundingRecord, ObjectId, StateSample},
    params::{Gripper, Lock as LockParams},
    wire::{DestinationKind, PlaceRelation, Provenance},
};

/// Where the object shall go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Destination {
    /// None was resolved.
    Unresolved,
    /// Only a relation describes it: the base policy places.
    Relational,
    /// A region of an object.
    Direct(Anchor),
}

/// A destination that geometry alone can reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// The object that carries the region.
    pub object: ObjectId,
    /// On it or in it.
    pub relation: PlaceRelation,
    /// Centre of the region in the object's frame, m.
    pub offset_m: [f64; 3],
    /// Half extent of the region, m.
    pub half_extent_m: [f64; 3],
}

/// A committed binding of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    /// The locked instance.
    pub target: ObjectId,
    /// The prompt that names it to the policy.
    pub prompt_id: u32,
    /// Where it shall go.
    pub destination: Destination,
    /// A model or a second look chose it, not the first rule.
    pub confirmed: bool,
    confidence: f64,
    compatible: bool,
}

/// Where the hand and the locked target were in one sample, base frame, m.
#[derive(Clone, Copy)]
pub(crate) struct Sighting {
    hand_m: Vector3,
    target_m: Vector3,
}

/// The lock on the target.
#[derive(Clone, Debug, PartialEq)]
pub struct Lock {
    epoch: u64,
    binding: Option<Binding>,
    flaps: u32,
    jumped: bool,
}

impl Lock {
    /// No target yet; epochs go on from `epoch`.
    pub(crate) const fn open(epoch: u64) -> Self {
        Self {
            epoch,
            binding: None,
            flaps: 0,
            jumped: false,
        }
    }

    /// The committed epoch.
    #[must_use]
    pub const fn epoch(&self) -> u64 {
        self.epoch
    }

    /// The committed binding.
    #[must_use]
    pub const fn binding(&self) -> Option<&Binding> {
        self.binding.as_ref()
    }

    /// The locked instance, 0 if none.
    #[must_use]
    pub fn target(&self) -> ObjectId {
        self.binding.map_or(0, |b| b.target)
    }

    /// The destination's anchor, if it is direct.
    #[must_use]
    pub fn anchor(&self) -> Option<&Anchor> {
        match self.binding.as_ref().map(|b| &b.destination) {
            Some(Destination::Direct(anchor)) => Some(anchor),
            _ => None,
        }
    }

    /// Commits a proposal. One without a target leaves the lock open, but its
    /// epoch counts.
    pub(crate) fn commit(&mut self, record: &GroundingRecord) {
        let provenance = Provenance::try_from(record.provenance);
        *self = Self {
            epoch: record.epoch,
            binding: (record.target != 0).then(|| Binding {
                target: record.target,
                prompt_id: record.prompt_id,
                destination: destination(record),
                confirmed: matches!(provenance, Ok(Provenance::Resolver | Provenance::Recheck)),
                confidence: confidence(record.confidence),
                compatible: compatible(record, record.target),
            }),
            flaps: 0,
            jumped: false,
        };
    }

    /// Fresh evidence of the committed epoch. A record that names another
    /// target does not move the lock; it counts as a flap.
    pub(crate) fn observe(&mut self, record: &GroundingRecord) {
        let Some(binding) = &mut self.binding else {
            return;
        };
        if record.target == binding.target {
            binding.confidence = confidence(record.confidence);
            binding.compatible = compatible(record, binding.target);
        } else {
            self.flaps = self.flaps.saturating_add(1);
            binding.compatible = compatible(record, binding.target);
        }
    }

    /// Notes a jump of the locked pose between two samples, with no gripper
    /// near that could have caused it.
    pub(crate) fn watch(
        &mut self,
        params: &LockParams,
        gripper: &Gripper,
        before: Option<Sighting>,
        after: Option<Sighting>,
    ) {
        let (Some(a), Some(b)) = (before, after) else {
            return;
        };
        let far = |s: &Sighting| vector::distance(s.hand_m, s.target_m) > gripper.held_radius_m;
        if vector::distance(a.target_m, b.target_m) > params.jump_m && far(&a) && far(&b) {
            self.jumped = true;
        }
    }

    /// Where the target is in `sample`, if it is there.
    pub(crate) fn sighting(&self, sample: &StateSample) -> Option<Sighting> {
        let object = robot::object(sample, self.target())?;
        Some(Sighting {
            hand_m: sample.ee_position_m,
            target_m: object.position_m,
        })
    }

    /// Confidence kappa of the binding at `now_ns`: 0 without a lock, and 0 if
    /// the target was not seen lately, unless it is `carried`.
    #[must_use]
    pub fn kappa(
        &self,
        params: &LockParams,
        now_ns: u64,
        sample: Option<&StateSample>,
        carried: bool,
    ) -> f64 {
        let Some(binding) = &self.binding else {
            return 0.0;
        };
        let seen = sample.and_then(|s| robot::object(s, binding.target));
        match seen {
            _ if carried => binding.confidence,
            Some(o) if age_ns(now_ns, o.stamp_ns) <= ms_to_ns(params.pose_lost_ms) => {
                binding.confidence
            }
            _ => 0.0,
        }
    }

    /// Evidence bits that speak against the binding.
    #[must_use]
    pub fn evidence(&self, params: &LockParams, kappa: f64) -> u64 {
        let Some(binding) = &self.binding else {
            return evidence::NO_LOCK;
        };
        let mut bits = 0;
        let mut note = |holds: bool, bit: u64| bits |= if holds { bit } else { 0 };
        note(kappa < params.kappa_min, evidence::KAPPA_LOW);
        note(!binding.compatible, evidence::LOCK_INCOMPATIBLE);
        note(self.jumped, evidence::LOCK_JUMPED);
        note(self.flaps >= params.flaps, evidence::FLAPPING);
        bits
    }
}

fn compatible(record: &GroundingRecord, target: ObjectId) -> bool {
    in_use(record).any(|c| c.id == target && c.compatible == 1)
}

fn in_use(record: &GroundingRecord) -> impl Iterator<Item = &Candidate> {
    record
        .candidates
        .iter()
        .take(usize::from(record.candidate_count))
}

fn destination(record: &GroundingRecord) -> Destination {
    let relation = PlaceRelation::try_from(record.relation);
    match (DestinationKind::try_from(record.destination_kind), relation) {
        (Ok(DestinationKind::Direct), Ok(relation)) if record.destination != 0 => {
            Destination::Direct(Anchor {
                object: record.destination,
                relation,
                offset_m: record.region_offset_m,
                half_extent_m: record.region_half_extent_m,
            })
        }
        (Ok(DestinationKind::Relational), _) => Destination::Relational,
        _ => Destination::Unresolved,
    }
}

/// The geometrically closest of `candidates` to the end effector (equation 4):
/// horizontal distance plus `lambda_z` times the height difference. Only
/// candidates that fit the instruction count; ties go to the lowest id; one
/// without a finite pose is left out.
///
/// It ranks; it never moves a lock by itself, for the nearest candidate is
/// also the one that a policy on its way to the wrong target approaches.
#[must_use]
pub fn closest_candidate(
    params: &LockParams,
    sample: &StateSample,
    candidates: &[Candidate],
) -> Option<ObjectId> {
    let mut best: Option<(f64, ObjectId)> = None;
    for candidate in candidates.iter().filter(|c| c.compatible == 1) {
        let Some(object) = robot::object(sample, candidate.id) else {
            continue;
        };
        let score = geometric_score(params, sample.ee_position_m, object.position_m);
        let better = match best {
            None => score.is_finite(),
            Some((s, id)) => score < s || (score == s && candidate.id < id),
        };
        if better {
            best = Some((score, candidate.id));
        }
    }
    best.map(|(_, id)| id)
}

/// `S_t(c)` of equation 4, m.
#[must_use]
pub fn geometric_score(params: &LockParams, ee_m: [f64; 3], candidate_m: [f64; 3]) -> f64 {
    let [dx, dy, dz] = vector::sub(candidate_m, ee_m);
    vector::norm([dx, dy, 0.0]) + params.lambda_z * dz.abs()
}

#[cfg(test)]
mod tests;
