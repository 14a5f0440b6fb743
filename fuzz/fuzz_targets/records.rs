//! Any bytes as a record of events that failed for good.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_pipeline::failure::{End, parse_record};

fuzz_target!(|record: &[u8]| {
    if let Ok(failures) = parse_record(record) {
        for failure in failures {
            assert!(failure.version.is_none_or(|version| !version.as_str().is_empty()));
            if let End::Error(message) = failure.end {
                assert!(!message.contains("Task timed out"), "{message}");
            }
        }
    }
});
