//! Messages of a page, without a browser.

use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::handles::{DragOptions, Handle, HandleKind};
use crate::protocol::{Source, State};
use crate::text_edit::TextChange;
use crate::view::Projection;

/// A page and its open script.
pub(super) struct Desk {
    _folder: tempfile::TempDir,
    path: PathBuf,
    pub(super) project: Project,
    pub(super) session: Session,
}

impl Desk {
    pub(super) fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, text).unwrap();
        let project = Project::open(&path).unwrap();
        let (session, answer) = Session::open(&project);
        assert!(answer.tell.tables.is_some() && answer.tell.lines.is_some());
        Self { _folder: folder, path, project, session }
    }

    pub(super) fn ask(&mut self, ask: ClientMessage) -> Answer {
        self.session.ask(&mut self.project, ask)
    }

    /// Replaces lines as the page's editor does.
    pub(super) fn edit(&mut self, at: usize, removed: usize, text: &str) -> Answer {
        let version = self.session.text_state(&self.project).version;
        let lines = text.split('\n').map(str::to_owned).collect();
        self.ask(ClientMessage::Edit { file: 0, version, changes: vec![TextChange { at, removed, lines }] })
    }

    pub(super) fn text(&self) -> String {
        String::from_utf8(self.project.files[0].document.bytes()).unwrap()
    }

    /// Returns the content of the file.
    pub(super) fn on_disk(&self) -> String {
        fs::read_to_string(&self.path).unwrap()
    }

    pub(super) fn state(&mut self) -> State {
        self.ask(ClientMessage::Hover { x: -1.0, y: -1.0 }).tell.state.unwrap()
    }

    /// Returns a point of the picture that shows the object of a line.
    pub(super) fn seen(&mut self, line: usize) -> DVec2 {
        let scene = self.session.scene(&self.project).unwrap();
        for y in (0..scene.screen.height()).step_by(4) {
            for x in (0..scene.screen.width()).step_by(4) {
                let (x, y) = (f64::from(x), f64::from(y));
                if self.session.pick(&self.project, x, y).is_some_and(|(found, _)| found == line) {
                    return DVec2::new(x, y);
                }
            }
        }
        panic!("line {line} is not seen");
    }

    pub(super) fn drag(&mut self, from: DVec2, to: DVec2) {
        self.ask(ClientMessage::Press { x: from.x, y: from.y, extend: false, grip: None, line: None });
        for share in [0.25, 0.5, 0.75, 1.0] {
            let at = from.lerp(to, share);
            self.ask(ClientMessage::Drag { x: at.x, y: at.y, options: DragOptions::default() });
        }
        self.ask(ClientMessage::Release);
    }
}

const TEXT: &str = "# a scene\r\nSCREEN 160,90\nCamera 0 2 8  0 -.2 -1  0 1 0  1  -.8 -.45  .8 .45\n\
                    Ilight 1 1 1 .5 -1 -.3 # sun\n\tSphere  1.0 0 1 0  .1 .1 .1 .9 .2 .2   # ball\nBox -3 -1 -3 3 0 3 0 0 0 .5 .5 .5\nTrace";

#[test]
fn a_drag_changes_one_line_and_one_undo_takes_it_back() {
    let mut desk = Desk::new(TEXT);
    let at = desk.seen(4);
    desk.drag(at, at + DVec2::new(40.0, 15.0));
    let text = desk.text();
    let changed: Vec<_> = text.split('\n').zip(TEXT.split('\n')).filter(|(new, old)| new != old).collect();
    assert_eq!(changed.len(), 1, "{text}");
    assert!(
        changed[0].0.starts_with("\tSphere  1.0 ") && changed[0].0.ends_with(" .1 .1 .1 .9 .2 .2   # ball"),
        "{text}"
    );
    assert_eq!(desk.state().selection, [4]);
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT);
    assert!(!desk.state().can_undo);
    desk.ask(ClientMessage::Redo);
    assert_eq!(desk.text(), text);
}

#[test]
fn what_is_given_up_while_it_is_held_leaves_no_step() {
    let mut desk = Desk::new(TEXT);
    let at = desk.seen(4);
    let options = DragOptions::default();
    desk.ask(ClientMessage::Press { x: at.x, y: at.y, extend: false, grip: None, line: None });
    desk.ask(ClientMessage::Drag { x: at.x + 20.0, y: at.y, options });
    assert_ne!(desk.text(), TEXT);
    let tell = desk.ask(ClientMessage::GiveUp { gesture: None }).tell;
    assert_eq!((desk.text().as_str(), tell.splices.len()), (TEXT, 1));
    desk.ask(ClientMessage::Drag { x: at.x + 20.0, y: at.y, options });
    assert_eq!(desk.text(), TEXT, "it is no longer held");
    // The same for a gesture of a field. Another one's steps stay.
    let set = |gesture| ClientMessage::Set { line: 4, first: 0, values: vec![2.0], gesture: Some(gesture) };
    desk.ask(set(3));
    let changed = desk.text();
    desk.ask(ClientMessage::GiveUp { gesture: Some(2) });
    desk.ask(ClientMessage::GiveUp { gesture: None });
    assert_eq!(desk.text(), changed);
    desk.ask(ClientMessage::GiveUp { gesture: Some(3) });
    let state = desk.state();
    assert_eq!((desk.text().as_str(), state.can_undo, state.can_redo), (TEXT, false, false));
}

#[test]
fn an_outline_is_that_of_the_picture_also_in_another_size_and_with_other_numbers() {
    let mut desk = Desk::new(TEXT);
    desk.ask(ClientMessage::Size { width: 160, height: 90 });
    let small = desk.ask(ClientMessage::Select { lines: vec![4] }).tell.outline.unwrap();
    let large = desk.ask(ClientMessage::Size { width: 320, height: 180 }).tell.outline.unwrap();
    assert!(small.starts_with('M') && large.starts_with('M') && small != large);
    let set = |gesture| ClientMessage::Set { line: 4, first: 0, values: vec![0.5], gesture };
    assert_eq!(desk.ask(set(Some(1))).tell.outline.as_deref(), Some(""), "while a slider moves");
    let done = ClientMessage::Set { line: 4, first: 0, values: vec![], gesture: None };
    let thinner = desk.ask(done).tell.outline.unwrap();
    assert!(thinner.starts_with('M') && thinner != large);
    assert_ne!(desk.edit(4, 1, "Sphere 2 0 1 0 0 0 0 1 1 1").tell.outline, Some(thinner));
}

#[test]
fn what_is_pressed_without_moving_changes_nothing() {
    let mut desk = Desk::new(TEXT);
    let at = desk.seen(4);
    desk.drag(at, at);
    assert_eq!(desk.text(), TEXT);
    assert!(!desk.state().can_undo);
}

#[test]
fn a_drag_with_snap_aligns_with_another_object_and_shows_it() {
    let text = "Screen 160 90\nLook 0 4 9  0 1 0  40\nIlight 1 1 1  -1 -1 -1\n\
                Sphere 0.5  -1.37 0.5 0  .1 .1 .1  1 1 1\nSphere 0.25  1.03 0.25 1.5  .1 .1 .1  1 1 1\nTrace\n";
    let mut desk = Desk::new(text);
    let at = desk.seen(4);
    let options = DragOptions { snap: true, ..DragOptions::default() };
    desk.ask(ClientMessage::Press { x: at.x, y: at.y, extend: false, grip: None, line: None });
    let free = desk.ask(ClientMessage::Drag { x: at.x + 20.0, y: at.y, options }).tell.guides.unwrap();
    assert_eq!(free, "", "nothing is near");
    let scene = desk.session.scene(&desk.project).unwrap();
    let projection = Projection::new(&scene);
    let start = projection.point(glam::DVec3::new(1.03, 0.25, 1.5)).unwrap();
    let end = projection.point(glam::DVec3::new(-1.3, 0.25, 1.5)).unwrap();
    let to = at + end - start;
    let guides = desk.ask(ClientMessage::Drag { x: to.x, y: to.y, options }).tell.guides.unwrap();
    assert!(guides.starts_with('M') && guides.matches('L').count() == 1, "{guides}");
    assert!(desk.text().contains("Sphere 0.25  -1.37 0.25 1.5 "), "{}", desk.text());
    assert_eq!(desk.ask(ClientMessage::Release).tell.guides.as_deref(), Some(""));
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), text);
}

#[test]
fn a_drag_beside_all_objects_turns_a_free_camera_and_leaves_the_script() {
    let mut desk = Desk::new(TEXT);
    desk.drag(DVec2::new(2.0, 2.0), DVec2::new(60.0, 20.0));
    assert!(desk.state().free);
    assert_eq!(desk.text(), TEXT);
    desk.ask(ClientMessage::KeepCamera);
    let text = desk.text();
    assert!(!desk.state().free && text.lines().nth(2) != TEXT.lines().nth(2));
    assert_eq!(text.lines().count(), TEXT.lines().count());
    assert!(desk.project.files[0].is_sound(), "{text}");
}

#[test]
fn a_camera_of_the_palette_looks_from_here_at_what_it_falls_on() {
    let mut desk = Desk::new(TEXT);
    let before = desk.seen(4);
    let (_, point) = desk.session.pick(&desk.project, before.x, before.y).unwrap();
    desk.ask(ClientMessage::Add { command: "Camera".into(), at: Some(before.into()) });
    let text = desk.text();
    assert_eq!(text.lines().count(), TEXT.lines().count(), "{text}");
    let scene = desk.session.scene(&desk.project).unwrap();
    let after = Projection::new(&scene).point(point).unwrap();
    let middle = 0.5 * DVec2::new(f64::from(scene.screen.width()), f64::from(scene.screen.height()));
    assert!(after.distance(middle) < 1.5 && before.distance(middle) > 5.0, "{before} to {after}");
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT);
}

#[test]
fn a_draft_leaves_out_indirect_light_in_the_viewport_alone() {
    assert_eq!(Desk::new(TEXT).ask(ClientMessage::Undo).tell.state.unwrap().draft, None, "there is none");
    let text = format!("Samples 16\nIndirect 3\n{TEXT}");
    let mut desk = Desk::new(&text);
    let bounces = |picture: &Wanted| picture.scene.indirect_bounces();
    let answer = desk.ask(ClientMessage::Draft { on: true });
    assert_eq!(answer.tell.state.unwrap().draft, Some(true));
    assert_eq!(bounces(&answer.picture.unwrap()), 0);
    let answer = desk.ask(ClientMessage::Draft { on: false });
    assert_eq!(answer.tell.state.unwrap().draft, Some(false));
    assert_eq!(bounces(&answer.picture.unwrap()), 3);
    assert_eq!(desk.text(), text);
}

#[test]
fn a_key_that_cannot_move_the_selection_says_why() {
    let mut desk = Desk::new(&TEXT.replace("Trace", "Text \"A\" 1 .2\nTrace"));
    let line = desk.text().lines().position(|line| line.starts_with("Text")).unwrap();
    let nudged = |desk: &mut Desk, line| {
        desk.ask(ClientMessage::Nudge { lines: vec![line], by: [1.0, 0.0, 0.0] }).tell.notice
    };
    assert!(nudged(&mut desk, line).is_some_and(|notice| notice.contains("Ctrl+G")));
    let ball = desk.text().lines().position(|line| line.contains("Sphere")).unwrap();
    assert_eq!(nudged(&mut desk, ball), None);
}

#[test]
fn the_picture_through_the_scripts_camera_is_the_scene_of_the_script() {
    let mut desk = Desk::new(TEXT);
    let picture = desk.ask(ClientMessage::Size { width: 160, height: 200 }).picture.unwrap();
    let scene =
        rayfold_scene::parse("a", TEXT.as_bytes(), &Default::default()).script.unwrap().frame(0).unwrap();
    assert_eq!(picture.scene, scene, "as large as fits, in the script's proportions");
    let picture = desk.ask(ClientMessage::Size { width: 100_000, height: 100_000 }).picture.unwrap();
    assert!(picture.scene.screen.pixels() <= crate::wanted::PIXELS + 10_000);
}

#[test]
fn five_objects_from_an_empty_page() {
    let mut desk = Desk::new("");
    assert!(desk.state().picture.is_none());
    for command in ["Box", "Sphere", "Sphere", "Triangle", "Ilight"] {
        desk.ask(ClientMessage::Add { command: command.into(), at: None });
        assert!(desk.project.files[0].is_sound(), "{}", desk.text());
    }
    let scene = desk.project.files[0].script.as_ref().unwrap().frame(0).unwrap();
    assert_eq!((scene.objects.len(), scene.lights.len()), (4, 2));
    while desk.state().can_undo {
        desk.ask(ClientMessage::Undo);
    }
    assert_eq!(desk.text(), "");
}

#[test]
fn a_script_with_an_error_keeps_its_last_picture_and_tells_the_place() {
    let mut desk = Desk::new(TEXT);
    let answer = desk.edit(4, 1, "Spere 1");
    assert!(answer.picture.is_some());
    let state = answer.tell.state.unwrap();
    assert_eq!((state.faults[0].line, state.faults[0].column, state.faults[0].length), (4, 0, 5));
    assert_eq!(desk.session.pick(&desk.project, 80.0, 45.0), None, "lines and picture differ");
    desk.ask(ClientMessage::Undo);
    assert!(desk.state().faults.is_empty());
}

#[test]
fn what_is_typed_in_a_line_is_one_step() {
    let mut desk = Desk::new(TEXT);
    for text in ["T", "Tr", "# Trace"] {
        desk.edit(6, 1, text);
        desk.ask(ClientMessage::Hover { x: 1.0, y: 1.0 });
    }
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT);
}

#[test]
fn a_change_of_a_text_that_has_changed_meanwhile_is_refused() {
    let mut desk = Desk::new(TEXT);
    let edit = |version| {
        let changes = vec![TextChange { at: 0, removed: 1, lines: vec!["# one".into(), "# two".into()] }];
        ClientMessage::Edit { file: 0, version, changes }
    };
    let old = desk.session.text_state(&desk.project).version;
    // Its own changes do not change the version, so it need not wait for replies.
    for _ in 0..2 {
        let tell = desk.ask(edit(old)).tell;
        assert_eq!((tell.accepted, tell.text.unwrap().version), (Some(true), old));
    }
    let text = desk.text();
    let tell = desk.ask(ClientMessage::Remove { lines: vec![6] }).tell;
    assert!(tell.accepted.is_none() && tell.text.unwrap().version != old);
    let tell = desk.ask(edit(old)).tell;
    assert!(tell.accepted == Some(false) && tell.splices.is_empty());
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), text);
    // A change of lines that are not there brings the text that is there.
    let version = desk.session.text_state(&desk.project).version;
    let changes = vec![TextChange { at: 99, removed: 1, lines: vec!["x".into()] }];
    let tell = desk.ask(ClientMessage::Edit { file: 0, version, changes }).tell;
    assert!(tell.accepted == Some(false) && tell.lines.is_some() && desk.text() == text);
}

#[test]
fn a_change_of_a_script_that_is_no_longer_shown_reaches_it() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.txt", "b.txt"] {
        fs::write(folder.path().join(name), TEXT).unwrap();
    }
    let mut project = Project::open(folder.path()).unwrap();
    let (mut session, first) = Session::open(&project);
    let version = first.tell.text.unwrap().version;
    session.ask(&mut project, ClientMessage::Frame { frame: 1, moving: true });
    let changes = vec![TextChange { at: 0, removed: 1, lines: vec!["# a".into()] }];
    let tell = session.ask(&mut project, ClientMessage::Edit { file: 0, version, changes }).tell;
    assert!(tell.accepted == Some(true) && tell.splices.is_empty());
    project.save(true);
    assert!(fs::read_to_string(folder.path().join("a.txt")).unwrap().starts_with("# a\r\n"));
    assert_eq!(fs::read_to_string(folder.path().join("b.txt")).unwrap(), TEXT);
}

#[test]
fn a_script_that_loses_its_frames_stays_shown() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.txt", "b.txt"] {
        fs::write(folder.path().join(name), "Screen 4 3\nFrames 5\nTrace\n").unwrap();
    }
    let mut project = Project::open(folder.path()).unwrap();
    let (mut session, first) = Session::open(&project);
    let version = first.tell.text.unwrap().version;
    session.ask(&mut project, ClientMessage::Frame { frame: 4, moving: false });
    let changes = vec![TextChange { at: 1, removed: 1, lines: vec!["Frames 2".into()] }];
    let tell = session.ask(&mut project, ClientMessage::Edit { file: 0, version, changes }).tell;
    let state = tell.state.unwrap();
    assert_eq!((state.file, state.frame, tell.lines), (0, 1, None));
}

#[test]
fn a_parameter_that_was_left_out_comes_whole() {
    let mut desk = Desk::new(TEXT);
    desk.ask(ClientMessage::Set { line: 4, first: 11, values: vec![0.5], gesture: None });
    assert_eq!(desk.text(), TEXT.replace(".9 .2 .2   #", ".9 .2 .2 0 0.5 0   #"));
    desk.ask(ClientMessage::Set { line: 4, first: 12, values: vec![], gesture: None });
    assert_eq!(desk.text(), TEXT.replace(".9 .2 .2   #", ".9 .2 .2 0 0.5 0   #"));
}

#[test]
fn the_selection_stays_with_its_lines() {
    let mut desk = Desk::new(TEXT);
    desk.ask(ClientMessage::Select { lines: vec![4, 5] });
    desk.edit(0, 1, &format!("# one\n# two\n{}", desk.text().lines().next().unwrap()));
    assert_eq!(desk.state().selection, [6, 7]);
    desk.ask(ClientMessage::Remove { lines: vec![6] });
    desk.ask(ClientMessage::Undo);
    desk.ask(ClientMessage::Select { lines: vec![7] });
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.state().selection, [5]);
    assert_eq!(desk.text(), TEXT);
}

#[test]
fn handles_lead_to_the_numbers_of_the_line() {
    let mut desk = Desk::new(TEXT);
    let handles = desk.ask(ClientMessage::Select { lines: vec![5] }).tell.state.unwrap().handles;
    let grips: Vec<_> = handles.iter().map(|handle| handle.grip).collect();
    let axes = [0, 1, 2].map(|axis| HandleKind::Axis { axis });
    let planes = [1, 2].map(|axis| HandleKind::Plane { axis });
    let points = [0, 3].map(|first| HandleKind::Point { first });
    let size = [HandleKind::Size];
    assert_eq!(grips, [axes.as_slice(), &planes, &points, &size].concat(), "that of y and z is seen edge on");
    let Handle { at, .. } = handles[grips.len() - 2];
    let (grip, line) = (Some(HandleKind::Point { first: 3 }), Some(5));
    desk.ask(ClientMessage::Press { x: at[0], y: at[1], extend: false, grip, line });
    desk.ask(ClientMessage::Drag {
        x: at[0],
        y: at[1] - 12.0,
        options: DragOptions { upright: true, ..DragOptions::default() },
    });
    let text = desk.text();
    assert!(text.contains("\nBox -3 -1 -3 3 0.") && text.contains(" 3 0 0 0 .5 .5 .5\n"), "{text}");
}

/// In all example scenes: if any object of the first script is moved, only its line differs.
#[test]
fn touching_one_object_of_each_example_changes_its_line_alone() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut seen = 0;
    for entry in fs::read_dir(scenes).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir())
    {
        let project = Project::open(&entry).unwrap();
        let text = String::from_utf8(project.files[0].document.bytes()).unwrap();
        if rayfold_scene::parse("example", text.as_bytes(), &Default::default()).script.is_none() {
            // Its models and pictures are in its folder.
            continue;
        }
        let mut desk = Desk::new(&text);
        let objects = desk.session.shown(&desk.project).source_map.objects.clone();
        for line in objects.into_iter().take(12) {
            desk.ask(ClientMessage::Nudge { lines: vec![line], by: [1.0, 0.0, 0.0] });
            desk.project.save(true);
            let saved = fs::read_to_string(&desk.path).unwrap();
            let (new, old): (Vec<_>, Vec<_>) = (saved.split('\n').collect(), text.split('\n').collect());
            assert_eq!(new.len(), old.len());
            let differ: Vec<_> = (0..new.len()).filter(|&at| new[at] != old[at]).collect();
            assert_eq!(differ, [line], "{}", entry.display());
            desk.ask(ClientMessage::Undo);
            assert_eq!(desk.text(), text);
            seen += 1;
        }
    }
    assert!(seen > 20, "are the scenes still there?");
}

#[test]
fn a_huge_script_is_edited_line_by_line() {
    let mut text = String::from("Screen 160 90\nCamera 0 0 500  0 0 -1  0 1 0  1  -.8 -.45  .8 .45\n");
    for object in 0..100_000 {
        text.push_str(&format!(
            "Sphere 1 {} {} 0  .1 .1 .1  1 1 1\n",
            object % 400 - 200,
            object / 400 - 125
        ));
    }
    text.push_str("Trace\n");
    let mut desk = Desk::new(&text);
    let answer = desk.ask(ClientMessage::Set { line: 50_000, first: 1, values: vec![7.5], gesture: Some(1) });
    assert!(answer.picture.is_some() && answer.tell.lines.is_none());
    assert_eq!(answer.tell.splices.len(), 1, "the reply is small");
    assert_eq!(answer.tell.splices[0].lines.len(), 1);
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), text);
}

#[test]
fn another_text_is_one_step_and_an_example_is_drawn() {
    let mut desk = Desk::new(TEXT);
    let from = Source::Example { name: "marbles".into() };
    let answer = desk.ask(ClientMessage::Load { from, new: None });
    assert!(answer.picture.is_some() && desk.project.files[0].is_sound());
    assert!(desk.text().lines().count() > 10 && desk.text() != TEXT);
    desk.ask(ClientMessage::Undo);
    assert_eq!(desk.text(), TEXT);
    desk.ask(ClientMessage::Load { from: Source::Empty, new: None });
    assert_eq!(desk.text(), "");
    desk.ask(ClientMessage::Undo);
    let refused = desk.ask(ClientMessage::Load { from: Source::Shown, new: Some("b.txt".into()) });
    assert!(refused.tell.notice.unwrap().contains("one script was opened"));
    assert_eq!(fs::read_dir(desk.path.parent().unwrap()).unwrap().count(), 1);
}

#[test]
fn a_copy_under_a_new_name_is_shown_and_the_old_one_stays() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.txt", "c.txt"] {
        fs::write(folder.path().join(name), TEXT).unwrap();
    }
    let mut project = Project::open(folder.path()).unwrap();
    let (mut session, first) = Session::open(&project);
    assert_eq!(first.tell.can_create, Some(true));
    session.ask(&mut project, ClientMessage::Frame { frame: 1, moving: false });
    let answer =
        session.ask(&mut project, ClientMessage::Load { from: Source::Shown, new: Some("b.txt".into()) });
    let state = answer.tell.state.unwrap();
    assert_eq!((state.file, state.frame, state.frames), (1, 1, 3));
    assert_eq!(answer.tell.lines.unwrap().len(), TEXT.split('\n').count(), "the reply has its lines");
    assert_eq!(answer.tell.files.unwrap().len(), 3);
    assert_eq!(fs::read_to_string(folder.path().join("b.txt")).unwrap(), TEXT);
    let version = answer.tell.text.unwrap().version;
    let edit = |file, version| {
        let changes = vec![TextChange { at: 0, removed: 1, lines: vec!["# b".into()] }];
        ClientMessage::Edit { file, version, changes }
    };
    assert_eq!(session.ask(&mut project, edit(1, version)).tell.accepted, Some(true));
    project.save(true);
    assert_eq!(fs::read_to_string(folder.path().join("c.txt")).unwrap(), TEXT);
    assert!(fs::read_to_string(folder.path().join("b.txt")).unwrap().starts_with("# b\r\n"));
}
