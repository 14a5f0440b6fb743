//! Any JSON as the event of a function.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_lambda::event::Event;

fuzz_target!(|payload: &[u8]| {
    let Ok(payload) = serde_json::from_slice::<serde_json::Value>(payload) else { return };
    let records = payload["Records"].as_array().map_or(0, Vec::len);
    match Event::parse(payload) {
        Ok(Event::Objects(objects)) => assert!(objects.len() <= records, "an event for each record"),
        Ok(Event::Failures(messages)) => assert_eq!(messages.len(), records, "a message for each record"),
        Ok(Event::Sweep(_)) | Err(_) => {}
    }
});
