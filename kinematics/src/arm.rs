//! What inverse kinematics needs of an arm.

use crate::chain::{Chain, Frame, JointLimits, JointOutOfRange, Solution};

/// An arm of `N` joints that can say where its tip is.
pub trait Arm<const N: usize> {
    /// Limits of the joints.
    fn limits(&self) -> &[JointLimits; N];

    /// A distance from the base's origin that the tip never exceeds, in metres.
    fn reach_m(&self) -> f64;

    /// The frame of the tip.
    ///
    /// # Errors
    /// [`JointOutOfRange`] where a coordinate is not finite or beyond 1e6.
    fn tip(&self, q: &[f64; N]) -> Result<Frame, JointOutOfRange>;

    /// The frame of the tip and its Jacobian: base axes, reference point at the tip.
    ///
    /// # Errors
    /// As for [`Arm::tip`].
    fn solve(&self, q: &[f64; N]) -> Result<Solution<N>, JointOutOfRange>;
}

impl<const N: usize> Arm<N> for Chain<N> {
    fn limits(&self) -> &[JointLimits; N] {
        Chain::limits(self)
    }

    fn reach_m(&self) -> f64 {
        Chain::reach_m(self)
    }

    fn tip(&self, q: &[f64; N]) -> Result<Frame, JointOutOfRange> {
        Chain::tip(self, q)
    }

    fn solve(&self, q: &[f64; N]) -> Result<Solution<N>, JointOutOfRange> {
        Chain::solve(self, q)
    }
}
