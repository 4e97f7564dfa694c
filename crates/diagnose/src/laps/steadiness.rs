//! Whether the size of an effect stays what it is while a run goes on, or settles.

use nalgebra::DVector;
use rayon::prelude::*;

use super::atlas::{Atlas, Extent};
use super::expectation::Expectation;
use super::hypothesis::Hypothesis;
use super::observed::{ObservedLap, ObservedRun};
use super::summary::lap_vectors;
use super::tests_of_fit::Quadratic;
use super::trial::Trial;

/// A size that settles while a run goes on: what it is more at first decays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Settling {
    /// Time in which the decay goes down to 1/e.
    pub(super) time_s: f64,
    /// How much more the size is at the start of a run, as a share of what it is in the end.
    pub(super) more: f64,
    /// That in standard deviations.
    pub(super) sigmas: f64,
}

impl Settling {
    /// Probability that chance makes as much of the likeliest of [`TIMES`] (Bonferroni).
    pub(super) fn p(&self) -> f64 {
        (TIMES.len() as f64 * Quadratic::new(self.sigmas.powi(2), 1).p).min(1.0)
    }
}

/// Data sets simulated with the effects.
const SETS: u64 = 32;

/// Times that are tried, in laps.
const TIMES: [f64; 7] = [1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0];

/// Runs of laps.
type Runs = [ObservedRun];

impl Trial<'_> {
    /// How the size of one effect of a hypothesis settles within the runs; `None` where the robot crashes.
    ///
    /// Each lap is projected, in units of a lap's scatter, on what the effect does to the mean lap of its run: a size lap by
    /// lap. What these have of a decay in time, beside a level and a change at a constant rate, is compared with what those of
    /// simulated laps have.
    pub(super) fn settling(&self, runs: &Runs, hypothesis: &Hypothesis, part: usize) -> Option<Settling> {
        let settings = hypothesis.settings(self.atlas);
        let others = hypothesis.without(part).settings(self.atlas);
        self.spend(SETS, Extent::Whole);
        let with: Vec<Vec<ObservedRun>> = (0..SETS)
            .into_par_iter()
            .map(|set| (self.simulate)(&settings, set, Extent::Whole))
            .collect::<Option<_>>()?;
        let without = if others.is_empty() {
            self.atlas.declared_mean(0..SETS)
        } else {
            self.simulated_briefly(&others, 0..SETS)?
        };
        let directions = self.atlas.directions_of(&with, &without);
        let sizes = |data: &Runs| self.atlas.sizes_along(&directions, data);
        let measured = sizes(runs);
        let simulated: Vec<Vec<DVector<f64>>> = with.iter().map(|data| sizes(data)).collect();
        let settling = |laps: &f64| {
            let time_s = laps * self.atlas.lap_s();
            // Run by run: what is more than expected, the square that it has where it is the effect's all, and its variance.
            let of_run = |(run, of): (usize, &ObservedRun)| {
                let contrast = contrast(&of.laps, time_s);
                let expected = simulated.iter().map(|sizes| sizes[run].dot(&contrast));
                let expected = DVector::from_iterator(simulated.len(), expected);
                let more = measured[run].dot(&contrast) - expected.mean();
                let square = directions[run].norm_squared() * contrast.norm_squared();
                (more, square, expected.variance())
            };
            let (mut more, mut square, mut variance) = (0.0, 0.0, 0.0);
            for of_run in runs.iter().enumerate().map(of_run) {
                more += of_run.0;
                square += of_run.1;
                variance += of_run.2;
            }
            // The variance divides by the number of sets; the mean of as many has an error too.
            let sets = simulated.len() as f64;
            variance *= sets / (sets - 1.0) * (1.0 + 1.0 / sets);
            Settling {
                time_s,
                more: more / square,
                sigmas: more / variance.sqrt(),
            }
        };
        TIMES
            .iter()
            .map(settling)
            .max_by(|a, b| a.sigmas.abs().total_cmp(&b.sigmas.abs()))
    }
}

impl Atlas {
    /// The laps of each run of a data set projected on a direction of their own.
    fn sizes_along(&self, directions: &[DVector<f64>], data: &Runs) -> Vec<DVector<f64>> {
        let vectors = self.lap_vectors(data);
        let of_run = |(run, (recording, _)): (usize, (usize, usize))| {
            let scatter = &self.scatter[recording];
            let size = |lap: &DVector<f64>| directions[run].dot(&scatter.whiten(lap));
            DVector::from_iterator(vectors[run].len(), vectors[run].iter().map(size))
        };
        self.layout.places().enumerate().map(of_run).collect()
    }

    /// The laps of all runs as vectors.
    fn lap_vectors(&self, data: &Runs) -> Vec<Vec<DVector<f64>>> {
        let mut rest = data;
        let of_recording = |laps: &Vec<usize>| {
            let (own, others) = rest.split_at(laps.len());
            rest = others;
            lap_vectors(own)
        };
        self.layout.laps.iter().flat_map(of_recording).collect()
    }

    /// What an effect does to the mean lap of each run, in units of a lap's scatter.
    fn directions_of(&self, with: &[Vec<ObservedRun>], without: &Expectation) -> Vec<DVector<f64>> {
        let sets: Vec<Vec<Vec<DVector<f64>>>> = with.iter().map(|data| self.lap_vectors(data)).collect();
        let direction = |(run, (recording, place)): (usize, (usize, usize))| {
            let laps = sets.iter().flat_map(|data| &data[run]);
            let count = laps.clone().count() as f64;
            let mean = laps.sum::<DVector<f64>>() / count;
            self.scatter[recording].whiten(&(mean - &without.0[recording].means[place]))
        };
        self.layout.places().enumerate().map(direction).collect()
    }
}

/// Time of the middle of a lap, s.
fn middle_s(lap: &ObservedLap) -> f64 {
    0.5 * (lap.seen.start_s + lap.seen.end_s)
}

/// A decay over the laps of a run less what a constant and a change at a constant rate say of it.
fn contrast(laps: &[ObservedLap], time_s: f64) -> DVector<f64> {
    let times: Vec<f64> = laps.iter().map(middle_s).collect();
    let n = times.len() as f64;
    let middle = times.iter().sum::<f64>() / n;
    let decay = DVector::from_iterator(times.len(), times.iter().map(|t| (-t / time_s).exp()));
    let ramp = DVector::from_iterator(times.len(), times.iter().map(|t| t - middle));
    let level = decay.mean();
    let slope = ramp.dot(&decay) / ramp.norm_squared();
    decay.add_scalar(-level) - ramp * slope
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laps(n: usize) -> Vec<ObservedLap> {
        let lap = |i: usize| track::Lap {
            start_s: 100.0 + 70.0 * i as f64,
            end_s: 170.0 + 70.0 * i as f64,
            times_s: Vec::new(),
            offsets_m: Vec::new(),
            missed: Vec::new(),
        };
        (0..n).map(lap).map(ObservedLap::exact).collect()
    }

    #[test]
    fn a_level_and_a_constant_rate_are_no_settling() {
        let laps = laps(12);
        let contrast = contrast(&laps, 150.0);
        let steady = DVector::from_iterator(12, laps.iter().map(|lap| 3.0 - 0.02 * lap.seen.start_s));
        assert!(contrast.dot(&steady).abs() < 1e-12 && contrast.norm() > 0.1);
    }

    #[test]
    fn a_decay_projects_to_what_it_is_at_the_start() {
        let laps = laps(12);
        let contrast = contrast(&laps, 150.0);
        let settling = laps.iter().map(|lap| 5.0 + 2.0 * (-middle_s(lap) / 150.0).exp());
        let settling = DVector::from_iterator(12, settling);
        assert!((contrast.dot(&settling) / contrast.norm_squared() - 2.0).abs() < 1e-12);
    }
}
