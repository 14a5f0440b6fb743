//! The numbers of objects, and the lines of the text that draw them.

use rayfold_scene::{Origin, Script, parse};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Default::default());
    parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics))
}

/// Returns the number and the lines of each object of a frame.
fn origins(script: &Script, k: usize) -> Vec<(usize, Vec<usize>)> {
    let origins = script.origins(k).unwrap();
    assert_eq!(origins.len(), script.frame(k).unwrap().objects.len());
    let lines = |origin: &Origin| origin.uses.iter().copied().chain([origin.line]).collect();
    origins.iter().map(|origin| (origin.number, lines(origin))).collect()
}

fn plain(of: &[(usize, usize)]) -> Vec<(usize, Vec<usize>)> {
    of.iter().map(|(number, line)| (*number, vec![*line])).collect()
}

const SURFACE: &str = "1 0 0  0 0 0";

#[test]
fn an_object_keeps_its_number_in_all_frames() {
    let script = script(&format!(
        "Screen 4 3\n# one\n\nSphere 1  0 0 -5  {SURFACE}\nSphere 0  0 0 -5  {SURFACE}\nSphere (1:0 2:1)  0 0 -5  {SURFACE}\n\
         Material m ambient (1:0 2:1) 0 0\nSphere 1  1 0 -5  m\nBox 0 0 0 1 1 1  {SURFACE}\nFrames 2\nTrace\nClear\nFrames \
         1\n\nBox 0 0 0 1 1 1  {SURFACE}\nTrace\nBox 2 0 0 3 1 1  {SURFACE}\nTrace\n"
    ));
    assert_eq!(script.frame_count(), 4);
    assert_eq!(
        origins(&script, 0),
        plain(&[(1, 4), (3, 8), (4, 9)]),
        "one is hidden, and one is in all frames"
    );
    assert_eq!(origins(&script, 1), plain(&[(1, 4), (2, 6), (3, 8), (4, 9)]));
    assert_eq!(origins(&script, 2), plain(&[(1, 15)]), "after Clear");
    assert_eq!(origins(&script, 3), plain(&[(1, 15), (2, 17)]));
    assert_eq!(script.origins(4), None);
    assert_eq!(origins(&script.only(3).unwrap(), 0), origins(&script, 3));
    assert_eq!(origins(&script.only(1).unwrap(), 0), origins(&script, 1));
}

#[test]
fn objects_of_groups_have_numbers_of_their_own_and_the_lines_of_all_uses() {
    let script = script(&format!(
        "Screen 4 3\nGroup inner\nSphere 1  0 0 0  {SURFACE}\nSphere (1:0 2:1)  1 0 0  {SURFACE}\nEnd\nGroup outer\nUse inner  0 0 0\n\
         Box 0 0 0 1 1 1  {SURFACE}\nUse inner  3 0 0  0 0 0  (1:0 2:1)\nUse inner 0 0 0  0 0 0  0\nEnd\nUse outer  0 0 -9\n\
         Box 0 0 0 1 1 1  {SURFACE}\nUse inner  0 0 -5\nFrames 2\nTrace\n"
    ));
    let all = [
        (1, vec![12, 7, 3]),
        (2, vec![12, 7, 4]),
        (3, vec![12, 8]),
        (4, vec![12, 9, 3]),
        (5, vec![12, 9, 4]),
        // The group that is hidden in all frames has two.
        (8, vec![13]),
        (9, vec![14, 3]),
        (10, vec![14, 4]),
    ];
    assert_eq!(origins(&script, 1), all);
    let shown = all.into_iter().filter(|(number, _)| [1, 3, 8, 9].contains(number));
    assert_eq!(origins(&script, 0), shown.collect::<Vec<_>>());
}

#[test]
fn a_comment_changes_lines_and_no_script() {
    let text = format!("Screen 4 3\nSphere 1  0 0 -5  {SURFACE}\nTrace\n");
    let (bare, commented) = (script(&text), script(&format!("# a ball\n{text}")));
    assert_eq!(bare, commented);
    assert_eq!((origins(&bare, 0), origins(&commented, 0)), (plain(&[(1, 2)]), plain(&[(1, 3)])));
    let made = Script::from(&bare.frame(0).unwrap());
    assert_eq!(origins(&made, 0), plain(&[(1, 0)]), "it comes from no text");
}
