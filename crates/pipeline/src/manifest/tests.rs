//! Tests of the text of a manifest, its head, and the facts that are carried over.

use super::*;
use crate::reconcile::{Results, ScriptFound, Scripts, reconcile};

#[test]
fn a_status_is_shown_as_it_is_written() {
    use Status::{Done, Empty, Failed, Refused, Rendering, Waiting};
    for status in [Empty, Waiting, Rendering, Failed, Refused, Done] {
        assert_eq!(serde_json::to_value(status).unwrap(), status.to_string());
    }
}

fn manifest(names: &[&str], removed_at: Option<u64>) -> Manifest {
    let found = names.iter().map(|name| ScriptFound {
        name: ScriptName::new(name).unwrap(),
        version: ETag::new("v"),
        modified: Timestamp(0),
    });
    let scripts = Scripts { found: found.collect(), ..Scripts::default() };
    let animation = Animation::new("film").unwrap();
    let mut manifest = reconcile(&animation, &scripts, &Results::default(), &Settings::absent());
    manifest.head.removed_at = removed_at.map(Timestamp);
    manifest
}

#[test]
fn a_manifest_remembers_when_a_script_was_last_gone() {
    let check = |before: Option<&Manifest>, names: &[&str], expected: Option<u64>| {
        let next = manifest(names, None);
        assert_eq!(next.removed_at(before, Timestamp(9)), expected.map(Timestamp), "{names:?}");
    };
    check(None, &["1"], None);
    check(Some(&manifest(&["1", "2"], None)), &["1", "2", "3"], None);
    check(Some(&manifest(&["1", "2"], None)), &["2", "3"], Some(9));
    check(Some(&manifest(&["1", "2"], Some(4))), &["1", "2", "3"], Some(4));
    check(Some(&manifest(&["1"], Some(4))), &[], Some(9));
    assert!(manifest(&["1"], Some(4)).agrees_with(&manifest(&["1"], None)));
}

/// Manifests with one change each, and whether they then count as different.
fn changes() -> Vec<(&'static str, bool, Manifest)> {
    let fault = |receipt: &str, reason: Option<&str>| Fault {
        receipt: ETag::new(receipt),
        reason: reason.map(Reason::new),
    };
    let mut changes = Vec::new();
    let mut change = |what, counts, step: &dyn Fn(&mut Manifest)| {
        let mut changed = full();
        step(&mut changed);
        changes.push((what, counts, changed));
    };
    change("status", true, &|m| m.head.status = Status::Waiting);
    change("generation", true, &|m| m.head.generation = Generation::new(&"0b".repeat(16)).unwrap());
    change("settings", true, &|m| m.head.settings.version = Some(ETag::new("s")));
    change("rejected", true, &|m| m.head.rejected.clear());
    change("a rejected file", true, &|m| m.head.rejected[0].key.push('x'));
    change("what is wrong with it", true, &|m| m.head.rejected[0].problem.push('x'));
    change("excess", true, &|m| m.head.excess = None);
    change("warnings", true, &|m| m.head.warnings.clear());
    change("refusal", true, &|m| m.head.refusal = None);
    change("refusal's receipt", true, &|m| m.head.refusal = Some(fault("other", None)));
    change("frames", true, &|m| drop(m.frames.pop()));
    change("a frame's script", true, &|m| m.frames[0].script = ScriptName::new("z").unwrap());
    change("a frame's version", true, &|m| m.frames[0].version = ETag::new("w"));
    change("a frame's part", true, &|m| m.frames[0].part = Some(NonZeroU64::MIN));
    change("a frame's state", true, &|m| m.frames[0].state = FrameState::Done { pixels: 1 });
    change("a frame's fault", true, &|m| m.frames[1].state = FrameState::Failed(fault("other", None)));
    change("revision", false, &|m| m.head.revision += 1);
    change("writer", false, &|m| m.head.writer = "someone".to_owned());
    change("a frame's reason", false, &|m| {
        m.frames[1].state = FrameState::Failed(fault("f", Some("why")));
    });
    change("refusal's reason", false, &|m| m.head.refusal = Some(fault("r", Some("why"))));
    changes
}

/// A manifest with some of everything.
fn full() -> Manifest {
    let mut manifest = manifest(&["1", "2"], Some(4));
    let fault = |receipt: &str| Fault { receipt: ETag::new(receipt), reason: None };
    manifest.head.rejected =
        vec![Rejected { key: "scripts/film/.txt".to_owned(), problem: "no name".to_owned() }];
    manifest.head.warnings =
        vec![Rejected { key: "scripts/film/3.TXT".to_owned(), problem: "its ending".to_owned() }];
    manifest.head.excess = Some(Reason::new("too many"));
    manifest.head.refusal = Some(fault("r"));
    manifest.frames[1].state = FrameState::Failed(fault("f"));
    manifest
}

#[test]
fn manifests_agree_that_say_the_same() {
    assert!(full().agrees_with(&full()));
    for (what, counts, changed) in changes() {
        assert_eq!(changed.agrees_with(&full()), !counts, "{what}");
        assert_eq!(full().agrees_with(&changed), !counts, "{what}, the other way");
    }
}

#[test]
fn the_gif_that_counts_is_that_of_this_generation() {
    let mut head = full().head;
    assert_eq!(head.version_of(Container::Gif), None);
    let gif = |generation: &Generation| Made { generation: generation.clone(), version: ETag::new("g") };
    head.gif = Some(gif(&head.generation));
    assert_eq!(head.version_of(Container::Gif), Some(&ETag::new("g")));
    assert_eq!(head.version_of(Container::Webp), None);
    head.gif = Some(gif(&Generation::new(&"0b".repeat(16)).unwrap()));
    assert_eq!(head.version_of(Container::Gif), None);
}

#[test]
fn a_fact_is_shown_by_what_says_so() {
    let one = Some(NonZeroU64::MIN);
    let mut shown = manifest(&["1", "2", "3"], None);
    shown.frames[0].state = FrameState::Done { pixels: 2 };
    shown.frames[1].state = FrameState::Failed(Fault { receipt: ETag::new("f"), reason: None });
    shown.frames[2].part = one;
    let name = |name: &str| ScriptName::new(name).unwrap();
    let (v, w, f) = (|| ETag::new("v"), || ETag::new("w"), || ETag::new("f"));
    let facts = [
        (Fact::Fold, false),
        (Fact::Absent(name("4")), true),
        (Fact::Absent(name("1")), false),
        (Fact::Version(name("1"), v()), true),
        (Fact::Version(name("1"), w()), false),
        (Fact::Version(name("4"), v()), false),
        (Fact::Settings(None), true),
        (Fact::Settings(Some(w())), false),
        (Fact::Drawn(name("1"), v(), None, 2), true),
        (Fact::Drawn(name("1"), v(), None, 1), true),
        (Fact::Drawn(name("1"), v(), None, 3), false),
        (Fact::Drawn(name("1"), v(), one, 2), false),
        (Fact::Drawn(name("1"), w(), None, 2), false),
        (Fact::Drawn(name("2"), v(), None, 2), false),
        (Fact::Faulty(name("2"), v(), None, f()), true),
        (Fact::Faulty(name("2"), v(), None, w()), false),
        (Fact::Faulty(name("2"), v(), one, f()), false),
        (Fact::Faulty(name("1"), v(), None, f()), true),
        (Fact::Faulty(name("3"), v(), one, f()), false),
        (Fact::Split(name("3"), v()), true),
        (Fact::Split(name("3"), w()), false),
        (Fact::Split(name("1"), v()), false),
    ];
    for (fact, expected) in facts {
        assert_eq!(shown.shows(&fact), expected, "{fact:?}");
    }
    assert_eq!(Fact::Drawn(name("3"), v(), one, 2).subject(), Some((&name("3"), one)));
    assert_eq!(Fact::Split(name("3"), v()).subject(), Some((&name("3"), None)));
    assert_eq!(Fact::Settings(None).subject(), None);
}

#[test]
fn parts_to_come_are_those_of_this_version() {
    let mut manifest = manifest(&["1", "2", "3"], None);
    for (frame, part) in manifest.frames.iter_mut().zip([1, 2, 3]) {
        frame.part = NonZeroU64::new(part);
        frame.script = ScriptName::new(if part < 3 { "s" } else { "t" }).unwrap();
    }
    manifest.frames[0].state = FrameState::Done { pixels: 2 };
    let pending = |script: &str, version: &str| {
        let parts = manifest.pending_parts(&ScriptName::new(script).unwrap(), &ETag::new(version))?;
        Some(parts.into_iter().map(NonZeroU64::get).collect::<Vec<_>>())
    };
    assert_eq!(pending("s", "v"), Some(vec![2]));
    assert_eq!(pending("t", "v"), Some(vec![3]));
    assert_eq!((pending("s", "w"), pending("u", "v")), (None, None));
}

#[test]
fn an_animation_has_at_most_as_many_frames_as_it_may() {
    for (most, is_too_many) in [(None, false), (Some(3), false), (Some(4), false), (Some(2), true)] {
        let head = manifest(&["1", "2", "3"], None).bounded(most).head;
        assert_eq!(head.excess.is_some(), is_too_many, "{most:?}");
        assert_eq!(head.status == Status::Failed, is_too_many, "{most:?}");
    }
}

#[test]
fn of_many_diagnostics_the_first_are_repeated_and_the_others_counted() {
    let unknown = br#"{"a": 1, "b": 2, "c": 3, "d": 4, "e": 5}"#;
    let all = parse_settings(SETTINGS_FILE, unknown).diagnostics;
    assert_eq!(all.len(), 5, "{all:?}");
    let whole = Reason { omitted: 7, ..Reason::from_diagnostics(all.clone()) };
    assert_eq!(whole.diagnostics, all);
    let shortened = whole.shortened();
    assert_eq!((&shortened.diagnostics[..], shortened.omitted), (&all[..DIAGNOSTICS_SHOWN], 9));
    assert_eq!(shortened.clone().shortened(), shortened);
}

/// Each line must stay short, because people read it, and each reader of a large manifest fetches it.
#[test]
fn a_document_leaves_out_what_says_nothing() {
    let json = |reason: &Reason| serde_json::to_string(reason).unwrap();
    let plain = Reason::new("why");
    assert_eq!(json(&plain), r#"{"message":"why"}"#);
    assert_eq!(json(&Reason { omitted: 1, ..plain.clone() }), r#"{"message":"why","omitted":1}"#);
    for reason in [Reason { omitted: 3, ..plain.clone() }, plain] {
        assert_eq!(serde_json::from_str::<Reason>(&json(&reason)).unwrap(), reason);
    }
}
