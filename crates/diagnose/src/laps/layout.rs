//! Which entries of a whitened data set belong to which run.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::atlas::Extent;
use super::beginning::BEGINNING;
use super::observed::ObservedRun;
use super::summary::SECOND;

/// The shape of one or more recordings, each of runs that were driven under the same declaration.
///
/// A whitened data set holds, recording after recording: the mean lap of each run, the trend within the runs, the numbers of
/// second order, and how runs begin if that is known.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Layout {
    /// Laps of each run, recording by recording.
    pub(super) laps: Vec<Vec<usize>>,
    /// Whether it is known how each run begins, recording by recording.
    pub(super) begins: Vec<Vec<bool>>,
    /// Entries of one lap.
    pub(super) lap: usize,
}

impl Layout {
    /// The shape of one recording of such runs, a lap of which has so many entries.
    pub(super) fn of_recording(runs: &[ObservedRun], lap: usize) -> Self {
        Self {
            laps: vec![runs.iter().map(|run| run.laps.len()).collect()],
            begins: vec![runs.iter().map(|run| run.beginning.is_some()).collect()],
            lap,
        }
    }

    /// The shape of several recordings together.
    pub(super) fn join<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> Option<Self> {
        Some(Self {
            lap: parts.clone().next()?.lap,
            laps: parts.clone().flat_map(|part| part.laps.clone()).collect(),
            begins: parts.flat_map(|part| part.begins.clone()).collect(),
        })
    }

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

    /// Number of laps of so much of a data set.
    pub(super) fn laps_of_extent(&self, extent: Extent) -> u64 {
        let runs = |laps: &Vec<usize>| laps[..extent.runs(laps.len())].iter().sum::<usize>();
        self.laps.iter().map(runs).sum::<usize>() as u64
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
    pub(super) fn noise(&self, recording: usize) -> Range<usize> {
        let start = self.trend(recording).end;
        start..start + SECOND
    }

    /// Entries that say how runs of a recording begin.
    pub(super) fn beginning(&self, recording: usize) -> Range<usize> {
        let start = self.noise(recording).end;
        start..start + if self.is_begun(recording) { BEGINNING } else { 0 }
    }

    /// Whether it is known how any run of a recording begins.
    pub(super) fn is_begun(&self, recording: usize) -> bool {
        self.begins[recording].contains(&true)
    }

    /// Whether the first run of every recording tells as much as all its runs: how it begins too, if that is known of any.
    pub(super) fn first_runs_tell_all(&self) -> bool {
        let tells = |(recording, begins): (usize, &Vec<bool>)| begins[0] == self.is_begun(recording);
        self.begins.iter().enumerate().all(tells)
    }

    /// Entries of a recording's numbers that are no mean laps: both of these.
    pub(super) fn second(&self, recording: usize) -> Range<usize> {
        self.noise(recording).start..self.beginning(recording).end
    }

    fn recording_start(&self, recording: usize) -> usize {
        recording
            .checked_sub(1)
            .map_or(0, |before| self.beginning(before).end)
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
            begins: vec![vec![false, true], vec![false]],
            lap: 12,
        };
        let mut all: Vec<usize> = Vec::new();
        all.extend(layout.run(0));
        all.extend(layout.run(1));
        all.extend(layout.trend(0));
        all.extend(layout.noise(0));
        all.extend(layout.beginning(0));
        all.extend(layout.run(2));
        all.extend(layout.trend(1));
        all.extend(layout.second(1));
        assert_eq!(all, (0..layout.len()).collect::<Vec<_>>());
        assert_eq!((layout.runs(), layout.total_laps()), (3, 17));
        // How the first recording begins only its second run tells.
        assert_eq!(layout.beginning(0).len(), BEGINNING);
        assert!(!layout.first_runs_tell_all());
    }

    #[test]
    fn entries_of_many_recordings_are_found_at_once() {
        const MANY: usize = 64;
        let layout = Layout {
            laps: vec![vec![5]; MANY],
            begins: vec![vec![true]; MANY],
            lap: 12,
        };
        assert_eq!(layout.len(), MANY * (2 * 12 + SECOND + BEGINNING));
    }

    #[test]
    fn the_ramp_of_five_laps_has_the_norm_of_minus_two_to_two() {
        assert!((ramp_norm(5) - 10.0_f64.sqrt()).abs() < 1e-12);
    }
}
