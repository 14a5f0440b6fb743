//! Boxes with round edges: what is read, what is refused, and what they are with a radius of 0.

use rayfold_scene::{Limits, Object, Script, parse};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    parsed.script.unwrap_or_else(|| panic!("{text}\n{}", shown.join("\n")))
}

fn messages(lines: &str) -> Vec<String> {
    let text = format!("Screen 4 3\n{lines}\nTrace");
    parse("a.txt", text.as_bytes(), &Limits::default()).diagnostics.into_iter().map(|d| d.message).collect()
}

#[test]
fn with_the_radius_0_it_is_the_box() {
    for [round, sharp] in [
        ["Roundbox 1 2 3 -4 5 6 0 1 1 1 0 0 0", "Box 1 2 3 -4 5 6 1 1 1 0 0 0"],
        ["Roundbox 1 2 3 -4 2 6 0 1 1 1 0 0 0", "Box 1 2 3 -4 2 6 1 1 1 0 0 0"],
        [
            "Group g\nRoundbox 1 2 3 -4 5 6 0 1 1 1 0 0 0\nEnd\nUse g 1 2 3 10 20 30 2",
            "Group g\nBox 1 2 3 -4 5 6 1 1 1 0 0 0\nEnd\nUse g 1 2 3 10 20 30 2",
        ],
        ["Roundbox 1 2 3 -4 5 6 (1:0 2:0) 1 1 1 0 0 0\nFrames 2", "Box 1 2 3 -4 5 6 1 1 1 0 0 0\nFrames 2"],
    ] {
        let objects = |text: &str| script(&format!("Screen 4 3\n{text}\nTrace")).frame(0).unwrap().objects;
        assert_eq!(objects(round)[..], objects(sharp)[..], "{round}");
        assert_eq!(messages(round), messages(sharp), "{round}");
    }
}

#[test]
fn a_radius_moves_from_sharp_to_as_round_as_can_be() {
    let script = script("Screen 4 3\nRoundbox 0 0 0 2 3 (1:4 9:2) (1:0 9:1) 1 1 1 0 0 0\nFrames 9\nTrace");
    let radius = |frame| match &script.frame(frame).unwrap().objects[..] {
        [Object::Roundbox(roundbox)] => roundbox.radius(),
        [Object::Cuboid(_)] => 0.0,
        other => panic!("{other:?}"),
    };
    assert_eq!([0, 4, 8].map(radius), [0.0, 0.5, 1.0]);
    let again = parse("b.txt", script.to_string().as_bytes(), &Limits::default());
    assert_eq!(again.script, Some(script));
}

#[test]
fn a_radius_that_does_not_fit_is_refused_with_the_largest_that_does() {
    let most = "the radius r must be at most half of the shortest side, 0.5";
    assert_eq!(messages("Roundbox 0 0 0 2 1 3 .6 1 1 1 0 0 0"), [most]);
    assert_eq!(messages("Roundbox 0 0 0 2 1 3 .5 1 1 1 0 0 0"), [""; 0]);
    assert_eq!(messages("Roundbox .8 .8 .8 1 1 1 .1 1 1 1 0 0 0"), [""; 0], "1 - .8 is less than .2");
    assert_eq!(messages("Roundbox 0 0 0 2 1 3 -.1 1 1 1 0 0 0"), ["the radius must not be negative"]);
    let curved = messages("Roundbox 0 0 0 2 (1:2 3:1) 3 .6 1 1 1 0 0 0\nFrames 3");
    assert_eq!(curved.len(), 1);
    assert!(curved[0].contains("half of the shortest side") && curved[0].contains("frame 3"), "{curved:?}");
    let overshoots = messages("Roundbox 0 0 0 2 2 2 (back 1:0 9:1) 1 1 1 0 0 0\nFrames 9");
    assert!(overshoots[0].contains("radius"), "{overshoots:?}");
}
