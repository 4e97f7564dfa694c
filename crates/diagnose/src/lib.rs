//! What a model lacks: fits of its parts to measurements.

mod candidate;
mod error;
mod least_squares;
mod response_fit;

pub use candidate::Candidate;
pub use error::Error;
pub use response_fit::{Estimate, ResponseFit};
