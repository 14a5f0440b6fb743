//! Any bytes as a frame that the assembler reads back.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rayfold_lambda::animator::GifAnimator;
use rayfold_pipeline::{Animator, Encoding};
use tokio::runtime::{Builder, Runtime};

/// The most pixels that a frame may have here: a larger one finds nothing faster.
const MOST_PIXELS: u64 = 1 << 16;

static RUNTIME: LazyLock<Runtime> =
    LazyLock::new(|| Builder::new_current_thread().build().expect("a runtime"));

fuzz_target!(|frame: &[u8]| {
    let animator = GifAnimator { most_pixels: MOST_PIXELS };
    let mut encoding = animator.begin(&Default::default()).expect("the usual settings");
    RUNTIME.block_on(async {
        if encoding.push(frame.to_vec().into()).await.is_ok() {
            encoding.finish().await.expect("one frame is an animation");
        }
    });
});
