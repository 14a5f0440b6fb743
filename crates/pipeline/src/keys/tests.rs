//! Keys parse, format back to themselves, and have errors that name the fault.

use super::*;

fn animation(name: &str) -> Animation {
    Animation::new(name).unwrap()
}

fn tag(version: &str, pixels: u32) -> Tag {
    Tag { version: ETag::new(version), pixels }
}

fn check(text: &str, expected: Key) {
    assert_eq!(text.parse::<Key>().unwrap_or_else(|error| panic!("{text}: {error}")), expected, "{text}");
    assert_eq!(expected.to_string(), text);
}

fn rejects(text: &str, expected: &str) {
    match text.parse::<Key>() {
        Err(Error::Key { problem, .. }) => assert_eq!(problem, expected, "{text}"),
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn every_kind_of_key_reads_back() {
    let name = ScriptName::new("00 1@x").unwrap();
    let number = NonZeroU64::new(12).unwrap();
    let band = Band::all(number).last().unwrap();
    let generation = Generation::new(&"0a".repeat(16)).unwrap();
    let a = || animation("films/ä+b");
    let t = || tag("\"d41d8cd9-2\"", 3);
    check("scripts/films/ä+b/00 1@x.txt", Key::Script { animation: a(), name: name.clone() });
    check("scripts/films/ä+b/animation.json", Key::Settings { animation: a() });
    check(
        "parts/films/ä+b/00 1@x@d41d8cd9-2-p3/12.json",
        Key::Part { animation: a(), name: name.clone(), tag: t(), number },
    );
    check(
        "parts/films/ä+b/00 1@x@d41d8cd9-2-p3/files.json",
        Key::Wake { animation: a(), name: name.clone(), tag: t() },
    );
    for (text, receipt) in [
        ("00 1@x@d41d8cd9-2-p3.taken", Receipt::Taken { name: name.clone(), tag: t() }),
        ("00 1@x@d41d8cd9-2-p3.waits.json", Receipt::Waits { name: name.clone(), tag: t() }),
        ("00 1@x@d41d8cd9-2-p3.png", Receipt::Frame { name: name.clone(), tag: t(), part: None }),
        ("00 1@x@d41d8cd9-2-p3/12.png", Receipt::Frame { name: name.clone(), tag: t(), part: Some(number) }),
        ("00 1@x@d41d8cd9-2-p3.error.json", Receipt::Fault { name: name.clone(), tag: t(), part: None }),
        (
            "00 1@x@d41d8cd9-2-p3/12.error.json",
            Receipt::Fault { name: name.clone(), tag: t(), part: Some(number) },
        ),
        (
            "00 1@x@d41d8cd9-2-p3.begun-12",
            Receipt::Begun { name: name.clone(), tag: t(), part: None, attempt: number },
        ),
        (
            "00 1@x@d41d8cd9-2-p3/12.begun-12",
            Receipt::Begun { name: name.clone(), tag: t(), part: Some(number), attempt: number },
        ),
        ("00 1@x@d41d8cd9-2-p3.split-12", Receipt::Split { name: name.clone(), tag: t(), count: number }),
        (
            "00 1@x@d41d8cd9-2-p3.cut-12",
            Receipt::Cut { name: name.clone(), tag: t(), part: None, count: number },
        ),
        (
            "00 1@x@d41d8cd9-2-p3/12.cut-12",
            Receipt::Cut { name: name.clone(), tag: t(), part: Some(number), count: number },
        ),
        (
            "00 1@x@d41d8cd9-2-p3.12-of-12.band",
            Receipt::Band { name: name.clone(), tag: t(), part: None, band },
        ),
        (
            "00 1@x@d41d8cd9-2-p3/12.12-of-12.band",
            Receipt::Band { name: name.clone(), tag: t(), part: Some(number), band },
        ),
        (
            "@0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a.error.json",
            Receipt::Refusal { generation: generation.clone(), output: Container::Gif },
        ),
        (
            "@0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a.webp.error.json",
            Receipt::Refusal { generation: generation.clone(), output: Container::Webp },
        ),
    ] {
        assert_eq!(text.parse::<Receipt>().unwrap(), receipt);
        check(&format!("frames/films/ä+b/{text}"), Key::Receipt { animation: a(), receipt });
    }
    let woken = |part| Key::Band { animation: a(), name: name.clone(), tag: t(), part, band, attempt: 0 };
    check("parts/films/ä+b/00 1@x@d41d8cd9-2-p3/12-of-12.band-0.json", woken(None));
    check("parts/films/ä+b/00 1@x@d41d8cd9-2-p3/12/12-of-12.band-0.json", woken(Some(number)));
    check("manifests/films/ä+b.json", Key::Manifest { animation: a() });
    check(
        "assemblies/films/ä+b/17-0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a0a.json",
        Key::Claim { animation: a(), revision: 17, generation },
    );
    let retry = |part| Key::Retry { animation: a(), name: name.clone(), tag: t(), part, attempt: number };
    check("retries/films/ä+b/00 1@x@d41d8cd9-2-p3/12", retry(None));
    check("retries/films/ä+b/00 1@x@d41d8cd9-2-p3/12/12", retry(Some(number)));
    check("checkpoints/films/ä+b.state", Key::Checkpoint { animation: a() });
    for output in Container::ALL {
        let ending = output.ending();
        check(&format!("animations/films/ä+b.{ending}"), Key::Output { animation: a(), output });
        check(&format!("frames/films/ä+b/@output.{ending}"), Key::OutputMark { animation: a(), output });
    }
}

/// An error receipt of a script whose name starts with `@` was mistaken for a refusal, and the script stayed pending
/// for ever.
#[test]
fn names_that_start_with_an_at_sign_have_receipts_like_all_others() {
    let generation = "0a".repeat(16);
    let band = Band::all(NonZeroU64::MIN).next().unwrap();
    for name in [
        "@",
        "@1",
        "@@",
        &format!("@{generation}"),
        &format!("{generation}.error.json"),
        &format!("@{generation}.webp"),
    ] {
        let (name, tag) = (ScriptName::new(name).unwrap(), tag("v", 1));
        for part in [None, NonZeroU64::new(2)] {
            let receipts = [
                Receipt::Frame { name: name.clone(), tag: tag.clone(), part },
                Receipt::Fault { name: name.clone(), tag: tag.clone(), part },
                Receipt::Begun { name: name.clone(), tag: tag.clone(), part, attempt: NonZeroU64::MIN },
                Receipt::Split { name: name.clone(), tag: tag.clone(), count: NonZeroU64::MIN },
                Receipt::Cut { name: name.clone(), tag: tag.clone(), part, count: NonZeroU64::MIN },
                Receipt::Band { name: name.clone(), tag: tag.clone(), part, band },
            ];
            for receipt in receipts {
                check(&animation("a").receipt(&receipt), Key::Receipt { animation: animation("a"), receipt });
            }
        }
    }
    let receipt =
        Receipt::Refusal { generation: Generation::new(&generation).unwrap(), output: Container::Gif };
    check(&format!("frames/a/@{generation}.error.json"), Key::Receipt { animation: animation("a"), receipt });
}

#[test]
fn leases_are_no_receipts() {
    check("frames/a/b/@assembler.json", Key::Lease { animation: animation("a/b") });
    check("frames/a/b/@sweep.json", Key::SweepLease { animation: animation("a/b") });
    for file in ["@assembler.json", "@sweep.json"] {
        rejects(&format!("frames/{file}"), "not a key of the pipeline");
        rejects(&format!("frames/a/x{file}"), "not a key of the pipeline");
    }
}

#[test]
fn manifests_that_are_set_aside_are_no_manifests() {
    let version = ETag::new("d41.8~c");
    check("manifests/a.json~d41~2e8~7ec", Key::SetAside { animation: animation("a"), version });
    check("manifests/a.json~x.json", Key::Manifest { animation: animation("a.json~x") });
    rejects("manifests/a.json~", "not a key of the pipeline");
}

#[test]
fn tags_may_hold_anything() {
    for version in ["a", "a-p1", "ü/ä.png", "~", "x@y", "a b\n"] {
        let tag = tag(version, 0);
        assert_eq!(Tag::parse(&tag.to_string()), Some(tag.clone()), "{version}");
        assert!(!tag.to_string().contains(['/', '@', '.', ' ']), "{tag}");
    }
}

/// A script whose name looks like another script's cut, and which was split, was never done, because its own receipt
/// was not recognised.
#[test]
fn names_that_end_like_receipts_have_receipts_of_their_own() {
    let two = NonZeroU64::new(2).unwrap();
    let band = Band::all(two).last().unwrap();
    let tag = || tag("d41", 3);
    let ends = ["png", "error.json", "begun-1", "cut-450", "split-2", "1-of-2.band", "x"];
    for end in ends.iter().flat_map(|end| [format!("x@vmp4-p3.{end}"), format!("@{end}"), format!("x.{end}")])
    {
        let name = || ScriptName::new(&end).unwrap();
        for part in [None, Some(two)] {
            let receipts = [
                Receipt::Frame { name: name(), tag: tag(), part },
                Receipt::Fault { name: name(), tag: tag(), part },
                Receipt::Begun { name: name(), tag: tag(), part, attempt: two },
                Receipt::Split { name: name(), tag: tag(), count: two },
                Receipt::Cut { name: name(), tag: tag(), part, count: two },
                Receipt::Band { name: name(), tag: tag(), part, band },
            ];
            for receipt in receipts {
                let key = Key::Receipt { animation: animation("a"), receipt };
                assert_eq!(key.to_string().parse::<Key>().ok(), Some(key));
            }
        }
    }
}

#[test]
fn script_keys_say_what_is_wrong() {
    rejects("scripts/a//b.txt", "an animation's name has an empty segment");
    rejects("scripts//b.txt", "an animation's name has an empty segment");
    rejects("scripts/./b.txt", "an animation's name has a segment . or ..");
    rejects("scripts/a/../b.txt", "an animation's name has a segment . or ..");
    rejects("scripts/a/.txt", "what systems leave in folders is ignored");
    rejects("scripts/a/.old.txt", "what systems leave in folders is ignored");
    rejects("scripts/__MACOSX/a/b.txt", "what systems leave in folders is ignored");
    rejects("scripts/a/b.TXT", "expected the ending .txt in small letters");
    rejects("scripts/a/b\\c.txt", "the key has a backslash: folders are separated by /");
    rejects("scripts/a/b.jpg", "neither a script (.txt) nor animation.json");
    rejects("scripts/a/", "what systems leave in folders is ignored");
    rejects(
        "scripts/b.txt",
        "a script lies in a folder, which is the animation: scripts/<animation>/<name>.txt",
    );
    rejects("other/a/b.txt", "not a key of the pipeline");
    rejects("frames/a/b.png", "not a key of the pipeline");
    rejects("frames/a/b@c-p1/01.png", "not a key of the pipeline");
    rejects("frames/a/b@c-p1.6-of-5.band", "not a key of the pipeline");
    rejects("frames/a/b@c-p1.band", "not a key of the pipeline");
    rejects("parts/a/b@c-p1/1-of-2.band-.json", "not a key of the pipeline");
    rejects("parts/a/b@c-p1/01/1-of-2.band-0.json", "not a key of the pipeline");
    rejects("parts/a/1/1-of-2.band-0.json", "not a key of the pipeline");
    rejects("assemblies/a/+1-x.json", "not a key of the pipeline");
    rejects("checkpoints/a.gif", "not a key of the pipeline");
    rejects("checkpoints/.state", "an animation's name has an empty segment");
}

#[test]
fn script_keys_end_at_900_bytes() {
    let at_the_edge = format!("scripts/a/{}.txt", "x".repeat(900 - 14));
    assert_eq!(at_the_edge.len(), LONGEST_SCRIPT_KEY);
    let Key::Script { animation, name } = at_the_edge.parse().unwrap() else { panic!() };
    rejects(&format!("scripts/a/{}.txt", "x".repeat(900 - 13)), "the key is longer than 900 bytes");

    let most = NonZeroU64::new(99_999_999).unwrap();
    let tag = tag(&format!("{}-10000", "0".repeat(32)), 9_999);
    let receipt = Receipt::Fault { name: name.clone(), tag: tag.clone(), part: Some(most) };
    let (band, part) = (Band::all(NonZeroU64::new(1_000).unwrap()).last().unwrap(), Some(most));
    let banded = Receipt::Band { name: name.clone(), tag: tag.clone(), part, band };
    let retry = Key::Retry {
        animation: animation.clone(),
        name: name.clone(),
        tag: tag.clone(),
        part,
        attempt: most,
    };
    let woken = Key::Band { animation: animation.clone(), name, tag, part, band, attempt: most.get() };
    let receipts = [receipt, banded].map(|receipt| animation.receipt(&receipt));
    for key in receipts.into_iter().chain([retry.to_string(), woken.to_string()]) {
        assert!(key.len() <= 1024, "{} bytes", key.len());
    }
}

#[test]
fn event_keys_are_form_encoded() {
    assert_eq!(decode_event_key("scripts/a%2Fb/x%2By+z.txt").unwrap(), "scripts/a/b/x+y z.txt");
    assert_eq!(decode_event_key("100%25").unwrap(), "100%");
    assert!(decode_event_key("%ff").is_err());
}

#[test]
fn prefixes_are_what_keys_start_with() {
    let (a, name) = (animation("films/b"), ScriptName::new("c@d").unwrap());
    assert_eq!(a.as_str(), "films/b");
    let prefixes = [a.scripts(), a.frames(), a.retries(), a.parts()];
    assert_eq!(prefixes, ["scripts/films/b/", "frames/films/b/", "retries/films/b/", "parts/films/b/"]);
    assert_eq!(Tag::receipts_of(&name, &ETag::new("v/1")), "c@d@v~2f1-p");
    assert_eq!(Generation::new(&"0a".repeat(16)).unwrap().as_str(), "0a".repeat(16));
}

#[test]
fn a_receipt_is_of_one_version_of_one_script() {
    let [c, d] = ["c", "d"].map(|name| ScriptName::new(name).unwrap());
    let [v, w] = ["v", "w"].map(ETag::new);
    let (number, band) = (NonZeroU64::MIN, Band::all(NonZeroU64::MIN).last().unwrap());
    let (name, part) = (c.clone(), None);
    let tag = || tag("v", 3);
    let receipts = [
        Receipt::Frame { name: name.clone(), tag: tag(), part },
        Receipt::Fault { name: name.clone(), tag: tag(), part },
        Receipt::Begun { name: name.clone(), tag: tag(), part, attempt: number },
        Receipt::Cut { name: name.clone(), tag: tag(), part, count: number },
        Receipt::Band { name: name.clone(), tag: tag(), part, band },
        Receipt::Split { name, tag: tag(), count: number },
    ];
    for receipt in receipts {
        assert!(receipt.is_of(&c, &v), "{receipt}");
        assert!(!receipt.is_of(&c, &w) && !receipt.is_of(&d, &v) && !receipt.is_of(&d, &w), "{receipt}");
    }
    let generation = Generation::new(&"0a".repeat(16)).unwrap();
    assert!(!Receipt::Refusal { generation, output: Container::Gif }.is_of(&c, &v));
}
