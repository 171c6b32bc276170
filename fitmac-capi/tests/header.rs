//! `include/fitmac.h` is what the source says.
//!
//! `FITMAC_WRITE_HEADER=1 cargo test -p fitmac-capi --test header` writes it anew.

use std::{fmt::Write as _, fs, path::Path};

use fitmac_core::{evidence, intake::Refusal, message, message::Command, reason, wire};

#[test]
fn the_header_is_made_from_the_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("include/fitmac.h");
    let made = generate(root);
    if std::env::var_os("FITMAC_WRITE_HEADER").is_some() {
        fs::write(&path, &made).expect("the header can be written");
    }
    let found = fs::read_to_string(&path).expect("the header can be read");
    let stale = made
        .lines()
        .zip(found.lines())
        .find(|(made, found)| made != found);
    assert!(
        made == found,
        "include/fitmac.h is stale, first at {stale:?}: run \
         `FITMAC_WRITE_HEADER=1 cargo test -p fitmac-capi --test header`"
    );
    let unresolved = made
        .lines()
        .find(|line| line.contains("[`") || line.contains("crate::"));
    assert_eq!(unresolved, None, "a link that only Rust understands");
}

const HEAD: &str = "\
/* fitmac.h - the C interface of the FIT-MAC decision core.
 *
 * Made from the Rust source by cbindgen: do not edit.
 *
 * Units are SI, positions are in the robot's base frame, quaternions are
 * (w, x, y, z), times are nanoseconds of one monotonic clock. Messages are
 * plain data without padding, the same in memory, in traces and in Rust.
 *
 * Nothing is allocated: objects live in memory of the caller, whose size and
 * alignment (16) are asked for, or given by the *_STORAGE constants. Every
 * function answers with a status; none throws or unwinds.
 *
 * FIT-MAC is not a safety function: keep the robot's own stops in place.
 */";

fn generate(root: &Path) -> String {
    let config = root.join("cbindgen.toml");
    let mut config = cbindgen::Config::from_file(config).expect("cbindgen.toml is well formed");
    config.header = Some(HEAD.to_owned());
    config.after_includes = Some(constants());
    let bindings = cbindgen::generate_with_config(root, config).expect("cbindgen reads the source");
    let mut bytes = Vec::new();
    bindings.write(&mut bytes);
    let text = String::from_utf8(bytes).expect("the source is UTF-8");
    // cbindgen's own constants of types have no spelling of ours.
    let kept = without_type_constants(&text);
    in_words_of_c(&kept)
}

/// Links of Rust's documentation as names that stand in the header.
fn in_words_of_c(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("[`") {
        let (link, behind) = after.split_once("`]").expect("a link ends");
        out.push_str(before);
        out.push_str(&match link {
            "crate::reason" => "`FITMAC_REASON_*`".to_owned(),
            "crate::evidence" => "`FITMAC_EVIDENCE_*`".to_owned(),
            "Command::CLAMPED" => "`FITMAC_COMMAND_CLAMPED`".to_owned(),
            "SUBTASK_CAPACITY" => "`FITMAC_SUBTASK_CAPACITY`".to_owned(),
            "fitmac_tick" => "fitmac_tick".to_owned(),
            name => {
                let name = name.rsplit("::").next().unwrap_or(name);
                format!("`FITMAC_{}_*`", screaming(name))
            }
        });
        rest = behind;
    }
    out.push_str(rest);
    out.replace("# Safety\n", "The caller's part:\n")
}

/// Drops `#define Type_NAME value` lines and the comments above them.
fn without_type_constants(text: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    for line in text.lines() {
        if line.starts_with("#define fitmac_") {
            while kept
                .last()
                .is_some_and(|l| l.starts_with("/**") || l.starts_with(" *"))
            {
                kept.pop();
            }
        } else {
            kept.push(line);
        }
    }
    kept.join("\n") + "\n"
}

/// Capacities, codes and bits: what stands in macros that cbindgen can't read.
fn constants() -> String {
    let mut out = String::from("\n/* Sizes. */\n");
    for (name, value) in [
        ("ABI_VERSION", u64::from(fitmac_capi::FITMAC_ABI_VERSION)),
        ("CHUNK_CAPACITY", message::CHUNK_CAPACITY as u64),
        ("ACTION_DIM", message::ACTION_DIM as u64),
        ("CANDIDATE_CAPACITY", message::CANDIDATE_CAPACITY as u64),
        ("OBJECT_CAPACITY", message::OBJECT_CAPACITY as u64),
        ("SUBTASK_CAPACITY", message::SUBTASK_CAPACITY as u64),
        ("JOINT_COUNT", message::JOINT_COUNT as u64),
        ("CONFIG_STORAGE", fitmac_capi::FITMAC_CONFIG_STORAGE as u64),
        (
            "CONTROLLER_STORAGE",
            fitmac_capi::FITMAC_CONTROLLER_STORAGE as u64,
        ),
        (
            "SNAPSHOT_STORAGE",
            fitmac_capi::FITMAC_SNAPSHOT_STORAGE as u64,
        ),
    ] {
        line(&mut out, name, &value.to_string());
    }
    out.push_str("\n/* Flags of a command. */\n");
    for (name, bit) in [
        ("COMMAND_CLAMPED", Command::CLAMPED),
        ("COMMAND_LIMITED", Command::LIMITED),
        ("COMMAND_LAST", Command::LAST),
        ("COMMAND_FROM_POLICY", Command::FROM_POLICY),
    ] {
        line(&mut out, name, &format!("{bit:#x}u"));
    }
    out.push_str("\n/* The host's floating-point state: see fitmac_float_state(). */\n");
    for (name, bit) in [
        (
            "FLOAT_FLUSH_TO_ZERO",
            fitmac_capi::FITMAC_FLOAT_FLUSH_TO_ZERO,
        ),
        (
            "FLOAT_DENORMALS_ZERO",
            fitmac_capi::FITMAC_FLOAT_DENORMALS_ZERO,
        ),
        ("FLOAT_ROUNDING", fitmac_capi::FITMAC_FLOAT_ROUNDING),
        ("FLOAT_TRAPS", fitmac_capi::FITMAC_FLOAT_TRAPS),
    ] {
        line(&mut out, name, &format!("{bit:#x}u"));
    }
    macro_rules! vocabularies {
        ($($name:ident),+) => {
            $(
                let members = wire::$name::ALL.iter().map(|m| (m.name(), u32::from(m.code())));
                vocabulary(&mut out, stringify!($name), members);
            )+
        };
    }
    vocabularies!(
        ActionSpace,
        ActionFrame,
        GripperConvention,
        GraspClass,
        DestinationKind,
        PlaceRelation,
        Provenance,
        Verdict,
        CriticLabel,
        Request,
        Phase,
        Diagnosis,
        Route,
        Mode,
        SubPhase,
        EventKind
    );
    let refusals = Refusal::ALL.iter().map(|r| (r.name(), r.code()));
    vocabulary(&mut out, "Refusal", refusals);
    bits(&mut out, "REASON", reason::ALL);
    bits(&mut out, "EVIDENCE", evidence::ALL);
    out
}

fn vocabulary(out: &mut String, name: &str, members: impl Iterator<Item = (&'static str, u32)>) {
    let _infallible = writeln!(out, "\n/* {name}. */");
    for (member, code) in members {
        let name = format!("{}_{}", screaming(name), member.to_ascii_uppercase());
        line(out, &name, &code.to_string());
    }
}

fn bits(out: &mut String, name: &str, all: &[(u64, &str)]) {
    let _infallible = writeln!(out, "\n/* Bits: {}. */", name.to_ascii_lowercase());
    for (bit, member) in all {
        let name = format!("{name}_{}", member.to_ascii_uppercase());
        line(out, &name, &format!("{bit:#x}ull"));
    }
}

fn line(out: &mut String, name: &str, value: &str) {
    let _infallible = writeln!(out, "#define FITMAC_{name} {value}");
}

/// `SubPhase` as `SUB_PHASE`.
fn screaming(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_uppercase());
    }
    out
}
