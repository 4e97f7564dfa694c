//! Diagnosis from laps that the camera saw.

// What is measured and what is expected.
mod beginning;
mod expectation;
mod layout;
mod observed;
mod summary;
#[cfg(test)]
mod testing;
mod tests_of_fit;
mod unseen;

// The declared model, what is tried on it, and how likely that makes the data.
mod areas;
mod atlas;
mod hypothesis;
mod kept;
mod likelihood;
mod memo;
mod part;
mod path;
mod probe;
mod simulated;
mod spread;
mod trial;

// Which effects could explain the data.
mod beside;
mod groups;
mod pairs;
mod pieces;
mod ripple;
mod scans;
mod screen;
mod second;
mod steadiness;
mod together;

// Their most likely sizes, and how well these are known.
mod hunt;
mod intervals;
mod last_look;
mod likeliest;
mod parabola;
mod refine;

// The search through all that, and the answer.
mod classes;
mod diagnosis;
mod rounds;
mod search;
mod singles;
mod slopes;
mod verdict;

// What is said beside the answer.
mod baseline;
mod detectable;
mod separation;

pub use atlas::{Atlas, Extent, Simulate};
pub use baseline::Baselines;
pub use beginning::{Beginning, MeanBeginning};
pub use diagnosis::LapDiagnosis;
pub use observed::{ObservedLap, ObservedRun};
pub use separation::{Rival, TELLS_NOTHING, separations};
pub(crate) use tests_of_fit::SIGNIFICANT_P;
pub use tests_of_fit::{Departures, Quadratic};
pub use unseen::Unseen;
