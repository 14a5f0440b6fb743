//! Checks `docs/language.md`: its examples are parsed, and its messages and limits are those of the program.

use rayfold_scene::{
    AnimationSettings, CommandEntry, Limits, ParameterEntry, language, parse, parse_settings,
};

const PAGE: &str = include_str!("../../../../docs/language.md");

/// Returns the code block that starts with `start`.
fn block(start: &str) -> &'static str {
    let mut blocks = PAGE.split("\n```").skip(1).step_by(2).filter_map(|block| block.split_once('\n'));
    let found = blocks.find(|(_, text)| text.starts_with(start));
    found.unwrap_or_else(|| panic!("no block starts with {start:?}")).1
}

#[test]
fn the_example_is_a_script() {
    let parsed = parse("two-balls.txt", block("# Two balls").as_bytes(), &Limits::default());
    assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
    assert_eq!(parsed.script.map(|script| script.frame_count()), Some(1));
}

#[test]
fn the_message_is_what_is_told_about_the_example_misspelt() {
    let script = block("# Two balls").replacen("\nSphere", "\nSpere", 1);
    let parsed = parse("two-balls.txt", script.as_bytes(), &Limits::default());
    assert_eq!(parsed.diagnostics[0].render(false), block("error: "));
}

/// Returns the cells of the table under a heading, without its head.
fn table(heading: &str) -> Vec<Vec<&'static str>> {
    let rows =
        PAGE.lines().skip_while(|line| *line != heading).skip_while(|line| !line.starts_with('|')).skip(2);
    let cells = |row: &'static str| row.trim_matches('|').split('|').map(str::trim).collect();
    rows.take_while(|line| line.starts_with('|')).map(cells).collect()
}

/// Returns the usages of commands in the rows of a table.
fn usages(heading: &str) -> Vec<String> {
    table(heading)
        .iter()
        .map(|row| {
            let [command, parameters] = [row[0], row[1]].map(|cell| cell.trim_matches('`'));
            [command].into_iter().chain(parameters.split_whitespace()).collect::<Vec<_>>().join(" ")
        })
        .collect()
}

#[test]
fn every_command_and_clause_is_written_as_the_table_says() {
    let language = language();
    let expect =
        |entries: &[CommandEntry]| entries.iter().map(|entry| entry.usage.clone()).collect::<Vec<_>>();
    assert_eq!(usages("## Commands"), expect(&language.commands));
    assert_eq!(usages("## Materials"), expect(&language.clauses));
}

#[test]
fn every_parameter_is_told_with_what_it_counts_by_and_may_be() {
    let check = |heading: &str, entries: &[CommandEntry]| {
        let rows: Vec<_> = table(heading).iter().map(|row| row.join(" | ")).collect();
        let row = |entry: &CommandEntry, p: &ParameterEntry| {
            let default = p.default.unwrap_or("must stand");
            format!(
                "`{}` | `{}` | {} | {} | {} | {default}",
                entry.name,
                p.names.join(" "),
                p.kind,
                p.unit,
                p.range
            )
        };
        let parameters = entries.iter().flat_map(|entry| entry.parameters.iter().map(move |p| (entry, p)));
        let expect: Vec<_> = parameters.map(|(entry, p)| row(entry, p)).collect();
        assert_eq!(rows, expect, "the page should have\n| {} |", expect.join(" |\n| "));
    };
    check("## Parameters", &language().commands);
    check("### Parameters of clauses", &language().clauses);
}

#[test]
fn every_mode_of_a_curve_is_told() {
    let words: Vec<_> = table("## Numbers that change").iter().map(|row| row[0].trim_matches('`')).collect();
    assert_eq!(words, language().curve_modes.iter().map(|mode| mode.name).collect::<Vec<_>>());
}

#[test]
fn the_settings_are_settings() {
    let parsed = parse_settings("animation.json", block("{").as_bytes());
    assert_eq!(parsed.settings, AnimationSettings::new(Some(50), 25.0, 0).ok());
}

#[test]
fn the_limits_are_the_defaults() {
    let rows = table("## Limits");
    let limits = Limits::default();
    let numbers: Vec<u64> = rows
        .iter()
        .map(|row| row[1].chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0))
        .collect();
    let expect = [
        limits.max_script_bytes as u64 >> 20,
        limits.max_objects as u64,
        limits.max_lights as u64,
        limits.max_pixels,
        Limits::FRAMES,
    ];
    assert_eq!(numbers, expect, "{rows:#?}");
}
