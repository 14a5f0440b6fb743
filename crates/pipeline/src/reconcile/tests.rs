//! The rules of `docs/pipeline.md`, row by row: each test turns a listing into a manifest.
//!
//! A listing is written as the keys in the bucket, with a version after each script: `1.txt a`. The manifest is written
//! in short: its status, and for each frame script, version, part and state.

use super::*;
use crate::Randomness;
use crate::keys::Key;

/// Returns the manifest for a listing of `scripts/film/` and `frames/film/`.
fn manifest(listing: &str, settings: &str) -> Manifest {
    let (scripts, results) = listed(listing);
    let settings = match settings {
        "" => Settings::absent(),
        text => Settings::parse(ETag::new(text), text.as_bytes()),
    };
    reconcile(&Animation::new("film").unwrap(), &scripts, &results, &settings)
}

fn listed(listing: &str) -> (Scripts, Results) {
    let (mut scripts, mut results) = (Scripts::default(), Results::default());
    for (line, entry) in listing.lines().map(str::trim).filter(|entry| !entry.is_empty()).enumerate() {
        let modified = Timestamp(line as u64);
        let (file, version) = entry.split_once(' ').unwrap_or((entry, ""));
        if let Some(name) = file.strip_suffix(".txt") {
            let (name, version) = (ScriptName::new(name).unwrap(), ETag::new(version));
            scripts.found.push(ScriptFound { name, version, modified });
        } else if let Some(problem) = entry.strip_prefix("rejected ") {
            let (key, problem) = ("scripts/film/x".to_owned(), problem.to_owned());
            scripts.rejected.push(Rejected { key, problem });
        } else {
            let Ok(Key::Receipt { receipt, .. }) = format!("frames/film/{file}").parse() else {
                panic!("{file} is no receipt")
            };
            results.receipts.push(ReceiptFound { receipt, etag: ETag::new(file), modified });
        }
    }
    (scripts, results)
}

/// Returns a short summary of a manifest.
fn said(manifest: &Manifest) -> String {
    let mut text = format!("{:?}", manifest.head.status).to_lowercase();
    for frame in &manifest.frames {
        let part = frame.part.map_or(String::new(), |number| format!("/{number}"));
        let state = match &frame.state {
            FrameState::Pending => "pending".to_owned(),
            FrameState::Done { pixels } => format!("p{pixels}"),
            FrameState::Waiting(fault) => format!("waits by {}", fault.receipt),
            FrameState::Failed(fault) => format!("failed by {}", fault.receipt),
        };
        text += &format!(", {}{part} {} {state}", frame.script, frame.version);
    }
    text
}

#[track_caller]
fn check(listing: &str, settings: &str, expected: &str) {
    let manifest = manifest(listing, settings);
    assert_eq!(said(&manifest), expected);
    let mut whole = manifest.clone();
    whole.head.revision = 1;
    whole.head.writer = "w".to_owned();
    // The reasons are not in the listing.
    for frame in &mut whole.frames {
        if let FrameState::Failed(fault) = &mut frame.state {
            fault.reason = Some(crate::manifest::Reason::new("r"));
        }
    }
    if let Some(refusal) = &mut whole.head.refusal {
        refusal.reason = Some(crate::manifest::Reason::new("r"));
    }
    crate::invariants::check(&whole, None).expect("what is reconciled keeps the manifest's rules");
}

#[test]
fn a_version_resolves_to_a_split_a_frame_or_an_error_in_this_order() {
    check("1.txt a", "", "rendering, 1 a pending");
    check("1.txt a\n1@a-p1.error.json", "", "failed, 1 a failed by 1@a-p1.error.json");
    check("1.txt a\n1@a-p1.png", "", "done, 1 a p1");
    check("1.txt a\n1@a-p1.split-2", "", "rendering, 1/1 a pending, 1/2 a pending");
    check("1.txt a\n1@a-p1.error.json\n1@a-p1.png", "", "done, 1 a p1");
    let all = "1.txt a\n1@a-p1.error.json\n1@a-p1.png\n1@a-p1.split-2";
    check(all, "", "rendering, 1/1 a pending, 1/2 a pending");
}

/// A waiting frame is no failure. A frame that is drawn after all takes precedence over the receipt that it waits.
#[test]
fn a_frame_that_waits_for_files_counts_as_neither_failed_nor_pending() {
    let waits = "1.txt a\n1@a-p1.waits.json\n2.txt b\n";
    check(waits, "", "rendering, 1 a waits by 1@a-p1.waits.json, 2 b pending");
    check(&format!("{waits}2@b-p1.png"), "", "waiting, 1 a waits by 1@a-p1.waits.json, 2 b p1");
    check(
        &format!("{waits}2@b-p1.error.json"),
        "",
        "waiting, 1 a waits by 1@a-p1.waits.json, 2 b failed by 2@b-p1.error.json",
    );
    check(&format!("{waits}2@b-p1.png\n1@a-p1.png"), "", "done, 1 a p1, 2 b p1");
    check(
        &format!("{waits}2@b-p1.png\n1@a-p1.error.json"),
        "",
        "failed, 1 a failed by 1@a-p1.error.json, 2 b p1",
    );
}

#[test]
fn a_late_frame_beats_an_error_whatever_their_pixel_versions() {
    check("1.txt a\n1@a-p2.error.json\n1@a-p1.png", "", "done, 1 a p1");
    let parts = "1.txt a\n1@a-p1.split-2\n1@a-p1/1.png\n1@a-p1/2.error.json\n1@a-p1/2.png";
    check(parts, "", "done, 1/1 a p1, 1/2 a p1");
}

#[test]
fn a_frame_of_any_pixel_version_will_do_and_the_newest_is_used() {
    check("1.txt a\n1@a-p3.png", "", "done, 1 a p3");
    check("1.txt a\n1@a-p10.png\n1@a-p9.png\n1@a-p1.png", "", "done, 1 a p10");
    let parts = "1.txt a\n1@a-p1.split-2\n1@a-p1/1.png\n1@a-p2/1.png\n1@a-p1/2.png";
    check(parts, "", "done, 1/1 a p2, 1/2 a p1");
    check("1.txt a\n1@a-p1.error.json\n1@a-p2.error.json", "", "failed, 1 a failed by 1@a-p2.error.json");
}

#[test]
fn receipts_of_other_versions_and_other_scripts_count_for_nothing() {
    check("1.txt b\n1@a-p1.png\n2@b-p1.png\n2@b-p1.error.json", "", "rendering, 1 b pending");
    check("1.txt b\n1@a-p1.split-3\n1@a-p1/1.png", "", "rendering, 1 b pending");
    check("1@a-p1.png", "", "empty");
}

#[test]
fn a_split_script_has_just_as_many_frames_as_the_split_says() {
    let listing = "1.txt a\n1@a-p1.split-2\n1@a-p1/3.png\n1@a-p1/2.error.json";
    check(listing, "", "rendering, 1/1 a pending, 1/2 a failed by 1@a-p1/2.error.json");
    // Two splits, as of two versions of the reader: the one with more frames counts.
    let two = "1.txt a\n1@a-p1.split-1\n1@a-p2.split-2\n1@a-p1/1.png\n1@a-p1/2.png";
    check(two, "", "done, 1/1 a p1, 1/2 a p1");
    // A frame of the whole script says nothing of its parts, and the other way round.
    check("1.txt a\n1@a-p1.split-1\n1@a-p1.png", "", "rendering, 1/1 a pending");
    check("1.txt a\n1@a-p1/1.png", "", "rendering, 1 a pending");
}

#[test]
fn frames_stand_in_natural_order_and_parts_in_theirs() {
    let listing = "10.txt a\n9.txt b\nf2.txt c\nf10.txt d\n9@b-p1.split-2";
    check(listing, "", "rendering, 9/1 b pending, 9/2 b pending, 10 a pending, f2 c pending, f10 d pending");
}

#[test]
fn the_settings_say_how_many_frames_to_wait_for() {
    let one = "1.txt a\n1@a-p1.png";
    check(one, r#"{"frames": 1}"#, "done, 1 a p1");
    check(one, r#"{"frames": 2}"#, "waiting, 1 a p1");
    check("2.txt a\n2@a-p1.error.json", r#"{"frames": 2}"#, "waiting, 2 a failed by 2@a-p1.error.json");
    // With more, all are used.
    check(&format!("{one}\n2.txt b\n2@b-p1.png"), r#"{"frames": 1}"#, "done, 1 a p1, 2 b p1");
    check("", r#"{"frames": 2}"#, "empty");
    // A script that has not been read yet counts as one frame, a split one as its parts.
    check("1.txt a\n1@a-p1.split-2", r#"{"frames": 3}"#, "waiting, 1/1 a pending, 1/2 a pending");
    let missing = |listing: &str| manifest(listing, r#"{"frames": 3}"#).head.missing();
    assert_eq!((missing(""), missing("1.txt a"), missing("1.txt a\n1@a-p1.png")), (3, 3, 2));
}

#[test]
fn an_animation_fails_only_when_everything_has_been_tried() {
    let failed = "1.txt a\n1@a-p1.error.json";
    let expected = "rendering, 1 a failed by 1@a-p1.error.json, 2 b pending";
    check(&format!("{failed}\n2.txt b"), "", expected);
    let expected = "failed, 1 a failed by 1@a-p1.error.json, 2 b p1";
    check(&format!("{failed}\n2.txt b\n2@b-p1.png"), "", expected);
    // Faulty settings, and a file that cannot be a script.
    check("1.txt a", "[]", "rendering, 1 a pending");
    check("1.txt a\n1@a-p1.png", "[]", "failed, 1 a p1");
    check("1.txt a\n1@a-p1.png\nrejected too long", "", "failed, 1 a p1");
    check("rejected too long", "", "failed");
    check("", "[]", "empty");
}

#[test]
fn a_refusal_is_of_one_generation_and_of_what_is_done() {
    let done = "1.txt a\n1@a-p1.png";
    let generation = manifest(done, "").head.generation;
    let refused = format!("{done}\n@{generation}.error.json");
    check(&refused, "", "refused, 1 a p1");
    assert!(manifest(&refused, "").head.refusal.is_some());
    check(&refused, r#"{"fps": 20}"#, "done, 1 a p1");
    check(&format!("{refused}\n1@a-p2.png"), "", "done, 1 a p2");
    let pending = manifest("1.txt a", "").head.generation;
    let early = format!("1.txt a\n@{pending}.error.json");
    check(&early, "", "rendering, 1 a pending");
    assert!(manifest(&early, "").head.refusal.is_none(), "what is not done is not refused");
}

#[test]
fn the_generation_tells_what_a_gif_shows_and_nothing_else() {
    let generation = |listing: &str, settings: &str| manifest(listing, settings).head.generation;
    let base = "1.txt a\n2.txt b\n1@a-p1.png\n2@b-p1.png";
    let same = [
        "2.txt b\n1.txt a\n2@b-p1.png\n1@a-p1.png",
        "1.txt a\n2.txt b\n1@a-p1.png\n2@b-p1.png\n1@z-p1.png\n1@a-p0.png\n2@b-p1.error.json",
    ];
    for listing in same {
        assert_eq!(generation(listing, ""), generation(base, ""), "{listing}");
    }
    let listings = [
        base,
        "1.txt a\n2.txt b\n1@a-p1.png",
        "1.txt a\n2.txt b\n1@a-p1.png\n2@b-p1.error.json",
        "1.txt a\n2.txt b\n1@a-p1.png\n2@b-p2.png",
        "1.txt a\n2.txt c\n1@a-p1.png\n2@c-p1.png",
        "1.txt a\n3.txt b\n1@a-p1.png\n3@b-p1.png",
        "1.txt a\n1@a-p1.png",
        "1.txt a\n1@a-p1.split-2\n1@a-p1/1.png\n1@a-p1/2.png",
        "",
    ];
    let all_settings = ["", r#"{"fps": 20}"#, r#"{"loop": 2}"#, r#"{"frames": 2}"#, "[]", "[ ]"];
    let mut seen = BTreeMap::new();
    for listing in listings {
        for settings in all_settings {
            let other = seen.insert(generation(listing, settings), (listing, settings));
            assert_eq!(other, None, "{listing} with {settings}");
        }
    }
    // Without lengths, different fields could concatenate to the same bytes.
    assert_ne!(generation("ab.txt c", ""), generation("a.txt bc", ""));
}

#[test]
fn the_order_of_a_listing_has_no_say() {
    let listing = "1.txt a\n2.txt b\n10.txt c\n1@a-p1.split-2\n1@a-p1/1.png\n1@a-p2/1.png\n1@a-p1/2.error.json\n\
                   2@b-p1.png\n2@b-p2.error.json\n2@x-p9.png\n10@c-p1.error.json\n10@c-p2.error.json";
    let expected = manifest(listing, "");
    let mut lines: Vec<&str> = listing.lines().collect();
    let random = Randomness::seeded(7);
    for _ in 0..100 {
        for last in (1..lines.len()).rev() {
            lines.swap(last, usize::try_from(random.below(last as u64 + 1)).unwrap());
        }
        assert_eq!(manifest(&lines.join("\n"), ""), expected);
    }
}

#[test]
fn above_a_page_of_scripts_every_thousandth_name_is_marked() {
    let marks = |count: usize| {
        let listing: String = (0..count).map(|number| format!("{number}.txt a\n")).collect();
        manifest(&listing, "").head.marks
    };
    assert!(marks(MARK_EVERY).is_empty());
    let mut names: Vec<String> = (0..2_500).map(|number: usize| number.to_string()).collect();
    names.sort();
    let marked: Vec<String> = marks(2_500).iter().map(ToString::to_string).collect();
    assert_eq!(marked, [names[999].clone(), names[1_999].clone()]);
    assert!(marks(MARK_EVERY * MAX_MARKS + 5_000).len() <= MAX_MARKS);
}
