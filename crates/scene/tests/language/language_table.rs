//! Checks the table of commands: the parser accepts and refuses what the table says.

use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Code, Command, Diagnostic, Field, Limits, Presence, Values, parse_with_files};

/// Returns a valid line of the command with all of its numbers.
fn sample(command: Command) -> &'static str {
    match command {
        Command::Screen => "Screen 4 3",
        Command::Orthocamera => "Orthocamera",
        Command::Camera => "Camera 1 2 3 4 5 -6 .3 .5 .7 2 -3 -4 5 6",
        Command::Look => "Look 1 2 3 4 5 -6 40 .3 .5 .1",
        Command::Lens => "Lens .1 5",
        Command::Background => "Background .1 .2 .3 .4 .5 .6",
        Command::Sky => "Sky .1 .2 .3 .4 .5 .6",
        Command::SkyPicture => "Sky \"sky.png\" .5 30",
        Command::Fog => "Fog .1 .2 .3 4",
        Command::Samples => "Samples 16 .5",
        Command::Shutter => "Shutter .5",
        Command::Tone => "Tone srgb",
        Command::Depth => "Depth 3",
        Command::Indirect => "Indirect 4",
        Command::Sphere => "Sphere 1 2 3 4 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Triangle => "Triangle 1 2 3 4 5 7 8 8 9 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Cuboid => "Box 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Plane => "Plane 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Disc => "Disc 1 2 3 4 5 6 7 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Cylinder => "Cylinder 1 2 3 4 5 6 7 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Cone => "Cone 1 2 3 4 5 6 7 8 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Torus => "Torus 3e300 5e-324 3 4 5 6 7 8 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Capsule => "Capsule 1 2 3 4 5 6 7 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Roundbox => "Roundbox 1 2 3 5 6 7 5e-324 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Mesh => "Mesh \"corner.obj\" .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Text => "Text \"a\" 1 .2 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Material => "Material red diffuse 1 0 0",
        Command::Group => "Group ball",
        Command::End => "End",
        Command::Use => "Use ball 1 2 3 4 5 6 7",
        Command::Ilight => "Ilight .1 .2 .3 4 5 6 7",
        Command::Plight => "Plight .1 .2 .3 4 5 6 7 8",
        Command::Frames => "Frames 1 4294967295",
        Command::Clear => "Clear",
        Command::Trace => "Trace",
    }
}

/// Returns the errors of a line in a script that is otherwise valid.
fn errors(line: &str) -> Vec<Diagnostic> {
    let (before, behind) = match line.split(' ').next() {
        Some("Group") => ("", "End\n"),
        Some("End") => ("Group ball\n", ""),
        Some("Use") => ("Group ball\nEnd\n", ""),
        _ => ("", ""),
    };
    let script = format!("Screen 4 3\n{before}{line}\n{behind}Trace\n");
    let corner = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let sky = include_bytes!("../pixel.png");
    let files = MemoryFiles::from([("corner.obj", corner.to_vec()), ("sky.png", sky.to_vec())]);
    let files = Library::new(files);
    let parsed = parse_with_files("a.txt", script.as_bytes(), &Limits::default(), &files);
    let mut errors = parsed.diagnostics;
    errors.retain(|d| d.is_error() && d.code != Code::LimitExceeded);
    errors
}

/// Returns the sample with other numbers from `first` on.
fn replaced(command: Command, first: usize, numbers: &[String]) -> String {
    let mut words: Vec<String> = sample(command).split(' ').map(String::from).collect();
    for (word, number) in words[1 + first..].iter_mut().zip(numbers) {
        word.clone_from(number);
    }
    words.join(" ")
}

/// Returns every parameter of every command, and the index of its first number.
fn fields() -> impl Iterator<Item = (Command, usize, &'static Field)> {
    Command::ALL.iter().flat_map(|&command| {
        let mut first = 0;
        let form = command.form();
        form.fields.iter().map(move |field| {
            let place = first + usize::from(form.subject.is_some());
            first += field.names.len();
            (command, place, field)
        })
    })
}

/// Returns numbers that a parameter allows, and numbers that it refuses.
fn edges(field: &Field) -> (Vec<Vec<String>>, Vec<Vec<String>>) {
    let alike = |number: &str| vec![number.to_owned(); field.names.len()];
    let along = |axis: usize, number: &str| {
        let mut numbers = alike("0");
        numbers[axis] = number.to_owned();
        numbers
    };
    let wide = || ["-1e300", "-0.5", "1e-300", "1e300"].map(alike).to_vec();
    match field.values {
        Values::Any | Values::Clamped => ([wide(), vec![alike("0"), alike("-0")]].concat(), vec![]),
        Values::Positive => (vec![alike("5e-324"), alike("1e300")], ["0", "-0", "-1"].map(alike).to_vec()),
        Values::NotNegative => {
            (vec![alike("0"), alike("-0"), alike("1e300")], vec![alike("-5e-324"), alike("-1")])
        }
        Values::AtLeastOne => (vec![alike("1"), alike("1e300")], vec![alike(".999"), alike("-1")]),
        Values::Share => (vec![alike("0"), alike("1")], vec![alike("-1e-9"), alike("1.001")]),
        Values::HalfTurn => (vec![alike("0"), alike("179.999")], vec![alike("-1e-9"), alike("180")]),
        Values::FieldOfView => (vec![alike("1e-9"), alike("179.999")], vec![alike("0"), alike("180")]),
        Values::OneOf(words) => (
            words.iter().flat_map(|word| [alike(word), alike(&word.to_uppercase())]).collect(),
            vec![alike("0"), alike("1"), alike("gamma"), alike("(1:0)")],
        ),
        Values::NotZero => {
            let axes = (0..field.names.len()).flat_map(|axis| ["1e-300", "-1"].map(|x| along(axis, x)));
            (axes.collect(), vec![alike("0"), alike("-0")])
        }
        Values::Whole(least, most) => {
            let beyond = f64::from(most) + 1.0;
            let below = f64::from(least) - 1.0;
            (
                vec![alike(&least.to_string()), alike(&format!("{most}.0"))],
                vec![alike(&below.to_string()), alike(&beyond.to_string()), alike("1.5"), alike("-1")],
            )
        }
    }
}

#[test]
fn the_samples_are_in_order_and_whole() {
    for &command in Command::ALL {
        let line = sample(command);
        assert_eq!(errors(line), [], "{line}");
        if command != Command::Material {
            let form = command.form();
            let names = usize::from(form.subject.is_some());
            assert_eq!(line.split(' ').count() - 1 - names, form.arity().1, "{line}");
        }
    }
}

#[test]
fn parameters_take_and_refuse_what_the_table_says() {
    let mut refused_in_all = 0;
    for (command, first, field) in fields() {
        let (taken, refused) = edges(field);
        for numbers in taken {
            // No torus is that thin.
            if command == Command::Torus && field.names == ["R"] && numbers == ["5e-324"] {
                continue;
            }
            // No side is that long.
            if command == Command::Roundbox
                && field.names == ["r"]
                && numbers[0].parse::<f64>().unwrap() > 2.0
            {
                continue;
            }
            let line = replaced(command, first, &numbers);
            assert_eq!(errors(&line), [], "{line}");
        }
        for numbers in refused {
            refused_in_all += 1;
            let line = replaced(command, first, &numbers);
            let [fault] = &errors(&line)[..] else { panic!("one error: {line}") };
            let marked = &fault.excerpt.text[fault.excerpt.marked.clone()];
            assert_eq!((fault.code, marked), (Code::InvalidValue, numbers.join(" ").as_str()), "{line}");
            assert_eq!(fault.excerpt.text, line);
        }
    }
    assert!(refused_in_all >= 20, "only {refused_in_all} values were refused");
}

#[test]
fn optional_parameters_may_be_left_out_whole_or_number_by_number() {
    for &command in Command::ALL.iter().filter(|&&command| command != Command::Material) {
        let form = command.form();
        let (least, most) = form.arity();
        let words: Vec<_> = sample(command).split(' ').collect();
        let names = usize::from(form.subject.is_some());
        for count in 0..=most {
            let faults: Vec<_> =
                errors(&words[..=names + count].join(" ")).into_iter().map(|d| d.code).collect();
            let mut end = 0;
            let is_taken = count >= least
                && (count == 0
                    // Ambient and diffuse stand or are omitted together.
                    || form.is_bare(count)
                    || form.required() <= count && form.fields.iter().any(|field| {
                        let start = end;
                        end += field.names.len();
                        count == end
                            || matches!(field.presence, Presence::FromTheEnd(_))
                                && (start..end).contains(&count)
                    }));
            let expect: &[Code] = if is_taken { &[] } else { &[Code::TooFewParameters] };
            assert_eq!(faults, expect, "{count} numbers of {}", command.name());
        }
        // The surface of a mesh or a text is omitted as a whole.
        let is_required = |(i, (_, field)): &(usize, (_, &Field))| {
            field.presence == Presence::Required && !form.is_of_optional_surface(*i)
        };
        let required = form.numbers().enumerate().filter(is_required).count();
        assert_eq!(least, required, "{}", command.name());
    }
}
