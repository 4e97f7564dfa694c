//! What a model leads one to expect of a data set, by simulation.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

use super::summary::{SECOND, Summary};

/// Means of the summaries of simulated data sets.
///
/// A model whose runs are alike (`alike`) expects the same of each, so their summaries are pooled.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Expectation {
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
        let first = summaries
            .clone()
            .next()
            .expect("at least one data set is simulated");
        let (runs, size) = (first.runs.len(), first.runs[0].mean.len());
        let sets = summaries.clone().count() as f64;
        let mut means = vec![DVector::zeros(size); runs];
        let (mut trend, mut second) = (DVector::zeros(size), DVector::zeros(SECOND));
        for summary in summaries {
            for (mean, run) in means.iter_mut().zip(&summary.runs) {
                mean.axpy(1.0 / sets, &run.mean, 1.0);
                trend.axpy(1.0 / sets / runs as f64, &run.trend, 1.0);
            }
            second.axpy(1.0 / sets, &summary.second, 1.0);
        }
        let mut expectation = Self { means, trend, second };
        if alike {
            expectation.pool();
        }
        expectation
    }

    /// The mean of several expectations of the same shape.
    pub(super) fn mean(all: &[Self], alike: bool) -> Self {
        let share = 1.0 / all.len() as f64;
        let mut mean = all[0].moved(-1.0, &all[0].zero(), &all[0]);
        for one in all {
            mean = mean.moved(share, &one.zero(), one);
        }
        if alike {
            mean.pool();
        }
        mean
    }

    fn zero(&self) -> Self {
        let zero = |v: &DVector<f64>| DVector::zeros(v.len());
        Self {
            means: self.means.iter().map(zero).collect(),
            trend: zero(&self.trend),
            second: zero(&self.second),
        }
    }

    /// Gives all runs the mean of their means.
    fn pool(&mut self) {
        let pooled = self.means.iter().sum::<DVector<f64>>() / self.means.len() as f64;
        self.means.iter_mut().for_each(|mean| mean.clone_from(&pooled));
    }

    /// This expectation moved by `factor` times the difference of two others.
    pub(super) fn moved(&self, factor: f64, from: &Self, to: &Self) -> Self {
        let moved = |base: &DVector<f64>, a: &DVector<f64>, b: &DVector<f64>| base + (b - a) * factor;
        Self {
            means: (0..self.means.len())
                .map(|r| moved(&self.means[r], &from.means[r], &to.means[r]))
                .collect(),
            trend: moved(&self.trend, &from.trend, &to.trend),
            second: moved(&self.second, &from.second, &to.second),
        }
    }
}

/// How a data set scatters about its expectation: the covariance of one lap and of the second-order numbers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Scatter {
    lap: Cholesky<f64, Dyn>,
    second: Cholesky<f64, Dyn>,
    /// log det of the covariance of one lap.
    pub(super) log_det: f64,
}

impl Scatter {
    /// The scatter within the runs of simulated data sets, and of their second-order numbers between data sets; `None` if
    /// there are too few for the number of coordinates.
    pub(super) fn of<'a>(summaries: impl Iterator<Item = &'a Summary> + Clone) -> Option<Self> {
        let sets = summaries.clone().count();
        let mean = Expectation::of(summaries.clone(), true).second;
        let mut second = DMatrix::zeros(SECOND, SECOND);
        for summary in summaries.clone() {
            let deviation = &summary.second - &mean;
            second.ger(1.0 / (sets as f64 - 1.0), &deviation, &deviation, 1.0);
        }
        let spread = inflation(sets - 1, SECOND)?;
        let second = (second * spread).cholesky()?;
        Self::with_second(summaries, second)
    }

    /// The scatter of the laps of these data sets, with another's scatter of the second-order numbers, which few data sets
    /// do not determine.
    pub(super) fn of_laps<'a>(
        summaries: impl Iterator<Item = &'a Summary> + Clone,
        other: &Self,
    ) -> Option<Self> {
        Self::with_second(summaries, other.second.clone())
    }

    fn with_second<'a>(
        summaries: impl Iterator<Item = &'a Summary> + Clone,
        second: Cholesky<f64, Dyn>,
    ) -> Option<Self> {
        let size = summaries.clone().next()?.scatter.nrows();
        let (mut lap, mut freedom) = (DMatrix::zeros(size, size), 0);
        for summary in summaries {
            lap += &summary.scatter;
            freedom += summary.freedom;
        }
        let lap = (lap * (inflation(freedom, size)? / freedom as f64)).cholesky()?;
        let log_det = 2.0 * lap.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        Some(Self { lap, second, log_det })
    }

    /// A vector of one lap's covariance in units of it.
    pub(super) fn whiten(&self, lap: &DVector<f64>) -> DVector<f64> {
        let mut white = lap.clone();
        self.lap.l_dirty().solve_lower_triangular_mut(&mut white);
        white
    }

    /// Second-order numbers in units of their covariance.
    pub(super) fn whiten_second(&self, second: &DVector<f64>) -> DVector<f64> {
        let mut white = second.clone();
        self.second.l_dirty().solve_lower_triangular_mut(&mut white);
        white
    }
}

/// What makes the inverse of a covariance estimated with `freedom` degrees of freedom in `size` dimensions unbiased (the mean
/// of the inverse Wishart distribution); `None` where it has none.
fn inflation(freedom: usize, size: usize) -> Option<f64> {
    (freedom > size + 1).then(|| freedom as f64 / (freedom - size - 1) as f64)
}
