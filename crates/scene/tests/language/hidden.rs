//! Objects with the radius 0 are hidden, moment by moment.

use rayfold_scene::{Limits, Object, Script, parse};

fn script(text: &str) -> Script {
    let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    parsed.script.unwrap_or_else(|| panic!("{text}\n{}", shown.join("\n")))
}

fn messages(line: &str) -> Vec<String> {
    let text = format!("Screen 4 3\n{line}\nTrace");
    parse("a.txt", text.as_bytes(), &Limits::default()).diagnostics.into_iter().map(|d| d.message).collect()
}

#[test]
fn what_has_the_radius_0_is_not_drawn() {
    let shapes = [
        "Sphere 0 0 0 -5 1 1 1 0 0 0",
        "Disc -0 0 0 -5 0 0 1 1 1 1 0 0 0",
        "Cylinder 0 0 0 -5 1 1 1 1 1 1 0 0 0",
        "Cone 0 0 0 0 -5 1 1 1 1 1 1 0 0 0",
        "Sphere 0 0 0 -5 #ffffff #000000",
    ];
    for shape in shapes {
        let with = script(&format!("Screen 4 3\n{shape}\nBox 0 0 0 1 1 1 1 1 1 0 0 0\nTrace"));
        let objects = with.frame(0).unwrap().objects;
        assert!(matches!(&objects[..], [Object::Cuboid(_)]), "{shape}: {objects:?}");
        assert_eq!(messages(shape), ["nothing is drawn: the radius is 0"], "{shape}");
    }
}

#[test]
fn a_radius_may_shrink_to_0_also_in_groups() {
    let text = "Screen 4 3\nMaterial m diffuse 1 0 0\nGroup g\nSphere (1:1 3:0 5:1) 0 0 0 m\nBox 0 0 0 1 1 1 m\n\
                Cone (1:1 3:0 5:1) 0 0 0 0 0 1 0 m\nDisc 1 0 0 0 0 1 0 m\nEnd\nUse g\nUse g 1 0 0\n\
                Cylinder (1:1 3:0 5:1) 0 0 0 0 1 0 m\nDisc (1:1 3:0 5:1) 0 0 0 0 1 0 m\nFrames 5\nTrace";
    let script = script(text);
    let kinds = |frame| {
        let objects = script.frame(frame).unwrap().objects;
        let kind = |object: &Object| match object {
            Object::Instance(instance) => format!("{:?}", instance.object()),
            object => format!("{object:?}"),
        };
        objects.iter().map(|o| kind(o).chars().take(4).collect::<String>()).collect::<Vec<_>>().join(" ")
    };
    let all = "Sphe Cubo Cone Disc Sphe Cubo Cone Disc Cyli Disc";
    assert_eq!([0, 1, 2, 3, 4].map(kinds), [all, all, "Cubo Disc Cubo Disc", all, all]);
    let again = parse("b.txt", script.to_string().as_bytes(), &Limits::default());
    assert_eq!(again.script, Some(script));
}

#[test]
fn the_other_numbers_of_a_hidden_object_are_checked_and_no_radius_is_below_0() {
    for (line, message) in [
        ("Sphere -1 0 0 0 1 1 1 0 0 0", "the radius must not be negative"),
        ("Sphere (1:0 2:-1) 0 0 0 1 1 1 0 0 0\nFrames 2", "the radius is -1 at frame 2"),
        ("Disc 0 0 0 0 0 0 0 1 1 1 0 0 0", "the normal must not be zero"),
        ("Cylinder 0 1 2 3 1 2 3 1 1 1 0 0 0", "the ends of the axis must differ"),
        (
            "Cylinder (1:0 2:0) 1 2 3 1 2 3 1 1 1 0 0 0\nFrames 2",
            "the ends of the axis must differ, which fails at frame 1",
        ),
        ("Cone 0 -1 1 2 3 1 2 4 1 1 1 0 0 0", "the radius Rb must not be negative"),
        ("Torus 1 0 0 0 0 0 1 0 1 1 1 0 0 0", "the thickness r must be greater than zero"),
        // What overshoots goes below 0.
        ("Sphere (back 1:1 9:0) 0 0 0 1 1 1 0 0 0\nFrames 9", "the radius is -0.0968185546875 at frame 6"),
    ] {
        let found = messages(line);
        assert!(found.iter().any(|found| found.as_str() == message), "{line}: {found:?}");
    }
}
