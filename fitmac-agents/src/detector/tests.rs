use std::io::{Read, Write};
use std::net::TcpListener;

use super::wordpiece::WordPiece;
use super::*;
use crate::canvas::Colour;

/// A camera 1 m above the table, looking straight down.
fn camera() -> Camera {
    Camera {
        name: "top".to_owned(),
        image_size_px: [100, 100],
        focal_px: [100.0, 100.0],
        principal_px: [50.0, 50.0],
        position_m: [0.5, 0.0, 1.0],
        rotation: [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
    }
}

const TABLE: Table = Table {
    centre_m: [0.5, 0.0, 0.0],
    half_extent_m: [0.4, 0.5],
};

#[test]
fn projection_and_its_inverse_agree() {
    let camera = camera();
    let point = [0.62, -0.13, 0.2];
    let pixel = camera.project(point).expect("before the camera");
    let back = camera.unproject(pixel, 0.8);
    for axis in 0..3 {
        assert!((back[axis] - point[axis]).abs() < 1e-12);
    }
    assert_eq!(camera.project([0.5, 0.0, 1.5]), None);
}

#[test]
fn a_box_is_placed_by_its_depth_or_by_the_table() {
    let camera = camera();
    // A box of 10 cm whose top is 0.1 m above the table, at x = 0.6, y = -0.2.
    let pixel = camera.project([0.6, -0.2, 0.1]).expect("seen");
    let size = 0.1 / 0.9 * 100.0;
    let found = ImageBox {
        label: "box".to_owned(),
        confidence: 0.7,
        box_px: [pixel[0] - size / 2.0, pixel[1] - size / 2.0, size, size],
    };
    let depth = vec![0.9_f32; 100 * 100];
    let view = View {
        depth_m: Some(&depth),
        table: Some(TABLE),
        ..View::default()
    };
    let placed = lift(&view, &camera, &found).expect("placed");
    assert!((placed.size_m[0] - 0.1).abs() < 1e-6);
    assert!((placed.position_m[1] + 0.2).abs() < 0.06, "{placed:?}");
    let flat = View {
        table: Some(TABLE),
        ..View::default()
    };
    assert!(lift(&flat, &camera, &found).is_some());
    assert_eq!(lift(&View::default(), &camera, &found), None);
    // Depth of another size is no depth.
    let short = View {
        depth_m: Some(&depth[..50]),
        ..View::default()
    };
    assert_eq!(lift(&short, &camera, &found), None);
}

fn serve(body: String) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("http://{}/", listener.local_addr().expect("an address"));
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let mut buffer = [0; 65536];
            let _ = stream.read(&mut buffer);
            let head = "HTTP/1.1 200 OK\r\nconnection: close\r\ncontent-length:";
            let _ = write!(stream, "{head} {}\r\n\r\n{body}", body.len());
        }
    });
    url
}

fn ask(body: &str) -> Result<Scene, DetectError> {
    let mut detector = RemoteDetector::new(RemoteConfig::new(&serve(body.to_owned())));
    let (image, camera) = (Canvas::filled(100, 100, Colour::GREY), camera());
    let view = View {
        image: Some(&image),
        camera: Some(&camera),
        table: Some(TABLE),
        ..View::default()
    };
    detector.detect(&view, &["bowl".to_owned()])
}

#[test]
fn a_remote_detector_is_checked() {
    let good = r#"{"boxes":[{"label":"bowl","confidence":0.8,"box_px":[40,40,10,10]}]}"#;
    let scene = ask(good).expect("a scene");
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(scene.check(), Ok(()));
    for (from, to) in [
        ("0.8", "8"),
        ("[40,40,10,10]", "[40,40,-10,10]"),
        ("[40,40,10,10]", "[40,40,1e300,10]"),
        ("\"label\":\"bowl\"", "\"label\":\"bowl\\u001b[2J\""),
        ("\"confidence\"", "\"gripper\":1,\"confidence\""),
        ("]}]}", "]}]"),
    ] {
        let bad = good.replace(from, to);
        assert_ne!(bad, good);
        assert!(matches!(ask(&bad), Err(DetectError::Failed(_))), "{to}");
    }
    let mut nowhere = RemoteDetector::new(RemoteConfig::new("http://127.0.0.1:9/"));
    let missing = nowhere.detect(&View::default(), &[]);
    assert_eq!(missing, Err(DetectError::Missing("image")));
}

#[test]
fn names_become_word_pieces() {
    let vocabulary = "[PAD]\n[UNK]\n[CLS]\n[SEP]\n.\nblack\nbowl\nram\n##ek\n##in\n";
    let pieces = WordPiece::new(vocabulary).expect("complete");
    let names = [
        "Black bowl".to_owned(),
        "ramekin".to_owned(),
        "xyz".to_owned(),
    ];
    let tokens = pieces.names(&names, 256);
    assert_eq!(tokens.ids, [2, 5, 6, 4, 7, 8, 9, 4, 1, 4, 3]);
    assert_eq!(tokens.names[1..4], [Some(0), Some(0), None]);
    assert_eq!(tokens.names[4..8], [Some(1), Some(1), Some(1), None]);
    // A name that doesn't fit is left out whole.
    assert_eq!(pieces.names(&names, 7).ids, [2, 5, 6, 4, 3]);
    assert!(WordPiece::new("black\nbowl").is_err());
}
