//! What a model lacks, from the robot's own log: readings and commands beside the camera's positions.
//!
//! The commands are recomputed from the readings ([`Decided`]). Everything else is judged by an extended Kalman filter
//! over the pose that is driven by the logged commands and measures the camera's positions and all eight readings:
//! under the right model its innovations are white. Each effect has columns of derivatives of the whitened
//! innovations; linear algebra ranks the effects, and the best are refined by the log-likelihood.

mod catalogue;
mod channels;
mod columns;
mod decide;
mod detectable;
mod diagnosis;
mod evidence;
mod filter;
mod groups;
mod leads;
mod moments;
mod noise;
mod pairs;
mod recut;
mod refine;
mod refined;
mod repeat;
mod rows;
mod screen;
mod search;
mod separation;
mod settling;
mod steps;
mod unnamed;
mod wheels;

pub use channels::Channel;
pub use decide::Decided;
pub use diagnosis::{LogDiagnosis, diagnose_logs};
pub use rows::LogRow;
pub use separation::log_separation;
