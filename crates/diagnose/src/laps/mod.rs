//! Diagnosis from laps that the camera saw.

mod atlas;
mod baseline;
mod beside;
mod classes;
mod detectable;
mod diagnosis;
mod expectation;
mod groups;
mod hunt;
mod hypothesis;
mod intervals;
mod last_look;
mod layout;
mod likeliest;
mod likelihood;
mod memo;
mod observed;
mod pairs;
mod parabola;
mod probe;
mod refine;
mod ripple;
mod scans;
mod screen;
mod search;
mod separation;
mod simulated;
mod steadiness;
mod summary;
mod tests_of_fit;

pub use atlas::{Atlas, Simulate};
pub use baseline::Baselines;
pub use diagnosis::LapDiagnosis;
pub use observed::ObservedLap;
pub use separation::{Rival, separations};
pub use tests_of_fit::{FourNumbers, Quadratic};
