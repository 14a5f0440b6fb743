//! The cost of an animation on AWS before it is made, and the cost of the stack. Makes no requests: the prices are a
//! data file, the rest is arithmetic.

mod estimate;
mod prices;

pub use estimate::{Line, Section, Workload, estimate, render_ms, waiting_ms};
pub use prices::{CloudWatch, Lambda, Prices, S3};
