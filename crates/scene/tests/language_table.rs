//! The table of commands tells the truth: what it says of each parameter is what the parser takes and refuses.

use rayfold_scene::{Code, Command, Diagnostic, Field, Limits, Values, parse};

/// A line of the command that is in order, with all of its numbers.
fn sample(command: Command) -> &'static str {
    match command {
        Command::Screen => "Screen 4 3",
        Command::Orthocamera => "Orthocamera",
        Command::Camera => "Camera 1 2 3 4 5 -6 .3 .5 .7 2 -3 -4 5 6",
        Command::Background => "Background .1 .2 .3",
        Command::Sphere => "Sphere 1 2 3 4 .1 .2 .3 .4 .5 .6 .7 .8 .9",
        Command::Triangle => "Triangle 1 2 3 4 5 7 8 8 9 .1 .2 .3 .4 .5 .6",
        Command::Cuboid => "Box 1 2 3 4 5 6 .1 .2 .3 .4 .5 .6",
        Command::Ilight => "Ilight .1 .2 .3 4 5 6",
        Command::Clear => "Clear",
        Command::Trace => "Trace",
    }
}

/// What is wrong with a line that stands in a script which is otherwise in order.
fn told(line: &str) -> Vec<Diagnostic> {
    let script = format!("Screen 4 3\n{line}\nTrace\n");
    let mut told = parse("a.txt", script.as_bytes(), &Limits::default()).diagnostics;
    told.retain(|d| d.is_error() && d.code != Code::LimitExceeded);
    told
}

/// The sample with the numbers from `first` on replaced.
fn replaced(command: Command, first: usize, numbers: &[String]) -> String {
    let mut words: Vec<String> = sample(command).split(' ').map(String::from).collect();
    for (word, number) in words[1 + first..].iter_mut().zip(numbers) {
        word.clone_from(number);
    }
    words.join(" ")
}

/// Every parameter of every command, and its place among the numbers.
fn fields() -> impl Iterator<Item = (Command, usize, &'static Field)> {
    Command::ALL.iter().flat_map(|&command| {
        let mut first = 0;
        command.form().fields.iter().map(move |field| {
            let place = first;
            first += field.names.len();
            (command, place, field)
        })
    })
}

/// Numbers that a parameter takes, and such that it refuses.
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
        assert_eq!(told(line), [], "{line}");
        assert_eq!(line.split(' ').count() - 1, *command.form().arity().end(), "{line}");
    }
}

#[test]
fn parameters_take_and_refuse_what_the_table_says() {
    let mut refused_in_all = 0;
    for (command, first, field) in fields() {
        let (taken, refused) = edges(field);
        for numbers in taken {
            let line = replaced(command, first, &numbers);
            assert_eq!(told(&line), [], "{line}");
        }
        for numbers in refused {
            refused_in_all += 1;
            let line = replaced(command, first, &numbers);
            let [fault] = &told(&line)[..] else { panic!("one error: {line}") };
            let marked = &fault.excerpt.text[fault.excerpt.marked.clone()];
            assert_eq!((fault.code, marked), (Code::InvalidValue, numbers.join(" ").as_str()), "{line}");
            assert_eq!(fault.excerpt.text, line);
        }
    }
    assert!(refused_in_all >= 20, "only {refused_in_all} values were refused");
}

#[test]
fn optional_parameters_may_be_left_out_number_by_number() {
    for &command in Command::ALL {
        let (least, most) = command.form().arity().into_inner();
        let words: Vec<_> = sample(command).split(' ').collect();
        for count in 0..=most {
            let faults: Vec<_> = told(&words[..=count].join(" ")).into_iter().map(|d| d.code).collect();
            let expect: &[Code] = if count < least { &[Code::TooFewParameters] } else { &[] };
            assert_eq!(faults, expect, "{count} numbers of {}", command.name());
        }
        let missing: usize =
            command.form().fields.iter().filter(|field| field.optional).map(|field| field.names.len()).sum();
        assert_eq!(most - least, missing, "{}", command.name());
    }
}
