//! Any bytes as a manifest, and as an error receipt.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Manifest, Reason};

fuzz_target!(|body: &[u8]| {
    let animation = Animation::new("film").expect("a name");
    if let Ok(manifest) = Manifest::decode(&animation, body) {
        for glimpse in [1, 800, 32 * 1024] {
            let written = manifest.encode(glimpse).expect("what was read can be written");
            assert_eq!(Manifest::decode(&animation, &written).expect("and read again"), manifest);
        }
    }
    if let Ok(reason) = serde_json::from_slice::<Reason>(body) {
        let written = serde_json::to_vec(&reason).expect("what was read can be written");
        assert_eq!(serde_json::from_slice::<Reason>(&written).expect("and read again"), reason);
        assert!(reason.shortened().diagnostics.len() <= rayfold_pipeline::manifest::DIAGNOSTICS_SHOWN);
    }
});
