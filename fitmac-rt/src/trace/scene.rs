//! What a viewer draws: frames, shapes and messages, derived from the ticks.

use fitmac_core::{
    evidence,
    intake::Refusal,
    message::{ObjectSample, StateSample, TraceRecord},
    reason,
    wire::{Diagnosis, EventKind, GraspClass, Mode, Phase, Route, SubPhase},
};
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, Duration, FrameTransform, FrameTransforms, Log, Pose,
    Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, TextPrimitive, Timestamp, Vector3,
    log::Level,
};

use crate::frame::Tick;

/// Time between two pictures, ns: 25 a second.
const PICTURE_EVERY_NS: u64 = 40_000_000;
/// Shapes vanish when they are not drawn again for this long, ns.
const SHAPE_LIFETIME_NS: u32 = 500_000_000;
const BASE: &str = "base";
const TOOL: &str = "tool_centre_point";

/// What is drawn of a tick.
#[derive(Default)]
pub(super) struct Pictures {
    pub(super) shapes: Option<(FrameTransforms, SceneUpdate)>,
    pub(super) log: Vec<Log>,
}

/// Remembers what was drawn last.
#[derive(Default)]
pub(super) struct Scene {
    due_ns: u64,
    newest: Option<TraceRecord>,
    mode: u8,
}

impl Scene {
    pub(super) fn step(&mut self, tick: &Tick) -> Pictures {
        let mut pictures = Pictures::default();
        let now_ns = tick.head.now_ns;
        if tick.output.command.mode != self.mode {
            self.mode = tick.output.command.mode;
            pictures.log.push(mode_message(tick));
        }
        if let Some(trace) = &tick.output.trace {
            let before = self.newest.replace(*trace);
            if is_news(before.as_ref(), trace) {
                pictures.log.push(decision_message(trace));
            }
        }
        if let Some(refusal) = tick.output.event.as_ref().and_then(refusal_message) {
            pictures.log.push(refusal);
        }
        if let Some(state) = tick.state.as_deref()
            && now_ns >= self.due_ns
        {
            self.due_ns = now_ns + PICTURE_EVERY_NS;
            pictures.shapes = Some((
                transforms(now_ns, state),
                shapes(now_ns, state, self.newest.as_ref()),
            ));
        }
        pictures
    }
}

fn is_news(before: Option<&TraceRecord>, now: &TraceRecord) -> bool {
    let key = |t: &TraceRecord| (t.route, t.diagnosis, t.phase, t.sub_phase, t.target);
    before.is_none_or(|b| key(b) != key(now))
}

/// A message for a refused message; changes of mode have their own.
fn refusal_message(event: &TraceRecord) -> Option<Log> {
    let kind = EventKind::try_from(event.kind).ok()?;
    matches!(
        kind,
        EventKind::ChunkRefused | EventKind::StateRefused | EventKind::GroundingRefused
    )
    .then(|| {
        let why = Refusal::ALL.get(event.detail as usize);
        let why = why.map_or("unknown", |r| r.name());
        log(event.stamp_ns, Level::Warning, format!("{kind}: {why}"))
    })
}

fn mode_message(tick: &Tick) -> Log {
    let command = &tick.output.command;
    let mode = command.mode();
    let level = match mode {
        Some(Mode::Normal) => Level::Info,
        Some(Mode::Warn | Mode::Hold) => Level::Warning,
        Some(Mode::Stop) | None => Level::Error,
    };
    let reasons: Vec<&str> = reason::names(command.reasons).collect();
    log(
        tick.head.now_ns,
        level,
        format!(
            "mode {}: {}",
            mode.map_or("unknown", Mode::name),
            reasons.join(", ")
        ),
    )
}

fn decision_message(t: &TraceRecord) -> Log {
    let name = |name: Option<&'static str>| name.unwrap_or("unknown");
    let evidence: Vec<&str> = evidence::names(t.evidence).collect();
    let reasons: Vec<&str> = reason::names(t.reasons).collect();
    let text = format!(
        "query {} step {}: {} in {} ({}), diagnosis {}; evidence [{}]; reasons [{}]",
        t.query,
        t.policy_step,
        name(Route::try_from(t.route).ok().map(Route::name)),
        name(Phase::try_from(t.phase).ok().map(Phase::name)),
        name(SubPhase::try_from(t.sub_phase).ok().map(SubPhase::name)),
        name(Diagnosis::try_from(t.diagnosis).ok().map(Diagnosis::name)),
        evidence.join(", "),
        reasons.join(", "),
    );
    log(t.stamp_ns, Level::Info, text)
}

fn log(now_ns: u64, level: Level, message: String) -> Log {
    Log {
        timestamp: Some(timestamp(now_ns)),
        level: level.into(),
        message,
        name: "fitmac".into(),
        ..Log::default()
    }
}

fn timestamp(ns: u64) -> Timestamp {
    let seconds = u32::try_from(ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (ns % 1_000_000_000) as u32)
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn quaternion([w, x, y, z]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

fn pose([x, y, z]: [f64; 3], orientation: [f64; 4]) -> Pose {
    Pose {
        position: Some(Vector3 { x, y, z }),
        orientation: Some(quaternion(orientation)),
    }
}

fn objects(state: &StateSample) -> &[ObjectSample] {
    let count = (state.object_count as usize).min(state.objects.len());
    &state.objects[..count]
}

fn transforms(now_ns: u64, state: &StateSample) -> FrameTransforms {
    let transform = |child: String, at: [f64; 3], orientation| FrameTransform {
        timestamp: Some(timestamp(now_ns)),
        parent_frame_id: BASE.into(),
        child_frame_id: child,
        translation: Some(vector(at)),
        rotation: Some(quaternion(orientation)),
    };
    let tool = transform(TOOL.into(), state.ee_position_m, state.ee_orientation);
    let things = objects(state)
        .iter()
        .map(|o| transform(format!("object_{}", o.id), o.position_m, o.orientation));
    FrameTransforms {
        transforms: core::iter::once(tool).chain(things).collect(),
    }
}

fn shapes(now_ns: u64, state: &StateSample, decision: Option<&TraceRecord>) -> SceneUpdate {
    let entity = |id: String| SceneEntity {
        timestamp: Some(timestamp(now_ns)),
        frame_id: BASE.into(),
        id,
        lifetime: Some(Duration::new(0, SHAPE_LIFETIME_NS)),
        ..SceneEntity::default()
    };
    let mut entities: Vec<SceneEntity> = objects(state)
        .iter()
        .map(|o| object_entity(o, decision, entity(format!("object_{}", o.id))))
        .collect();
    entities.push(SceneEntity {
        spheres: vec![sphere(state.ee_position_m, 0.015, rgba(0.1, 0.1, 0.1, 1.0))],
        ..entity("tool".into())
    });
    if let Some(t) = decision
        && t.waypoint_m.iter().all(|x| x.is_finite())
    {
        entities.push(SceneEntity {
            spheres: vec![sphere(t.waypoint_m, 0.02, rgba(1.0, 0.55, 0.0, 0.8))],
            ..entity("waypoint".into())
        });
    }
    SceneUpdate {
        deletions: Vec::new(),
        entities,
    }
}

fn object_entity(
    object: &ObjectSample,
    decision: Option<&TraceRecord>,
    entity: SceneEntity,
) -> SceneEntity {
    let color = match decision {
        Some(t) if t.target == object.id => rgba(0.1, 0.7, 0.2, 0.8),
        Some(t) if t.other != 0 && t.other == object.id => rgba(0.85, 0.15, 0.1, 0.8),
        _ => rgba(0.6, 0.6, 0.65, if object.visible == 0 { 0.25 } else { 0.7 }),
    };
    let place = pose(object.position_m, object.orientation);
    let size = vector(object.half_extent_m.map(|h| 2.0 * h));
    let label = TextPrimitive {
        pose: Some(place),
        billboard: true,
        font_size: 12.0,
        scale_invariant: true,
        color: Some(rgba(0.0, 0.0, 0.0, 1.0)),
        text: object.id.to_string(),
    };
    let round = matches!(
        GraspClass::try_from(object.grasp_class),
        Ok(GraspClass::Can | GraspClass::Bottle | GraspClass::Bowl)
    );
    let (cubes, cylinders) = if round {
        let cylinder = CylinderPrimitive {
            pose: Some(place),
            size: Some(size),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(color),
        };
        (Vec::new(), vec![cylinder])
    } else {
        let cube = CubePrimitive {
            pose: Some(place),
            size: Some(size),
            color: Some(color),
        };
        (vec![cube], Vec::new())
    };
    SceneEntity {
        cubes,
        cylinders,
        texts: vec![label],
        ..entity
    }
}

fn sphere(at: [f64; 3], radius_m: f64, color: Color) -> SpherePrimitive {
    SpherePrimitive {
        pose: Some(pose(at, [1.0, 0.0, 0.0, 0.0])),
        size: Some(vector([2.0 * radius_m; 3])),
        color: Some(color),
    }
}

fn rgba(r: f64, g: f64, b: f64, a: f64) -> Color {
    Color { r, g, b, a }
}
