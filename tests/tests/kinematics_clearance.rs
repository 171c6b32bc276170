//! Distances to obstacles against parry.

use kinematics::clearance::Obstacle;
use kinematics::{Pose, UnitQuaternion};
use parry3d_f64::math::{Pose as Isometry, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cuboid, Cylinder, HalfSpace, Shape};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn vector(v: [f64; 3]) -> Vector {
    Vector::new(v[0], v[1], v[2])
}

fn isometry(pose: Pose) -> Isometry {
    let [w, x, y, z] = pose.orientation.wxyz();
    Isometry::from_parts(vector(pose.position), Rotation::from_xyzw(x, y, z, w))
}

/// A random obstacle, and the same as a shape of parry's with its place.
fn obstacle(rng: &mut ChaCha8Rng) -> (Obstacle, Box<dyn Shape>, Isometry) {
    let mut point = |size: f64| std::array::from_fn(|_| rng.random_range(-size..size));
    let pose = Pose::new(point(0.5), UnitQuaternion::from_rotation_vector(point(2.0)));
    let [a, b, c] = point(0.2).map(|x: f64| x.abs() + 0.02);
    match rng.random_range(0..4) {
        0 => {
            let shape = Box::new(Cuboid::new(vector([a, b, c])));
            (
                Obstacle::Box {
                    pose,
                    half_extents_m: [a, b, c],
                },
                shape,
                isometry(pose),
            )
        }
        1 => {
            // Parry's cylinders stand on y, ours on z.
            let upright = UnitQuaternion::from_rpy(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
            let at = Pose::new(pose.position, pose.orientation * upright);
            let shape = Box::new(Cylinder::new(a, b));
            (
                Obstacle::Cylinder {
                    pose,
                    radius_m: b,
                    half_length_m: a,
                },
                shape,
                isometry(at),
            )
        }
        2 => {
            let at = Pose::from_position(pose.position);
            let ball = Obstacle::Sphere {
                center: pose.position,
                radius_m: a,
            };
            (ball, Box::new(Ball::new(a)), isometry(at))
        }
        _ => {
            let normal = pose.transform_vector([0.0, 0.0, 1.0]);
            let plane = Obstacle::HalfSpace {
                point: pose.position,
                normal,
            };
            let shape = Box::new(HalfSpace::new(vector([0.0, 0.0, 1.0])));
            (plane, shape, isometry(pose))
        }
    }
}

/// A sphere moved along a straight line is a capsule: its distance is ours less the radius.
#[test]
fn swept_spheres_are_as_far_from_obstacles_as_capsules() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut apart, mut over, mut under) = (0, 0.0_f64, 0.0_f64);
    for _ in 0..20_000 {
        let (ours, theirs, place) = obstacle(&mut rng);
        let mut point = || std::array::from_fn(|_| rng.random_range(-0.8..0.8));
        let (from, to): ([f64; 3], [f64; 3]) = (point(), point());
        let radius = rng.random_range(0.005..0.05);
        let capsule = Capsule::new(vector(from), vector(to), radius);
        let expected = query::distance(&Isometry::IDENTITY, &capsule, &place, &*theirs)
            .expect("parry knows these shapes")
            .distance;
        let clearance = ours.distance_to_segment_m(from, to).0 - radius;
        if expected > 0.0 {
            apart += 1;
            over = over.max(clearance - expected);
            under = under.max(expected - clearance);
        } else {
            assert!(
                clearance < 1e-6,
                "{clearance} but parry has them touch: {ours:?}"
            );
        }
    }
    println!("{apart} of 20000 apart; ours is at most {over:.1e} m larger, {under:.1e} m smaller");
    assert!(apart > 5_000, "{apart}");
    // Ours is the distance of an actual point of the segment, so it cannot be too small; parry's
    // iteration on round bodies stops some micrometres before its end.
    assert!(over < 1e-8, "{over:e}");
    assert!(under < 5e-5, "{under:e}");
}
