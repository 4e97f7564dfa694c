//! What a model lacks: fits of its parts to measurements.

mod answer;
mod candidate;
mod corners;
mod detectable;
mod error;
mod laps;
mod least_squares;
mod log;
mod mean_laps;
mod outlying;
mod remembered;
mod response_fit;
mod sightings;
mod slip;

pub use answer::{ALTERNATIVE, Answer, Cause, Explanation, Verdict};
pub use candidate::Candidate;
pub use corners::{Corners, other_cuts};
pub use detectable::Detectable;
pub use error::{Error, Toward};
pub use laps::{
    Atlas, Baselines, Beginning, Departures, Extent, LapDiagnosis, MeanBeginning, ObservedLap, ObservedRun,
    Quadratic, Rival, Simulate, TELLS_NOTHING, Unseen, separations,
};
pub use log::{
    Agree, Channel, Decided, Implausible, LogDiagnosis, LogRow, LoggedRun, Spoilt, can_be_followed,
    diagnose_logs, log_separation, take_out_implausible,
};
pub use mean_laps::{MeanLaps, mean_lap, rms};
pub use outlying::{far, median};
pub use response_fit::{Estimate, ResponseFit};
pub use sightings::{
    Hole, coarse_unit_m, hole_in, long_holes, outlying_sightings, repeated_sightings, stray_sightings,
};

/// Is told what is being tried, in words for a reader who waits.
pub type Watch<'a> = dyn Fn(&str) + Sync + 'a;
