//! The studio without a server, in the workers of a page: the session in one ([`Desk`]), and drawing in several
//! ([`Drawer`], [`Reel`]). They share no memory, and communicate by messages, which the page's scripts transport.
//!
//! Each worker has its own copy of the files in memory. The page stores files when [`Desk`] asks it to. A worker draws
//! rows of a picture, and the desk joins them. Rows are drawn the same everywhere, so the number of workers changes no
//! pixel.

mod archive;
mod desk;
mod drawer;
mod packet;
mod painter;
mod reel;

pub use archive::{unzipped, zipped};
pub use desk::{Desk, Effect};
pub use drawer::Drawer;
pub use packet::{File, files_of, packet};
pub use reel::Reel;

/// Provides the default font of letters.
#[cfg(target_arch = "wasm32")]
pub use rayfold_scene::assets::provide_font;

/// Sets the time since an arbitrary moment. A browser's workers have no clock of their own.
#[cfg(target_arch = "wasm32")]
pub fn set_time(micros: u64) {
    crate::clock::set(micros);
}
