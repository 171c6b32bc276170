//! Scenes: where things stand at the start.

use fitmac_core::{
    message::ObjectId,
    wire::{GraspClass, PlaceRelation},
};

use super::{Body, Plant, Support, World};

/// The can that is usually meant.
pub const CAN: ObjectId = 1;
/// A can that is not meant.
pub const OTHER: ObjectId = 2;
/// A plate.
pub const PLATE: ObjectId = 3;
/// A basket.
pub const BASKET: ObjectId = 4;
/// A bowl, wider than the gripper.
pub const BOWL: ObjectId = 5;
/// A box, oblong.
pub const BOX: ObjectId = 6;

/// A task: what is meant, and where it shall go.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The world at the start.
    pub world: World,
    /// The object that the instruction means.
    pub target: ObjectId,
    /// The object that carries the destination region.
    pub destination: ObjectId,
    /// On it or in it.
    pub relation: PlaceRelation,
    /// Half extent of the region; its depth for a container, m.
    pub region_m: [f64; 3],
}

impl Scene {
    /// Two cans and a plate; the one at the right goes on the plate.
    #[must_use]
    pub fn can_to_plate() -> Self {
        Self::on_plate(Body::thing(
            CAN,
            GraspClass::Can,
            [0.50, -0.10],
            [0.03, 0.03, 0.04],
        ))
    }

    /// A bowl, to be grasped by its rim, and a can; the bowl goes on the plate.
    #[must_use]
    pub fn bowl_to_plate() -> Self {
        Self::on_plate(Body::thing(
            BOWL,
            GraspClass::Bowl,
            [0.50, -0.10],
            [0.053, 0.053, 0.025],
        ))
    }

    /// An oblong box and a can; the box goes on the plate.
    #[must_use]
    pub fn box_to_plate() -> Self {
        Self::on_plate(Body::thing(
            BOX,
            GraspClass::Box,
            [0.50, -0.10],
            [0.045, 0.025, 0.03],
        ))
    }

    fn on_plate(target: Body) -> Self {
        let id = target.id;
        let bodies = vec![
            target,
            Body::thing(OTHER, GraspClass::Can, [0.50, 0.12], [0.03, 0.03, 0.04]),
            Body::fixture(PLATE, Support::Surface, [0.35, 0.25], [0.09, 0.09, 0.01]),
        ];
        Self {
            world: World::new(Plant::default(), [0.45, 0.0, 0.30], bodies),
            target: id,
            destination: PLATE,
            relation: PlaceRelation::On,
            region_m: [0.06, 0.06, 0.0],
        }
    }

    /// A can and another one; the can goes into the basket.
    #[must_use]
    pub fn can_to_basket() -> Self {
        let bodies = vec![
            Body::thing(CAN, GraspClass::Can, [0.50, -0.10], [0.03, 0.03, 0.04]),
            Body::thing(OTHER, GraspClass::Can, [0.50, 0.12], [0.03, 0.03, 0.04]),
            Body::fixture(BASKET, Support::Container, [0.35, 0.25], [0.08, 0.08, 0.05]),
        ];
        Self {
            world: World::new(Plant::default(), [0.45, 0.0, 0.30], bodies),
            target: CAN,
            destination: BASKET,
            relation: PlaceRelation::In,
            region_m: [0.061, 0.061, 0.10],
        }
    }

    /// True if the task is done.
    #[must_use]
    pub fn is_done(&self, world: &World) -> bool {
        world.is_placed(self.target, self.destination)
    }

    /// Centre of the destination region in its object's frame, m: on the
    /// surface, or at the rim.
    #[must_use]
    pub fn region_offset_m(&self) -> [f64; 3] {
        let top = self
            .world
            .body(self.destination)
            .map_or(0.0, |b| b.half_extent_m[2]);
        [0.0, 0.0, top]
    }
}
