//! What a model leads one to expect of a data set, by simulation.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};
use serde::{Deserialize, Serialize};
use statrs::function::gamma::digamma;

use super::summary::{Recording, SECOND, Summary};

/// Means of the summaries of simulated data sets, recording by recording.
///
/// A model whose runs are alike (`alike`) expects the same of each run of a recording, so their summaries are pooled.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Expectation(pub(super) Vec<Expected>);

/// What is expected of one recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Expected {
    /// Mean lap of each run.
    pub(super) means: Vec<DVector<f64>>,
    /// Trend within the runs, mean over them.
    pub(super) trend: DVector<f64>,
    /// Second order.
    pub(super) second: DVector<f64>,
}

impl Expectation {
    /// The mean of several summaries of the same shape.
    pub(super) fn of<'a>(summaries: impl Iterator<Item = &'a Summary> + Clone, alike: bool) -> Self {
        let recordings = summaries.clone().next().map_or(0, |first| first.0.len());
        let expected = |g: usize| Expected::of(summaries.clone().map(move |summary| &summary.0[g]), alike);
        Self((0..recordings).map(expected).collect())
    }

    /// The mean of several expectations of the same shape.
    pub(super) fn mean(all: &[&Self], alike: bool) -> Self {
        let share = 1.0 / all.len() as f64;
        let zero = all[0].moved(-1.0, &all[0].zero(), all[0]);
        let mut mean = all
            .iter()
            .fold(zero, |mean, one| mean.moved(share, &one.zero(), one));
        if alike {
            mean.0.iter_mut().for_each(Expected::pool);
        }
        mean
    }

    /// The same of so many runs of each recording, of which one is expected what another is.
    pub(super) fn for_runs(mut self, counts: impl Iterator<Item = usize>) -> Self {
        for (expected, count) in self.0.iter_mut().zip(counts) {
            expected.means = vec![expected.means[0].clone(); count];
        }
        self
    }

    fn zero(&self) -> Self {
        let zero = |v: &DVector<f64>| DVector::zeros(v.len());
        let expected = |e: &Expected| Expected {
            means: e.means.iter().map(zero).collect(),
            trend: zero(&e.trend),
            second: zero(&e.second),
        };
        Self(self.0.iter().map(expected).collect())
    }

    /// This expectation moved by `factor` times the difference of two others.
    pub(super) fn moved(&self, factor: f64, from: &Self, to: &Self) -> Self {
        let moved = |base: &DVector<f64>, a: &DVector<f64>, b: &DVector<f64>| base + (b - a) * factor;
        let expected = |((base, a), b): ((&Expected, &Expected), &Expected)| Expected {
            means: (0..base.means.len())
                .map(|r| moved(&base.means[r], &a.means[r], &b.means[r]))
                .collect(),
            trend: moved(&base.trend, &a.trend, &b.trend),
            second: moved(&base.second, &a.second, &b.second),
        };
        Self(self.0.iter().zip(&from.0).zip(&to.0).map(expected).collect())
    }

    /// Expectations of several recordings as one.
    pub(super) fn join(parts: impl Iterator<Item = Self>) -> Self {
        Self(parts.flat_map(|part| part.0).collect())
    }
}

impl Expected {
    fn of<'a>(recordings: impl Iterator<Item = &'a Recording> + Clone, alike: bool) -> Self {
        let first = recordings
            .clone()
            .next()
            .expect("at least one data set is simulated");
        let (runs, size) = (first.runs.len(), first.runs[0].mean.len());
        let sets = recordings.clone().count() as f64;
        let mut means = vec![DVector::zeros(size); runs];
        let (mut trend, mut second) = (DVector::zeros(size), DVector::zeros(first.second.len()));
        for recording in recordings {
            for (mean, run) in means.iter_mut().zip(&recording.runs) {
                mean.axpy(1.0 / sets, &run.mean, 1.0);
                trend.axpy(1.0 / sets / runs as f64, &run.trend, 1.0);
            }
            second.axpy(1.0 / sets, &recording.second, 1.0);
        }
        let mut expected = Self { means, trend, second };
        if alike {
            expected.pool();
        }
        expected
    }

    /// Leaves a share of how its numbers of all runs differ from others: its trend and what is of second order.
    pub(super) fn draw_towards(&mut self, other: &Self, share: f64) {
        for (own, other) in [(&mut self.trend, &other.trend), (&mut self.second, &other.second)] {
            own.axpy(1.0 - share, other, share);
        }
    }

    /// Gives all runs the mean of their means.
    fn pool(&mut self) {
        let pooled = self.means.iter().sum::<DVector<f64>>() / self.means.len() as f64;
        self.means.iter_mut().for_each(|mean| mean.clone_from(&pooled));
    }
}

/// How one recording scatters about its expectation: the covariance of one lap and of the second-order numbers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Scatter {
    /// Of a lap.
    lap: Cholesky<f64, Dyn>,
    /// Of a run's mean lap, as if it were one lap: with what the declaration leaves open.
    mean: Cholesky<f64, Dyn>,
    second: Cholesky<f64, Dyn>,
    /// What the declaration leaves open, as a covariance of a run's mean lap times the number of laps.
    open: DMatrix<f64>,
    /// log det of the covariance of one lap, without bias.
    pub(super) log_det: f64,
    /// Degrees of freedom of the covariance of one lap.
    pub(super) freedom: f64,
    /// Principal axes of the covariance of one lap, the longest first, each of unit length.
    axes: DMatrix<f64>,
}

impl Scatter {
    /// The scatter within the runs of simulated recordings, and of their second-order numbers between recordings; `None` if
    /// there are too few for the number of coordinates.
    pub(super) fn of<'a>(recordings: impl Iterator<Item = &'a Recording> + Clone) -> Option<Self> {
        let sets = recordings.clone().count();
        let mean = Expected::of(recordings.clone(), true).second;
        let freedom = sets as f64 - 1.0;
        let mut second = DMatrix::zeros(mean.len(), mean.len());
        for recording in recordings.clone() {
            let deviation = &recording.second - &mean;
            second.ger(1.0 / freedom, &deviation, &deviation, 1.0);
        }
        // How runs begin has nothing to do with how their laps scatter.
        let mut apart = DMatrix::zeros(mean.len(), mean.len());
        for part in [0..SECOND, SECOND..mean.len()] {
            let (at, size) = ((part.start, part.start), (part.len(), part.len()));
            let own = second.view(at, size) * inflation(freedom, part.len())?;
            apart.view_mut(at, size).copy_from(&own);
        }
        Self::of_second(recordings, apart)
    }

    /// As [`Scatter::of`] from few recordings: the second-order numbers are taken to be independent of each other.
    pub(super) fn of_few<'a>(recordings: impl Iterator<Item = &'a Recording> + Clone) -> Option<Self> {
        let all: Vec<&Recording> = recordings.clone().collect();
        let variances = variances_of_second(&all, 1);
        Self::of_second(recordings, DMatrix::from_diagonal(&variances))
    }

    fn of_second<'a>(
        recordings: impl Iterator<Item = &'a Recording> + Clone,
        second: DMatrix<f64>,
    ) -> Option<Self> {
        let size = recordings.clone().next()?.scatter.nrows();
        let (lap, freedom) = pooled(recordings, size);
        let axes = principal_axes(&lap);
        Self::with(lap, freedom, second.cholesky()?, DMatrix::zeros(size, size), axes)
    }

    /// The scatter of the laps of these recordings where they are too few to know it well: drawn towards one that has the
    /// principal axes of another, as far as chance explains the difference (Ledoit and Wolf 2004), and so is that of the
    /// second-order numbers. There may be several `copies` of the same recordings, one after the other, simulated with the same draws at
    /// other sizes. How well all of them tell the scatter shows in how well it fits laps that it was not made of.
    pub(super) fn near<'a>(
        recordings: impl Iterator<Item = &'a Recording>,
        copies: usize,
        other: &Self,
    ) -> Option<Self> {
        let all: Vec<&Recording> = recordings.collect();
        let size = other.open.nrows();
        let (own, freedom) = pooled(all.iter().copied(), size);
        let freedom = freedom / copies as f64;
        let along = |covariance: &DMatrix<f64>| other.axes.tr_mul(covariance) * &other.axes;
        let others = along(&other.of_lap()).diagonal();
        let along = along(&own);
        let wider = smoothed(&along.diagonal().component_div(&others));
        let target = others.component_mul(&wider);
        let in_its_units =
            DMatrix::from_fn(size, size, |i, j| along[(i, j)] / (target[i] * target[j]).sqrt());
        let share = share_by_chance(in_its_units, freedom);
        let target = &other.axes * DMatrix::from_diagonal(&target) * other.axes.transpose();
        let second = other.second_near(&all, copies)?;
        let parts = in_parts(&all, copies, size);
        if parts.len() < 3 {
            return other.blended(own, freedom, target, share, second);
        }
        let wider = wider_by_new_laps(&parts, &target, share)?;
        // As for a Wishart distribution, the more recordings the better; the target's axes are no better known than they are.
        let of_parts_but_one = freedom_of(wider, size);
        let freedom = of_parts_but_one * parts.len() as f64 / (parts.len() as f64 - 1.0);
        let freedom = (freedom.recip() + share.powi(2) / other.freedom).recip();
        let lap = (own * (1.0 - share) + target * share) * wider.min(1.0);
        Self::with(lap, freedom, second, other.open.clone(), other.axes.clone())
    }

    /// The covariance of the second-order numbers of these recordings: this one's with variances that are theirs as far as
    /// chance does not explain how they differ.
    fn second_near(&self, recordings: &[&Recording], copies: usize) -> Option<Cholesky<f64, Dyn>> {
        let sets = recordings.len() / copies;
        if sets < 3 {
            return Some(self.second.clone());
        }
        let freedom = (sets - 1) as f64;
        let l = self.second.l();
        let others = &l * l.transpose();
        let bias = digamma(freedom / 2.0) - (freedom / 2.0).ln();
        let apart = variances_of_second(recordings, copies)
            .component_div(&others.diagonal())
            .map(|ratio| ratio.ln() - bias);
        let by_chance = apart.len() as f64 * variance_of_log(freedom);
        let own = 1.0 - (by_chance / apart.norm_squared()).min(1.0);
        // What makes the inverse of a variance estimated with few degrees of freedom unbiased.
        let wider = own * own * 2.0 / freedom;
        let factors = apart.map(|apart| (0.5 * (own * apart + wider)).exp());
        let root = DMatrix::from_diagonal(&factors) * l;
        (&root * root.transpose()).cholesky()
    }

    /// The scatter of the laps of these recordings drawn towards this one, as far as chance explains the difference.
    pub(super) fn unless_apart<'a>(
        &self,
        recordings: impl Iterator<Item = &'a Recording> + Clone,
    ) -> Option<Self> {
        let (own, freedom) = pooled(recordings, self.open.nrows());
        let common = self.of_lap();
        let root = common.clone().cholesky()?;
        let mut in_its_units = own.clone();
        root.l_dirty().solve_lower_triangular_mut(&mut in_its_units);
        in_its_units.transpose_mut();
        root.l_dirty().solve_lower_triangular_mut(&mut in_its_units);
        let share = share_by_chance(in_its_units, freedom);
        if share == 1.0 {
            return Some(self.clone());
        }
        self.blended(own, freedom, common, share, self.second.clone())
    }

    /// A covariance of one lap blended with a share of a target, and one of the second-order numbers; the rest is this scatter's.
    fn blended(
        &self,
        own: DMatrix<f64>,
        freedom: f64,
        target: DMatrix<f64>,
        share: f64,
        second: Cholesky<f64, Dyn>,
    ) -> Option<Self> {
        let freedom = ((1.0 - share).powi(2) / freedom + share.powi(2) / self.freedom).recip();
        Self::with(
            own * (1.0 - share) + target * share,
            freedom,
            second,
            self.open.clone(),
            self.axes.clone(),
        )
    }

    /// This scatter where the declaration leaves the mean lap open: `directions` are as likely as not, in units of a lap;
    /// runs have `laps` laps.
    pub(super) fn left_open(self, directions: &[DVector<f64>], laps: f64) -> Option<Self> {
        let size = self.open.nrows();
        let mut open = DMatrix::zeros(size, size);
        for direction in directions {
            open.ger(laps / directions.len() as f64, direction, direction, 1.0);
        }
        let mean = (self.of_lap() + &open).cholesky()?;
        Some(Self { mean, open, ..self })
    }

    /// From a covariance of one lap that was estimated with so many degrees of freedom.
    fn with(
        lap: DMatrix<f64>,
        freedom: f64,
        second: Cholesky<f64, Dyn>,
        open: DMatrix<f64>,
        axes: DMatrix<f64>,
    ) -> Option<Self> {
        let size = lap.nrows();
        let enlarged = &lap * inflation(freedom, size)?;
        let lap = lap.cholesky()?;
        let logarithms = lap.l_dirty().diagonal().map(f64::ln).sum();
        Some(Self {
            mean: (&enlarged + &open).cholesky()?,
            lap: enlarged.cholesky()?,
            second,
            open,
            log_det: 2.0 * logarithms - log_det_bias(freedom, size),
            freedom,
            axes,
        })
    }

    /// A run's mean lap in units of a lap's scatter and of what the declaration leaves open.
    pub(super) fn whiten_mean(&self, mean: &DVector<f64>) -> DVector<f64> {
        whiten(&self.mean, mean)
    }

    /// The mean lap of [`Scatter::whiten_mean`].
    pub(super) fn unwhiten_mean(&self, white: &DVector<f64>) -> DVector<f64> {
        self.root_of_mean() * white
    }

    /// The vector of [`Scatter::whiten`].
    pub(super) fn unwhiten(&self, white: &DVector<f64>) -> DVector<f64> {
        self.root_of_lap() * white
    }

    /// The numbers of [`Scatter::whiten_second`].
    pub(super) fn unwhiten_second(&self, white: &DVector<f64>) -> DVector<f64> {
        self.second.l() * white
    }

    /// log det of the covariance of the second-order numbers.
    pub(super) fn log_det_second(&self) -> f64 {
        2.0 * self.second.l_dirty().diagonal().map(f64::ln).sum()
    }

    /// What the declaration leaves open, as a covariance of a run's mean lap times the number of laps.
    pub(super) fn open(&self) -> &DMatrix<f64> {
        &self.open
    }

    /// The lower root of the covariance by which [`Scatter::whiten_mean`] whitens.
    pub(super) fn root_of_mean(&self) -> DMatrix<f64> {
        self.mean.l()
    }

    /// The lower root of the covariance by which [`Scatter::whiten`] does.
    pub(super) fn root_of_lap(&self) -> DMatrix<f64> {
        self.lap.l()
    }

    /// The covariance of one lap.
    pub(super) fn of_lap(&self) -> DMatrix<f64> {
        let root = self.root_of_lap();
        &root * root.transpose()
    }

    /// The mean square of how laps of some recordings deviate from their runs, in units of one lap's covariance.
    pub(super) fn mean_square<'a>(&self, recordings: impl Iterator<Item = &'a Recording>) -> f64 {
        let size = self.open.nrows();
        let (own, _) = pooled(recordings, size);
        self.lap.solve(&own).trace() / size as f64
    }

    /// A vector of one lap's covariance in units of it.
    pub(super) fn whiten(&self, lap: &DVector<f64>) -> DVector<f64> {
        whiten(&self.lap, lap)
    }

    /// Second-order numbers in units of their covariance.
    pub(super) fn whiten_second(&self, second: &DVector<f64>) -> DVector<f64> {
        whiten(&self.second, second)
    }
}

fn whiten(covariance: &Cholesky<f64, Dyn>, vector: &DVector<f64>) -> DVector<f64> {
    let mut white = vector.clone();
    covariance.l_dirty().solve_lower_triangular_mut(&mut white);
    white
}

/// The covariance of one lap within the runs of some recordings, and its degrees of freedom.
pub(super) fn pooled<'a>(
    recordings: impl Iterator<Item = &'a Recording>,
    size: usize,
) -> (DMatrix<f64>, f64) {
    let (mut lap, mut freedom) = (DMatrix::zeros(size, size), 0);
    for recording in recordings {
        lap += &recording.scatter;
        freedom += recording.freedom;
    }
    let freedom = freedom as f64;
    (lap / freedom, freedom)
}

/// The scatter of some recordings and its degrees of freedom in up to four parts, the copies of a recording in the same.
fn in_parts(recordings: &[&Recording], copies: usize, size: usize) -> Vec<(DMatrix<f64>, f64)> {
    const MOST: usize = 4;
    let sets = recordings.len() / copies;
    let count = sets.min(MOST);
    let mut parts = vec![(DMatrix::zeros(size, size), 0.0); count];
    for (i, recording) in recordings.iter().enumerate() {
        let (scatter, freedom) = &mut parts[i % sets % count];
        *scatter += &recording.scatter;
        *freedom += recording.freedom as f64;
    }
    parts
}

/// By how much a covariance of one lap, of parts of some recordings but one and of a share of a target, has to be multiplied for its inverse
/// to fit the laps of that one.
fn wider_by_new_laps(parts: &[(DMatrix<f64>, f64)], target: &DMatrix<f64>, share: f64) -> Option<f64> {
    let all: DMatrix<f64> = parts.iter().map(|(scatter, _)| scatter).sum();
    let freedom_of_all: f64 = parts.iter().map(|(_, freedom)| freedom).sum();
    let mut wider = 0.0;
    for (scatter, freedom) in parts {
        let others = (&all - scatter) / (freedom_of_all - freedom);
        let known = others * (1.0 - share) + target * share;
        wider += known.cholesky()?.solve(scatter).trace() / freedom;
    }
    Some(wider / (parts.len() * target.nrows()) as f64)
}

/// Degrees of freedom with which a covariance is known whose inverse is unbiased once it is multiplied by this; see [`inflation`].
fn freedom_of(wider: f64, size: usize) -> f64 {
    const MOST: f64 = 1e5;
    if wider > 1.0 {
        (wider * (size as f64 + 1.0) / (wider - 1.0)).min(MOST)
    } else {
        MOST
    }
}

/// Variances of the second-order numbers between recordings; of copies, one after the other, each about its own mean.
fn variances_of_second(recordings: &[&Recording], copies: usize) -> DVector<f64> {
    let sets = recordings.len() / copies;
    let mut variances = DVector::zeros(recordings[0].second.len());
    for copy in recordings.chunks(sets) {
        let sum: DVector<f64> = copy.iter().map(|recording| &recording.second).sum();
        let mean = sum / sets as f64;
        for recording in copy {
            let deviation = &recording.second - &mean;
            variances += deviation.component_mul(&deviation) / ((sets - 1) as f64 * copies as f64);
        }
    }
    variances
}

/// The principal axes of a covariance, the longest first.
pub(super) fn principal_axes(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let found = SymmetricEigen::new(covariance.clone());
    let mut order: Vec<usize> = (0..covariance.nrows()).collect();
    order.sort_by(|&a, &b| found.eigenvalues[b].total_cmp(&found.eigenvalues[a]));
    found.eigenvectors.select_columns(&order)
}

/// Ratios of variances along neighbouring axes: each becomes the geometric mean of those about it.
pub(super) fn smoothed(ratios: &DVector<f64>) -> DVector<f64> {
    const ABOUT: usize = 3;
    let logarithms = ratios.map(f64::ln);
    DVector::from_fn(ratios.len(), |i, _| {
        let first = i.saturating_sub(ABOUT);
        let last = (i + ABOUT).min(ratios.len() - 1);
        logarithms.rows(first, last + 1 - first).mean().exp()
    })
}

/// Share of the squared distance between a covariance and what it should be that chance explains if it was estimated with `freedom`
/// degrees of freedom; it is given in units of what it should be. The same is asked of their inverses (Wishart, and inverse Wishart), and
/// the lesser share counts: where a covariance is far smaller than it should be only the inverses differ much.
fn share_by_chance(in_units: DMatrix<f64>, freedom: f64) -> f64 {
    let size = in_units.nrows() as f64;
    let ratios = in_units.symmetric_eigenvalues();
    let apart = |times: f64, of: fn(f64) -> f64| -> f64 {
        let squares = ratios.iter().map(|&ratio| (times * of(ratio) - 1.0).powi(2));
        squares.sum::<f64>().max(f64::MIN_POSITIVE)
    };
    let share = size * (size + 1.0) / freedom / apart(1.0, |ratio| ratio);
    let left = freedom - size - 1.0;
    // The inverse has no variance otherwise.
    if left <= 2.0 {
        return share.min(1.0);
    }
    let by_chance = size * (left * (freedom - 1.0) / ((freedom - size) * (left - 2.0)) - 1.0);
    share.min(by_chance / apart(left / freedom, f64::recip)).min(1.0)
}

/// What makes the inverse of a covariance estimated with `freedom` degrees of freedom in `size` dimensions unbiased (the mean
/// of the inverse Wishart distribution); `None` where it has none.
fn inflation(freedom: f64, size: usize) -> Option<f64> {
    let left = freedom - size as f64 - 1.0;
    (left > 0.0).then(|| freedom / left)
}

/// Variance of the logarithm of a variance estimated with `freedom` degrees of freedom: trigamma of half of it.
fn variance_of_log(freedom: f64) -> f64 {
    let inverse = 2.0 / freedom;
    inverse + inverse.powi(2) / 2.0 + inverse.powi(3) / 6.0
}

/// Expectation of the log determinant of a covariance estimated with `freedom` degrees of freedom, less the true one (Wishart).
fn log_det_bias(freedom: f64, size: usize) -> f64 {
    (0..size)
        .map(|i| digamma((freedom - i as f64) / 2.0) - (freedom / 2.0).ln())
        .sum()
}

#[cfg(test)]
mod tests {
    use sim::{Stream, Streams};

    use super::*;

    const SIZE: usize = 30;

    /// Smooth deviations of a size along the lap, and noise of unit variance at every gate.
    fn covariance(smooth: f64) -> DMatrix<f64> {
        DMatrix::from_fn(SIZE, SIZE, |i, j| {
            smooth * correlation(i, j, 6.0) + one_if(i == j)
        })
    }

    fn correlation(i: usize, j: usize, gates: f64) -> f64 {
        let apart = i.abs_diff(j) as f64 / gates;
        (-0.5 * apart * apart).exp()
    }

    fn one_if(same: bool) -> f64 {
        f64::from(u8::from(same))
    }

    fn drawn(root: &DMatrix<f64>, stream: &mut Stream) -> DVector<f64> {
        root * DVector::from_fn(SIZE, |_, _| stream.normal())
    }

    fn recording(root: &DMatrix<f64>, freedom: usize, stream: &mut Stream) -> Recording {
        let mut scatter = DMatrix::zeros(SIZE, SIZE);
        for _ in 0..freedom {
            let lap = drawn(root, stream);
            scatter.ger(1.0, &lap, &lap, 1.0);
        }
        Recording {
            runs: Vec::new(),
            second: DVector::from_fn(SECOND, |_, _| stream.normal()),
            scatter,
            freedom,
        }
    }

    /// A well known scatter of these laps.
    fn known(smooth: f64) -> Scatter {
        let lap = covariance(smooth);
        let axes = principal_axes(&lap);
        let second = DMatrix::identity(SECOND, SECOND).cholesky().unwrap();
        Scatter::with(lap, 1e4, second, DMatrix::zeros(SIZE, SIZE), axes).unwrap()
    }

    #[test]
    fn the_scatter_of_few_recordings_is_neither_too_wide_nor_too_narrow() {
        let other = known(4.0);
        // Nine times the smooth variance, the same noise: no multiple of what was declared.
        for smooth in [4.0, 36.0] {
            let truth = covariance(smooth).cholesky().unwrap();
            let log_det = 2.0 * truth.l().diagonal().map(f64::ln).sum();
            let mut stream = Streams { seed: 5, run: 0 }.open("laps");
            let (mut squares, mut off) = (0.0, 0.0);
            const TIMES: usize = 40;
            for _ in 0..TIMES {
                let few = recording(&truth.l(), 3 * SIZE, &mut stream);
                let scatter = Scatter::near(std::iter::repeat_n(&few, 7), 7, &other).unwrap();
                let fresh = drawn(&truth.l(), &mut stream);
                squares += scatter.whiten(&fresh).norm_squared() / TIMES as f64;
                off += (scatter.log_det - log_det) / TIMES as f64;
            }
            // 30 +- 1.2 by chance.
            assert!((squares - 30.0).abs() < 3.6, "{smooth}: {squares}");
            assert!(off.abs() < 1.0, "{smooth}: {off}");
        }
    }

    #[test]
    fn the_scatter_of_a_robot_unlike_the_declared_one_is_as_wide_as_its_laps_are() {
        let other = known(4.0);
        // Twenty times the variance in shorter waves, and a twentieth of the noise.
        let truth = DMatrix::from_fn(SIZE, SIZE, |i, j| {
            80.0 * correlation(i, j, 4.0) + 0.05 * one_if(i == j)
        });
        let root = truth.cholesky().unwrap().l();
        let mut stream = Streams { seed: 8, run: 0 }.open("laps");
        const SETS: usize = 8;
        const COPIES: usize = 3;
        // Copies that are all the same tell nothing new; those that have nothing in common tell three times as much.
        for differ in [false, true] {
            let mut squares = 0.0;
            const TIMES: usize = 40;
            for _ in 0..TIMES {
                let mut draw = || recording(&root, SIZE / 4, &mut stream);
                let mut all: Vec<Recording> = (0..SETS).map(|_| draw()).collect();
                for i in 0..(COPIES - 1) * SETS {
                    let copy = if differ { draw() } else { all[i].clone() };
                    all.push(copy);
                }
                let scatter = Scatter::near(all.iter(), COPIES, &other).unwrap();
                let fresh = drawn(&root, &mut stream);
                squares += scatter.whiten(&fresh).norm_squared() / TIMES as f64;
            }
            // 30 +- 1.2 by chance.
            assert!((squares - 30.0).abs() < 4.0, "{differ}: {squares}");
        }
    }

    #[test]
    fn second_order_numbers_have_their_own_variances_as_far_as_chance_allows() {
        let other = known(4.0);
        let mut stream = Streams { seed: 7, run: 0 }.open("laps");
        // As declared, and with every other number three times as wide.
        for wide in [1.0, 3.0] {
            let mut draw = || {
                DVector::from_fn(SECOND, |i, _| {
                    stream.normal() * if i % 2 == 0 { wide } else { 1.0 }
                })
            };
            let (mut squares, mut off) = (0.0, 0.0);
            const TIMES: usize = 60;
            for _ in 0..TIMES {
                let few: Vec<Recording> = (0..12)
                    .map(|_| Recording {
                        runs: Vec::new(),
                        second: draw(),
                        scatter: DMatrix::identity(SIZE, SIZE),
                        freedom: 72,
                    })
                    .collect();
                // The same twice: copies at another size, with another mean.
                let shifted = few.iter().map(|recording| Recording {
                    second: recording.second.add_scalar(5.0),
                    ..recording.clone()
                });
                let all: Vec<Recording> = few.iter().cloned().chain(shifted).collect();
                let scatter = Scatter::near(all.iter(), 2, &other).unwrap();
                squares += scatter.whiten_second(&draw()).norm_squared() / TIMES as f64;
                off += (scatter.log_det_second() - f64::from(2 * SECOND.div_ceil(2) as u32) * wide.ln())
                    / TIMES as f64;
            }
            // 21 +- 0.8 by chance; a variance known from 12 recordings costs a little.
            assert!((squares - SECOND as f64).abs() < 3.0, "{wide}: {squares}");
            assert!(off.abs() < 3.0, "{wide}: {off}");
        }
    }

    #[test]
    fn rivals_share_a_scatter_unless_theirs_differ_by_more_than_chance() {
        let common = known(4.0);
        let mut stream = Streams { seed: 6, run: 0 }.open("laps");
        for (smooth, kept) in [(4.0, 0.15), (8.0, 0.8)] {
            let truth = covariance(smooth).cholesky().unwrap();
            let laps = recording(&truth.l(), 1000, &mut stream);
            let scatter = common.unless_apart(std::iter::once(&laps)).unwrap();
            let (own, of_lap) = (&laps.scatter / 1000.0, scatter.of_lap());
            let moved = (&of_lap - common.of_lap()).norm() / (own - common.of_lap()).norm();
            assert_eq!(moved > kept, smooth > 4.0, "{smooth}: {moved}");
        }
    }
}
