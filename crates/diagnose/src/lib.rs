//! What a model lacks: fits of its parts to measurements.

mod candidate;
mod error;
mod laps;
mod least_squares;
mod log;
mod response_fit;

pub use candidate::Candidate;
pub use error::Error;
pub use laps::{Atlas, Diagnosis, Explanation, FourNumbers, Quadratic, Simulate, Verdict};
pub use log::{
    Channel, Corners, Decided, LogDiagnosis, LogExplanation, LogRow, LogVerdict, UnlistedEffect,
    diagnose_logs,
};
pub use response_fit::{Estimate, ResponseFit};
