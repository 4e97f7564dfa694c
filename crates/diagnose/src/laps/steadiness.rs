//! Whether the size of an effect stays what it is while a run goes on, or settles.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use track::Lap;

use super::atlas::{Atlas, Extent};
use super::expectation::Scatter;
use super::hypothesis::Hypothesis;
use super::observed::ObservedRun;
use super::part::Tied;
use super::summary::RunVectors;
use super::tests_of_fit::{Quadratic, SIGNIFICANT_P};
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
    /// What tells it.
    pub(super) asked: Asked,
}

impl Settling {
    /// What the value of a parameter is that says how much more the size is at first.
    pub(super) fn at_first(&self, parameter: usize) -> Tied {
        Tied {
            parameter,
            multiple: self.more,
            error: (self.more / self.sigmas).abs(),
        }
    }

    /// Probability that chance makes as much of the likeliest of [`TIMES`] by [`LAPS_ASKED`] (Bonferroni).
    pub(super) fn p(&self) -> f64 {
        ((TIMES.len() * LAPS_ASKED.len()) as f64 * Quadratic::new(self.sigmas.powi(2), 1).p).min(1.0)
    }
}

/// Data sets simulated with the effects, and without the one that may settle: these only tell along what to look.
const SETS: u64 = 32;
const SETS_WITHOUT: u64 = 8;

/// Times that are tried, in laps.
const TIMES: [f64; 9] = [0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0];

/// Runs of laps.
type Runs = [ObservedRun];

impl Trial<'_> {
    /// How the size of one effect of a hypothesis settles within the runs, if that is not chance: by all that is seen of them, and by the
    /// laps that count alone, in which less has to settle (what an effect does is not in proportion to large sizes). `None` where the
    /// robot crashes.
    ///
    /// Each lap, and what comes before those that count, is projected on what the effect does to the mean lap of its run: a size lap by
    /// lap. What these have of a decay in time, beside a level and a change at a constant rate, is compared with what those of simulated
    /// laps have.
    pub(super) fn settling(
        &self,
        runs: &Runs,
        hypothesis: &Hypothesis,
        part: usize,
    ) -> Option<Vec<Settling>> {
        let settings = hypothesis.settings(self.atlas);
        let others = hypothesis.without(part).settings(self.atlas);
        self.spend(SETS, Extent::FromTheirStarts);
        let with: Vec<Vec<ObservedRun>> = (0..SETS)
            .into_par_iter()
            .map(|set| (self.simulate)(&settings, set, Extent::FromTheirStarts))
            .collect::<Option<_>>()?;
        let without = if others.is_empty() {
            self.atlas.declared_mean(0..SETS)
        } else {
            self.simulated_briefly(&others, 0..SETS_WITHOUT)?
        };
        let vectors_of = |data: &Runs| self.atlas.vectors(data);
        let (measured, simulated) = (vectors_of(runs), with.iter().map(|data| vectors_of(data)));
        let simulated: Vec<Vec<RunVectors>> = simulated.collect();
        let covariances: Vec<DMatrix<f64>> = self.atlas.scatter.iter().map(Scatter::of_lap).collect();
        let of_run = |(run, (recording, place)): (usize, (usize, usize))| {
            let all: Vec<&RunVectors> = simulated.iter().map(|data| &data[run]).collect();
            let without = &without.0[recording].means[place];
            Sizes::new(&runs[run], &measured[run], &all, without, &covariances[recording])
        };
        let sizes: Vec<Sizes> = (self.atlas.layout.places().enumerate())
            .map(of_run)
            .collect::<Option<_>>()?;
        let settling = |asked: Asked, laps: f64| {
            let time_s = laps * self.atlas.lap_s();
            let of_runs: Vec<Share> = sizes.iter().map(|run| run.decay(time_s, asked)).collect();
            let sum = |of: fn(&Share) -> f64| of_runs.iter().map(of).sum::<f64>();
            let more = sum(|run| run.more);
            Settling {
                time_s,
                more: more / sum(|run| run.square),
                sigmas: more / sum(|run| run.variance).sqrt(),
                asked,
            }
        };
        let likeliest = |asked: Asked| {
            let tried = TIMES.iter().map(|&laps| settling(asked, laps));
            tried.max_by(|a, b| a.sigmas.abs().total_cmp(&b.sigmas.abs()))
        };
        let found = LAPS_ASKED.into_iter().filter_map(likeliest);
        Some(found.filter(|found| found.p() < SIGNIFICANT_P).collect())
    }
}

/// Which laps of a run are asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// All, and the way to the first of them.
    All,
    Counted,
}

const LAPS_ASKED: [Asked; 2] = [Asked::All, Asked::Counted];

impl Atlas {
    /// All runs as vectors.
    fn vectors(&self, data: &Runs) -> Vec<RunVectors> {
        let mut rest = data;
        let of_recording = |laps: &Vec<usize>| {
            let (own, others) = rest.split_at(laps.len());
            rest = others;
            RunVectors::of(own)
        };
        self.layout.laps.iter().flat_map(of_recording).collect()
    }
}

/// A part of a lap projected on what an effect does to it: generalised least squares.
struct Projection {
    /// Entries of the lap's vector.
    entries: Vec<usize>,
    weights: Vec<f64>,
    /// One over the variance of the size.
    information: f64,
}

impl Projection {
    /// On a direction, of laps of some covariance; `None` of too few entries.
    fn new(entries: Vec<usize>, direction: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<Self> {
        /// A stretch of eight gates.
        const FEWEST: usize = 8;
        if entries.len() < FEWEST {
            return None;
        }
        let own = covariance.select_rows(&entries).select_columns(&entries);
        let along = direction.select_rows(&entries);
        let weights = own.cholesky()?.solve(&along);
        Some(Self {
            information: weights.dot(&along),
            weights: weights.iter().copied().collect(),
            entries,
        })
    }

    /// The size of what each of some laps is more than the mean.
    fn sizes<'l>(&self, laps: impl Iterator<Item = &'l DVector<f64>>, mean: &DVector<f64>) -> Vec<f64> {
        let size = |lap: &DVector<f64>| {
            let along = self.entries.iter().zip(&self.weights);
            along.map(|(&i, weight)| weight * (lap[i] - mean[i])).sum::<f64>() / self.information
        };
        laps.map(size).collect()
    }
}

/// The sizes of an effect in one run, in the order of time.
struct Sizes {
    times_s: Vec<f64>,
    /// One over the variance of each.
    information: Vec<f64>,
    /// How many come before the laps that count.
    before: usize,
    measured: DVector<f64>,
    simulated: Vec<DVector<f64>>,
}

/// What one run says of a decay.
struct Share {
    /// More than expected, in units of information.
    more: f64,
    /// What that is where the size decays from once what it is to nothing.
    square: f64,
    variance: f64,
}

impl Sizes {
    fn new(
        run: &ObservedRun,
        measured: &RunVectors,
        simulated: &[&RunVectors],
        without: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let laps = simulated.iter().flat_map(|run| &run.laps);
        let mean = laps.clone().sum::<DVector<f64>>() / laps.count() as f64;
        let direction = &mean - without;
        let everyone = || std::iter::once(measured).chain(simulated.iter().copied());
        let before = (run.before.iter().enumerate()).filter_map(|(place, lap)| {
            let laps: Vec<&DVector<f64>> = everyone()
                .map(|run| run.before.get(place))
                .collect::<Option<_>>()?;
            let is_known = |&i: &usize| laps.iter().all(|lap| lap[i].is_finite());
            let entries = (0..mean.len()).filter(is_known).collect();
            let along = Projection::new(entries, &direction, covariance)?;
            Some((
                middle_s(lap),
                along.information,
                along.sizes(laps.into_iter(), &mean),
            ))
        });
        let whole = Projection::new((0..mean.len()).collect(), &direction, covariance)?;
        let counted = (run.laps.iter().enumerate()).map(|(place, lap)| {
            let laps = everyone().map(|run| &run.laps[place]);
            (middle_s(&lap.seen), whole.information, whole.sizes(laps, &mean))
        });
        let laps: Vec<(f64, f64, Vec<f64>)> = before.chain(counted).collect();
        let sizes_of = |one: usize| DVector::from_iterator(laps.len(), laps.iter().map(|lap| lap.2[one]));
        let mut sizes = (0..=simulated.len()).map(sizes_of);
        Some(Self {
            times_s: laps.iter().map(|lap| lap.0).collect(),
            information: laps.iter().map(|lap| lap.1).collect(),
            before: laps.len() - run.laps.len(),
            measured: sizes.next()?,
            simulated: sizes.collect(),
        })
    }

    fn decay(&self, time_s: f64, asked: Asked) -> Share {
        let mut information = self.information.clone();
        if asked == Asked::Counted {
            information[..self.before].fill(0.0);
        }
        let contrast = contrast(&self.times_s, &information, time_s);
        let expected = self.simulated.iter().map(|sizes| sizes.dot(&contrast));
        let expected = DVector::from_iterator(self.simulated.len(), expected);
        let decay = self.times_s.iter().map(|t| (-t / time_s).exp());
        // The variance divides by the number of sets; the mean of as many has an error too.
        let sets = expected.len() as f64;
        Share {
            more: self.measured.dot(&contrast) - expected.mean(),
            square: decay.zip(&contrast).map(|(decay, share)| decay * share).sum(),
            variance: expected.variance() * sets / (sets - 1.0) * (1.0 + 1.0 / sets),
        }
    }
}

/// Time of the middle of what is known of a lap, s.
fn middle_s(lap: &Lap) -> f64 {
    let known_s = || lap.times_s.iter().copied().filter(|t| t.is_finite());
    0.5 * (known_s().fold(f64::INFINITY, f64::min) + known_s().fold(f64::NEG_INFINITY, f64::max))
}

/// A decay at some times, less what a constant and a change at a constant rate say of it, times the information at each.
fn contrast(times_s: &[f64], information: &[f64], time_s: f64) -> DVector<f64> {
    let weighted = |of: &dyn Fn(f64) -> f64| {
        let terms = times_s.iter().zip(information).map(|(&t, weight)| weight * of(t));
        terms.sum::<f64>()
    };
    let decay = |t: f64| (-t / time_s).exp();
    let mean = |of: &dyn Fn(f64) -> f64| weighted(of) / weighted(&|_| 1.0);
    let (middle_s, level) = (mean(&|t| t), mean(&decay));
    let slope = weighted(&|t| (t - middle_s) * decay(t)) / weighted(&|t| (t - middle_s).powi(2));
    let rest = |(&t, weight): (&f64, &f64)| weight * (decay(t) - level - slope * (t - middle_s));
    DVector::from_iterator(times_s.len(), times_s.iter().zip(information).map(rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The way to gate 0, of which less is known, and twelve laps.
    fn times() -> (Vec<f64>, Vec<f64>) {
        let times_s = (0..13).map(|i| 30.0 + 68.0 * f64::from(i)).collect();
        let information = (0..13).map(|i| if i == 0 { 0.3 } else { 2.0 }).collect();
        (times_s, information)
    }

    #[test]
    fn a_level_and_a_constant_rate_are_no_settling() {
        let (times_s, information) = times();
        let contrast = contrast(&times_s, &information, 150.0);
        let steady = DVector::from_iterator(13, times_s.iter().map(|t| 3.0 - 0.02 * t));
        assert!(contrast.dot(&steady).abs() < 1e-12 && contrast.norm() > 0.1);
    }

    #[test]
    fn a_decay_is_what_it_is_at_the_start() {
        let (times_s, information) = times();
        let size = |t: &f64| 5.0 + 2.0 * (-t / 150.0).exp();
        let run = |size: &dyn Fn(&f64) -> f64| DVector::from_iterator(13, times_s.iter().map(size));
        let sizes = Sizes {
            measured: run(&size),
            simulated: vec![run(&|_| 1.0), run(&|t| 1.0 + 0.1 * (-t / 150.0).exp())],
            times_s: times_s.clone(),
            information,
            before: 1,
        };
        let [all, counted] = LAPS_ASKED.map(|asked| sizes.decay(150.0, asked));
        for found in [&all, &counted] {
            // A mean of .05 and a variance of .005 are expected.
            assert!((found.more / found.square - 1.95).abs() < 1e-12);
            assert!((found.variance / found.square.powi(2) - 0.0075).abs() < 1e-12);
        }
        assert!(counted.square < 0.8 * all.square);
    }

    #[test]
    fn a_part_of_a_lap_has_the_size_of_the_whole() {
        let direction = DVector::from_fn(12, |i, _| 1.0 + i as f64);
        let covariance = DMatrix::from_fn(12, 12, |i, j| 0.5_f64.powf((i as f64 - j as f64).abs()));
        let mean = DVector::from_fn(12, |i, _| (i as f64).sin());
        let lap = &mean + 0.7 * &direction;
        let of =
            |entries: std::ops::Range<usize>| Projection::new(entries.collect(), &direction, &covariance);
        let [whole, part] = [0..12, 3..12].map(|entries| of(entries).unwrap());
        for along in [&whole, &part] {
            let sizes = along.sizes(std::iter::once(&lap), &mean);
            assert!((sizes[0] - 0.7).abs() < 1e-12);
        }
        assert!(part.information < whole.information);
        assert!(of(0..7).is_none());
    }
}
