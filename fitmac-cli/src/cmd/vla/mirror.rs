//! Pictures for a policy that wants some: the scene of the card with the robot
//! and the objects where the newest sample has them, cast by rays. It stands
//! where a camera would stand.

use std::sync::Arc;

use fitmac_core::message::StateSample;
use fitmac_openpi::{Image, observation::SIDE_PX};
use sim_harness::{
    object::{ObjectClass, ObjectKind},
    pose::Pose,
    raster::{self, Camera},
    scene::{Arena, Scene},
    sim::Sim,
};

use crate::card::{Card, Look};

/// The scene as another process has it.
pub(super) struct Mirror {
    sim: Sim,
}

impl Mirror {
    /// The scene of a card.
    ///
    /// # Errors
    /// If the card's things make no scene.
    pub(super) fn of(card: &Card) -> anyhow::Result<Self> {
        let mut scene = Scene::new(Arena {
            surface_m: card.surface_m,
            surface_colour: card.surface_colour,
            ..Arena::default()
        });
        for look in &card.objects {
            let id = scene.put(&look.name, Arc::new(kind(look)), [0.0, 0.0], 0.0)?;
            anyhow::ensure!(
                id == look.id,
                "the card gives `{}` the id {}; ids count from 1",
                look.name,
                look.id
            );
        }
        Ok(Self {
            sim: Sim::new(scene)?,
        })
    }

    /// From in front of the robot, and from its wrist.
    ///
    /// # Errors
    /// If the sample is not sound.
    pub(super) fn pictures(&mut self, state: &StateSample) -> anyhow::Result<[Image; 2]> {
        let count = usize::try_from(state.object_count).unwrap_or(usize::MAX);
        let objects: Vec<_> = state
            .objects
            .iter()
            .take(count)
            .map(|object| {
                let pose = Pose {
                    position_m: object.position_m,
                    orientation: object.orientation,
                };
                (object.id, pose)
            })
            .collect();
        self.sim
            .show(&state.joint_position_rad, state.gripper_width_m, &objects)?;
        let front = Camera::agent_view(self.sim.scene().arena.surface_m);
        let wrist = Camera::wrist(&self.sim.robot());
        let mut take = |camera: &Camera| {
            Image::new(raster::picture(&mut self.sim, camera, SIDE_PX, SIDE_PX, 1).rgb)
        };
        Ok([take(&front)?, take(&wrist)?])
    }
}

/// A thing as it looks. Nothing moves by itself here: mass, class and hold don't matter.
fn kind(look: &Look) -> ObjectKind {
    ObjectKind {
        label: look.label.clone(),
        class: ObjectClass::Fixture,
        shape: look.shape.clone(),
        mass_kg: 1.0,
        fixed: false,
        part_of: None,
        colour: look.colour,
    }
}

#[cfg(test)]
mod tests {
    use fitmac_core::message::ObjectSample;
    use sim_harness::suite::Suite;

    use super::*;

    #[test]
    fn the_mirror_shows_what_the_simulator_shows() {
        let suite = Suite::embedded("object").unwrap();
        let task = suite.task("milk").unwrap();
        let scene = suite.sample_scene(task, 3).unwrap();
        let card = Card::of(&scene, &task.instruction);
        let card: Card = serde_json::from_str(&serde_json::to_string(&card).unwrap()).unwrap();
        let mut sim = Sim::new(scene).unwrap();
        for _ in 0..10 {
            let action = [0.5, 0.3, -0.8, 0.0, 0.0, 0.2, 1.0];
            sim.step_policy(&action).unwrap();
        }
        let robot = sim.robot();
        let mut state = StateSample {
            joint_position_rad: robot.joint_position_rad,
            gripper_width_m: robot.gripper_width_m,
            object_count: u32::try_from(sim.objects().len()).unwrap(),
            ..StateSample::default()
        };
        for (slot, object) in state.objects.iter_mut().zip(sim.objects()) {
            *slot = ObjectSample {
                id: object.id,
                position_m: object.pose.position_m,
                orientation: object.pose.orientation,
                ..ObjectSample::default()
            };
        }
        let mut mirror = Mirror::of(&card).unwrap();
        let [front, wrist] = mirror.pictures(&state).unwrap();
        let camera = Camera::agent_view(card.surface_m);
        let direct = raster::picture(&mut sim, &camera, SIDE_PX, SIDE_PX, 1);
        let differing = front.rgb().iter().zip(&direct.rgb).filter(|(a, b)| a != b);
        let differing = differing.count();
        // The fingers are not told apart: both show half the width.
        assert!(differing < Image::BYTES / 200, "{differing} bytes differ");
        let distinct = |image: &Image| {
            let pixels = image.rgb().chunks_exact(3);
            pixels.collect::<std::collections::BTreeSet<_>>().len()
        };
        assert!(
            distinct(&front) > 20 && distinct(&wrist) > 5,
            "empty pictures"
        );
        state.joint_position_rad[3] = f64::NAN;
        assert!(mirror.pictures(&state).is_err());
    }
}
