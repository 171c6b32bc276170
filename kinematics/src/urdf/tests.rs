use std::format;

use super::*;

fn joint(name: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>"#
    )
}

fn robot(links: &[&str], joints: &[String]) -> String {
    let links: String = links
        .iter()
        .map(|l| format!(r#"<link name="{l}"/>"#))
        .collect();
    format!(r#"<robot name="r">{links}{}</robot>"#, joints.concat())
}

const LIMIT: &str = r#"<limit lower="-1" upper="2" effort="1" velocity="0.5"/>"#;

fn arm() -> String {
    let turned = r#"<origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>"#;
    robot(
        &["a", "b", "c", "d", "e"],
        &[
            joint("mount", "fixed", "a", "b", turned),
            joint(
                "slide",
                "prismatic",
                "b",
                "c",
                &format!(r#"<axis xyz="1 0 0"/>{LIMIT}"#),
            ),
            joint(
                "turn",
                "continuous",
                "c",
                "d",
                r#"<origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>"#,
            ),
            joint("flange", "fixed", "d", "e", r#"<origin xyz="0.25 0 0"/>"#),
        ],
    )
}

#[test]
fn fixed_joints_are_folded_and_limits_kept() {
    let read = UrdfChain::parse(&arm(), "a", "e").expect("an arm");
    assert_eq!(read.joint_names, ["slide", "turn"]);
    let chain: Chain<2> = read.to_chain().expect("two joints");
    let slide = JointLimits {
        lower: -1.0,
        upper: 2.0,
        velocity: 0.5,
    };
    assert_eq!(chain.limits(), &[slide, JointLimits::NONE]);
    // The mount turns x to y.
    let tip = chain
        .tip(&[0.125, core::f64::consts::PI])
        .expect("finite")
        .position;
    let expected = [0.0, 0.5 + 0.125 - 0.25, 1.0];
    assert!(crate::vector::distance(tip, expected) < 1e-15, "{tip:?}");
}

#[test]
fn what_a_chain_cannot_have_is_refused_by_name() {
    let error = |joints: &[String], tip| {
        let text = robot(&["a", "b", "c"], joints);
        UrdfChain::parse(&text, "a", tip)
            .expect_err("refused")
            .to_string()
    };
    let floating = joint("free", "floating", "a", "b", "");
    assert!(error(&[floating], "b").contains("\"free\" is floating"));
    let mimic = format!(r#"{LIMIT}<mimic joint="lead"/>"#);
    let pair = [
        joint("lead", "revolute", "a", "b", LIMIT),
        joint("follow", "revolute", "b", "c", &mimic),
    ];
    assert!(error(&pair, "c").contains("\"follow\" mimics \"lead\""));
    assert!(error(&[], "x").contains("no link \"x\"; the links are: a, b, c"));
    assert!(error(&[], "b").contains("not moved by joints below"));
    let twice = [
        joint("p", "fixed", "a", "b", ""),
        joint("q", "fixed", "c", "b", ""),
    ];
    assert!(error(&twice, "b").contains("more than one parent"));
    let circle = [
        joint("p", "fixed", "c", "b", ""),
        joint("q", "fixed", "b", "c", ""),
    ];
    assert!(error(&circle, "b").contains("must be a tree"));
}

#[test]
fn bad_numbers_are_refused_by_name() {
    let with = |more: &str| {
        let text = robot(&["a", "b"], &[joint("elbow", "revolute", "a", "b", more)]);
        let error = UrdfChain::parse(&text, "a", "b").and_then(|c| c.to_chain::<1>());
        error.expect_err("refused").to_string()
    };
    assert!(
        with(&format!(r#"<axis xyz="0 0 0"/>{LIMIT}"#)).contains("\"elbow\": joint 0: the axis")
    );
    assert!(with(&format!(r#"<origin xyz="nan 0 0"/>{LIMIT}"#)).contains("elbow"));
    assert!(
        with(r#"<limit lower="2" upper="1" effort="1" velocity="1"/>"#).contains("lower limit")
    );
    let count = UrdfChain::parse(&arm(), "a", "e").and_then(|c| c.to_chain::<3>());
    assert!(
        count
            .expect_err("two joints")
            .to_string()
            .contains("has 2 joints, not 3")
    );
}

#[test]
fn malformed_text_is_an_error_wherever_it_is_cut() {
    let text = arm();
    for end in 0..text.len() {
        assert!(
            UrdfChain::parse(&text[..end], "a", "e").is_err(),
            "{}",
            &text[..end]
        );
    }
    for garbage in [
        "",
        "<robot/>",
        "<robot name='r'><link/></robot>",
        "\u{0}",
        "{}",
    ] {
        assert!(UrdfChain::parse(garbage, "a", "e").is_err());
    }
    let missing = UrdfChain::read(Path::new("no/such.urdf"), "a", "e").expect_err("no file");
    assert!(missing.to_string().contains("no/such.urdf"));
}

#[test]
fn paths_that_leave_their_package_are_refused() {
    let with = |path: &str| {
        let mesh = format!(
            r#"<robot name="r"><link name="a"><visual><geometry><mesh filename="{path}"/></geometry></visual></link><link name="b"/>{}</robot>"#,
            joint("j", "fixed", "a", "b", "")
        );
        UrdfChain::parse(&mesh, "a", "b")
    };
    for bad in [
        "package://p/../q/x.stl",
        "package://../x",
        "package://p/a/../../../etc",
        "../x.stl",
    ] {
        let error = with(bad).expect_err("escapes").to_string();
        assert!(error.contains(bad) && error.contains("\"a\""), "{error}");
    }
    for good in [
        "package://p/meshes/../x.stl",
        "meshes/x.stl",
        "file:///opt/robot/x.stl",
    ] {
        assert!(with(good).is_ok(), "{good}");
    }
}
