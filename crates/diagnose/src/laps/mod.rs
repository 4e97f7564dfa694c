//! Diagnosis from laps that the camera saw.

mod atlas;
mod baseline;
mod diagnosis;
mod expectation;
mod groups;
mod hypothesis;
mod layout;
mod pairs;
mod probe;
mod refine;
mod screen;
mod search;
mod summary;
mod tests_of_fit;

pub use atlas::{Atlas, Simulate};
pub use baseline::Baselines;
pub use diagnosis::LapDiagnosis;
pub use tests_of_fit::{FourNumbers, Quadratic};
