//! Laps as vectors, and a data set of them as the numbers that tell effects apart.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::statistics::{Data, OrderStatistics};

use track::Lap;

use super::beginning::{Beginning, MeanBeginning};
use super::layout::ramp_norm;
use super::observed::{ObservedLap, ObservedRun};

/// Blocks of gates whose durations are part of a lap's vector.
pub(super) const BLOCKS: usize = 20;

/// Numbers of second order: see [`second_order`].
pub(super) const SECOND: usize = 21;

/// One lap by its moving mean: positions at the gates in mm, then durations of [`BLOCKS`] equal stretches in units of 10 ms.
///
/// The units make all entries of similar size. A block's duration runs from gate to gate, so that it is the same for
/// laps driven either way round.
pub(super) fn lap_vector(lap: &ObservedLap) -> DVector<f64> {
    vector_of(&lap.smooth)
}

/// As [`lap_vector`], of a lap by its moving mean; NaN where the lap is.
pub(super) fn vector_of(lap: &Lap) -> DVector<f64> {
    let gates = lap.offsets_m.len();
    // Of two gates next to each other, but for gate 0, the later one is the first of a lap driven the other way round.
    let pairs = lap.times_s.windows(2).skip(1);
    let backward = pairs
        .map(|pair| pair[0] - pair[1])
        .find(|apart_s| !apart_s.is_nan());
    let backward = backward.is_some_and(|apart_s| apart_s > 0.0);
    // The time at the border before gate g; border `gates` closes the lap.
    let time = |border: usize| match (border, backward) {
        (0, true) => lap.end_s,
        (border, false) if border == gates => lap.end_s,
        (border, true) if border == gates => lap.start_s,
        (border, _) => lap.times_s[border],
    };
    let border = |block: usize| block * gates / BLOCKS;
    let durations = (0..BLOCKS).map(|b| 100.0 * (time(border(b + 1)) - time(border(b))).abs());
    DVector::from_iterator(
        gates + BLOCKS,
        lap.offsets_m.iter().map(|m| 1000.0 * m).chain(durations),
    )
}

/// By how much the positions at the gates are off their moving mean, mm: next to nothing but what the camera adds.
fn noise_vector(lap: &ObservedLap) -> DVector<f64> {
    let pairs = lap.seen.offsets_m.iter().zip(&lap.smooth.offsets_m);
    DVector::from_iterator(
        lap.seen.offsets_m.len(),
        pairs.map(|(seen_m, smooth_m)| 1000.0 * (seen_m - smooth_m)),
    )
}

/// What one run tells of its laps' mean and its change.
#[derive(Debug, Clone)]
pub(super) struct RunSummary {
    /// Mean lap.
    pub(super) mean: DVector<f64>,
    /// Sum over the laps of lap x position in the run, the positions centred and of unit norm: its covariance is that of one lap.
    pub(super) trend: DVector<f64>,
}

/// What a data set tells: recording by recording, each of runs under the same declaration.
#[derive(Debug, Clone)]
pub(super) struct Summary(pub(super) Vec<Recording>);

impl Summary {
    /// The summary of runs of closed laps, `counts` of them in each recording; `None` if a run has fewer than three.
    pub(super) fn new(runs: &[ObservedRun], counts: &[usize]) -> Option<Self> {
        let mut rest = runs;
        let recordings = counts.iter().map(|&count| {
            let (own, others) = rest.split_at_checked(count)?;
            rest = others;
            Recording::new(own)
        });
        recordings.collect::<Option<_>>().map(Self)
    }
}

/// What the runs of one recording tell.
#[derive(Debug, Clone)]
pub(super) struct Recording {
    pub(super) runs: Vec<RunSummary>,
    /// See [`second_order`]; behind them the numbers of a run's [`Beginning`], on average, where it is known of any.
    pub(super) second: DVector<f64>,
    /// Scatter of the laps about their run's line, and its degrees of freedom.
    pub(super) scatter: DMatrix<f64>,
    pub(super) freedom: usize,
}

impl Recording {
    fn new(runs: &[ObservedRun]) -> Option<Self> {
        if runs.is_empty() || runs.iter().any(|run| run.laps.len() < 3) {
            return None;
        }
        let (vectors, noise) = (of_each(runs, lap_vector), of_each(runs, noise_vector));
        let beginning = mean_beginning(runs);
        let of_laps = vectors.iter().chain(&noise).flatten();
        if !(of_laps.chain(&beginning)).all(|numbers| numbers.iter().all(|x| x.is_finite())) {
            return None;
        }
        let near = Reach::of(&vectors).brought_all_near(vectors);
        let size = near[0][0].len();
        let mut scatter = DMatrix::zeros(size, size);
        let mut freedom = 0;
        let mut summaries = Vec::with_capacity(near.len());
        for laps in &near {
            let summary = summarise(laps);
            let ramp = ramp(laps.len());
            let residuals = DMatrix::from_fn(size, laps.len(), |i, j| {
                laps[j][i] - summary.mean[i] - ramp[j] * summary.trend[i]
            });
            scatter.gemm(1.0, &residuals, &residuals.transpose(), 1.0);
            freedom += laps.len() - 2;
            summaries.push(summary);
        }
        let second = second_order(&near, &noise);
        let second = beginning.map_or(second.clone(), |beginning| joined(&second, &beginning));
        Some(Self {
            runs: summaries,
            second,
            scatter,
            freedom,
        })
    }
}

/// A run as vectors of laps, those that went far astray brought nearer.
pub(super) struct RunVectors {
    /// Of what comes before the laps that count, NaN where it is not known.
    pub(super) before: Vec<DVector<f64>>,
    pub(super) laps: Vec<DVector<f64>>,
}

impl RunVectors {
    /// The runs of one recording.
    pub(super) fn of(runs: &[ObservedRun]) -> Vec<Self> {
        let laps = of_each(runs, lap_vector);
        let reach = Reach::of(&laps);
        let laps = reach.brought_all_near(laps);
        let joined = |((run, laps), middle): ((&ObservedRun, _), &DVector<f64>)| Self {
            before: (run.before.iter().map(vector_of))
                .map(|lap| reach.brought_near(lap, middle))
                .collect(),
            laps,
        };
        runs.iter().zip(laps).zip(&reach.middles).map(joined).collect()
    }
}

/// What a vector of each lap of each run is.
pub(super) fn of_each(
    runs: &[ObservedRun],
    vector: fn(&ObservedLap) -> DVector<f64>,
) -> Vec<Vec<DVector<f64>>> {
    let of_run = |run: &ObservedRun| run.laps.iter().map(vector).collect();
    runs.iter().map(of_run).collect()
}

/// How runs begin on average, of those of which it is known; `None` if it is known of none.
fn mean_beginning(runs: &[ObservedRun]) -> Option<DVector<f64>> {
    let known: Vec<Beginning> = runs.iter().filter_map(|run| run.beginning).collect();
    MeanBeginning::of(&known).map(|mean| DVector::from_row_slice(&mean.ahead_mm))
}

fn joined(a: &DVector<f64>, b: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(a.len() + b.len(), a.iter().chain(b).copied())
}

/// How far laps lie from the middle of their run.
///
/// Laps that went far astray are brought nearer to it, as a whole: one of them would decide a mean. How far is far is told by how all
/// the others scatter.
struct Reach {
    /// Of each run.
    middles: Vec<DVector<f64>>,
    /// Of the entries of a lap about its run's middle.
    variances: DVector<f64>,
}

impl Reach {
    /// Of the runs of one recording.
    fn of(runs: &[Vec<DVector<f64>>]) -> Self {
        let middles: Vec<DVector<f64>> = runs.iter().map(|laps| middle(laps)).collect();
        let squares: Vec<DVector<f64>> = (runs.iter().zip(&middles))
            .flat_map(|(laps, middle)| laps.iter().map(move |lap| (lap - middle).map(|x| x * x)))
            .collect();
        let variances = DVector::from_fn(middles[0].len(), |i, _| {
            trimmed_mean(squares.iter().map(|square| square[i]).collect())
        });
        Self { middles, variances }
    }

    /// The same runs, as they are used.
    fn brought_all_near(&self, runs: Vec<Vec<DVector<f64>>>) -> Vec<Vec<DVector<f64>>> {
        let near = |(laps, middle): (Vec<DVector<f64>>, &DVector<f64>)| {
            let laps = laps.into_iter();
            laps.map(|lap| self.brought_near(lap, middle)).collect()
        };
        runs.into_iter().zip(&self.middles).map(near).collect()
    }

    /// A lap of which the middle is known, NaN where it is not known itself.
    fn brought_near(&self, lap: DVector<f64>, middle: &DVector<f64>) -> DVector<f64> {
        /// Deviations, all along one of the stretches.
        const FAR: f64 = 5.0;
        let deviations = (&lap - middle).map(|x| x * x).component_div(&self.variances);
        let mean_of = |part: Range<usize>| {
            let known = || {
                deviations
                    .rows_range(part.clone())
                    .into_iter()
                    .filter(|x| !x.is_nan())
            };
            known().sum::<f64>() / known().count() as f64
        };
        let most = stretches(lap.len()).map(mean_of).fold(0.0, f64::max);
        if most > FAR * FAR {
            middle + (lap - middle) * (FAR / most.sqrt())
        } else {
            lap
        }
    }
}

/// Medians of the entries of some laps.
fn middle(laps: &[DVector<f64>]) -> DVector<f64> {
    let median_of = |i: usize, _| Data::new(laps.iter().map(|lap| lap[i]).collect::<Vec<f64>>()).median();
    DVector::from_fn(laps[0].len(), median_of)
}

/// The mean of some values but for the largest, one in forty.
fn trimmed_mean(mut values: Vec<f64>) -> f64 {
    let kept = values.len() - values.len() / 40;
    if kept < values.len() {
        values.select_nth_unstable_by(kept, f64::total_cmp);
    }
    values[..kept].iter().sum::<f64>() / kept as f64
}

/// Positions of n laps in their run, centred and of unit norm.
fn ramp(n: usize) -> Vec<f64> {
    let middle = (n as f64 - 1.0) / 2.0;
    let norm = ramp_norm(n);
    (0..n).map(|j| (j as f64 - middle) / norm).collect()
}

fn summarise(laps: &[DVector<f64>]) -> RunSummary {
    let size = laps[0].len();
    let (mut mean, mut trend) = (DVector::zeros(size), DVector::zeros(size));
    for (lap, position) in laps.iter().zip(ramp(laps.len())) {
        mean.axpy(1.0 / laps.len() as f64, lap, 1.0);
        trend.axpy(position, lap, 1.0);
    }
    RunSummary { mean, trend }
}

/// How the laps scatter, as [`SECOND`] numbers: log variance about the means of a run's quarters in 10 blocks of gates and
/// 5 of durations; log mean square of second differences along the lap at spacing 1 and 5 gates; log mean square of what single
/// positions are off, and its log kurtosis, winsorised; kurtosis and skewness of the durations.
fn second_order(runs: &[Vec<DVector<f64>>], noise: &[Vec<DVector<f64>>]) -> DVector<f64> {
    let size = runs[0][0].len();
    let gates = size - BLOCKS;
    let mut squares = DVector::<f64>::zeros(size);
    let (mut rough1, mut rough5) = (Moments::default(), Moments::default());
    let mut durations = Moments::default();
    for deviation in deviations(runs) {
        squares += deviation.component_mul(&deviation);
        for (rough, spacing) in [(&mut rough1, 1), (&mut rough5, 5)] {
            for g in spacing..gates.saturating_sub(spacing) {
                rough.add(deviation[g - spacing] - 2.0 * deviation[g] + deviation[g + spacing]);
            }
        }
        deviation
            .rows(gates, BLOCKS)
            .iter()
            .for_each(|&d| durations.add(d));
    }
    let freedom = |laps: &Vec<DVector<f64>>| laps.len() - quarters(laps).count();
    let freedom = runs.iter().map(freedom).sum::<usize>() as f64;
    let variances = stretches(size)
        .map(|part| (squares.rows(part.start, part.len()).sum() / freedom / part.len() as f64).ln());
    let noise: Vec<f64> = (deviations(noise))
        .flat_map(|lap| lap.data.as_vec().clone())
        .collect();
    let others = [
        rough1.square().ln(),
        rough5.square().ln(),
        Moments::of(&noise).square().ln(),
        Moments::of(&winsorised(noise)).kurtosis().ln(),
        durations.kurtosis(),
        durations.skewness(),
    ];
    DVector::from_iterator(SECOND, variances.chain(others))
}

/// The entries of a lap's vector in 10 stretches of gates and 5 of durations.
fn stretches(size: usize) -> impl Iterator<Item = Range<usize>> {
    let gates = size - BLOCKS;
    let of_gates = (0..10).map(move |b| b * gates / 10..(b + 1) * gates / 10);
    let of_durations = (0..5).map(move |b| gates + 4 * b..gates + 4 * (b + 1));
    of_gates.chain(of_durations)
}

/// How the laps' vectors deviate from the means of their run's quarters.
pub(super) fn deviations(runs: &[Vec<DVector<f64>>]) -> impl Iterator<Item = DVector<f64>> {
    let quarters = runs.iter().flat_map(|laps| quarters(laps));
    quarters.flat_map(|quarter| {
        let mean = quarter.iter().sum::<DVector<f64>>() / quarter.len() as f64;
        quarter.iter().map(move |lap| lap - &mean)
    })
}

/// A run's laps in four parts of about the same length, of two laps at least.
fn quarters(laps: &[DVector<f64>]) -> impl Iterator<Item = &[DVector<f64>]> {
    let parts = (laps.len() / 2).clamp(1, 4);
    (0..parts).map(move |k| &laps[k * laps.len() / parts..(k + 1) * laps.len() / parts])
}

/// Values of which the largest, one in a thousand, are brought to the next: a lap that once went far astray would decide their
/// fourth moment.
fn winsorised(mut values: Vec<f64>) -> Vec<f64> {
    let cut = values.len() / 1000;
    if cut > 0 {
        let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
        let (_, &mut most, _) = sizes.select_nth_unstable_by(cut, |a, b| b.total_cmp(a));
        values.iter_mut().for_each(|x| *x = x.clamp(-most, most));
    }
    values
}

/// Sums of the first four powers.
#[derive(Debug, Default)]
struct Moments([f64; 5]);

impl Moments {
    fn of(values: &[f64]) -> Self {
        let mut moments = Self::default();
        values.iter().for_each(|&x| moments.add(x));
        moments
    }

    fn add(&mut self, x: f64) {
        let mut power = 1.0;
        for sum in &mut self.0 {
            *sum += power;
            power *= x;
        }
    }

    fn about_zero(&self, power: usize) -> f64 {
        self.0[power] / self.0[0]
    }

    fn square(&self) -> f64 {
        self.about_zero(2)
    }

    fn kurtosis(&self) -> f64 {
        self.about_zero(4) / self.square().powi(2)
    }

    fn skewness(&self) -> f64 {
        self.about_zero(3) / self.square().powf(1.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of laps that deviate by no more than 1 from 3.
    fn usual_run(seed: u64) -> Vec<DVector<f64>> {
        let mut stream = sim::Streams { seed, run: 0 }.open("laps");
        let mut lap = || DVector::from_fn(100 + BLOCKS, |_, _| 3.0 + stream.symmetric());
        (0..20).map(|_| lap()).collect()
    }

    #[test]
    fn a_lap_far_astray_hardly_moves_the_mean_and_no_other_lap_moves() {
        let usual = vec![usual_run(1), usual_run(2)];
        let brought_near = |runs: &Vec<Vec<DVector<f64>>>| Reach::of(runs).brought_all_near(runs.clone());
        assert_eq!(brought_near(&usual), usual);
        let mut astray = usual.clone();
        // Eighty times as far as the others scatter (by 0.58) in ten gates.
        astray[1][7].rows_mut(40, 10).add_scalar_mut(46.0);
        let near = brought_near(&astray);
        let most = near[1][7].rows(40, 10).map(|x| (x - 3.0).abs()).max();
        assert!((2.0..4.0).contains(&most), "{most}");
        for (run, laps) in near.iter().enumerate() {
            for (at, lap) in laps.iter().enumerate().filter(|(at, _)| (run, *at) != (1, 7)) {
                assert_eq!(lap, &usual[run][at]);
            }
        }
        // Of a lap that is known in part that part is judged.
        let reach = Reach::of(&usual);
        let brought_near = |lap: &DVector<f64>| reach.brought_near(lap.clone(), &reach.middles[1]);
        for (lap, is_near) in [(&usual[1][7], true), (&astray[1][7], false)] {
            let mut part = lap.clone();
            part.rows_mut(0, 43).fill(f64::NAN);
            let near = brought_near(&part);
            assert!(near.rows(0, 43).iter().all(|x| x.is_nan()));
            assert_eq!(near.rows(43, 77) == part.rows(43, 77), is_near);
        }
    }

    #[test]
    fn medians_and_trimmed_means() {
        let median = |values: &[f64]| {
            let laps: Vec<DVector<f64>> = values.iter().map(|&x| DVector::from_element(1, x)).collect();
            middle(&laps)[0]
        };
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        let mut values: Vec<f64> = (0..79).map(|_| 2.0).collect();
        values.extend([90.0]);
        assert_eq!(trimmed_mean(values), 2.0);
    }

    #[test]
    fn one_lap_far_astray_does_not_decide_the_kurtosis() {
        // Quantiles of a uniform law on [-1, 1], whose kurtosis is 9/5.
        let uniform: Vec<f64> = (0..4000).map(|i| (f64::from(i) - 1999.5) / 2000.0).collect();
        let astray: Vec<f64> = uniform.iter().copied().chain([30.0, -20.0, 10.0]).collect();
        assert!(Moments::of(&astray).kurtosis() > 100.0);
        for values in [uniform, astray] {
            let kurtosis = Moments::of(&winsorised(values)).kurtosis();
            assert!((kurtosis - 1.8).abs() < 0.01, "{kurtosis}");
        }
        // Too few to leave any out.
        assert_eq!(winsorised(vec![1.0, -7.0]), [1.0, -7.0]);
    }
}
