//! Ordered images to an animated GIF, streaming.
