//! Chains read from URDF files against Pinocchio.

use std::path::{Path, PathBuf};

use fitmac_tests::oracle;
use kinematics::arm::Arm;
use kinematics::chain::{Chain, JointKind};
use kinematics::panda::{self, Panda};
use kinematics::urdf::UrdfChain;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SAMPLES: usize = 10_000;

fn robots() -> PathBuf {
    let answer = oracle::run("kinematics_pinocchio.py", &["locate"], &[]);
    PathBuf::from(String::from_utf8(answer).expect("a path").trim())
}

/// Largest differences over all samples, relative to the arm's size.
#[derive(Debug, Default)]
struct Worst {
    rotation: f64,
    position: f64,
    jacobian: f64,
    body_jacobian: f64,
    bias: f64,
}

fn largest(ours: impl IntoIterator<Item = f64>, theirs: &[f64]) -> f64 {
    let ours: Vec<f64> = ours.into_iter().collect();
    assert_eq!(ours.len(), theirs.len());
    ours.iter()
        .zip(theirs)
        .fold(0.0, |m, (a, b)| f64::max(m, (a - b).abs()))
}

/// `samples` coordinates and velocities: any angle, any place on a slide.
fn samples<const N: usize>(seed: u64, chain: &UrdfChain) -> Vec<([f64; N], [f64; N])> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut sample = || {
        let q = std::array::from_fn(|i| match chain.joints[i].kind {
            JointKind::Revolute => rng.random_range(-3.2..3.2),
            JointKind::Prismatic => {
                let limits = chain.joints[i].limits;
                rng.random_range(limits.lower..=limits.upper)
            }
        });
        (q, std::array::from_fn(|_| rng.random_range(-1.0..1.0)))
    };
    (0..SAMPLES).map(|_| sample()).collect()
}

fn evaluate<const N: usize>(
    urdf: &Path,
    base: &str,
    tip: &str,
    samples: &[([f64; N], [f64; N])],
) -> Vec<f64> {
    let bytes: Vec<u8> = samples
        .iter()
        .flat_map(|(q, v)| q.iter().chain(v))
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let path = urdf.to_str().expect("a path in UTF-8");
    let answer = oracle::run(
        "kinematics_pinocchio.py",
        &["evaluate", path, base, tip],
        &bytes,
    );
    oracle::floats(&answer)
}

/// Compares an arm with what Pinocchio makes of the same file.
fn compare<const N: usize>(
    arm: &Chain<N>,
    samples: &[([f64; N], [f64; N])],
    theirs: &[f64],
) -> Worst {
    let size = arm.reach_m().max(1.0);
    let mut worst = Worst::default();
    let rows = theirs.chunks_exact(12 + 12 * N + 6);
    assert_eq!(rows.len(), samples.len());
    for ((q, v), row) in samples.iter().zip(rows) {
        let ours = arm.solve(q).expect("finite");
        let (rotation, row) = row.split_at(9);
        let (position, row) = row.split_at(3);
        let (jacobian, row) = row.split_at(6 * N);
        let (body, bias) = row.split_at(6 * N);
        let of = ours.tip.rotation.iter().flatten().copied();
        worst.rotation = worst.rotation.max(largest(of, rotation));
        let of = ours.tip.position;
        worst.position = worst.position.max(largest(of, position) / size);
        let of = ours.jacobian.rows().into_iter().flatten();
        worst.jacobian = worst.jacobian.max(largest(of, jacobian) / size);
        let of = ours
            .jacobian
            .in_body(&ours.tip.rotation)
            .rows()
            .into_iter()
            .flatten();
        worst.body_jacobian = worst.body_jacobian.max(largest(of, body) / size);
        let of = arm.jacobian_dot_velocity(q, v).expect("finite");
        worst.bias = worst.bias.max(largest(of, bias) / size);
    }
    worst
}

fn check<const N: usize>(seed: u64, file: &str, base: &str, tip: &str) {
    let urdf = robots().join(file);
    let read = UrdfChain::read(&urdf, base, tip).unwrap_or_else(|e| panic!("{file}: {e}"));
    let path = urdf.to_str().expect("a path in UTF-8");
    let names = oracle::run("kinematics_pinocchio.py", &["joints", path, base, tip], &[]);
    let names = String::from_utf8(names).expect("names");
    assert_eq!(
        read.joint_names,
        names.lines().collect::<Vec<_>>(),
        "{file}"
    );
    let arm: Chain<N> = read.to_chain().unwrap_or_else(|e| panic!("{file}: {e}"));
    let samples = samples(seed, &read);
    let worst = compare(&arm, &samples, &evaluate(&urdf, base, tip, &samples));
    println!(
        "{file}, {N} joints, reach {:.2} m: {worst:?}",
        arm.reach_m()
    );
    let Worst {
        rotation,
        position,
        jacobian,
        body_jacobian,
        bias,
    } = worst;
    for value in [rotation, position, jacobian, body_jacobian, bias] {
        assert!(value < 1e-12, "{file}: {worst:?}");
    }
}

#[test]
fn panda() {
    check::<7>(
        1,
        "panda_description/urdf/panda.urdf",
        "panda_link0",
        "panda_hand_tcp",
    );
}

#[test]
fn ur3() {
    check::<6>(
        2,
        "ur_description/urdf/ur3_robot.urdf",
        "base_link",
        "ee_link",
    );
}

#[test]
fn ur5() {
    check::<6>(
        3,
        "ur_description/urdf/ur5_robot.urdf",
        "base_link",
        "ee_link",
    );
}

#[test]
fn ur10() {
    check::<6>(
        4,
        "ur_description/urdf/ur10_robot.urdf",
        "base_link",
        "ee_link",
    );
}

#[test]
fn kinova() {
    check::<6>(
        5,
        "kinova_description/robots/kinova.urdf",
        "j2s6s200_link_base",
        "j2s6s200_end_effector",
    );
}

#[test]
fn xarm7() {
    check::<7>(6, "xarm_description/urdf/xarm7.urdf", "link_base", "link7");
}

#[test]
fn z1() {
    check::<6>(7, "z1_description/urdf/z1.urdf", "link00", "link06");
}

/// A lift under the arm: a prismatic joint.
#[test]
fn tiago() {
    check::<8>(
        8,
        "tiago_description/robots/tiago.urdf",
        "torso_fixed_link",
        "arm_tool_link",
    );
}

/// A base that is itself mounted on something that can move.
#[test]
fn baxter() {
    check::<7>(
        9,
        "baxter_description/urdf/baxter.urdf",
        "left_arm_mount",
        "left_gripper_base_link",
    );
}

/// The constants of the Panda are those of the file: limits exactly, frames to rounding.
#[test]
fn the_panda_constants_are_those_of_the_urdf() {
    let urdf = robots().join("panda_description/urdf/panda.urdf");
    let read = UrdfChain::read(&urdf, "panda_link0", "panda_hand_tcp").expect("the Panda");
    for (joint, limits) in read.joints.iter().zip(panda::LIMITS) {
        assert_eq!(joint.limits, limits);
    }
    let chain: Chain<7> = read.to_chain().expect("seven joints");
    for (q, _) in samples::<7>(10, &read) {
        let (file, ours) = (
            chain.solve(&q).expect("finite"),
            Panda.solve(&q).expect("finite"),
        );
        let flat = |m: [[f64; 3]; 3]| m.into_iter().flatten().collect::<Vec<_>>();
        assert!(largest(flat(ours.tip.rotation), &flat(file.tip.rotation)) < 1e-14);
        assert!(largest(ours.tip.position, &file.tip.position) < 1e-14);
        let columns = file.jacobian.columns.concat();
        assert!(largest(ours.jacobian.columns.concat(), &columns) < 1e-14);
    }
}
