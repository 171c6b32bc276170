use super::*;

const TABLE: Obstacle = Obstacle::HalfSpace {
    point: [0.0, 0.0, 0.1],
    normal: [0.0, 0.0, 2.0],
};

fn down(position: Vector3) -> Pose {
    Pose::new(position, UnitQuaternion::HALF_TURN_X)
}

#[test]
fn hover_over_a_table_clears_by_the_height_of_the_finger_tips() {
    let path = [down([0.4, 0.0, 0.3]), down([0.4, 0.0, 0.15])];
    let place = narrowest(&PANDA_HAND, &path, &[TABLE])
        .expect("valid")
        .expect("one");
    assert!(
        (place.clearance_m - (0.05 - 0.014)).abs() < 1e-12,
        "{place:?}"
    );
    assert_eq!((place.leg, place.at), (0, 1.0));
    assert!(place.probe < 2);
}

#[test]
fn transport_through_a_box_is_negative_and_says_where() {
    let wall = Obstacle::Box {
        pose: Pose::from_position([0.5, 0.0, 0.2]),
        half_extents_m: [0.02, 0.3, 0.2],
    };
    let path = [
        down([0.3, 0.0, 0.3]),
        down([0.7, 0.0, 0.3]),
        down([0.7, 0.0, 0.6]),
    ];
    let place = narrowest(&PANDA_HAND, &path, &[TABLE, wall])
        .expect("valid")
        .expect("one");
    assert_eq!((place.obstacle, place.leg), (1, 0));
    assert!(
        place.clearance_m < 0.0 && (place.at - 0.5).abs() < 0.15,
        "{place:?}"
    );
    let above = path.map(|p| p.translated([0.0, 0.0, 0.25]));
    let place = narrowest(&PANDA_HAND, &above, &[wall])
        .expect("valid")
        .expect("one");
    assert!(place.clearance_m > 0.05, "{place:?}");
}

#[test]
fn a_turning_hand_sweeps_a_disc() {
    // Half a turn about z: a sphere at 10 cm passes the post, though both ends are clear of it.
    let probe = [Probe {
        center: [0.1, 0.0, 0.0],
        radius_m: 0.01,
    }];
    let turn = |yaw| Pose::new([0.0; 3], UnitQuaternion::from_yaw(yaw));
    let post = Obstacle::Cylinder {
        pose: Pose::from_position([0.0, 0.1, 0.0]),
        radius_m: 0.005,
        half_length_m: 0.2,
    };
    let place = narrowest(&probe, &[turn(0.0), turn(3.0)], &[post])
        .expect("valid")
        .expect("one");
    assert!(
        place.clearance_m <= -0.015 && place.clearance_m > -0.0155,
        "{place:?}"
    );
    let resting = narrowest(&probe, &[turn(0.0)], &[post])
        .expect("valid")
        .expect("one");
    assert!(resting.clearance_m > 0.12, "{resting:?}");
}

#[test]
fn a_split_path_has_the_same_narrowest_place() {
    let ball = Obstacle::Sphere {
        center: [0.3, 0.2, 0.1],
        radius_m: 0.07,
    };
    let (a, b) = (down([0.0, 0.0, 0.3]), down([0.6, 0.3, 0.2]));
    let middle = down(lerp(a.position, b.position, 0.37));
    let whole = narrowest(&PANDA_HAND, &[a, b], &[ball])
        .expect("valid")
        .expect("one");
    let split = narrowest(&PANDA_HAND, &[a, middle, b], &[ball])
        .expect("valid")
        .expect("one");
    assert!((whole.clearance_m - split.clearance_m).abs() < 1e-9);
}

#[test]
fn nothing_to_meet_is_no_place() {
    assert_eq!(narrowest(&[], &[Pose::IDENTITY], &[TABLE]), Ok(None));
    assert_eq!(narrowest(&PANDA_HAND, &[], &[TABLE]), Ok(None));
    assert_eq!(narrowest(&PANDA_HAND, &[Pose::IDENTITY], &[]), Ok(None));
}

#[test]
fn bad_requests_are_named() {
    let path = [Pose::IDENTITY, Pose::from_position([f64::NAN, 0.0, 0.0])];
    assert_eq!(
        narrowest(&PANDA_HAND, &path, &[TABLE]),
        Err(Refusal::Path { pose: 1 })
    );
    let flat = Obstacle::HalfSpace {
        point: [0.0; 3],
        normal: [0.0; 3],
    };
    let refused = narrowest(&PANDA_HAND, &path[..1], &[TABLE, flat]);
    assert_eq!(refused, Err(Refusal::Obstacle { obstacle: 1 }));
    let negative = [Probe {
        center: [0.0; 3],
        radius_m: -1.0,
    }];
    assert_eq!(
        narrowest(&negative, &path[..1], &[TABLE]),
        Err(Refusal::Probe { probe: 0 })
    );
}
