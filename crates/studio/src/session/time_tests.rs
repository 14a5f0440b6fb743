//! Keys, groups and locks, without a browser.

use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use super::tests::Desk;
use super::*;
use crate::handles::{Grip, Manner};
use crate::protocol::{Switch, TimeWish};
use crate::tracks::KeyPlace;

const TEXT: &str = "# a scene\r\nScreen 64 36\nCamera 0 2 8  0 -.2 -1  0 1 0  1  -.8 -.45  .8 .45\n\
                    Ilight 1 1 1 .5 -1 -.3 # sun\nMaterial grey diffuse .5 .5 (1:.5 50:.2)\n\
                    Sphere 1.0  0 1 0  .1 .1 .1 .9 .2 .2   # ball\nBox -3 -1 -3 3 0 3 grey\nGroup table\n\
                    Cylinder .5  0 0 0  0 1 0  grey\nDisc 1 0 1 0  0 1 0 grey\nEnd\nUse table  2.5 0 0 # one\nFrames 50\nTrace";
const BALL: usize = 5;
const TABLE: usize = 11;

fn time(desk: &mut Desk, wish: TimeWish) -> Answer {
    desk.ask(Ask::Time { wish })
}

fn show(desk: &mut Desk, number: usize) {
    desk.ask(Ask::Frame { frame: number - 1, moving: false });
}

fn small() -> Desk {
    let mut desk = Desk::new(TEXT);
    desk.ask(Ask::Size { width: 64, height: 36 });
    desk
}

fn key(line: usize, number: usize, frame: f64) -> KeyPlace {
    KeyPlace { line, number, frame }
}

/// The only line that differs.
fn changed(desk: &Desk) -> String {
    let text = desk.text();
    let new: Vec<_> = text.split('\n').zip(TEXT.split('\n')).filter(|(new, old)| new != old).collect();
    assert_eq!((new.len(), text.split('\n').count()), (1, TEXT.split('\n').count()), "{text}");
    new[0].0.to_owned()
}

#[test]
fn a_drag_with_auto_key_writes_a_key_at_the_frame_that_is_shown() {
    let mut desk = small();
    time(&mut desk, TimeWish::Switch { what: Switch::AutoKey, on: true });
    show(&mut desk, 25);
    let at = desk.seen(BALL);
    desk.drag(at, at + DVec2::new(9.0, 0.0));
    let line = changed(&desk);
    assert!(
        line.starts_with("Sphere 1.0  (smooth 1:0 25:") && line.ends_with("  .1 .1 .1 .9 .2 .2   # ball"),
        "{line}"
    );
    assert!(!line.contains("(smooth 1:1"), "its height stays a number: {line}");
    let state = desk.state();
    let inspected = state.inspected.unwrap();
    assert_eq!((inspected.curves.first(), inspected.keyed.first()), (Some(&1), Some(&1)));
    assert!(state.way.starts_with('M') && state.marks.matches("h0").count() == 2);
    show(&mut desk, 13);
    assert!(desk.state().inspected.unwrap().keyed.is_empty());
    desk.ask(Ask::Undo);
    assert_eq!(desk.text(), TEXT, "a drag is one step");
}

#[test]
fn a_key_by_button_then_a_drag_elsewhere_moves_it_there() {
    let mut desk = small();
    time(&mut desk, TimeWish::Key { lines: vec![BALL] });
    assert!(changed(&desk).starts_with("Sphere 1.0  (smooth 1:0) (smooth 1:1) (smooth 1:0)  .1"));
    show(&mut desk, 25);
    desk.ask(Ask::Nudge { lines: vec![BALL], by: [1.0, 0.0, 0.0] });
    let line = changed(&desk);
    assert!(
        line.starts_with("Sphere 1.0  (smooth 1:0 25:") && line.contains(") (smooth 1:1) (smooth 1:0)  .1"),
        "{line}"
    );
    time(
        &mut desk,
        TimeWish::Remove { keys: vec![key(BALL, 1, 25.0), key(BALL, 2, 1.0), key(BALL, 3, 1.0)] },
    );
    assert_eq!(desk.text(), TEXT, "one key left is a number, as it was");
}

#[test]
fn keys_are_dragged_as_one_step_and_back_is_as_before() {
    let mut desk = small();
    let start = TEXT.replace("1.0  0 1 0", "1.0  (1:0 9:2.50 20:1) 1 0");
    desk.ask(Ask::Text { line: BALL, text: start.split('\n').nth(BALL).unwrap().into() });
    let held = vec![key(BALL, 1, 9.0), key(BALL, 1, 20.0)];
    time(&mut desk, TimeWish::Grab { keys: held.clone() });
    for by in [1.0, 30.0, 11.0, -4.0] {
        let answer = time(&mut desk, TimeWish::Move { by });
        assert!(answer.picture.is_some_and(|picture| picture.moving));
    }
    desk.ask(Ask::Release);
    assert!(desk.text().contains("(1:0 5:2.5 16:1)"), "{}", desk.text());
    assert_eq!(desk.session.tracks.as_ref().unwrap().tracks[1].keys, [(1.0, 0.0), (5.0, 2.5), (16.0, 1.0)]);
    desk.ask(Ask::Undo);
    assert_eq!(desk.text(), start);
    time(&mut desk, TimeWish::Grab { keys: held });
    time(&mut desk, TimeWish::Move { by: 3.0 });
    time(&mut desk, TimeWish::Move { by: 0.0 });
    desk.ask(Ask::Release);
    assert_eq!(desk.text(), start);
}

#[test]
fn copied_keys_stay_with_their_lines() {
    let mut desk = small();
    time(&mut desk, TimeWish::Copy { keys: vec![key(4, 3, 50.0)] });
    desk.ask(Ask::Insert { at: 0, text: "# one\n# two".into() });
    show(&mut desk, 30);
    time(&mut desk, TimeWish::Paste);
    assert!(desk.text().contains("Material grey diffuse .5 .5 (1:0.5 30:0.2 50:0.2)\n"), "{}", desk.text());
}

#[test]
fn the_number_of_frames_is_set_and_the_frame_that_is_shown_is_one_of_them() {
    let mut desk = small();
    show(&mut desk, 40);
    time(&mut desk, TimeWish::Frames { count: 10 });
    assert_eq!(changed(&desk), "Frames 10");
    let state = desk.state();
    assert_eq!((state.frame, state.frames, state.time.number, state.time.last), (9, 10, 10.0, 10));
}

#[test]
fn the_picture_at_a_frame_is_that_of_the_script() {
    let mut desk = small();
    desk.ask(Ask::Frame { frame: 30, moving: true });
    let picture = desk.ask(Ask::Frame { frame: 30, moving: false }).picture.unwrap();
    let script = rayfold_scene::parse("a", TEXT.as_bytes(), &Default::default()).script.unwrap();
    assert_eq!(picture.scene, script.frame(30).unwrap());
}

#[test]
fn a_group_is_picked_moved_and_turned_as_one() {
    let mut desk = small();
    show(&mut desk, 1);
    let at = desk.seen(TABLE);
    desk.drag(at, at + DVec2::new(0.0, 5.0));
    let line = changed(&desk);
    let place: Vec<f64> = line.split_whitespace().skip(2).take(3).map(|n| n.parse().unwrap()).collect();
    assert!(
        line.ends_with(" # one") && place[1] == 0.0 && place[2] > 0.5,
        "along the ground, nearer: {line}"
    );
    let state = desk.state();
    assert_eq!(state.selection, [TABLE]);
    desk.ask(Ask::Undo);
    let turn = Grip::Turn { first: 3, axis: 2 };
    let handles = desk.ask(Ask::Select { lines: vec![TABLE] }).tell.state.unwrap().handles;
    let found = handles.iter().find(|handle| handle.grip == turn).unwrap();
    let [x, y] = found.at;
    desk.ask(Ask::Press { x, y, extend: false, grip: Some(turn), line: Some(TABLE) });
    desk.ask(Ask::Drag { x, y: y - 20.0, manner: Manner::default() });
    desk.ask(Ask::Release);
    let line = changed(&desk);
    let numbers: Vec<f64> = line.split_whitespace().skip(2).take(6).map(|n| n.parse().unwrap()).collect();
    assert!(numbers[..5] == [2.5, 0.0, 0.0, 0.0, 0.0] && numbers[5] > 0.0, "{line}");
}

#[test]
fn several_become_a_group_and_undo_takes_it_back() {
    let mut desk = small();
    desk.ask(Ask::Group { lines: vec![TABLE, BALL] });
    let selection = desk.state().selection;
    assert_eq!(desk.session.line(&desk.project, selection[0]).unwrap().subject(), Some("group1"));
    assert!(desk.project.files[0].is_sound(), "{}", desk.text());
    assert_eq!(desk.session.pick(&desk.project, 32.0, 18.0).map(|(line, _)| line), Some(selection[0]));
    desk.ask(Ask::Undo);
    assert_eq!(desk.text(), TEXT);
    let answer = desk.ask(Ask::Group { lines: vec![0, 3] });
    assert!(answer.tell.notice.is_some_and(|told| told.contains("select some first")));
}

#[test]
fn what_is_locked_is_not_taken_hold_of_and_the_script_says_nothing_of_it() {
    let mut desk = small();
    let at = desk.seen(BALL);
    desk.ask(Ask::Lock { lines: vec![BALL] });
    desk.ask(Ask::Insert { at: 0, text: "# one".into() });
    assert_eq!(desk.state().locked, [BALL + 1]);
    desk.drag(at, at + DVec2::new(9.0, 0.0));
    assert_eq!(desk.text(), format!("# one\r\n{TEXT}"));
    assert!(
        desk.state().selection.is_empty()
            && desk.ask(Ask::Select { lines: vec![BALL + 1] }).tell.state.unwrap().handles.is_empty()
    );
    desk.ask(Ask::Lock { lines: vec![BALL + 1] });
    assert!(desk.state().locked.is_empty());
}

#[test]
fn hovering_outlines_what_is_under_the_pointer_once() {
    let mut desk = small();
    let at = desk.seen(BALL);
    let tell = desk.ask(Ask::Hover { x: at.x, y: at.y }).tell;
    assert!(tell.hovered == Some(Some(BALL)) && tell.hover_outline.is_some_and(|path| path.starts_with('M')));
    assert_eq!(desk.ask(Ask::Hover { x: at.x, y: at.y }).tell.hover_outline, None);
    assert_eq!(desk.ask(Ask::Hover { x: -1.0, y: 0.0 }).tell.hover_outline.as_deref(), Some(""));
}

#[test]
fn ghosts_are_where_it_is_at_other_frames() {
    let mut desk = small();
    desk.ask(Ask::Text {
        line: BALL,
        text: "Sphere 1.0  (1:-3 50:3) 1 0  .1 .1 .1 .9 .2 .2   # ball".into(),
    });
    desk.ask(Ask::Select { lines: vec![BALL] });
    time(&mut desk, TimeWish::Switch { what: Switch::Onion, on: true });
    let tell = desk.ask(Ask::Frame { frame: 24, moving: false }).tell;
    let ghosts = tell.ghosts.unwrap();
    assert_eq!(ghosts.iter().map(|ghost| ghost.after).collect::<Vec<_>>(), [-2, -1, 1, 2]);
    assert!(ghosts.iter().all(|ghost| Some(&ghost.path) != tell.outline.as_ref()));
    assert_eq!(desk.ask(Ask::Frame { frame: 0, moving: false }).tell.ghosts.unwrap().len(), 2);
}

#[test]
fn an_object_added_at_a_later_frame_comes_before_the_trace() {
    let mut desk = small();
    show(&mut desk, 30);
    desk.ask(Ask::Add { command: "Sphere".into(), at: None });
    assert_eq!(desk.text().matches("Trace").count(), 1, "{}", desk.text());
    assert!(desk.project.files[0].is_sound(), "{}", desk.text());
}

/// A random wish; what it concerns need not be there.
fn wishes() -> impl Strategy<Value = Ask> {
    let line = || 0..18usize;
    let keys = || {
        let one = (line(), 0..8usize, 0..6u32)
            .prop_map(|(at, number, frame)| key(at, number, f64::from(frame * 10 + 1)));
        prop::collection::vec(one, 0..4)
    };
    let lines = || prop::collection::vec(line(), 0..4);
    let step = || -3.0..3.0f64;
    let mode =
        prop_oneof![Just("linear"), Just("smooth"), Just("step"), Just("none")].prop_map(str::to_owned);
    let switch = prop_oneof![Just(Switch::AutoKey), Just(Switch::Path), Just(Switch::Onion)];
    let wish = prop_oneof![
        (switch, any::<bool>()).prop_map(|(what, on)| TimeWish::Switch { what, on }),
        lines().prop_map(|lines| TimeWish::Key { lines }),
        (line(), prop::collection::vec(0..9usize, 0..3))
            .prop_map(|(line, numbers)| TimeWish::Toggle { line, numbers }),
        keys().prop_map(|keys| TimeWish::Grab { keys }),
        (-20..20i32).prop_map(|by| TimeWish::Move { by: by.into() }),
        keys().prop_map(|keys| TimeWish::Remove { keys }),
        keys().prop_map(|keys| TimeWish::Copy { keys }),
        Just(TimeWish::Paste),
        (keys(), mode, any::<bool>()).prop_map(|(keys, mode, cycle)| TimeWish::Ease { keys, mode, cycle }),
        (1..80u32).prop_map(|count| TimeWish::Frames { count }),
    ];
    let point = || (0.0..64.0f64, 0.0..36.0f64);
    prop_oneof![
        6 => wish.prop_map(|wish| Ask::Time { wish }),
        2 => (0..60usize, any::<bool>()).prop_map(|(frame, moving)| Ask::Frame { frame, moving }),
        2 => (line(), 0..9usize, prop::collection::vec(step(), 0..3), prop::option::of(0..3u64))
            .prop_map(|(line, first, values, gesture)| Ask::Set { line, first, values, gesture }),
        2 => (point(), any::<bool>()).prop_map(|((x, y), extend)| Ask::Press { x, y, extend, grip: None, line: None }),
        3 => (point(), any::<[bool; 3]>()).prop_map(|((x, y), [upright, snap, whole])| Ask::Drag {
            x, y, manner: Manner { upright, snap, whole },
        }),
        2 => Just(Ask::Release),
        2 => lines().prop_map(|lines| Ask::Select { lines }),
        1 => (lines(), [step(), step(), step()]).prop_map(|(lines, by)| Ask::Nudge { lines, by }),
        1 => lines().prop_map(|lines| Ask::Group { lines }),
        1 => line().prop_map(|line| Ask::Ungroup { line }),
        1 => lines().prop_map(|lines| Ask::Duplicate { lines }),
        1 => lines().prop_map(|lines| Ask::Remove { lines }),
        1 => lines().prop_map(|lines| Ask::Hide { lines }),
        1 => lines().prop_map(|lines| Ask::Lock { lines }),
        1 => lines().prop_map(|lines| Ask::Ground { lines }),
        1 => lines().prop_map(|lines| Ask::Drop { lines }),
        1 => (lines(), Just("gold".to_owned())).prop_map(|(lines, preset)| Ask::Preset { lines, preset }),
        1 => (lines(), Just("grey".to_owned())).prop_map(|(lines, material)| Ask::Surface { lines, material }),
        1 => (line(), any::<bool>()).prop_map(|(line, down)| Ask::Reorder { line, down }),
        1 => Just(Ask::Add { command: "Torus".into(), at: None }),
        3 => Just(Ask::Undo),
        1 => Just(Ask::Redo),
    ]
}

/// Edits of all kinds, of keys too: what the page was told is what the script says, and undoing all gives its first bytes.
#[test]
fn ten_thousand_wishes_and_undos_end_in_the_same_bytes() {
    let mut runner = TestRunner::new(Config { cases: 20, max_shrink_iters: 200, ..Config::default() });
    runner
        .run(&prop::collection::vec(wishes(), 500), |asks| {
            let mut desk = small();
            let mut page: Vec<String> =
                TEXT.split('\n').map(|line| line.trim_end_matches('\r').to_owned()).collect();
            let mut hear = |desk: &Desk, answer: Answer| {
                for told in answer.tell.splices {
                    let lines = told.lines.into_iter().map(|line| line.text);
                    page.splice(told.at..told.at + told.removed, lines);
                }
                let lines: Vec<_> = desk.project.files[0].document.lines().iter().map(Line::text).collect();
                prop_assert_eq!(&page, &lines, "what is told is what was done");
                Ok(())
            };
            for ask in asks {
                let answer = desk.ask(ask);
                hear(&desk, answer)?;
            }
            desk.ask(Ask::Release);
            let edited = desk.text();
            let mut steps = 0;
            while desk.project.files[0].document.can_undo() {
                let answer = desk.ask(Ask::Undo);
                hear(&desk, answer)?;
                steps += 1;
            }
            prop_assert_eq!(desk.text(), TEXT);
            for _ in 0..steps {
                desk.ask(Ask::Redo);
            }
            prop_assert_eq!(desk.text(), edited);
            Ok(())
        })
        .unwrap();
}
