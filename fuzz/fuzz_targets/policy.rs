//! Any text as the policy of a session.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_bucket::policy::{Access, Policy, Verdict};

fuzz_target!(|text: &str| {
    let Ok(policy) = text.parse::<Policy>() else { return };
    for (action, resource) in [
        ("s3:GetObject", "arn:aws:s3:::films/scripts/a/1.txt"),
        ("s3:PutObject", "arn:aws:s3:::films/frames/a/1@v-p1.png"),
        ("s3:ListBucket", "arn:aws:s3:::films"),
    ] {
        for prefix in [None, Some(""), Some("scripts/")] {
            let access = Access { action, resource, prefix, delimiter: None };
            if !text.contains("Allow") {
                assert_ne!(policy.verdict(&access), Verdict::Allowed, "nothing allows it");
            }
            assert_eq!(policy.verdict(&access), policy.verdict(&access));
        }
    }
});
