//! A manifest that keeps all rules, and the manifests that each rule refuses.

use std::num::NonZeroU64;

use rayfold_scene::AnimationSettings;

use super::*;
use crate::keys::{Animation, ScriptName};
use crate::manifest::{Frame, Reason, Rejected, Settings, part};
use crate::reconcile::{Results, Scripts, reconcile};
use crate::store::ETag;

fn animation(name: &str) -> Animation {
    Animation::new(name).unwrap()
}

fn fault(reason: Option<&str>) -> Fault {
    Fault { receipt: ETag::new("r"), reason: reason.map(Reason::new) }
}

fn frame(script: &str, number: u64, state: FrameState) -> Frame {
    Frame { script: ScriptName::new(script).unwrap(), version: ETag::new("v"), part: part(number), state }
}

/// Three scripts, one of which has two frames. One frame is drawn, two are to come, and one cannot be drawn.
fn sound() -> Manifest {
    let nothing = (&Scripts::default(), &Results::default());
    let mut manifest = reconcile(&animation("film"), nothing.0, nothing.1, &Settings::absent());
    manifest.frames = vec![
        frame("1", 0, FrameState::Done { pixels: 1 }),
        frame("2", 1, FrameState::Pending),
        frame("2", 2, FrameState::Failed(fault(None))),
        frame("3", 0, FrameState::Pending),
    ];
    let head = &mut manifest.head;
    (head.revision, head.writer, head.status) = (5, "someone".to_owned(), Status::Rendering);
    (head.scripts, head.total, head.done, head.pending, head.failed) = (3, 4, 1, 2, 1);
    manifest
}

fn broken(next: &Manifest, before: Option<&Manifest>) -> Option<&'static str> {
    match check(next, before) {
        Ok(()) => None,
        Err(Error::Invariant { rule, .. }) => Some(rule),
        Err(error) => panic!("{error}"),
    }
}

/// Returns the rule that a valid manifest breaks after this change, given its predecessor.
fn broken_by(change: impl FnOnce(&mut Manifest)) -> Option<&'static str> {
    let (mut before, mut next) = (sound(), sound());
    before.head.revision = 4;
    change(&mut next);
    broken(&next, Some(&before))
}

#[test]
fn a_revision_follows_on_its_predecessor() {
    assert_eq!(broken_by(|_| {}), None);
    for revision in [0, 3, 4, 6] {
        let rule = broken_by(|next| next.head.revision = revision);
        assert_eq!(rule, Some("the revision is the predecessor's plus one"), "{revision}");
    }
    let mut first = sound();
    assert_eq!(broken(&first, None), Some("the revision is the predecessor's plus one"));
    first.head.revision = 1;
    assert_eq!(broken(&first, None), None);
}

#[test]
fn a_manifest_says_whose_it_is_and_who_wrote_it() {
    let another = broken_by(|next| next.head.animation = animation("other"));
    assert_eq!(another, Some("the animation is the predecessor's"));
    assert_eq!(broken_by(|next| next.head.writer.clear()), Some("the writer is named"));
    assert_eq!(broken_by(|next| next.head.schema += 1), Some("the schema is the current one"));
}

#[test]
fn each_count_is_that_of_the_frames() {
    let counts: [fn(&mut Manifest) -> &mut u64; 5] = [
        |manifest| &mut manifest.head.scripts,
        |manifest| &mut manifest.head.total,
        |manifest| &mut manifest.head.done,
        |manifest| &mut manifest.head.pending,
        |manifest| &mut manifest.head.failed,
    ];
    for (place, count) in counts.into_iter().enumerate() {
        let rule = broken_by(|next| *count(next) += 1);
        assert_eq!(rule, Some("the counts are those of the frames"), "{place}");
        let rule = broken_by(|next| *count(next) -= 1);
        assert_eq!(rule, Some("the counts are those of the frames"), "{place}");
    }
}

#[test]
fn no_frame_comes_twice() {
    // The third script has another frame without a number, so that the counts are right.
    let rule = broken_by(|next| {
        next.frames[3].script = ScriptName::new("1").unwrap();
        next.head.scripts = 2;
    });
    assert_eq!(rule, Some("no frame comes twice"));
}

#[test]
fn parts_are_numbered_from_one_without_a_gap() {
    let numbered = |numbers: &[u64]| {
        let mut manifest = sound();
        manifest.frames = numbers.iter().map(|number| frame("s", *number, FrameState::Pending)).collect();
        parts_are_whole(&manifest, None)
    };
    assert!(numbered(&[]) && numbered(&[0]) && numbered(&[1]) && numbered(&[1, 2, 3]));
    for numbers in [&[2][..], &[1, 3], &[1, 2, 2], &[1, 2, 1], &[1, 0], &[0, 1], &[0, 0], &[2, 1]] {
        assert!(!numbered(numbers), "{numbers:?}");
    }
    let rule = broken_by(|next| next.frames[2].part = NonZeroU64::new(3));
    assert_eq!(rule, Some("a split script's parts are all there, in order"));
    let rule = broken_by(|next| next.frames[2].version = ETag::new("w"));
    assert_eq!(rule, Some("a split script's parts are all there, in order"));
}

/// The properties of a manifest that go with a status.
#[derive(Clone, Copy, Default)]
struct Stand {
    announced: Option<u64>,
    total: u64,
    pending: u64,
    failed: u64,
    has_bad_settings: bool,
    has_rejected: bool,
    is_refused: bool,
    is_too_many: bool,
}

impl Stand {
    fn bears(self, status: Status) -> bool {
        let mut manifest = sound();
        let head = &mut manifest.head;
        (head.status, head.total, head.pending, head.failed) =
            (status, self.total, self.pending, self.failed);
        head.settings.value = AnimationSettings::new(self.announced, 10.0, 0).ok();
        if self.has_bad_settings {
            head.settings.value = None;
        }
        if self.has_rejected {
            head.rejected = vec![Rejected { key: "k".to_owned(), problem: "p".to_owned() }];
        }
        head.refusal = self.is_refused.then(|| fault(None));
        head.excess = self.is_too_many.then(|| Reason::new("too many"));
        status_follows(&manifest, None)
    }
}

#[test]
fn each_status_goes_with_what_there_is() {
    use Status::{Done, Empty, Failed, Refused, Rendering, Waiting};
    let all = [Empty, Waiting, Rendering, Failed, Refused, Done];
    let nothing = Stand::default();
    let three = Stand { total: 3, ..nothing };
    let of_three = Stand { announced: Some(3), ..three };
    for (what, stand, borne) in [
        ("nothing", nothing, &[Empty][..]),
        ("three frames", three, &[Done]),
        ("as many as announced", of_three, &[Done]),
        ("more than announced", Stand { total: 4, ..of_three }, &[Done]),
        ("fewer than announced", Stand { total: 2, ..of_three }, &[Waiting]),
        ("none of those announced", Stand { total: 0, ..of_three }, &[Empty, Waiting]),
        ("one to come", Stand { pending: 1, ..of_three }, &[Rendering]),
        ("one to come, one failed", Stand { pending: 1, failed: 1, ..three }, &[Rendering]),
        ("fewer, one to come", Stand { total: 2, pending: 1, ..of_three }, &[Waiting, Rendering]),
        ("one failed", Stand { failed: 1, ..three }, &[Failed]),
        ("one failed, as many as announced", Stand { failed: 1, ..of_three }, &[Failed]),
        ("one failed, more than announced", Stand { total: 4, failed: 1, ..of_three }, &[Failed]),
        ("one failed, fewer than announced", Stand { total: 2, failed: 1, ..of_three }, &[Waiting]),
        ("bad settings", Stand { has_bad_settings: true, ..three }, &[Failed]),
        ("a key that cannot be", Stand { has_rejected: true, ..three }, &[Failed]),
        ("nothing but a key that cannot be", Stand { has_rejected: true, ..nothing }, &[Failed]),
        ("refused", Stand { is_refused: true, ..three }, &[Refused]),
        ("refused, one to come", Stand { is_refused: true, pending: 1, ..three }, &[Rendering]),
        ("refused, one failed", Stand { is_refused: true, failed: 1, ..three }, &[Failed]),
        ("nothing, refused", Stand { is_refused: true, ..nothing }, &[Empty]),
        ("too many", Stand { is_too_many: true, ..three }, &[Failed]),
        ("too many, one to come", Stand { is_too_many: true, pending: 1, ..three }, &[Failed]),
        ("too many of none", Stand { is_too_many: true, ..nothing }, &[]),
    ] {
        let found: Vec<Status> = all.into_iter().filter(|status| stand.bears(*status)).collect();
        assert_eq!(found, borne, "{what}");
    }
    assert_eq!(broken_by(|next| next.head.status = Done), Some("the status follows from the frames"));
}

#[test]
fn what_is_failed_for_good_has_its_reason() {
    let rule = Some("whatever is failed for good has its reason");
    // Everything is tried: the frame, and then the set.
    let failed = |reason: Option<&str>| {
        broken_by(|next| {
            next.frames.truncate(3);
            next.frames[1].state = FrameState::Done { pixels: 1 };
            next.frames[2].state = FrameState::Failed(fault(reason));
            let head = &mut next.head;
            (head.scripts, head.total, head.done, head.pending) = (2, 3, 2, 0);
            head.status = Status::Failed;
        })
    };
    assert_eq!((failed(None), failed(Some("why"))), (rule, None));
    let refused = |reason: Option<&str>| {
        broken_by(|next| {
            next.frames.truncate(1);
            let head = &mut next.head;
            (head.scripts, head.total, head.done, head.pending, head.failed) = (1, 1, 1, 0, 0);
            (head.status, head.refusal) = (Status::Refused, Some(fault(reason)));
        })
    };
    assert_eq!((refused(None), refused(Some("why"))), (rule, None));
}

#[test]
fn settings_have_either_a_value_or_a_fault() {
    let rule = Some("settings have either a value or a fault");
    assert_eq!(broken_by(|next| next.head.settings.value = None), rule);
    assert_eq!(broken_by(|next| next.head.settings.fault = Some(Reason::new("why"))), rule);
    let faulty = broken_by(|next| {
        (next.head.settings.value, next.head.settings.fault) = (None, Some(Reason::new("why")));
    });
    assert_eq!(faulty, None);
}
