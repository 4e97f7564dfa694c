//! What a model lacks, from the robot's own log: readings and commands beside the camera's positions.
//!
//! The commands are recomputed from the readings ([`Decided`]). Everything else is judged by an extended Kalman filter
//! over the pose that is driven by the logged commands and measures the camera's positions and all eight readings:
//! under the right model its innovations are white. Each effect has columns of derivatives of the whitened
//! innovations; linear algebra ranks the effects, and the best are refined by the log-likelihood.

// What is known exactly.
mod controller;
mod decide;
mod evidence;
mod implausible;
mod rows;
mod steps;

// How likely a log is.
mod channels;
mod filter;
mod moments;
mod tail;

// Which effects could explain it.
mod catalogue;
mod columns;
mod further;
mod groups;
mod leads;
mod normal;
mod pairs;
mod screen;
mod unnamed;

// Their most likely sizes.
mod noise;
mod recut;
mod refine;
mod refined;
mod settling;
mod wheels;

// The search through all that, and the answer.
mod diagnosis;
mod left_out;
mod repeat;
mod search;

// What is said beside the answer.
mod detectable;
mod separation;

pub use channels::Channel;
pub use decide::Decided;
pub use diagnosis::{Agree, LogDiagnosis, Spoilt, diagnose_logs};
pub use implausible::{Implausible, take_out_implausible};
pub use rows::{LogRow, LoggedRun, can_be_followed};
pub use separation::log_separation;
