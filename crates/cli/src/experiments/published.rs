//! The numbers that the paper prints.

/// Runs of the paper, in the order of its columns.
const RUNS: [&str; 4] = ["a", "b", "c", "d"];

/// A row of Table II or III.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row(pub(crate) [f64; 4]);

impl Row {
    /// The distance to a run, if the paper had a run of that name.
    pub(crate) fn of_run(&self, run: &str) -> Option<f64> {
        RUNS.iter()
            .position(|name| *name == run)
            .map(|column| self.0[column])
    }

    /// The mean over the runs.
    pub(crate) fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }
}

/// Table II.
pub(crate) const IMPROVED: Row = Row([2.4, 2.3, 2.4, 0.5]);
/// Table II.
pub(crate) const ORIGINAL: Row = Row([16.3, 12.9, 9.7, 11.0]);

/// Table III, the maximal wall errors in m; and the segments they need (section IV-B.2).
pub(crate) const WALLS: [(f64, Row, usize); 4] = [
    (0.001, Row([16.5, 6.1, 5.2, 6.8]), 105),
    (0.005, Row([12.8, 5.6, 4.6, 5.8]), 47),
    (0.01, Row([1.8, 2.7, 2.2, 0.8]), 33),
    (0.05, Row([11.2, 10.9, 11.2, 10.7]), 15),
];

/// Section IV-A: from a run of controller 1 to the nearest other of the same, least and greatest.
pub(crate) const NEAREST_RULE_BASED: [f64; 2] = [0.9, 2.0];
/// Section IV-A: the same of controller 2.
pub(crate) const NEAREST_BRAITENBERG: [f64; 2] = [1.8, 2.2];
/// Section IV-A: the least distance between runs of different controllers.
pub(crate) const NEAREST_OTHER: f64 = 5.7;

/// Fig. 8: distance in m and reading in counts of a real e-puck before a white wall, as later simulators of the robot
/// carry them; the improved model is fitted to them.
pub(crate) const SENSOR_PAIRS: [[f64; 2]; 10] = [
    [0.0, 4095.0],
    [0.005, 2133.33],
    [0.01, 1465.73],
    [0.015, 601.46],
    [0.02, 383.84],
    [0.03, 234.93],
    [0.04, 158.03],
    [0.05, 120.0],
    [0.06, 104.09],
    [0.07, 67.19],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_know_their_runs() {
        assert_eq!((IMPROVED.of_run("d"), IMPROVED.of_run("e")), (Some(0.5), None));
        assert!((WALLS[2].1.mean() - 1.875).abs() < 1e-12);
    }
}
