//! Keys, groups and locks, without a browser.

use super::tests::Desk;
use super::*;
use crate::handles::{DragOptions, HandleKind};
use crate::protocol::{Switch, TimelineEdit};
use crate::tracks::KeyPlace;

const TEXT: &str = "# a scene\r\nScreen 64 36\nCamera 0 2 8  0 -.2 -1  0 1 0  1  -.8 -.45  .8 .45\n\
                    Ilight 1 1 1 .5 -1 -.3 # sun\nMaterial grey diffuse .5 .5 (1:.5 50:.2)\n\
                    Sphere 1.0  0 1 0  .1 .1 .1 .9 .2 .2   # ball\nBox -3 -1 -3 3 0 3 grey\nGroup table\n\
                    Cylinder .5  0 0 0  0 1 0  grey\nDisc 1 0 1 0  0 1 0 grey\nEnd\nUse table  2.5 0 0 # one\nFrames 50\nTrace";
const BALL: usize = 5;
const TABLE: usize = 11;

fn time(desk: &mut Desk, wish: TimelineEdit) -> Answer {
    desk.ask(ClientMessage::Time { wish })
}

fn show(desk: &mut Desk, number: usize) {
    desk.ask(ClientMessage::Frame { frame: number - 1, moving: false });
}

fn small() -> Desk {
    let mut desk = Desk::new(TEXT);
    desk.ask(ClientMessage::Size { width: 64, height: 36 });
    desk
}

fn key(line: usize, number: usize, frame: f64) -> KeyPlace {
    KeyPlace { line, number, frame }
}

/// Returns the only line that differs.
fn changed(desk: &Desk) -> String {
    let text = desk.text();
    let new: Vec<_> = text.split('\n').zip(TEXT.split('\n')).filter(|(new, old)| new != old).collect();
    assert_eq!((new.len(), text.split('\n').count()), (1, TEXT.split('\n').count()), "{text}");
    new[0].0.to_owned()
}

#[test]
fn a_drag_with_auto_key_writes_a_key_at_the_frame_that_is_shown() {
    let mut desk = small();
    time(&mut desk, TimelineEdit::Switch { what: Switch::AutoKey, on: true });
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
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT, "a drag is one step");
}

#[test]
fn a_key_by_button_then_a_drag_elsewhere_moves_it_there() {
    let mut desk = small();
    time(&mut desk, TimelineEdit::Key { lines: vec![BALL] });
    assert!(changed(&desk).starts_with("Sphere 1.0  (smooth 1:0) (smooth 1:1) (smooth 1:0)  .1"));
    show(&mut desk, 25);
    desk.ask(ClientMessage::Nudge { lines: vec![BALL], by: [1.0, 0.0, 0.0] });
    let line = changed(&desk);
    assert!(
        line.starts_with("Sphere 1.0  (smooth 1:0 25:") && line.contains(") (smooth 1:1) (smooth 1:0)  .1"),
        "{line}"
    );
    time(
        &mut desk,
        TimelineEdit::Remove { keys: vec![key(BALL, 1, 25.0), key(BALL, 2, 1.0), key(BALL, 3, 1.0)] },
    );
    assert_eq!(desk.text(), TEXT, "one key left is a number, as it was");
}

#[test]
fn keys_are_dragged_as_one_step_and_back_is_as_before() {
    let mut desk = small();
    let start = TEXT.replace("1.0  0 1 0", "1.0  (1:0 9:2.50 20:1) 1 0");
    desk.edit(BALL, 1, start.split('\n').nth(BALL).unwrap());
    let held = vec![key(BALL, 1, 9.0), key(BALL, 1, 20.0)];
    time(&mut desk, TimelineEdit::Grab { keys: held.clone() });
    for by in [1.0, 30.0, 11.0, -4.0] {
        let answer = time(&mut desk, TimelineEdit::Move { by, value: 0.0 });
        assert!(answer.picture.is_some_and(|picture| picture.moving));
    }
    desk.ask(ClientMessage::Release);
    assert!(desk.text().contains("(1:0 5:2.5 16:1)"), "{}", desk.text());
    assert_eq!(desk.session.tracks.as_ref().unwrap().tracks[1].keys, [(1.0, 0.0), (5.0, 2.5), (16.0, 1.0)]);
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), start);
    time(&mut desk, TimelineEdit::Grab { keys: held });
    time(&mut desk, TimelineEdit::Move { by: 3.0, value: 0.0 });
    time(&mut desk, TimelineEdit::Move { by: 0.0, value: 0.0 });
    desk.ask(ClientMessage::Release);
    assert_eq!(desk.text(), start);
}

#[test]
fn copied_keys_stay_with_their_lines() {
    let mut desk = small();
    time(&mut desk, TimelineEdit::Copy { keys: vec![key(4, 3, 50.0)] });
    desk.edit(0, 1, &format!("# one\n# two\n{}", desk.text().lines().next().unwrap()));
    show(&mut desk, 30);
    time(&mut desk, TimelineEdit::Paste);
    assert!(desk.text().contains("Material grey diffuse .5 .5 (1:0.5 30:0.2 50:0.2)\n"), "{}", desk.text());
}

#[test]
fn the_number_of_frames_is_set_and_the_frame_that_is_shown_is_one_of_them() {
    let mut desk = small();
    show(&mut desk, 40);
    time(&mut desk, TimelineEdit::Frames { count: 10 });
    assert_eq!(changed(&desk), "Frames 10");
    let state = desk.state();
    assert_eq!((state.frame, state.frames, state.time.number, state.time.last), (9, 10, 10.0, 10));
}

#[test]
fn the_picture_at_a_frame_is_that_of_the_script() {
    let mut desk = small();
    desk.ask(ClientMessage::Frame { frame: 30, moving: true });
    let picture = desk.ask(ClientMessage::Frame { frame: 30, moving: false }).picture.unwrap();
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
    desk.ask(ClientMessage::Undo);
    let turn = HandleKind::Turn { first: 3, axis: 2 };
    let handles = desk.ask(ClientMessage::Select { lines: vec![TABLE] }).tell.state.unwrap().handles;
    let found = handles.iter().find(|handle| handle.grip == turn).unwrap();
    let [x, y] = found.at;
    desk.ask(ClientMessage::Press { x, y, extend: false, grip: Some(turn), line: Some(TABLE) });
    desk.ask(ClientMessage::Drag { x, y: y - 20.0, options: DragOptions::default() });
    desk.ask(ClientMessage::Release);
    let line = changed(&desk);
    let numbers: Vec<f64> = line.split_whitespace().skip(2).take(6).map(|n| n.parse().unwrap()).collect();
    assert!(numbers[..5] == [2.5, 0.0, 0.0, 0.0, 0.0] && numbers[5] > 0.0, "{line}");
}

#[test]
fn several_become_a_group_and_undo_takes_it_back() {
    let mut desk = small();
    desk.ask(ClientMessage::Group { lines: vec![TABLE, BALL] });
    let selection = desk.state().selection;
    assert_eq!(desk.session.line(&desk.project, selection[0]).unwrap().subject(), Some("group1"));
    assert!(desk.project.files[0].is_sound(), "{}", desk.text());
    assert_eq!(desk.session.pick(&desk.project, 32.0, 18.0).map(|(line, _)| line), Some(selection[0]));
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT);
    let answer = desk.ask(ClientMessage::Group { lines: vec![0, 3] });
    assert!(answer.tell.notice.is_some_and(|notice| notice.contains("select some first")));
}

#[test]
fn what_is_locked_is_not_taken_hold_of_and_the_script_says_nothing_of_it() {
    let mut desk = small();
    let at = desk.seen(BALL);
    desk.ask(ClientMessage::Lock { lines: vec![BALL] });
    desk.edit(0, 1, &format!("# one\n{}", desk.text().lines().next().unwrap()));
    assert_eq!(desk.state().locked, [BALL + 1]);
    desk.drag(at, at + DVec2::new(9.0, 0.0));
    assert_eq!(desk.text(), format!("# one\r\n{TEXT}"));
    assert!(
        desk.state().selection.is_empty()
            && desk
                .ask(ClientMessage::Select { lines: vec![BALL + 1] })
                .tell
                .state
                .unwrap()
                .handles
                .is_empty()
    );
    desk.ask(ClientMessage::Lock { lines: vec![BALL + 1] });
    assert!(desk.state().locked.is_empty());
}

#[test]
fn hovering_outlines_what_is_under_the_pointer_once() {
    let mut desk = small();
    let at = desk.seen(BALL);
    let tell = desk.ask(ClientMessage::Hover { x: at.x, y: at.y }).tell;
    assert!(tell.hovered == Some(Some(BALL)) && tell.hover_outline.is_some_and(|path| path.starts_with('M')));
    assert_eq!(desk.ask(ClientMessage::Hover { x: at.x, y: at.y }).tell.hover_outline, None);
    assert_eq!(desk.ask(ClientMessage::Hover { x: -1.0, y: 0.0 }).tell.hover_outline.as_deref(), Some(""));
}

#[test]
fn ghosts_are_where_it_is_at_other_frames() {
    let mut desk = small();
    desk.edit(BALL, 1, "Sphere 1.0  (1:-3 50:3) 1 0  .1 .1 .1 .9 .2 .2   # ball");
    desk.ask(ClientMessage::Select { lines: vec![BALL] });
    time(&mut desk, TimelineEdit::Switch { what: Switch::Onion, on: true });
    let tell = desk.ask(ClientMessage::Frame { frame: 24, moving: false }).tell;
    let ghosts = tell.ghosts.unwrap();
    assert_eq!(ghosts.iter().map(|ghost| ghost.after).collect::<Vec<_>>(), [-2, -1, 1, 2]);
    assert!(ghosts.iter().all(|ghost| Some(&ghost.path) != tell.outline.as_ref()));
    assert_eq!(desk.ask(ClientMessage::Frame { frame: 0, moving: false }).tell.ghosts.unwrap().len(), 2);
}

#[test]
fn an_object_added_at_a_later_frame_comes_before_the_trace() {
    let mut desk = small();
    show(&mut desk, 30);
    desk.ask(ClientMessage::Add { command: "Sphere".into(), at: None });
    assert_eq!(desk.text().matches("Trace").count(), 1, "{}", desk.text());
    assert!(desk.project.files[0].is_sound(), "{}", desk.text());
}

#[test]
fn the_pace_is_set_and_undone() {
    let mut desk = small();
    time(&mut desk, TimelineEdit::Pace { fps: 24.0 });
    assert_eq!((desk.state().fps, desk.state().can_undo), (24.0, true));
    let answer = time(&mut desk, TimelineEdit::Pace { fps: 0.0 });
    assert!(answer.tell.notice.unwrap().contains("0.01"), "what would be right");
    desk.ask(ClientMessage::Undo);
    assert_eq!((desk.state().fps, desk.state().can_undo), (10.0, false));
    desk.ask(ClientMessage::Redo);
    assert_eq!(desk.state().fps, 24.0);
}
