//! Any text as a key, as an event carries it or a listing shows it; and any names made into keys. The lines of the text are
//! a key, an animation, a script and a version.
#![no_main]

use std::num::NonZeroU64;

use libfuzzer_sys::fuzz_target;
use rayfold_pipeline::keys::{Animation, Band, Key, Receipt, ScriptName, Tag, decode_event_key};
use rayfold_pipeline::store::ETag;

fuzz_target!(|text: &str| {
    let mut lines = text.split('\n');
    let mut next = || lines.next().unwrap_or_default();
    let (encoded, animation, script, version) = (next(), next(), next(), next());
    let decoded = decode_event_key(encoded);
    for text in [Some(encoded), decoded.as_deref().ok()].into_iter().flatten() {
        if let Ok(key) = text.parse::<Key>() {
            assert_eq!(key.to_string(), text, "a key that parses is canonical");
            let animation = key.animation().as_str();
            assert!(animation.split('/').all(|segment| !matches!(segment, "" | "." | "..")), "{text}");
        }
    }
    let (Ok(animation), Ok(name)) = (Animation::new(animation), ScriptName::new(script)) else { return };
    let version = ETag::new(version);
    if version.as_str().is_empty() {
        return;
    }
    let count = NonZeroU64::new(text.len() as u64).unwrap_or(NonZeroU64::MIN);
    let tag = || Tag { version: version.clone(), pixels: 3 };
    let band = Band::all(count).last().unwrap_or_else(|| unreachable!("a frame has at least one band"));
    for part in [None, Some(count)] {
        let receipts = [
            Receipt::Frame { name: name.clone(), tag: tag(), part },
            Receipt::Fault { name: name.clone(), tag: tag(), part },
            Receipt::Begun { name: name.clone(), tag: tag(), part, attempt: count },
            Receipt::Split { name: name.clone(), tag: tag(), count },
            Receipt::Cut { name: name.clone(), tag: tag(), part, count },
            Receipt::Band { name: name.clone(), tag: tag(), part, band },
        ];
        let receipts = receipts.map(|receipt| Key::Receipt { animation: animation.clone(), receipt });
        let (animation, name) = (animation.clone(), name.clone());
        let (of, called) = (animation.clone(), name.clone());
        let retry = Key::Retry { animation, name, tag: tag(), part, attempt: count };
        let woken = Key::Band { animation: of, name: called, tag: tag(), part, band, attempt: count.get() };
        for key in receipts.into_iter().chain([retry, woken]) {
            // No name of a script makes a key that is read as another's.
            assert_eq!(key.to_string().parse::<Key>().ok(), Some(key));
        }
    }
});
