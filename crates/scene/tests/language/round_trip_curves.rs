//! Random scripts with curves, materials and groups, generated from the table of the language. They read back as the
//! same, and each of their frames is a script of its own.
//!
//! A failure prints its seed as a line for a `.proptest-regressions` file.

use std::sync::LazyLock;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Clause, Command, Diagnostic, Form, Limits, Script, Values, parse_with_files};

/// A constant number or a curve.
#[derive(Clone, Debug)]
enum Number {
    Constant(f64),
    Animated { words: &'static str, keys: Vec<(f64, f64)> },
}

/// A random line, before it is fitted to its command.
#[derive(Clone, Debug)]
struct Draft {
    command: usize,
    numbers: Vec<Number>,
    /// The number of optional numbers that are omitted.
    left_out: usize,
    /// The index of the name that it refers to, if it does.
    name: usize,
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => (-400..=400i32).prop_map(|x| f64::from(x) / 100.0),
        1 => prop::num::f64::NORMAL.prop_map(|x| x % 1e30),
        1 => Just(0.0),
        1 => Just(-0.0),
    ]
}

fn number() -> impl Strategy<Value = Number> {
    // None of these overshoots, so a number that fits at the keys fits between them.
    let modes = [
        "",
        "linear ",
        "smooth ",
        "STEP ",
        "cycle ",
        "smooth Cycle ",
        "cycle step ",
        "in ",
        "cycle Out ",
        "inout ",
        "bounce ",
        "bezier .3 0,.7 1 ",
    ];
    let keys = prop::collection::btree_map(-50..60i32, value(), 2..6);
    prop_oneof![
        3 => value().prop_map(Number::Constant),
        1 => (prop::sample::select(modes.to_vec()), keys).prop_map(|(words, keys)| {
            let keys = keys.into_iter().map(|(frame, value)| (f64::from(frame) / 4.0, value)).collect();
            Number::Animated { words, keys }
        }),
    ]
}

fn draft() -> impl Strategy<Value = Draft> {
    (0..64usize, prop::collection::vec(number(), 20), 0..12usize, 0..6usize)
        .prop_map(|(command, numbers, left_out, name)| Draft { command, numbers, left_out, name })
}

/// Converts a number to one that a parameter allows.
fn fitting(values: Values, x: f64) -> f64 {
    let fraction = (x.abs() / 7.0).fract();
    match values {
        Values::Any | Values::Clamped => x,
        Values::NotZero => x + 5.0,
        Values::Positive => x.abs() + 0.25,
        Values::NotNegative => x.abs(),
        Values::AtLeastOne => 1.0 + x.abs(),
        Values::Share => fraction,
        Values::HalfTurn => 170.0 * fraction,
        Values::FieldOfView => 1.0 + 170.0 * fraction,
        Values::Whole(least, most) => {
            f64::from(least) + (30.0 * fraction).floor().min(f64::from(most - least))
        }
        Values::OneOf(words) => (fraction * words.len() as f64).floor(),
    }
}

fn numbers(form: &Form, draft: &Draft) -> String {
    let (least, most) = form.arity();
    let counts: Vec<_> = form.counts().collect();
    let count = counts[counts.len() - 1 - draft.left_out % counts.len()];
    assert!((least..=most).contains(&count));
    let mut text = String::new();
    // The number of numbers that the last colour of digits still stands for.
    let (mut covered, mut is_behind_color) = (0, false);
    for (i, ((_, field), number)) in form.numbers().zip(&draft.numbers).take(count).enumerate() {
        let fit = |x: f64| fitting(field.values, x);
        if covered > 0 {
            covered -= 1;
            continue;
        }
        if let Number::Constant(x) = number
            && draft.name.is_multiple_of(2)
            && i + 3 <= count
            && form.takes_color(i, is_behind_color)
        {
            text += &format!(" #{:06x}", x.to_bits() >> 40);
            (covered, is_behind_color) = (2, true);
            continue;
        }
        is_behind_color = false;
        text += " ";
        match (number, field.values) {
            (Number::Constant(x), Values::OneOf(words)) => text += words[fit(*x) as usize],
            (Number::Animated { .. }, Values::OneOf(words)) => text += words[0],
            (Number::Animated { words, keys }, _) if form.takes_curve(i) => {
                let keys: Vec<_> = keys.iter().map(|(frame, x)| format!("{frame}:{:e}", fit(*x))).collect();
                text += &format!("({words}{})", keys.join(" "));
            }
            (Number::Animated { keys, .. }, _) => text += &fit(keys[0].1).to_string(),
            (Number::Constant(x), _) => text += &format!("{:e}", fit(*x)),
        }
    }
    text
}

/// Returns the word in quotes of a command, if it has one.
fn file(command: Command) -> &'static str {
    match command {
        Command::Mesh => " \"corner.obj\"",
        Command::SkyPicture => " \"sky.png\"",
        Command::Text => r#" "i \"1\"\n\\""#,
        _ => "",
    }
}

/// Returns the words behind the surface of a mesh or a text.
fn options(command: Command, draft: &Draft) -> &'static str {
    match command {
        Command::Mesh => ["", " flat", " smooth 40.5"][draft.left_out % 3],
        Command::Text => ["", " centre", " right"][draft.left_out % 3],
        _ => "",
    }
}

/// Makes a script of these lines. Lines that are not allowed in their place are left out.
fn script(drafts: &[Draft]) -> String {
    // Two plain materials, so that objects and patterns always have one to name.
    let mut text = String::from("Screen 4 3\nMaterial m-0 diffuse 1 0 0\nMaterial m-1 ambient .1 .2 .3\n");
    let mut materials: Vec<_> = ["m-0", "m-1"].map(String::from).into();
    let (mut groups, mut is_open) = (Vec::new(), false);
    for draft in drafts {
        let command = Command::ALL[draft.command % Command::ALL.len()];
        let form = command.form();
        let is_object = form.surface().is_some();
        let line = match command {
            Command::Material if !is_open => {
                let mut line = format!("Material m-{}", materials.len());
                let first = draft.left_out % Clause::ALL.len();
                let mut has_pattern = false;
                for clause in Clause::ALL.iter().cycle().skip(first).take(1 + draft.name) {
                    let names_other = clause.form().ends_with.is_some();
                    let is_pattern = names_other || *clause == Clause::Image;
                    if is_pattern && std::mem::replace(&mut has_pattern, true) {
                        continue;
                    }
                    if *clause == Clause::Image {
                        let width = numbers(clause.form(), &Draft { left_out: 0, ..draft.clone() });
                        line += " image \"sky.png\"";
                        line += &match draft.left_out % 3 {
                            0 => " ball".to_string(),
                            1 => format!(" flat{width}"),
                            _ => format!(" FLAT{width} xz"),
                        };
                        continue;
                    }
                    line += &format!(" {}{}", clause.name(), numbers(clause.form(), draft));
                    if names_other {
                        line += &format!(" {}", materials[draft.name % 2]);
                    }
                }
                materials.push(format!("m-{}", materials.len()));
                line
            }
            Command::Group if !is_open => {
                is_open = true;
                format!("Group g{}", groups.len())
            }
            Command::End if is_open => {
                is_open = false;
                groups.push(format!("g{}", groups.len()));
                "End".into()
            }
            Command::Use if !groups.is_empty() => {
                format!("Use {}{}", groups[draft.name % groups.len()], numbers(form, draft))
            }
            Command::Material | Command::Group | Command::End | Command::Use => continue,
            Command::Frames if !is_open && draft.name == 0 => format!("Frames {}", 1 + draft.left_out),
            Command::Frames if !is_open => {
                format!("Frames {} {}", 1 + draft.name, 1 + draft.name + draft.left_out)
            }
            _ if is_object && draft.name > 2 => {
                let all = numbers(form, draft);
                let mut words: Vec<String> = Vec::new();
                for word in all.split(' ').filter(|word| !word.is_empty()) {
                    match words.last_mut() {
                        // A curve is one parameter.
                        Some(last) if last.contains('(') && !last.contains(')') => {
                            *last += &format!(" {word}")
                        }
                        _ => words.push(word.to_string()),
                    }
                }
                words.truncate(form.surface().unwrap());
                let name = &materials[draft.name % materials.len()];
                format!("{command}{} {} {name}{}", file(command), words.join(" "), options(command, draft))
            }
            _ if is_open && !is_object => continue,
            _ => format!("{command}{}{}{}", file(command), numbers(form, draft), options(command, draft)),
        };
        text += &line;
        text += "\n";
    }
    text + if is_open { "End\nTrace\n" } else { "Trace\n" }
}

fn read(text: &str) -> Result<Script, Vec<Diagnostic>> {
    static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
        let corner = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let picture = include_bytes!("../pixel.png");
        Library::new(MemoryFiles::from([("corner.obj", corner.to_vec()), ("sky.png", picture.to_vec())]))
    });
    let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &LIBRARY);
    parsed.script.ok_or(parsed.diagnostics)
}

/// Formats numbers exactly: the texts of two numbers differ if their bits do, but `==` equates 0 and -0.
fn bits(scene: &impl std::fmt::Debug) -> String {
    format!("{scene:?}")
}

/// The generator covers the language: each command, clause and word occurs in valid scripts.
#[test]
fn everything_of_the_language_is_drawn() {
    let mut runner = TestRunner::deterministic();
    let drafts = prop::collection::vec(draft(), 1..40);
    let texts: Vec<_> = (0..600)
        .map(|_| script(&drafts.new_tree(&mut runner).unwrap().current()))
        .filter(|text| read(text).is_ok())
        .map(|text| text.to_lowercase())
        .collect();
    assert!(texts.len() > 100, "{} of 600 are in order", texts.len());
    let words = Command::ALL.iter().flat_map(|command| {
        let of_values = command.form().fields.iter().flat_map(|field| match field.values {
            Values::OneOf(words) => words,
            _ => &[],
        });
        of_values.copied().chain([command.name()])
    });
    for word in words.chain(Clause::ALL.iter().map(|clause| clause.name())) {
        let word = word.to_lowercase();
        let has = |text: &&String| text.split([' ', '\n']).any(|other| other == word);
        let count = texts.iter().filter(has).count();
        assert!(count >= 5, "`{word}` is in {count} of {} scripts", texts.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn scripts_with_curves_read_back(drafts in prop::collection::vec(draft(), 1..40)) {
        let text = script(&drafts);
        let read_first = read(&text);
        if let Err(faults) = &read_first {
            // Constraints on several numbers, and overflowing curves, are left to chance.
            let is_chance = faults.iter().all(|d| {
                let code = serde_json::to_string(&d.code).unwrap();
                !d.is_error() || matches!(code.as_str(), "\"invalid-value\"" | "\"curve-overflow\"")
            });
            prop_assert!(is_chance, "{text}\n{faults:#?}");
        }
        prop_assume!(read_first.is_ok());
        let first = read_first.unwrap();
        let written = first.to_string();
        let again = read(&written);
        prop_assert_eq!(again.as_ref(), Ok(&first), "{}\n{}", text, written);
        let again = again.unwrap();
        prop_assert_eq!(again.to_string(), written.clone());
        for k in 0..first.frame_count().min(4) {
            let numbers: Vec<usize> = first.origins(k).unwrap().iter().map(|origin| origin.number).collect();
            prop_assert_eq!(numbers.len(), first.frame(k).unwrap().objects.len());
            prop_assert!(numbers.iter().all(|number| *number > 0) && numbers.is_sorted_by(|a, b| a < b));
            let frame = first.frame(k);
            prop_assert_eq!(bits(&again.frame(k)), bits(&frame));
            let only = first.only(k).unwrap();
            prop_assert_eq!(bits(&only.frame(0)), bits(&frame), "{}\n{}", written, only);
            let text_of_one = only.to_string();
            let only_again = read(&text_of_one);
            prop_assert_eq!(only_again.as_ref(), Ok(&only), "{}", text_of_one);
        }
        prop_assert!(first.frames().count() == first.frame_count());
    }
}

#[test]
fn a_frame_knows_the_shortest_step_of_what_it_uses_alone() {
    let text = "Screen 4 3\nShutter .8\nMaterial lit diffuse (step 2:0 2.05:1 2.15:0) 0 0\n\
                Group g\nSphere 1 0 0 0 lit\nEnd\nSphere (1:1 1.5:2) 0 0 -5 1 0 0 0 0 0\nFrames 3\nTrace\n\
                Clear\nUse g 0 0 -5\nTrace\nClear\nShutter .1\nUse g 0 0 -5\nTrace";
    let script = read(text).unwrap();
    let steps: Vec<_> = script.frames().map(|scene| scene.shortest_step).collect();
    // The lines of the material are used by the frames from the fourth on; the last ones have short exposures, in which a
    // step of half of it is not short.
    let close = |step: Option<f64>, to: f64| step.is_some_and(|step| (step - to).abs() < 1e-12);
    assert!(close(steps[4], 0.05), "{steps:?}");
    assert!(steps.iter().enumerate().all(|(k, step)| k == 4 || step.is_none()), "{steps:?}");
    for (k, step) in steps.into_iter().enumerate() {
        let only = script.only(k).unwrap();
        assert_eq!(only.frame(0).unwrap().shortest_step, step);
        let again = read(&only.to_string()).unwrap();
        assert_eq!(again.frame(0).unwrap().shortest_step, step, "{only}");
    }
}
