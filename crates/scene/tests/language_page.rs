//! `docs/language.md` tells the truth: its examples are parsed, its messages and limits are the real ones.

use rayfold_scene::{AnimationSettings, Limits, parse, parse_settings};

const PAGE: &str = include_str!("../../../docs/language.md");

/// The code block that starts with `start`.
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

#[test]
fn every_command_is_written_as_the_table_says() {
    for line in PAGE.lines().skip_while(|line| *line != "## Commands").skip(4).take(10) {
        let cells: Vec<_> = line.split('|').map(|cell| cell.trim().trim_matches('`')).collect();
        let (command, parameters) = (cells[1], cells[2].split_whitespace().collect::<Vec<_>>().join(" "));
        let script = format!("{command} {}", "x ".repeat(16));
        let parsed = parse("a.txt", script.as_bytes(), &Limits::default());
        let help =
            parsed.diagnostics.iter().filter_map(|d| d.help.as_deref()).find(|h| h.starts_with("write"));
        assert_eq!(help, Some(format!("write `{}`", format!("{command} {parameters}").trim()).as_str()));
    }
}

#[test]
fn the_settings_are_settings() {
    let parsed = parse_settings("animation.json", block("{").as_bytes());
    assert_eq!(parsed.settings, AnimationSettings::new(Some(50), 25.0, 0).ok());
}

#[test]
fn the_limits_are_the_defaults() {
    let rows: Vec<_> = PAGE.lines().skip_while(|line| *line != "## Limits").skip(4).take(5).collect();
    let limits = Limits::default();
    let numbers: Vec<u64> = rows
        .iter()
        .map(|row| row.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0))
        .collect();
    let expect = [
        limits.max_script_bytes as u64 >> 20,
        limits.max_objects as u64,
        limits.max_lights as u64,
        limits.max_pixels,
        limits.max_frames.map_or(0, |frames| frames as u64),
    ];
    assert_eq!(numbers, expect, "{rows:#?}");
}
