//! Objects of the toy world.

use fitmac_core::{message::ObjectId, wire::GraspClass};
use kinematics::{
    rotation::UnitQuaternion,
    vector::{self, Vector3},
};

/// What an object does for others that lie on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Nothing: it is a thing to be moved.
    None,
    /// Things lie on its top.
    Surface,
    /// Things lie on its floor.
    Container,
}

/// An object: a box, or a bowl with a rim.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its identity.
    pub id: ObjectId,
    /// How it wants to be grasped.
    pub class: GraspClass,
    /// Centre, base frame, m.
    pub position_m: Vector3,
    /// Half extent, m.
    pub half_extent_m: Vector3,
    /// What it does for others.
    pub support: Support,
}

/// Thickness of a bowl's rim between the fingers, m.
const RIM_M: f64 = 0.005;
/// Thickness of a container's floor, m.
const FLOOR_M: f64 = 0.005;

impl Body {
    /// A thing to be moved that stands on a table of height 0.
    #[must_use]
    pub const fn thing(id: ObjectId, class: GraspClass, xy_m: [f64; 2], half_m: Vector3) -> Self {
        let ([x, y], [_, _, z]) = (xy_m, half_m);
        Self {
            id,
            class,
            position_m: [x, y, z],
            half_extent_m: half_m,
            support: Support::None,
        }
    }

    /// A fixture on a table of height 0.
    #[must_use]
    pub const fn fixture(id: ObjectId, support: Support, xy_m: [f64; 2], half_m: Vector3) -> Self {
        Self {
            support,
            ..Self::thing(id, GraspClass::Fixture, xy_m, half_m)
        }
    }

    /// The height at which it carries what is at `at_m`, m.
    pub(super) fn height_below(&self, at_m: Vector3) -> Option<f64> {
        let [dx, dy, _] = vector::sub(at_m, self.position_m);
        let [hx, hy, hz] = self.half_extent_m;
        let inside = dx.abs() <= hx && dy.abs() <= hy;
        match self.support {
            Support::Surface if inside => Some(self.position_m[2] + hz),
            Support::Container if inside => Some(self.position_m[2] - hz + FLOOR_M),
            _ => None,
        }
    }

    /// The width at which fingers at `ee_m` close on it; `None` if it does not
    /// stand between them.
    pub(super) fn grip_width(&self, ee_m: Vector3, hand: UnitQuaternion) -> Option<f64> {
        let [dx, dy, dz] = vector::sub(self.position_m, ee_m);
        let [hx, hy, hz] = self.half_extent_m;
        let [cx, cy, _] = hand.rotate([0.0, 1.0, 0.0]);
        match self.class {
            GraspClass::Fixture => None,
            GraspClass::Bowl => {
                let distance = dx.hypot(dy);
                let radial = (dx * cx + dy * cy).abs() / distance.max(1e-9);
                let at_rim = (distance - hx.min(hy)).abs() < 0.02 && radial > 0.7;
                let below_rim = -dz - hz;
                (at_rim && below_rim > -0.03 && below_rim < 0.01).then_some(RIM_M)
            }
            GraspClass::Box | GraspClass::Can | GraspClass::Bottle => {
                let half = cx.abs() * hx + cy.abs() * hy;
                let along = (dx * cx + dy * cy).abs();
                let across = (dx * cy - dy * cx).abs();
                let fits = along + half < 0.045 && across < 0.02 + 0.5 * hx.min(hy);
                (fits && dz.abs() < hz + 0.005).then_some(2.0 * half)
            }
        }
    }
}
