//! The size of a picture.

use crate::error::Fault;
use crate::limits;

/// Checks the size that a header promises.
pub(super) fn check_size(width: u32, height: u32) -> Result<(), Fault> {
    if width == 0 || height == 0 {
        return Err(Fault::new(format!("it has {width} x {height} pixels")));
    }
    if u64::from(width) * u64::from(height) > limits::PIXELS {
        return Err(Fault::new(format!("it has {width} x {height} pixels, more than {}", limits::PIXELS)));
    }
    Ok(())
}
