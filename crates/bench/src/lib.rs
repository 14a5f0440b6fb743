//! Measurements of rayfold, and the reports that they write.
//!
//! Each subcommand of the program is a module and writes one report. Parts that several of them share (the oracle, the
//! hard cases, the backends, the scenes) are modules beside them. The feature `bucket` (on by default) adds the
//! subcommands that need the AWS SDK. Each number in a report was measured by the run that wrote the report.

#![allow(clippy::print_stderr, reason = "a measurement says what it is at")]

pub mod accuracy;
pub mod backends;
pub mod coincident;
#[cfg(feature = "bucket")]
pub mod cold_start;
pub mod cpu_time;
#[cfg(feature = "bucket")]
pub mod explore;
pub mod fingerprints;
#[cfg(feature = "bucket")]
pub mod footprint;
pub mod gif;
pub mod growth;
pub mod hard_cases;
#[cfg(feature = "bucket")]
pub mod laptop;
pub mod measure;
pub mod metamorphic;
pub mod models;
pub mod needs;
pub mod oracle;
pub mod outlines;
#[cfg(feature = "bucket")]
pub mod packages;
pub mod parsing;
pub mod paths;
#[cfg(feature = "bucket")]
pub mod pipeline;
mod plot;
pub mod report_folder;
pub mod sampling;
#[cfg(feature = "bucket")]
pub mod scale;
pub mod scenes;
#[cfg(feature = "bucket")]
pub mod simulate;
pub mod speed;
pub mod studio;
