//! The language from outside: every command and its limits, errors, and scripts that are written and read again.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod colors;
mod diagnostic_text;
mod diagnostics;
mod diagnostics_curves;
mod diagnostics_doubts;
mod diagnostics_names;
mod hidden;
mod images;
mod language_page;
mod language_table;
mod meshes;
mod origins;
mod round_trip;
mod round_trip_curves;
mod roundbox;
mod settings_diagnostics;
mod skies;
mod texts;
