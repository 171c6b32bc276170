//! The story of a subtask: every policy step is kept, and what is known of
//! phase, progress and attempt is read from all of it anew.

use fitmac_core::{
    evidence,
    params::Params,
    wire::{Phase, Verdict},
};

use super::{
    sight::{Look, Pads},
    space::{Point, apart, length, minus},
};

/// How the target stands to the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Carry {
    Resting,
    /// Highest centre, and height of the hand above the centre at the lift.
    Lifted {
        top: f64,
        grip: f64,
    },
    Released,
}

/// One policy step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Page {
    pub(super) look: Look,
    phase_before: Phase,
    phase: Phase,
    carry: Carry,
    /// Another phase that the estimate would change to.
    wants: Option<Phase>,
    progress: Option<bool>,
    at_rest: bool,
    bits: u64,
}

/// All policy steps of a subtask, and from which page on what counts.
#[derive(Clone, Debug)]
pub(super) struct Story {
    pub(super) pages: Vec<Page>,
    pub(super) phase: Phase,
    pub(super) attempt_id: u64,
    /// Of the estimator: the hand's story with the target, and the phase.
    carry_from: usize,
    phase_from: usize,
    /// Of the windows of stall and reversal.
    window_from: usize,
    /// Of all differences.
    motion_from: usize,
    attempt_from: usize,
    unheeded_from: usize,
}

pub(super) fn picks(phase: Phase) -> bool {
    [Phase::Approach, Phase::Grasp, Phase::Lift].contains(&phase)
}

pub(super) fn places(phase: Phase) -> bool {
    phase != Phase::Complete && !picks(phase)
}

/// Where each phase may lead.
fn may_follow(from: Phase) -> &'static [Phase] {
    use Phase::{Approach, Complete, Descend, Grasp, Lift, Release, Stabilise, Transport};
    match from {
        Approach => &[Grasp, Lift, Complete],
        Grasp => &[Approach, Lift, Complete],
        Lift => &[Approach, Grasp, Transport, Complete],
        Transport => &[Approach, Descend, Release, Complete],
        Descend => &[Approach, Transport, Release, Complete],
        Release => &[Approach, Transport, Stabilise, Complete],
        Stabilise => &[Approach, Complete],
        Complete => &[],
    }
}

impl Story {
    pub(super) fn new() -> Self {
        Self {
            pages: Vec::new(),
            phase: Phase::Approach,
            attempt_id: 1,
            carry_from: 0,
            phase_from: 0,
            window_from: 0,
            motion_from: 0,
            attempt_from: 0,
            unheeded_from: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.pages.len()
    }

    pub(super) fn phase_steps(&self) -> usize {
        self.len() - self.phase_from
    }

    pub(super) fn attempt_steps(&self) -> usize {
        self.len() - self.attempt_from
    }

    pub(super) fn history(&self) -> usize {
        (self.len() - self.motion_from).min(9)
    }

    fn of_attempt(&self) -> &[Page] {
        &self.pages[self.attempt_from..]
    }

    /// Evidence that no query has heeded yet.
    pub(super) fn latched(&self) -> u64 {
        let unheeded = &self.pages[self.unheeded_from..];
        unheeded.iter().fold(0, |bits, page| bits | page.bits)
    }

    pub(super) fn heed(&mut self) {
        self.unheeded_from = self.len();
    }

    /// No difference holds any more.
    pub(super) fn forget_motion(&mut self) {
        self.motion_from = self.len();
        self.window_from = self.len();
    }

    pub(super) fn complete(&mut self) {
        if self.phase != Phase::Complete {
            self.phase = Phase::Complete;
            self.phase_from = self.len();
        }
    }

    fn next_attempt(&mut self, from: usize) {
        self.attempt_id += 1;
        self.attempt_from = from;
    }

    /// The attempt begins again with an approach.
    pub(super) fn restart(&mut self) {
        if self.phase != Phase::Complete {
            self.estimate_afresh();
            self.next_attempt(self.len());
            self.window_from = self.len();
        }
    }

    fn estimate_afresh(&mut self) {
        self.phase = Phase::Approach;
        (self.phase_from, self.carry_from) = (self.len(), self.len());
    }

    /// Another target.
    pub(super) fn retarget(&mut self) {
        self.forget_motion();
        self.next_attempt(self.len());
        self.heed();
        self.estimate_afresh();
    }

    /// Steps since progress was last seen.
    pub(super) fn since_progress(&self) -> Option<usize> {
        let pages = &self.pages[self.motion_from..];
        let last = pages.iter().rposition(|p| p.progress == Some(true))?;
        Some(pages.len() - 1 - last)
    }

    /// The page `ago` steps before the newest, if a difference may span it.
    fn ago(&self, ago: usize) -> Option<&Page> {
        self.pages[self.motion_from..].iter().rev().nth(ago)
    }

    /// How the target stands to the hand now.
    pub(super) fn carry(&self) -> Carry {
        let known = &self.pages[self.carry_from..];
        known.last().map_or(Carry::Resting, |page| page.carry)
    }

    pub(super) fn is_lifted(&self) -> bool {
        matches!(self.carry(), Carry::Lifted { .. })
    }

    /// The carry after all pages since the estimator began, read from the first.
    fn read_carry(&self, p: &Params) -> Carry {
        let mut carry = Carry::Resting;
        let mut rest: Option<f64> = None;
        let mut risen = 0;
        for page in &self.pages[self.carry_from..] {
            if page.phase_before == Phase::Complete {
                continue;
            }
            let open = page.look.pads == Pads::Open;
            if open && matches!(carry, Carry::Lifted { .. }) {
                // Released, or a failed lift if the carry had not begun.
                (carry, rest, risen) = (Carry::Released, None, 0);
                if picks(page.phase_before) {
                    carry = Carry::Resting;
                }
                continue;
            }
            let Some(target) = page.look.target else {
                continue;
            };
            let z = target.at[2];
            match carry {
                Carry::Resting if open || rest.is_none() => (rest, risen) = (Some(z), 0),
                Carry::Resting => {
                    let up = rest.is_some_and(|r| z - r > p.phase.lifted_m);
                    risen = if up && page.look.closed() {
                        risen + 1
                    } else {
                        0
                    };
                    if risen >= p.phase.hysteresis_steps {
                        let grip = page.look.ee[2] - z;
                        carry = Carry::Lifted { top: z, grip };
                    }
                }
                Carry::Lifted { top, grip } => {
                    carry = Carry::Lifted {
                        top: top.max(z),
                        grip,
                    }
                }
                Carry::Released => {}
            }
        }
        carry
    }

    /// Which phase the newest look alone speaks for.
    fn estimate(&self, p: &Params, look: &Look, carry: Carry) -> Phase {
        let now = self.phase;
        match (carry, look.target) {
            (Carry::Released, _) if [Phase::Release, Phase::Stabilise].contains(&now) => {
                Phase::Stabilise
            }
            (Carry::Released, _) => Phase::Release,
            (Carry::Lifted { .. }, _) if [Phase::Approach, Phase::Grasp].contains(&now) => {
                Phase::Lift
            }
            (Carry::Lifted { .. }, _) => {
                let over = look.place.is_some_and(|d| {
                    d.beside <= p.phase.descend_xy_m && d.clearance <= p.phase.descend_clearance_m
                });
                if over {
                    Phase::Descend
                } else {
                    Phase::Transport
                }
            }
            (Carry::Resting, None) => now,
            (Carry::Resting, Some(t)) => {
                let near = t.beside < p.phase.grasp_xy_m && t.above < p.phase.grasp_height_m;
                if near {
                    if look.closed() {
                        Phase::Lift
                    } else {
                        Phase::Grasp
                    }
                } else if t.distance > p.phase.approach_distance_m || !picks(now) {
                    Phase::Approach
                } else {
                    now
                }
            }
        }
    }

    /// A policy step; returns the bits of the monitor.
    pub(super) fn turn(&mut self, p: &Params, look: Look, verdict: Verdict) -> u64 {
        self.pages.push(Page {
            look,
            phase_before: self.phase,
            phase: self.phase,
            carry: Carry::Resting,
            wants: None,
            progress: None,
            at_rest: false,
            bits: 0,
        });
        let carry = self.read_carry(p);
        let newest = self.len() - 1;
        self.pages[newest].carry = carry;
        if self.phase != Phase::Complete {
            let estimate = self.estimate(p, &look, carry);
            self.settle_on(p, estimate);
        }
        self.pages[newest].phase = self.phase;
        self.pages[newest].progress = self.progress(p);
        self.pages[newest].at_rest = self.at_rest(p);
        let mut level = self.monitor(p);
        // What lies in its place may roll on.
        if carry == Carry::Released && look.in_region() == Some(true) {
            use evidence as e;
            level &= !(e::STALL | e::TIMEOUT | e::REVERSAL | e::MOVING_AWAY);
        }
        let bits = self.attempt(p, verdict);
        self.pages[newest].bits = bits;
        if self.latched() & evidence::DROPPED != 0 && matches!(carry, Carry::Lifted { .. }) {
            self.restart();
        }
        level
    }

    /// A new phase counts once it was seen often enough in a row.
    fn settle_on(&mut self, p: &Params, estimate: Phase) {
        let newest = self.len() - 1;
        if estimate == self.phase || !may_follow(self.phase).contains(&estimate) {
            return;
        }
        self.pages[newest].wants = Some(estimate);
        let since = &self.pages[self.phase_from..];
        let seen = since
            .iter()
            .rev()
            .take_while(|page| page.wants == Some(estimate));
        let enough = seen.count() >= p.phase.hysteresis_steps as usize;
        if !enough && estimate != Phase::Release {
            return;
        }
        let from = std::mem::replace(&mut self.phase, estimate);
        self.phase_from = self.len();
        self.window_from = newest;
        let failed_lift = (from, estimate) == (Phase::Lift, Phase::Approach);
        if failed_lift || (places(from) && picks(estimate)) {
            self.next_attempt(newest);
        }
    }

    /// Equation 5 on the newest page; unknown without a pose.
    fn progress(&self, p: &Params) -> Option<bool> {
        let now = self.ago(0)?.look;
        let then = self.ago(p.progress.delta_steps as usize)?.look;
        if picks(self.phase) {
            let nearer = then.target?.distance - now.target?.distance;
            let moved = apart(now.ee, then.ee);
            Some(nearer > p.progress.target_m || moved > p.progress.end_effector_m)
        } else {
            let moved = apart(now.target?.at, then.target?.at);
            let places = then.place.zip(now.place);
            let nearer = places.map_or(0.0, |(then, now)| then.distance - now.distance);
            Some(nearer > p.progress.destination_m || moved > p.progress.object_m)
        }
    }

    fn at_rest(&self, p: &Params) -> bool {
        let at = |ago| Some(self.ago(ago)?.look.target?.at);
        at(0)
            .zip(at(4))
            .is_some_and(|(now, then)| apart(now, then) < p.evidence.rest_distance_m)
    }

    fn window(&self) -> &[Page] {
        &self.pages[self.window_from.max(self.motion_from)..]
    }

    fn monitor(&self, p: &Params) -> u64 {
        let (w, t) = (&p.patience, &p.timeout);
        let (patience, timeout) = match self.phase {
            Phase::Approach => (w.approach_steps, t.approach_steps),
            Phase::Grasp => (w.grasp_steps, t.grasp_steps),
            Phase::Lift => (w.lift_steps, t.lift_steps),
            Phase::Transport => (w.transport_steps, t.transport_steps),
            Phase::Descend => (w.descend_steps, t.descend_steps),
            Phase::Release => (w.release_steps, t.release_steps),
            Phase::Stabilise => (w.stabilise_steps, t.stabilise_steps),
            Phase::Complete => (u32::MAX, u32::MAX),
        };
        let idle = self
            .window()
            .iter()
            .rev()
            .take_while(|page| page.progress != Some(true))
            .filter(|page| page.progress == Some(false))
            .count();
        let newest = self.pages.last().expect("pushed");
        [
            (newest.progress == Some(true), evidence::PROGRESS),
            (idle >= patience as usize, evidence::STALL),
            (self.phase_steps() > timeout as usize, evidence::TIMEOUT),
            (self.swings(p), evidence::REVERSAL),
        ]
        .iter()
        .filter(|(holds, _)| *holds)
        .fold(0, |bits, (_, bit)| bits | bit)
    }

    /// The arm keeps turning back and gets nowhere.
    fn swings(&self, p: &Params) -> bool {
        const STRIDE_M: f64 = 0.004;
        let span = p.progress.reversal_window_steps as usize;
        if p.progress.reversals == 0 {
            return false;
        }
        let pages = self.window();
        // The places at which a stride ended, and when.
        let mut posts: Vec<(usize, Point)> = Vec::new();
        for (i, page) in pages.iter().enumerate() {
            let strides =
                |&(_, from): &(usize, Point)| length(minus(page.look.ee, from)) >= STRIDE_M;
            if posts.last().is_none_or(strides) {
                posts.push((i, page.look.ee));
            }
        }
        let turns = posts
            .windows(3)
            .filter(|w| {
                let (a, b) = (minus(w[1].1, w[0].1), minus(w[2].1, w[1].1));
                let back = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < 0.0;
                back && w[2].0 + span >= pages.len()
            })
            .count();
        let distance = |page: &Page| {
            let picking = picks(page.phase);
            let target = page.look.target.filter(|_| picking).map(|t| t.distance);
            let place = page.look.place.filter(|_| !picking).map(|d| d.distance);
            target.or(place)
        };
        let window = (pages.len() - 1) / span;
        let before = window
            .checked_sub(1)
            .and_then(|w| distance(&pages[w * span]));
        let start = before.or(distance(&pages[window * span]));
        let now = distance(&pages[pages.len() - 1]);
        let stays = start
            .zip(now)
            .is_some_and(|(start, now)| start - now < p.progress.reversal_net_m);
        turns >= p.progress.reversals as usize && stays
    }

    /// Evidence of the newest page (it is the last of the attempt).
    fn attempt(&self, p: &Params, verdict: Verdict) -> u64 {
        let mut bits = 0;
        let mut note = |holds: bool, bit| {
            if holds {
                bits |= bit;
            }
        };
        let pages = self.of_attempt();
        let (newest, earlier) = pages.split_last().expect("pushed");
        let look = &newest.look;
        if picks(self.phase) {
            let opened = earlier.iter().any(|page| page.look.pads == Pads::Open);
            note(look.pads == Pads::Empty && opened, evidence::EMPTY_GRASP);
            note(self.nears_another(p), evidence::WRONG_TARGET);
            let then = self.ago(p.evidence.moving_away_steps as usize);
            let then = then.and_then(|page| page.look.target);
            let away = then
                .zip(look.target)
                .is_some_and(|(then, now)| now.distance - then.distance > p.evidence.moving_away_m);
            note(away && look.pads == Pads::Open, evidence::MOVING_AWAY);
            note(self.raises_another(p), evidence::WRONG_OBJECT_HELD);
        }
        let fell = match (newest.carry, look.target) {
            (Carry::Lifted { grip, .. }, Some(t)) => {
                look.ee[2] - t.at[2] - grip > p.evidence.dropped_m
            }
            _ => false,
        };
        note(fell, evidence::DROPPED);
        let patience = p.evidence.wrong_destination_steps;
        let strays = patience > 0 && self.straying(p) >= patience as usize;
        note(strays, evidence::WRONG_DESTINATION);
        if newest.carry == Carry::Released && self.rested() >= p.evidence.rest_steps as usize {
            let beside = verdict == Verdict::Unknown && look.in_region() == Some(false);
            let denied = verdict == Verdict::Fail;
            note(beside || denied, evidence::VERIFIER_NEGATIVE);
            note(beside, evidence::MISPLACED);
        }
        bits
    }

    /// Steps in a row, within the attempt, that the released target rested.
    pub(super) fn rested(&self) -> usize {
        let rests = |page: &&Page| page.carry == Carry::Released && page.at_rest;
        self.of_attempt().iter().rev().take_while(rests).count()
    }

    /// The gripper has closed in this attempt, after it was open.
    pub(super) fn has_acted(&self) -> bool {
        let pages = self.of_attempt();
        let opened = pages.iter().position(|page| page.look.pads == Pads::Open);
        opened.is_some_and(|from| pages[from..].iter().any(|page| page.look.closed()))
    }

    /// An approach to another thing than the target, for long enough.
    fn nears_another(&self, p: &Params) -> bool {
        const RECEDING_M: f64 = 0.02;
        let nearer = |page: &Page| {
            let (target, other) = (page.look.target?, page.look.other?);
            let near = other.distance < target.distance - p.evidence.wrong_target_margin_m
                && other.distance < p.evidence.wrong_target_distance_m;
            near.then_some((other.id, other.distance))
        };
        // (thing, nearest, steps)
        let mut run: Option<(u16, f64, u32)> = None;
        for page in self.of_attempt().iter().filter(|page| picks(page.phase)) {
            run = nearer(page).map(|(id, distance)| match run {
                Some((same, nearest, steps)) if same == id && distance < nearest + RECEDING_M => {
                    (id, nearest.min(distance), steps + 1)
                }
                _ => (id, distance, 1),
            });
        }
        run.is_some_and(|(_, _, steps)| steps >= p.evidence.wrong_target_steps)
    }

    /// Another thing than the target that seems held: which, and its height
    /// when it was grasped.
    pub(super) fn held_other(&self, p: &Params) -> Option<(u16, f64)> {
        let held = |page: &Page| {
            let other = page.look.other.filter(|o| {
                page.look.pads == Pads::Holding
                    && o.distance < p.gripper.held_radius_m
                    && page.look.target.is_none_or(|t| o.distance < t.distance)
            })?;
            Some((other.id, other.at[2]))
        };
        let seen: Vec<_> = self
            .of_attempt()
            .iter()
            .filter(|page| picks(page.phase))
            .map(held)
            .collect();
        let (id, _) = (*seen.last()?)?;
        let same = seen
            .iter()
            .rev()
            .take_while(|h| h.is_some_and(|(i, _)| i == id));
        same.last().copied().flatten()
    }

    fn raises_another(&self, p: &Params) -> bool {
        let now = self.pages.last().and_then(|page| page.look.other);
        self.held_other(p)
            .zip(now)
            .is_some_and(|((id, z), other)| other.id == id && other.at[2] - z > p.phase.lifted_m)
    }

    /// Steps in a row that the carried target was taken elsewhere.
    fn straying(&self, p: &Params) -> usize {
        let e = &p.evidence;
        let carried =
            |page: &&Page| matches!(page.carry, Carry::Lifted { .. }) && page.look.target.is_some();
        let pages = self.of_attempt();
        let run = pages.iter().rev().take_while(carried).count();
        let mut nearest = f64::INFINITY;
        let mut steps = 0;
        for page in &pages[pages.len() - run..] {
            let strays = match (page.carry, page.look.target, page.look.place) {
                (Carry::Lifted { top, .. }, Some(t), Some(d)) => {
                    nearest = nearest.min(d.beside);
                    let lowered = top - t.at[2] > e.wrong_destination_drop_m
                        && d.beside > e.wrong_destination_xy_m;
                    lowered || d.beside - nearest > e.wrong_destination_away_m
                }
                _ => false,
            };
            steps = if strays { steps + 1 } else { 0 };
        }
        steps
    }
}
