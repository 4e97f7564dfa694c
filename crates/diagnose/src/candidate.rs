//! What might explain a residual.

use sim::Setting;

/// An effect that might explain what the model lacks, with its fitted size.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The effect with its fitted values and their pattern.
    pub setting: Setting,
    /// Standard error of each fitted value, in the order of the pattern's values (for a pattern by run, run after run;
    /// by time, start values and then slopes); 0 for a value that was chosen and not fitted, such as a wall.
    pub standard_errors: Vec<f64>,
    /// Log-likelihood gained over the declared model.
    pub gain: f64,
    /// Number of fitted values.
    pub fitted: usize,
}
