//! Which entries of a whitened data set belong to which run.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::summary::SECOND;

/// The shape of one or more recordings, each of runs that were driven under the same declaration.
///
/// A whitened data set holds, recording after recording: the mean lap of each run, the trend within the runs, the numbers of
/// second order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Layout {
    /// Laps of each run, recording by recording.
    pub(super) laps: Vec<Vec<usize>>,
    /// Entries of one lap.
    pub(super) lap: usize,
}

impl Layout {
    /// Number of entries.
    pub(super) fn len(&self) -> usize {
        self.recording_start(self.laps.len())
    }

    /// Number of runs.
    pub(super) fn runs(&self) -> usize {
        self.laps.iter().map(Vec::len).sum()
    }

    /// Number of laps.
    pub(super) fn total_laps(&self) -> usize {
        self.laps.iter().flatten().sum()
    }

    /// Recording and place in it of every run.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        (self.laps.iter().enumerate()).flat_map(|(g, laps)| (0..laps.len()).map(move |r| (g, r)))
    }

    /// Entries of a run's mean lap.
    pub(super) fn run(&self, run: usize) -> Range<usize> {
        let (recording, place) = self.places().nth(run).expect("runs are counted by their layout");
        let start = self.recording_start(recording) + place * self.lap;
        start..start + self.lap
    }

    /// Entries of a recording's trend.
    pub(super) fn trend(&self, recording: usize) -> Range<usize> {
        let start = self.recording_start(recording) + self.laps[recording].len() * self.lap;
        start..start + self.lap
    }

    /// Entries of a recording's mean laps and of its trend, each of which is a draw of the scatter of one lap.
    pub(super) fn laps_of(&self, recording: usize) -> Vec<Range<usize>> {
        let start = self.recording_start(recording);
        let draw = |i: usize| start + i * self.lap..start + (i + 1) * self.lap;
        (0..=self.laps[recording].len()).map(draw).collect()
    }

    /// Entries of a recording's numbers of second order.
    pub(super) fn second(&self, recording: usize) -> Range<usize> {
        let start = self.trend(recording).end;
        start..start + SECOND
    }

    fn recording_start(&self, recording: usize) -> usize {
        let size = |laps: &Vec<usize>| (laps.len() + 1) * self.lap + SECOND;
        self.laps[..recording].iter().map(size).sum()
    }
}

/// Root of the sum of squares of the centred positions of n laps in their run.
pub(super) fn ramp_norm(n: usize) -> f64 {
    let n = n as f64;
    (n * (n * n - 1.0) / 12.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_two_recordings_follow_each_other_without_a_gap() {
        let layout = Layout {
            laps: vec![vec![5, 5], vec![7]],
            lap: 12,
        };
        let mut all: Vec<usize> = Vec::new();
        all.extend(layout.run(0));
        all.extend(layout.run(1));
        all.extend(layout.trend(0));
        all.extend(layout.second(0));
        all.extend(layout.run(2));
        all.extend(layout.trend(1));
        all.extend(layout.second(1));
        assert_eq!(all, (0..layout.len()).collect::<Vec<_>>());
        assert_eq!((layout.runs(), layout.total_laps()), (3, 17));
    }

    #[test]
    fn the_ramp_of_five_laps_has_the_norm_of_minus_two_to_two() {
        assert!((ramp_norm(5) - 10.0_f64.sqrt()).abs() < 1e-12);
    }
}
