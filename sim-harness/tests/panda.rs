//! The robot's two descriptions agree with each other and with what they are made from.

use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use rand::{RngExt as _, SeedableRng as _};
use sim_harness::panda::{ARM_JOINTS, HOME_RAD, MJCF, URDF};

/// Both descriptions, compiled by MuJoCo. A URDF's fixed links would be merged into their parents,
/// which hides the hand: that is switched off.
fn models() -> (MjModel, MjModel) {
    let keep = r#"<robot name="panda">
  <mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco>"#;
    assert!(URDF.contains(r#"<robot name="panda">"#));
    let urdf = URDF.replace(r#"<robot name="panda">"#, keep);
    (
        MjModel::from_xml_string(MJCF).unwrap(),
        MjModel::from_xml_string(&urdf).unwrap(),
    )
}

fn body(model: &MjModel, name: &str) -> usize {
    model
        .name_to_id(MjtObjBase::mjOBJ_BODY, name)
        .unwrap_or_else(|| panic!("no body {name}"))
}

const BODIES: [(&str, &str); 11] = [
    ("link1", "panda_link1"),
    ("link2", "panda_link2"),
    ("link3", "panda_link3"),
    ("link4", "panda_link4"),
    ("link5", "panda_link5"),
    ("link6", "panda_link6"),
    ("link7", "panda_link7"),
    ("hand", "panda_hand"),
    ("left_finger", "panda_leftfinger"),
    ("right_finger", "panda_rightfinger"),
    ("link0", "panda_link0"),
];

#[test]
fn kinematics_agree_over_the_whole_range() {
    let (mjcf, urdf) = models();
    let mut a = MjData::new(&mjcf);
    let mut b = MjData::new(&urdf);
    let tcp_site = mjcf.name_to_id(MjtObjBase::mjOBJ_SITE, "tcp").unwrap();
    let tcp_body = body(&urdf, "panda_hand_tcp");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    for _ in 0..200 {
        for joint in 0..ARM_JOINTS + 2 {
            let [low, high] = mjcf.jnt_range()[joint];
            let q = rng.random_range(low..=high);
            a.qpos_mut()[joint] = q;
            b.qpos_mut()[joint] = q;
        }
        a.forward();
        b.forward();
        for (in_mjcf, in_urdf) in &BODIES[..10] {
            let (x, y) = (body(&mjcf, in_mjcf), body(&urdf, in_urdf));
            for i in 0..3 {
                assert!((a.xpos()[x][i] - b.xpos()[y][i]).abs() < 1e-12, "{in_mjcf}");
            }
            for i in 0..9 {
                assert!((a.xmat()[x][i] - b.xmat()[y][i]).abs() < 1e-12, "{in_mjcf}");
            }
        }
        for i in 0..3 {
            assert!((a.site_xpos()[tcp_site][i] - b.xpos()[tcp_body][i]).abs() < 1e-12);
        }
    }
}

#[test]
fn limits_agree() {
    let (mjcf, urdf) = models();
    for joint in 0..ARM_JOINTS + 2 {
        assert_eq!(
            mjcf.jnt_range()[joint],
            urdf.jnt_range()[joint],
            "joint {joint}"
        );
    }
    // MuJoCo reads a URDF's effort as the joint's actuator force range.
    for joint in 0..ARM_JOINTS {
        let torque = mjcf.actuator_ctrlrange()[joint];
        assert_eq!(torque, urdf.jnt_actfrcrange()[joint], "joint {joint}");
        assert_eq!(torque[1], if joint < 4 { 87.0 } else { 12.0 });
    }
}

#[test]
fn inertias_agree() {
    let (mjcf, urdf) = models();
    for (in_mjcf, in_urdf) in BODIES {
        let (x, y) = (body(&mjcf, in_mjcf), body(&urdf, in_urdf));
        assert!(
            (mjcf.body_mass()[x] - urdf.body_mass()[y]).abs() < 1e-12,
            "{in_mjcf}"
        );
        for i in 0..3 {
            let (p, q) = (mjcf.body_ipos()[x][i], urdf.body_ipos()[y][i]);
            assert!((p - q).abs() < 1e-12, "{in_mjcf}: centre of mass");
        }
        let difference = inertia(&mjcf, x) - inertia(&urdf, y);
        assert!(difference.norm() < 1e-12, "{in_mjcf}: {difference}");
    }
}

/// The inertia about the centre of mass in the body's own axes. MuJoCo keeps it diagonalised, and
/// in what order depends on how it was given.
fn inertia(model: &MjModel, body: usize) -> nalgebra::Matrix3<f64> {
    let [w, x, y, z] = model.body_iquat()[body];
    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let axes = q.to_rotation_matrix();
    let principal = nalgebra::Matrix3::from_diagonal(&model.body_inertia()[body].into());
    axes.matrix() * principal * axes.matrix().transpose()
}

#[test]
fn the_tool_is_where_the_published_table_puts_it() {
    // Forward kinematics of Franka's modified Denavit-Hartenberg table, written out by hand.
    const A: [f64; 7] = [0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088];
    const D: [f64; 7] = [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0];
    const HALF: f64 = std::f64::consts::FRAC_PI_2;
    const ALPHA: [f64; 7] = [0.0, -HALF, HALF, HALF, -HALF, HALF, HALF];
    let craig = |i: usize, q: f64| {
        let ((sq, cq), (sa, ca)) = (q.sin_cos(), ALPHA[i].sin_cos());
        nalgebra::Matrix4::new(
            cq,
            -sq,
            0.0,
            A[i], //
            sq * ca,
            cq * ca,
            -sa,
            -D[i] * sa, //
            sq * sa,
            cq * sa,
            ca,
            D[i] * ca, //
            0.0,
            0.0,
            0.0,
            1.0,
        )
    };
    let chain = (0..7).fold(nalgebra::Matrix4::identity(), |t, i| {
        t * craig(i, HOME_RAD[i])
    });
    let tool = chain * nalgebra::Vector4::new(0.0, 0.0, 0.107 + 0.1034, 1.0);
    let model = MjModel::from_xml_string(MJCF).unwrap();
    let mut data = MjData::new(&model);
    data.qpos_mut()[..ARM_JOINTS].copy_from_slice(&HOME_RAD);
    data.forward();
    let site = model.name_to_id(MjtObjBase::mjOBJ_SITE, "tcp").unwrap();
    for i in 0..3 {
        assert!((data.site_xpos()[site][i] - tool[i]).abs() < 1e-12);
    }
}
