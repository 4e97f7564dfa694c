//! Two-sample tests: one file and one function each.

mod energy;
mod gates;
mod hotelling;

use nalgebra::DMatrix;

pub use energy::energy_test;
pub use gates::{max_standardised_difference, standardised_differences};
pub use hotelling::{Hotelling, hotelling};

use crate::{Cluster, Projection};

/// What a test of two samples found.
#[derive(Debug, Clone, PartialEq)]
pub struct TestResult {
    /// How far the samples are apart; its scale is the test's.
    pub statistic: f64,
    /// The probability of such a statistic or a larger one where both samples have one distribution, in (0, 1].
    pub p: f64,
    /// How it was computed, in words.
    pub method: String,
}

/// What a two-sample test takes: laps as they are, or their projection.
pub trait Points {
    /// The name for messages.
    fn name(&self) -> &str;
    /// The points, one per row.
    fn points(&self) -> &DMatrix<f64>;
}

impl Points for Cluster {
    fn name(&self) -> &str {
        self.name()
    }
    fn points(&self) -> &DMatrix<f64> {
        self.laps()
    }
}

impl Points for Projection {
    fn name(&self) -> &str {
        self.name()
    }
    fn points(&self) -> &DMatrix<f64> {
        self.points()
    }
}
