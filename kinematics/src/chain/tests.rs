use proptest::prelude::*;

use super::*;
use crate::arm::Arm;
use crate::panda::{self, Panda};
use crate::rotation::UnitQuaternion;
use crate::vector::{norm, sub};

/// A chain without any special angle or place, with a prismatic joint in the middle.
fn skew() -> Chain<5> {
    let joint = |k: f64, kind| Joint {
        rotation: UnitQuaternion::from_rpy(0.3 * k, -0.7 + k, 1.9 * k).to_matrix(),
        translation: [0.1 * k, 0.3 - 0.05 * k, -0.2],
        axis: [0.2 - k, 0.5, 0.1 + 0.3 * k],
        kind,
        limits: JointLimits {
            lower: -2.0,
            upper: 2.0,
            velocity: 1.0,
        },
    };
    let turn = JointKind::Revolute;
    let joints = [
        joint(0.0, turn),
        joint(1.0, turn),
        joint(2.0, JointKind::Prismatic),
        joint(3.0, turn),
        joint(4.0, turn),
    ];
    let tip = UnitQuaternion::from_rpy(0.1, 0.2, 0.3).to_matrix();
    Chain::new(&joints, &tip, [0.1, 0.0, 0.2]).expect("a chain")
}

/// The same by plain products of poses.
fn skew_by_poses(q: &[f64; 5]) -> Pose {
    let mut pose = Pose::IDENTITY;
    for (i, q) in q.iter().enumerate() {
        let k = i as f64;
        pose = pose
            * Pose::new(
                [0.1 * k, 0.3 - 0.05 * k, -0.2],
                UnitQuaternion::from_rpy(0.3 * k, -0.7 + k, 1.9 * k),
            );
        let axis = normalized([0.2 - k, 0.5, 0.1 + 0.3 * k]).expect("an axis");
        pose = pose
            * if i == 2 {
                Pose::from_position(vector::scale(axis, *q))
            } else {
                Pose::new(
                    [0.0; 3],
                    UnitQuaternion::from_axis_angle(axis, *q).expect("an axis"),
                )
            };
    }
    pose * Pose::new([0.1, 0.0, 0.2], UnitQuaternion::from_rpy(0.1, 0.2, 0.3))
}

fn close(a: Frame, b: Frame) -> bool {
    let rotations = a.rotation.iter().flatten().zip(b.rotation.iter().flatten());
    norm(sub(a.position, b.position)) < 1e-14
        && rotations.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) < 1e-14
}

fn angles<const N: usize>() -> impl Strategy<Value = [f64; N]> {
    prop::collection::vec(-3.0..3.0_f64, N).prop_map(|v| core::array::from_fn(|i| v[i]))
}

/// The difference quotient of the tip, linear over angular, in base axes.
fn quotient<const N: usize>(arm: &impl Arm<N>, q: &[f64; N], joint: usize) -> [f64; 6] {
    let h = 1e-6;
    let at = |d: f64| {
        let mut moved = *q;
        moved[joint] += d;
        arm.tip(&moved).expect("finite").pose()
    };
    let (v, w) = at(-h).error_to(at(h));
    [v[0], v[1], v[2], w[0], w[1], w[2]].map(|x| x / (2.0 * h))
}

proptest! {
    #[test]
    fn a_skew_chain_agrees_with_products_of_poses(q in angles::<5>()) {
        let frame = skew().tip(&q).expect("finite");
        let pose = skew_by_poses(&q);
        let expected = Frame { rotation: pose.orientation.to_matrix(), position: pose.position };
        prop_assert!(close(frame, expected), "{frame:?} {expected:?}");
    }

    #[test]
    fn the_jacobian_is_the_derivative(q in angles::<5>(), p in angles::<7>()) {
        let jacobian = skew().solve(&q).expect("finite").jacobian;
        for (joint, column) in jacobian.columns.iter().enumerate() {
            for (a, b) in column.iter().zip(quotient(&skew(), &q, joint)) {
                prop_assert!((a - b).abs() < 1e-8, "joint {joint}: {a} {b}");
            }
        }
        let jacobian = Panda.solve(&p).expect("finite").jacobian;
        for (joint, column) in jacobian.columns.iter().enumerate() {
            for (a, b) in column.iter().zip(quotient(&Panda, &p, joint)) {
                prop_assert!((a - b).abs() < 1e-8, "joint {joint}: {a} {b}");
            }
        }
    }

    #[test]
    fn the_bias_is_the_derivative_of_the_jacobian(q in angles::<5>(), v in angles::<5>()) {
        let h = 1e-6;
        let twist = |d: f64| {
            let moved: [f64; 5] = core::array::from_fn(|i| q[i] + d * v[i]);
            skew().solve(&moved).expect("finite").jacobian.times(&v)
        };
        let (before, after) = (twist(-h), twist(h));
        let bias = skew().jacobian_dot_velocity(&q, &v).expect("finite");
        for i in 0..6 {
            let expected = (after[i] - before[i]) / (2.0 * h);
            prop_assert!((bias[i] - expected).abs() < 1e-6 * (1.0 + expected.abs()));
        }
    }

    #[test]
    fn the_panda_is_its_chain(q in angles::<7>()) {
        let chain = panda::chain().expect("the constants are a chain");
        let (fast, general) = (Panda.solve(&q).expect("finite"), chain.solve(&q).expect("finite"));
        prop_assert!(close(fast.tip, general.tip));
        let pairs = fast.jacobian.columns.iter().flatten().zip(general.jacobian.columns.iter().flatten());
        prop_assert!(pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) < 1e-15 * 8.0);
        prop_assert!(close(chain.tip(&q).expect("finite"), general.tip));
        prop_assert!(close(Panda.tip(&q).expect("finite"), fast.tip));
    }

    #[test]
    fn a_tool_moves_the_tip(q in angles::<5>()) {
        let tool = Pose::new([0.05, -0.1, 0.2], UnitQuaternion::from_rpy(0.4, -1.2, 2.0));
        let with = skew().with_tool(tool).expect("a pose");
        let expected = skew_by_poses(&q) * tool;
        let expected = Frame { rotation: expected.orientation.to_matrix(), position: expected.position };
        prop_assert!(close(with.tip(&q).expect("finite"), expected));
        let (a, b) = (with.links(&q).expect("finite"), skew().links(&q).expect("finite"));
        prop_assert!(a.iter().zip(&b).all(|(a, b)| close(*a, *b)));
    }

    #[test]
    fn body_and_spatial_jacobians_follow_from_the_base_one(q in angles::<7>()) {
        let Solution { tip, jacobian } = Panda.solve(&q).expect("finite");
        let body = jacobian.in_body(&tip.rotation);
        prop_assert!((body.manipulability() - jacobian.manipulability()).abs() < 1e-12);
        // The first joint turns about the base's z axis: no velocity at the base's origin.
        let first = jacobian.at_base_origin(tip.position).columns[0];
        let expected = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        prop_assert!(first.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}

#[test]
fn the_last_link_carries_the_tip() {
    let q = [0.3, -0.4, 0.5, -1.6, 0.7, 1.8, 0.9];
    let chain = panda::chain().expect("the constants are a chain");
    let links = chain.links(&q).expect("finite").map(|f| f.pose());
    let hand = Pose::new(
        [0.0, 0.0, 0.2104],
        UnitQuaternion::from_yaw(-core::f64::consts::FRAC_PI_4),
    );
    let tip = chain.tip(&q).expect("finite").pose();
    assert!((links[6] * hand).distance(tip) < 1e-15);
    assert!((links[6] * hand).orientation.angle_to(tip.orientation) < 1e-14);
    assert_eq!(links[0].position, [0.0, 0.0, 0.333]);
}

#[test]
fn a_straight_panda_is_singular() {
    assert!(
        Panda
            .solve(&[0.0; 7])
            .expect("finite")
            .jacobian
            .manipulability()
            < 1e-6
    );
    assert!(
        Panda
            .solve(&panda::READY)
            .expect("finite")
            .jacobian
            .manipulability()
            > 0.05
    );
}

#[test]
fn bad_coordinates_are_named() {
    let mut q = panda::READY;
    for bad in [f64::NAN, f64::INFINITY, -2e6] {
        q[4] = bad;
        assert_eq!(Panda.tip(&q), Err(JointOutOfRange { joint: 4 }));
        let chain = panda::chain().expect("the constants are a chain");
        assert_eq!(chain.solve(&q).err(), Some(JointOutOfRange { joint: 4 }));
        assert_eq!(chain.links(&q).err(), Some(JointOutOfRange { joint: 4 }));
    }
}

#[test]
fn bad_descriptions_are_named() {
    let good = Joint {
        rotation: IDENTITY3,
        translation: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        kind: JointKind::Revolute,
        limits: JointLimits::NONE,
    };
    let chain = |second: Joint| Chain::new(&[good, second], &IDENTITY3, [0.0; 3]).err();
    assert_eq!(chain(good), None);
    assert_eq!(
        chain(Joint {
            axis: [0.0; 3],
            ..good
        }),
        Some(ChainError::Axis { joint: 1 })
    );
    let stretched = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(
        chain(Joint {
            rotation: stretched,
            ..good
        }),
        Some(ChainError::Transform { joint: 1 })
    );
    let empty = JointLimits {
        lower: 1.0,
        upper: -1.0,
        velocity: 1.0,
    };
    assert_eq!(
        chain(Joint {
            limits: empty,
            ..good
        }),
        Some(ChainError::Limits { joint: 1 })
    );
    assert_eq!(
        Chain::new(&[good], &stretched, [0.0; 3]).err(),
        Some(ChainError::Transform { joint: 1 })
    );
}
