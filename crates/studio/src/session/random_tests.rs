//! Random messages of a page: undoing all of them restores the original bytes.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use super::tests::Desk;
use super::*;
use crate::handles::DragOptions;
use crate::protocol::{LineState, Navigation, Source, Switch, TimelineEdit, ViewPreset};
use crate::text_edit::TextChange;
use crate::tracks::KeyPlace;

/// Lines of all kinds, with both line ends, a byte-order mark, and no end of the last line.
const TEXT: &str = "\u{feff}# a scene\r\nScreen 48 27\nLook 0 2 8  0 0 0  40\r\nIlight 1 1 1 .5 -1 -.3 # sun\n\n\
                    Material grey diffuse .5 .5 (1:.5 50:.2)\n\tSphere 1.0 , 0 (smooth 1:1 9:2) 0  .1 .1 .1 .9 .2 .2   # ball\n\
                    Box -3 -1 -3 3 0 3 grey\nGroup table\nCylinder .5  0 0 0  0 1 0  grey\nEnd\nUse table  2.5 0 0 # one\n\
                    Frames 9\nTrace\n# \u{20ac} no command\nClear\nTrace";

/// The total number of messages.
const WISHES: usize = 10_000;

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, 1e300, -1e-300, 1e17, f64::NAN, f64::INFINITY]),
    ]
}

fn line() -> impl Strategy<Value = String> {
    let known = [
        "Sphere 1 0 0 0 .1 .1 .1 1 1 1",
        "Group table",
        "End",
        "Use table",
        "Frames 3",
        "Trace",
        "Clear",
        "Screen 4 3",
        "Material grey mirror 1 1 1",
        "Orthocamera",
        "Box 0 0 0 1 1 1 gold # x",
        "",
    ];
    prop_oneof![
        prop::sample::select(known.to_vec()).prop_map(str::to_owned),
        "[ -~\u{e4}\\t]{0,20}",
        "Sphere( [0-9.:()-]{1,4}){0,9}",
    ]
}

fn wish() -> impl Strategy<Value = ClientMessage> {
    let at = || 0..18usize;
    let lines = || prop::collection::vec(0..18usize, 0..4);
    let keys = || {
        let key = (0..18usize, 0..8usize, prop::sample::select(vec![1.0, 2.0, 9.0, 50.0]));
        prop::collection::vec(key.prop_map(|(line, number, frame)| KeyPlace { line, number, frame }), 0..3)
    };
    let name = || prop::sample::select(vec!["grey", "table", "group1", "", "x y"]).prop_map(str::to_owned);
    let time = prop_oneof![
        (prop::sample::select(vec![Switch::AutoKey, Switch::Path, Switch::Onion]), any::<bool>())
            .prop_map(|(what, on)| TimelineEdit::Switch { what, on }),
        lines().prop_map(|lines| TimelineEdit::Key { lines }),
        (at(), prop::collection::vec(0..8usize, 0..3))
            .prop_map(|(line, numbers)| TimelineEdit::Toggle { line, numbers }),
        keys().prop_map(|keys| TimelineEdit::Grab { keys }),
        (number(), number()).prop_map(|(by, value)| TimelineEdit::Move { by, value }),
        keys().prop_map(|keys| TimelineEdit::Remove { keys }),
        keys().prop_map(|keys| TimelineEdit::Copy { keys }),
        Just(TimelineEdit::Paste),
        (
            keys(),
            prop::sample::select(vec!["linear", "smooth", "step", "bounce", "bezier .1 -1 .9 2", "no"]),
            any::<bool>()
        )
            .prop_map(|(keys, mode, cycle)| TimelineEdit::Ease { keys, mode: mode.into(), cycle }),
        (0..12u32).prop_map(|count| TimelineEdit::Frames { count }),
        prop::sample::select(vec![0.0, 5.0, 24.0, 1e9]).prop_map(|fps| TimelineEdit::Pace { fps }),
    ];
    let changes = prop_oneof![
        (at(), 0..12usize, prop::collection::vec(number(), 0..4), prop::option::of(0..3u64))
            .prop_map(|(line, first, values, gesture)| ClientMessage::Set { line, first, values, gesture }),
        // The version is set when it is sent.
        (at(), 1..3usize, prop::collection::vec(line(), 1..3)).prop_map(|(at, removed, lines)| {
            ClientMessage::Edit { file: 0, version: 0, changes: vec![TextChange { at, removed, lines }] }
        }),
        lines().prop_map(|lines| ClientMessage::Remove { lines }),
        lines().prop_map(|lines| ClientMessage::Duplicate { lines }),
        (at(), any::<bool>()).prop_map(|(line, down)| ClientMessage::Reorder { line, down }),
        (at(), name()).prop_map(|(line, name)| ClientMessage::Rename { line, name }),
        (at(), name()).prop_map(|(line, text)| ClientMessage::Words { line, text }),
        lines().prop_map(|lines| ClientMessage::Hide { lines }),
        lines().prop_map(|lines| ClientMessage::Ground { lines }),
        lines().prop_map(|lines| ClientMessage::Drop { lines }),
        lines().prop_map(|lines| ClientMessage::Lock { lines }),
        lines().prop_map(|lines| ClientMessage::Group { lines }),
        at().prop_map(|line| ClientMessage::Ungroup { line }),
        (lines(), name()).prop_map(|(lines, material)| ClientMessage::Surface { lines, material }),
        (lines(), prop::sample::select(materials::presets()))
            .prop_map(|(lines, preset)| ClientMessage::Preset { lines, preset: preset.into() }),
        (lines(), [number(), number(), number()]).prop_map(|(lines, by)| ClientMessage::Nudge { lines, by }),
        (
            prop::sample::select(vec!["Sphere", "Ilight", "Plane", "Text", "Trace", "?"]),
            prop::option::of([0.0..48.0, 0.0..27.0])
        )
            .prop_map(|(command, at)| ClientMessage::Add { command: command.into(), at }),
        Just(ClientMessage::KeepCamera),
        any::<bool>().prop_map(|on| ClientMessage::Draft { on }),
    ];
    let looks = prop_oneof![
        (0..12usize, any::<bool>()).prop_map(|(frame, moving)| ClientMessage::Frame { frame, moving }),
        lines().prop_map(|lines| ClientMessage::Select { lines }),
        ([number(), number()]).prop_map(|[x, y]| ClientMessage::Navigate { how: Navigation::Turn, x, y }),
        prop::sample::select(vec![ViewPreset::Script, ViewPreset::Top, ViewPreset::Selection])
            .prop_map(|at| ClientMessage::Look { at }),
    ];
    let pointer = prop_oneof![
        (0.0..48.0, 0.0..27.0, any::<bool>()).prop_map(|(x, y, extend)| ClientMessage::Press {
            x,
            y,
            extend,
            grip: None,
            line: None
        }),
        (number(), 0.0..27.0, any::<[bool; 3]>()).prop_map(|(x, y, [upright, snap, whole])| {
            ClientMessage::Drag { x: 20.0 + 5.0 * x, y, options: DragOptions { upright, snap, whole } }
        }),
        Just(ClientMessage::Release),
        prop::option::of(0..3u64).prop_map(|gesture| ClientMessage::GiveUp { gesture }),
    ];
    let load = prop_oneof![
        Just(Source::Empty),
        prop::collection::vec(line(), 0..5).prop_map(|text| Source::Text { text: text.join("\r\n") }),
    ];
    prop_oneof![
        12 => changes,
        4 => pointer,
        3 => time.prop_map(|wish| ClientMessage::Time { wish }),
        2 => looks,
        4 => Just(ClientMessage::Undo),
        2 => Just(ClientMessage::Redo),
        1 => load.prop_map(|from| ClientMessage::Load { from, new: None }),
    ]
}

#[test]
fn ten_thousand_wishes_and_undos_end_in_the_same_bytes() {
    let cases = 20;
    let mut runner = TestRunner::new(Config { cases, ..Config::default() });
    let wishes = prop::collection::vec(wish(), WISHES / cases as usize);
    runner
        .run(&wishes, |wishes| {
            let mut desk = Desk::new(TEXT);
            let mut page: Vec<LineState> = desk.session.lines(&desk.project);
            desk.ask(ClientMessage::Size { width: 48, height: 27 });
            let mut changes = 0;
            for mut wish in wishes {
                if let ClientMessage::Edit { version, .. } = &mut wish {
                    *version = desk.session.text_state(&desk.project).version;
                }
                let before = desk.text();
                let shown = format!("{wish:?}");
                let tell = desk.ask(wish).tell;
                changes += usize::from(desk.text() != before);
                if let Some(lines) = tell.lines {
                    page = lines;
                }
                for splice in tell.splices {
                    page.splice(splice.at..splice.at + splice.removed, splice.lines);
                }
                prop_assert_eq!(&page, &desk.session.lines(&desk.project), "the page knows all of {}", shown);
            }
            prop_assert!(changes > 50, "{} changes", changes);
            let (edited, mut steps) = (desk.text(), 0);
            while desk.state().can_undo {
                desk.ask(ClientMessage::Undo);
                steps += 1;
            }
            prop_assert_eq!(desk.text(), TEXT);
            prop_assert_eq!(desk.state().fps, 10.0);
            desk.project.save(true);
            prop_assert_eq!(&desk.on_disk(), TEXT);
            for _ in 0..steps {
                desk.ask(ClientMessage::Redo);
            }
            prop_assert_eq!(desk.text(), edited);
            Ok(())
        })
        .unwrap();
}
