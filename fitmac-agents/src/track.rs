//! Instance lock over time: which object of this scene is which of the last.
//!
//! Detections of a new scene are assigned to known tracks by distance, with a
//! penalty for another label. A detector that misses an object, names it wrongly
//! once or reports it twice doesn't move a lock: the track survives, the label
//! is voted, the double is merged.

use crate::scene::{Detection, Scene};

/// A track's identity; never reused by the tracker that gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrackId(pub u32);

/// Settings of a [`Tracker`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackParams {
    /// Farthest that an object moves from one scene to the next, m.
    pub gate_m: f64,
    /// Extra distance charged for another label, m.
    pub label_penalty_m: f64,
    /// How long a track lives unseen, s.
    pub forget_s: f64,
    /// Weight of a new position against the smoothed one, 0 to 1.
    pub smoothing: f64,
    /// Farthest that noise moves a resting object, m; beyond it the new
    /// position is taken as it is.
    pub rest_m: f64,
    /// Detections of an object before it counts, once the first scene is past.
    pub confirm_hits: u32,
}

impl Default for TrackParams {
    /// For a detector at 1 Hz or more with noise of about 1 cm.
    fn default() -> Self {
        Self {
            gate_m: 0.12,
            label_penalty_m: 0.04,
            forget_s: 3.0,
            smoothing: 0.4,
            rest_m: 0.04,
            confirm_hits: 2,
        }
    }
}

#[derive(Clone, Debug)]
struct Track {
    id: TrackId,
    smoothed: Detection,
    /// Labels with the confidence that they collected.
    votes: Vec<(String, f64)>,
    last_seen_ns: u64,
    hits: u32,
}

/// Keeps objects apart over time.
#[derive(Clone, Debug)]
pub struct Tracker {
    params: TrackParams,
    tracks: Vec<Track>,
    next: u32,
    scenes: u64,
}

/// A scene whose objects have identities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrackedScene {
    /// Smoothed objects, with those that were missed just now at a lowered
    /// confidence; camera, table and fixtures as in the last scene.
    pub scene: Scene,
    /// For each of the scene's objects, its track.
    pub tracks: Vec<TrackId>,
}

impl TrackedScene {
    /// Index of a track among the scene's objects.
    #[must_use]
    pub fn index_of(&self, track: TrackId) -> Option<usize> {
        self.tracks.iter().position(|other| *other == track)
    }
}

/// Two detections overlap by this share or more: one object, seen twice.
const SAME_OVERLAP: f64 = 0.35;

impl Tracker {
    /// A tracker that knows no object yet.
    #[must_use]
    pub fn new(params: TrackParams) -> Self {
        Self {
            params,
            tracks: Vec::new(),
            next: 1,
            scenes: 0,
        }
    }

    /// Takes a new scene; one that is older than the last changes nothing.
    pub fn update(&mut self, scene: &Scene) -> TrackedScene {
        let newest = self.tracks.iter().map(|track| track.last_seen_ns).max();
        if newest.is_none_or(|newest| scene.stamp_ns >= newest) {
            let detections = merged(&scene.objects);
            self.assign(&detections, scene.stamp_ns);
            self.scenes += 1;
        }
        let now = newest.unwrap_or(0).max(scene.stamp_ns);
        self.tracks
            .retain(|track| age_s(now, track.last_seen_ns) <= self.params.forget_s);
        self.tracked(scene, now)
    }

    fn assign(&mut self, detections: &[Detection], stamp_ns: u64) {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (at, track) in self.tracks.iter().enumerate() {
            for (index, detection) in detections.iter().enumerate() {
                if let Some(cost) = self.cost(track, detection) {
                    pairs.push((cost, at, index));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut track_taken = vec![false; self.tracks.len()];
        let mut detection_taken = vec![false; detections.len()];
        for (_, at, index) in pairs {
            if !track_taken[at] && !detection_taken[index] {
                (track_taken[at], detection_taken[index]) = (true, true);
                let params = self.params;
                self.tracks[at].see(&detections[index], stamp_ns, &params);
            }
        }
        for (detection, _) in detections
            .iter()
            .zip(&detection_taken)
            .filter(|(_, taken)| !**taken)
        {
            self.tracks.push(Track {
                id: TrackId(self.next),
                smoothed: detection.clone(),
                votes: vec![(detection.label.clone(), detection.confidence)],
                last_seen_ns: stamp_ns,
                // What the first scene shows counts at once.
                hits: if self.scenes == 0 {
                    self.params.confirm_hits
                } else {
                    1
                },
            });
            self.next = self.next.wrapping_add(1);
        }
    }

    /// Distance with penalties; `None` beyond the gate. Equal numbers of the
    /// pose source are always the same object, different ones never.
    fn cost(&self, track: &Track, detection: &Detection) -> Option<f64> {
        match (track.smoothed.id, detection.id) {
            (0, _) | (_, 0) => {}
            (known, given) if known == given => return Some(-1.0),
            _ => return None,
        }
        let distance = distance(&track.smoothed.position_m, &detection.position_m);
        let voted = track
            .votes
            .iter()
            .any(|(label, _)| *label == detection.label);
        let penalty = if voted {
            0.0
        } else {
            self.params.label_penalty_m
        };
        (distance <= self.params.gate_m).then_some(distance + penalty)
    }

    fn tracked(&self, scene: &Scene, now_ns: u64) -> TrackedScene {
        let known = self
            .tracks
            .iter()
            .filter(|track| track.hits >= self.params.confirm_hits);
        let (objects, tracks) = known
            .map(|track| (track.report(now_ns, &self.params), track.id))
            .unzip();
        let scene = Scene {
            stamp_ns: now_ns,
            camera: scene.camera.clone(),
            table: scene.table,
            objects,
            fixtures: scene.fixtures.clone(),
        };
        TrackedScene { scene, tracks }
    }
}

impl Track {
    fn see(&mut self, detection: &Detection, stamp_ns: u64, params: &TrackParams) {
        let moved = distance(&self.smoothed.position_m, &detection.position_m) > params.rest_m;
        let weight = if moved { 1.0 } else { params.smoothing };
        let mix = |old: f64, new: f64| old + weight * (new - old);
        for axis in 0..3 {
            let (old, new) = (
                &mut self.smoothed.position_m[axis],
                detection.position_m[axis],
            );
            *old = mix(*old, new);
            let (old, new) = (&mut self.smoothed.size_m[axis], detection.size_m[axis]);
            *old += params.smoothing * (new - *old);
        }
        self.smoothed.confidence +=
            params.smoothing * (detection.confidence - self.smoothed.confidence);
        self.smoothed.orientation = detection.orientation.or(self.smoothed.orientation);
        self.smoothed.box_px = detection.box_px.or(self.smoothed.box_px);
        self.smoothed.id = if detection.id == 0 {
            self.smoothed.id
        } else {
            detection.id
        };
        if detection.colour.is_some() {
            self.smoothed.colour.clone_from(&detection.colour);
        }
        match self
            .votes
            .iter_mut()
            .find(|(label, _)| *label == detection.label)
        {
            Some((_, votes)) => *votes += detection.confidence,
            None => self
                .votes
                .push((detection.label.clone(), detection.confidence)),
        }
        self.last_seen_ns = stamp_ns;
        self.hits = self.hits.saturating_add(1);
    }

    fn report(&self, now_ns: u64, params: &TrackParams) -> Detection {
        let total: f64 = self.votes.iter().map(|(_, votes)| votes).sum();
        let best = self.votes.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let share = best.map_or(
            0.0,
            |(_, votes)| if total > 0.0 { votes / total } else { 0.0 },
        );
        let fresh = 1.0 - 0.5 * (age_s(now_ns, self.last_seen_ns) / params.forget_s).min(1.0);
        Detection {
            label: best.map_or_else(String::new, |(label, _)| label.clone()),
            confidence: (self.smoothed.confidence * share * fresh).clamp(0.0, 1.0),
            ..self.smoothed.clone()
        }
    }
}

/// Detections without doubles; the surest of each object stays.
fn merged(detections: &[Detection]) -> Vec<Detection> {
    let mut order: Vec<&Detection> = detections.iter().collect();
    order.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let mut kept: Vec<Detection> = Vec::with_capacity(order.len());
    for detection in order {
        let different = |other: &Detection| {
            let apart = detection.id != 0 && other.id != 0 && detection.id != other.id;
            apart || overlap(detection, other) < SAME_OVERLAP
        };
        if kept.iter().all(different) {
            kept.push(detection.clone());
        }
    }
    kept
}

/// Intersection over union of two bounding boxes.
fn overlap(one: &Detection, other: &Detection) -> f64 {
    let mut common = 1.0;
    for axis in 0..3 {
        let half = (one.size_m[axis] + other.size_m[axis]) / 2.0;
        let gap = (one.position_m[axis] - other.position_m[axis]).abs();
        let smaller = one.size_m[axis].min(other.size_m[axis]);
        common *= (half - gap).clamp(0.0, smaller);
    }
    let volume = |detection: &Detection| detection.size_m.iter().product::<f64>();
    let union = volume(one) + volume(other) - common;
    if union > 0.0 { common / union } else { 0.0 }
}

fn distance(one: &[f64; 3], other: &[f64; 3]) -> f64 {
    one.iter()
        .zip(other)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

fn age_s(now_ns: u64, then_ns: u64) -> f64 {
    now_ns.saturating_sub(then_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bowl(x_m: f64, y_m: f64) -> Detection {
        Detection {
            id: 0,
            label: "black bowl".to_owned(),
            confidence: 0.8,
            position_m: [x_m, y_m, 0.025],
            size_m: [0.107, 0.107, 0.05],
            orientation: None,
            box_px: None,
            colour: None,
            parts: Vec::new(),
        }
    }

    fn scene(tick: u64, objects: Vec<Detection>) -> Scene {
        Scene {
            stamp_ns: tick * 200_000_000,
            objects,
            ..Scene::default()
        }
    }

    #[test]
    fn a_missed_bowl_keeps_its_track_beside_its_twin() {
        let mut tracker = Tracker::new(TrackParams::default());
        let first = tracker.update(&scene(0, vec![bowl(0.4, 0.0), bowl(0.52, 0.0)]));
        let (lock, twin) = (first.tracks[0], first.tracks[1]);
        for tick in 1..=10 {
            let seen = tracker.update(&scene(tick, vec![bowl(0.52, 0.0)]));
            let index = seen.index_of(lock).expect("still known");
            assert!((seen.scene.objects[index].position_m[0] - 0.4).abs() < 1e-9);
            assert!(seen.index_of(twin).is_some());
        }
        let back = tracker.update(&scene(11, vec![bowl(0.405, 0.0), bowl(0.52, 0.0)]));
        let index = back.index_of(lock).expect("the same bowl");
        assert!(back.scene.objects[index].position_m[0] < 0.41);
        assert_eq!(back.tracks.len(), 2);
    }

    #[test]
    fn a_thing_that_is_turned_has_its_newest_orientation() {
        let mut tracker = Tracker::new(TrackParams::default());
        let turned = |orientation| Detection {
            orientation,
            ..bowl(0.4, 0.0)
        };
        let quarter = [
            core::f64::consts::FRAC_1_SQRT_2,
            0.0,
            0.0,
            core::f64::consts::FRAC_1_SQRT_2,
        ];
        let upright = [1.0, 0.0, 0.0, 0.0];
        for (tick, (seen, expected)) in (0..).zip([
            (Some(upright), Some(upright)),
            (Some(quarter), Some(quarter)),
            (None, Some(quarter)),
        ]) {
            let tracked = tracker.update(&scene(tick, vec![turned(seen)]));
            assert_eq!(tracked.scene.objects[0].orientation, expected, "{tick}");
        }
    }

    #[test]
    fn an_object_that_stays_away_is_forgotten() {
        let mut tracker = Tracker::new(TrackParams::default());
        let lock = tracker.update(&scene(0, vec![bowl(0.4, 0.0)])).tracks[0];
        let gone = tracker.update(&scene(16, vec![]));
        assert_eq!(gone.index_of(lock), None);
    }

    #[test]
    fn one_wrong_label_is_outvoted_and_doubles_merge() {
        let mut tracker = Tracker::new(TrackParams::default());
        for tick in 0..3 {
            tracker.update(&scene(tick, vec![bowl(0.4, 0.0)]));
        }
        let mut wrong = bowl(0.4, 0.0);
        wrong.label = "ramekin".to_owned();
        let double = Detection {
            confidence: 0.4,
            ..bowl(0.41, 0.005)
        };
        let seen = tracker.update(&scene(3, vec![wrong, double]));
        assert_eq!(seen.scene.objects.len(), 1);
        assert_eq!(seen.scene.objects[0].label, "black bowl");
        assert!(seen.scene.objects[0].confidence < 0.7);
    }

    #[test]
    fn a_carried_object_is_followed() {
        let mut tracker = Tracker::new(TrackParams::default());
        let lock = tracker
            .update(&scene(0, vec![bowl(0.4, 0.0), bowl(0.4, 0.3)]))
            .tracks[0];
        for tick in 1..=8 {
            let x = 0.4 + 0.08 * tick as f64;
            let seen = tracker.update(&scene(tick, vec![bowl(x, 0.0), bowl(0.4, 0.3)]));
            let index = seen.index_of(lock).expect("followed");
            assert!((seen.scene.objects[index].position_m[0] - x).abs() < 1e-9);
        }
    }

    #[test]
    fn numbers_of_the_pose_source_win_over_distance() {
        let mut tracker = Tracker::new(TrackParams::default());
        let at = |x: f64, id: u16| Detection { id, ..bowl(x, 0.0) };
        let lock = tracker
            .update(&scene(0, vec![at(0.4, 1), at(0.52, 2)]))
            .tracks[0];
        // The two change places within one scene.
        let seen = tracker.update(&scene(1, vec![at(0.52, 1), at(0.4, 2)]));
        let index = seen.index_of(lock).expect("known");
        assert_eq!(seen.scene.objects[index].id, 1);
    }

    #[test]
    fn an_older_scene_changes_nothing() {
        let mut tracker = Tracker::new(TrackParams::default());
        tracker.update(&scene(5, vec![bowl(0.4, 0.0)]));
        let late = tracker.update(&scene(1, vec![bowl(0.7, 0.0), bowl(0.2, 0.2)]));
        assert_eq!(late.scene.objects.len(), 1);
        assert!((late.scene.objects[0].position_m[0] - 0.4).abs() < 1e-9);
    }
}
