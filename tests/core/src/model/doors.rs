//! The doors: which messages are believed.

use fitmac_core::{
    intake::Refusal,
    message::{
        ActionChunk, CANDIDATE_CAPACITY, CHUNK_CAPACITY, CriticReport, GroundingRecord,
        OBJECT_CAPACITY, Plan, PolicyQuery, StateSample, VerifierReport,
    },
    params::{OutOfRange, Params, PolicyGripper},
    wire::{CriticLabel, DestinationKind, GraspClass, PlaceRelation, Provenance, Verdict},
};

use super::space::{Point, apart};

pub(super) fn ms(n: u32) -> u64 {
    u64::from(n) * 1_000_000
}

/// `a` comes after `b` on the circle of all numbers.
fn after(a: u64, b: u64) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}

/// The first refusal whose condition holds.
fn first(rules: &[(bool, Refusal)]) -> Result<(), Refusal> {
    let found = rules.iter().find(|(holds, _)| *holds);
    found.map_or(Ok(()), |(_, refusal)| Err(*refusal))
}

/// A question to the policy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question {
    pub(super) query: PolicyQuery,
    pub(super) played: u64,
    pub(super) first: u64,
    pub(super) last: u64,
}

/// Everything that came through, and what guards the doors.
#[derive(Clone, Debug, Default)]
pub(super) struct Doors {
    pub(super) state: Option<StateSample>,
    numbered: Option<(u64, u64)>,
    jumps: Vec<u64>,
    /// Every number of an applied command, with the time of its first report.
    applied: Vec<(u64, u64)>,
    grounding_session: Option<u64>,
    grounding_number: u64,
    pub(super) proposal: Option<GroundingRecord>,
    pub(super) plan: Option<Plan>,
    pub(super) verdict: Option<Verdict>,
    verifier_number: Option<u64>,
    critic: Option<(CriticLabel, f64)>,
    critic_number: Option<u64>,
    chunk_session: Option<u64>,
    chunk_number: u64,
    heard: Option<(u64, u64)>,
    pub(super) question: Option<Question>,
    /// A chunk is at hand; its question was asked after so many actions.
    pub(super) ready: Option<u64>,
    chunks: Vec<Vec<[f32; 7]>>,
    fresh_from: usize,
    pub(super) broken_in_a_row: u32,
    pub(super) refused: [u32; Refusal::ALL.len()],
}

/// What became of a state sample.
pub(super) enum Came {
    Nothing,
    /// It goes on from this one.
    On(Box<StateSample>),
    /// No difference may span it.
    Leap,
}

impl Doors {
    pub(super) fn count(&mut self, refusal: Refusal) {
        self.refused[refusal as usize] += 1;
    }

    pub(super) fn episode(&mut self) {
        self.verdict = None;
        self.critic = None;
        self.numbered = None;
        if self.proposal.is_some_and(|r| r.subtask != 0) {
            self.proposal = None;
        }
        self.grounding_session = None;
        (self.question, self.ready, self.chunk_session) = (None, None, None);
        self.broken_in_a_row = 0;
        self.fresh_from = self.chunks.len();
    }

    /// A plan; true if it begins another episode.
    pub(super) fn hear_plan(&mut self, plan: &Plan) -> Result<bool, Refusal> {
        let sound = (1..=8).contains(&plan.subtask_count) && plan.confidence_permille <= 1000;
        first(&[(!sound, Refusal::BadPlan)])?;
        let before = self.plan.replace(*plan);
        Ok(before.is_some_and(|b| b.id != plan.id))
    }

    pub(super) fn hear_state(
        &mut self,
        p: &Params,
        now: u64,
        sample: &StateSample,
    ) -> Result<Came, Refusal> {
        let known = self
            .numbered
            .filter(|(session, _)| *session == sample.session);
        if let Some((_, last)) = known {
            if sample.sequence == last || self.jumps.last() == Some(&sample.sequence) {
                return Ok(Came::Nothing);
            }
            first(&[(!after(sample.sequence, last), Refusal::Sequence)])?;
        }
        sound_state(p, now, sample)?;
        let leapt = known.is_some()
            && self.state.is_some_and(|last| {
                let seconds = sample.stamp_ns.saturating_sub(last.stamp_ns) as f64 * 1e-9;
                let reach = p.state.jump_margin_m + p.state.jump_speed_m_s * seconds;
                apart(last.ee_position_m, sample.ee_position_m) > reach
            });
        if leapt && self.jumps.len() < p.state.jump_samples as usize {
            self.jumps.push(sample.sequence);
            return Err(Refusal::Jump);
        }
        self.jumps.clear();
        self.numbered = Some((sample.session, sample.sequence));
        let before = self.state.replace(*sample);
        if self
            .applied
            .last()
            .is_none_or(|(n, _)| *n != sample.applied_command)
        {
            self.applied.push((sample.applied_command, now));
        }
        Ok(if leapt || known.is_none() {
            Came::Leap
        } else {
            Came::On(Box::new(before.unwrap_or(*sample)))
        })
    }

    /// For how long the robot has applied nothing new.
    pub(super) fn unapplied(&self, now: u64) -> u64 {
        let last = self.applied.last().filter(|(n, _)| *n != 0);
        last.map_or(0, |(_, since)| now.saturating_sub(*since))
    }

    /// A record: true if it is evidence on the lock, false if a proposal.
    pub(super) fn hear_grounding(
        &mut self,
        p: &Params,
        now: u64,
        record: &GroundingRecord,
        epoch: u64,
        subtask: u32,
    ) -> Result<bool, Refusal> {
        if self.grounding_session == Some(record.session) {
            let last = self.grounding_number;
            first(&[
                (record.sequence == last, Refusal::Repeated),
                (!after(record.sequence, last), Refusal::Sequence),
            ])?;
        }
        // A broken record opens its session, but its number counts for nothing:
        // that of the last sound one stays.
        self.grounding_session = Some(record.session);
        sound_grounding(p, now, record)?;
        self.grounding_number = record.sequence;
        first(&[(record.subtask != subtask, Refusal::Subtask)])?;
        if record.epoch == epoch {
            return Ok(true);
        }
        let overtaken = self.proposal.is_some_and(|r| after(r.epoch, record.epoch));
        first(&[(overtaken || !after(record.epoch, epoch), Refusal::Epoch)])?;
        self.proposal = Some(*record);
        Ok(false)
    }

    pub(super) fn hear_verifier(&mut self, report: &VerifierReport, subtask: u32) {
        let news = self
            .verifier_number
            .is_none_or(|n| after(report.sequence, n));
        let said = Verdict::try_from(report.verdict).ok();
        if let Some(said) = said.filter(|_| news && report.subtask == subtask) {
            self.verifier_number = Some(report.sequence);
            self.verdict = Some(said);
        }
    }

    pub(super) fn hear_critic(&mut self, report: &CriticReport, subtask: u32) {
        let news = self.critic_number.is_none_or(|n| after(report.sequence, n));
        let said = CriticLabel::try_from(report.label).ok();
        if let Some(said) = said.filter(|_| news && report.subtask == subtask) {
            self.critic_number = Some(report.sequence);
            let sure = if report.confidence.is_nan() {
                0.0
            } else {
                report.confidence
            };
            self.critic = Some((said, sure.clamp(0.0, 1.0)));
        }
    }

    /// What the critic suspects, surely enough.
    pub(super) fn suspicion(&self, least: f64) -> Option<CriticLabel> {
        let (label, sure) = self.critic?;
        (sure >= least).then_some(label)
    }

    /// The next subtask: what was said of the last one is void.
    pub(super) fn next_subtask(&mut self, subtask: u32) {
        (self.verdict, self.critic) = (None, None);
        if self.proposal.is_some_and(|r| r.subtask != subtask) {
            self.proposal = None;
        }
    }

    pub(super) fn chunks_accepted(&self) -> usize {
        self.chunks.len()
    }

    /// A chunk; true if the policy is frozen.
    pub(super) fn hear_chunk(
        &mut self,
        p: &Params,
        now: u64,
        chunk: &ActionChunk,
    ) -> Result<bool, Refusal> {
        match self.believe_chunk(p, now, chunk) {
            Ok(played) => {
                self.chunks
                    .push(chunk.actions[..chunk.horizon as usize].to_vec());
                (self.ready, self.question) = (Some(played), None);
                self.broken_in_a_row = 0;
                let fresh = &self.chunks[self.fresh_from..];
                let newest = fresh.last().expect("pushed");
                let equal = fresh.iter().rev().take_while(|c| *c == newest).count();
                Ok(equal >= p.chunk.frozen_chunks as usize)
            }
            Err(refusal) => {
                let timing = matches!(
                    refusal,
                    Refusal::SessionChanged
                        | Refusal::TooOld
                        | Refusal::Epoch
                        | Refusal::Subtask
                        | Refusal::Query
                        | Refusal::Consumed
                        | Refusal::Repeated
                );
                if !timing {
                    self.broken_in_a_row += 1;
                    if self
                        .question
                        .is_some_and(|q| q.query.query_id == chunk.query_id)
                    {
                        self.question = None;
                    }
                }
                Err(refusal)
            }
        }
    }

    fn believe_chunk(&mut self, p: &Params, now: u64, c: &ActionChunk) -> Result<u64, Refusal> {
        let name = Some((c.session, c.sequence));
        let again = self.heard == name;
        self.heard = name;
        first(&[(again, Refusal::Repeated)])?;
        match self.chunk_session {
            None => self.chunk_session = Some(c.session),
            Some(session) if session != c.session => {
                (self.chunk_session, self.chunk_number) = (Some(c.session), c.sequence);
                (self.question, self.ready) = (None, None);
                return Err(Refusal::SessionChanged);
            }
            Some(_) => first(&[(!after(c.sequence, self.chunk_number), Refusal::Sequence)])?,
        }
        sound_chunk(p, now, c)?;
        self.chunk_number = c.sequence;
        let question = self.question.ok_or(Refusal::Query)?;
        first(&[
            (c.subtask != question.query.subtask, Refusal::Subtask),
            (c.epoch != question.query.epoch, Refusal::Epoch),
            (c.query_id != question.query.query_id, Refusal::Query),
        ])?;
        Ok(question.played)
    }

    /// The actions of the chunk at hand that are not out of date.
    pub(super) fn take_chunk(&mut self, played: u64) -> Option<Vec<[f32; 7]>> {
        let before = self.ready.take()?;
        let gone = played.saturating_sub(before).min(64) as usize;
        let chunk = self.chunks.last().expect("at hand");
        Some(chunk.iter().skip(gone).copied().collect())
    }
}

fn sound_pose(p: &Params, at: Point, turn: [f64; 4]) -> Result<(), Refusal> {
    let finite = at.iter().chain(&turn).all(|x| x.is_finite());
    let far = at.iter().any(|x| x.abs() > p.state.plausible_position_m);
    let square: f64 = turn.iter().map(|x| x * x).sum();
    first(&[
        (!finite, Refusal::NotFinite),
        (far, Refusal::Implausible),
        ((square - 1.0).abs() > 2e-5, Refusal::Quaternion),
    ])
}

fn sound_state(p: &Params, now: u64, s: &StateSample) -> Result<(), Refusal> {
    let count = s.object_count as usize;
    let mut numbers = [
        &s.joint_position_rad[..],
        &s.joint_velocity_rad_s,
        &s.ee_velocity_m_s,
    ]
    .concat();
    numbers.push(s.gripper_width_m);
    first(&[
        (count > OBJECT_CAPACITY, Refusal::TooLong),
        (
            s.stamp_ns.saturating_sub(now) > ms(p.state.future_skew_ms),
            Refusal::FromFuture,
        ),
        (!numbers.iter().all(|x| x.is_finite()), Refusal::NotFinite),
    ])?;
    sound_pose(p, s.ee_position_m, s.ee_orientation)?;
    for o in &s.objects[..count] {
        let known = GraspClass::ALL.iter().any(|c| c.code() == o.grasp_class) && o.visible < 2;
        let most = p.state.plausible_position_m;
        let sized = o.half_extent_m.iter().all(|h| (0.0..=most).contains(h));
        first(&[
            (!known, Refusal::UnknownCode),
            (!sized || !o.confidence.is_finite(), Refusal::NotFinite),
        ])?;
        sound_pose(p, o.position_m, o.orientation)?;
    }
    Ok(())
}

fn sound_grounding(p: &Params, now: u64, r: &GroundingRecord) -> Result<(), Refusal> {
    let count = usize::from(r.candidate_count);
    let direct = r.destination_kind == DestinationKind::Direct.code();
    let most = p.state.plausible_position_m;
    let region = r.region_offset_m.iter().all(|x| x.abs() <= most)
        && r.region_half_extent_m
            .iter()
            .all(|x| (0.0..=most).contains(x));
    let named = r.candidates.iter().take(count).any(|c| c.id == r.target);
    first(&[
        (count > CANDIDATE_CAPACITY, Refusal::TooLong),
        (
            r.stamp_ns.saturating_sub(now) > ms(p.state.future_skew_ms),
            Refusal::FromFuture,
        ),
        (
            DestinationKind::try_from(r.destination_kind).is_err(),
            Refusal::UnknownCode,
        ),
        (
            Provenance::try_from(r.provenance).is_err(),
            Refusal::UnknownCode,
        ),
        (
            direct && PlaceRelation::try_from(r.relation).is_err(),
            Refusal::UnknownCode,
        ),
        (direct && !region, Refusal::NotFinite),
        (r.target != 0 && !named, Refusal::NotACandidate),
    ])
}

fn sound_chunk(p: &Params, now: u64, c: &ActionChunk) -> Result<(), Refusal> {
    let gripper = match p.policy_gripper {
        PolicyGripper::MinusOneOpen => 1,
        PolicyGripper::OneOpen => 2,
    };
    let n = (c.horizon as usize).min(CHUNK_CAPACITY);
    let numbers = || c.actions[..n].iter().flatten().map(|x| f64::from(*x));
    let least = 1.0 + p.chunk.range_tolerance;
    let outside = p.out_of_range == OutOfRange::Refuse && numbers().any(|x| x.abs() > least);
    let ahead = c.observation_ns.max(c.stamp_ns).saturating_sub(now);
    let age = now.saturating_sub(c.observation_ns);
    first(&[
        (c.horizon as usize > CHUNK_CAPACITY, Refusal::TooLong),
        (c.horizon == 0, Refusal::Empty),
        (c.action_space != 1 || c.frame != 1, Refusal::UnknownCode),
        (![1, 2].contains(&c.gripper), Refusal::UnknownCode),
        (c.gripper != gripper, Refusal::Convention),
        (!numbers().all(f64::is_finite), Refusal::NotFinite),
        (outside, Refusal::OutOfRange),
        (ahead > ms(p.chunk.future_skew_ms), Refusal::FromFuture),
        (age > ms(p.chunk.max_age_ms), Refusal::TooOld),
    ])
}

/// A confidence that is no number in [0, 1] is none.
pub(super) fn confidence(x: f64) -> f64 {
    if (0.0..=1.0).contains(&x) { x } else { 0.0 }
}
