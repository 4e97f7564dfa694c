//! How much more laps scatter than the declared model's, along the principal axes of that one's scatter.
//!
//! A covariance of laps takes many data sets to be known, its diagonal along these axes one or two: how much more laps scatter along
//! an axis than the declared model's with the same draws.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::atlas::{Atlas, White};
use super::expectation::{Scatter, pooled, principal_axes, smoothed};
use super::summary::Summary;

/// Data sets of the declared model with which those of others share their draws; more add little.
pub(super) const PAIRED: usize = 8;

/// The principal axes of how one recording scatters under the declared model.
#[derive(Debug, Clone)]
pub(super) struct Axes {
    /// Of a run's mean lap, as if it were one lap: with what the declaration leaves open.
    mean: Principal,
    /// Of a single lap.
    lap: Principal,
}

impl Axes {
    pub(super) fn of(scatter: &Scatter) -> Self {
        let closed = DMatrix::zeros(scatter.open().nrows(), scatter.open().ncols());
        Self {
            mean: Principal::new(&scatter.root_of_mean(), scatter.open()),
            lap: Principal::new(&scatter.root_of_lap(), &closed),
        }
    }

    /// Variances of laps with some covariance.
    fn variances(&self, covariance: &DMatrix<f64>) -> Along {
        Along {
            mean: self.mean.variances(covariance),
            lap: self.lap.variances(covariance),
        }
    }
}

/// The principal axes of a covariance.
#[derive(Debug, Clone)]
struct Principal {
    /// Of unit length, the longest first.
    axes: DMatrix<f64>,
    /// What the declaration leaves open along them, as variances.
    open: DVector<f64>,
    /// Turns what was whitened by the covariance's root so that its entries are those along the axes.
    turn: DMatrix<f64>,
}

impl Principal {
    /// Of a covariance with such a lower root, of which so much is what the declaration leaves open.
    fn new(root: &DMatrix<f64>, open: &DMatrix<f64>) -> Self {
        let axes = principal_axes(&(root * root.transpose()));
        let mut turn = axes.tr_mul(root);
        for mut along in turn.row_iter_mut() {
            along.unscale_mut(along.norm());
        }
        Self {
            open: diagonal_along(&axes, open),
            axes,
            turn,
        }
    }

    fn variances(&self, covariance: &DMatrix<f64>) -> DVector<f64> {
        diagonal_along(&self.axes, covariance) + &self.open
    }
}

/// The diagonal of a matrix along some axes.
fn diagonal_along(axes: &DMatrix<f64>, matrix: &DMatrix<f64>) -> DVector<f64> {
    let image = matrix * axes;
    let pairs = axes.column_iter().zip(image.column_iter());
    DVector::from_iterator(axes.ncols(), pairs.map(|(axis, image)| axis.dot(&image)))
}

/// Numbers along the [`Axes`] of one recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Along {
    mean: DVector<f64>,
    lap: DVector<f64>,
}

/// Variances of the laps of one data set along the [`Axes`] of each recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Variances(Vec<Along>);

impl Variances {
    /// Of the laps of some data sets together.
    pub(super) fn of(axes: &[Axes], sets: &[Summary]) -> Self {
        let of_recording = |(g, axes): (usize, &Axes)| {
            let recordings = sets.iter().map(|set| &set.0[g]);
            axes.variances(&pooled(recordings, axes.lap.open.len()).0)
        };
        Self(axes.iter().enumerate().map(of_recording).collect())
    }

    /// Those of several recordings as one.
    pub(super) fn join(parts: impl Iterator<Item = Self>) -> Self {
        Self(parts.flat_map(|part| part.0).collect())
    }
}

/// Logarithms of how many times those of the declared model the variances of laps are, along the [`Axes`] of each recording.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Spread(Vec<Along>);

impl Spread {
    /// By the first of simulated data sets and the declared model's with the same draws; neighbouring axes are taken to tell the same.
    pub(super) fn of(axes: &[Axes], sets: &[Summary], declared: &[Variances]) -> Self {
        let paired = sets.len().min(declared.len());
        let own = Variances::of(axes, &sets[..paired]);
        let of_recording = |(g, own): (usize, &Along)| {
            let ratio = |own: &DVector<f64>, of: fn(&Along) -> &DVector<f64>| {
                let sum: DVector<f64> = declared[..paired].iter().map(|set| of(&set.0[g])).sum();
                smoothed(&own.component_div(&(sum / paired as f64))).map(f64::ln)
            };
            Along {
                mean: ratio(&own.mean, |along| &along.mean),
                lap: ratio(&own.lap, |along| &along.lap),
            }
        };
        Self(own.0.iter().enumerate().map(of_recording).collect())
    }

    /// Those of several recordings as one.
    pub(super) fn join<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        Self(parts.flat_map(|part| part.0.clone()).collect())
    }
}

impl Atlas {
    /// A whitened data set with its laps' entries along the principal axes: a rotation.
    pub(super) fn turned(&self, white: &White) -> White {
        let mut turned = white.clone();
        self.for_laps(|recording, range, is_mean| {
            let Axes { mean, lap } = &self.axes[recording];
            let by = if is_mean { &mean.turn } else { &lap.turn };
            let entries = white.rows(range.start, range.len());
            turned
                .rows_mut(range.start, range.len())
                .gemv(1.0, by, &entries, 0.0);
        });
        turned
    }

    /// A spread entry by entry of a turned data set: that of numbers of second order is not known.
    pub(super) fn widened_by(&self, spread: &Spread) -> White {
        let mut widened = White::zeros(self.layout.len());
        self.for_laps(|recording, range, is_mean| {
            let Along { mean, lap } = &spread.0[recording];
            let along = if is_mean { mean } else { lap };
            widened.rows_mut(range.start, range.len()).copy_from(along);
        });
        widened
    }

    /// How much more simulated data sets, from the first on, scatter than the declared model's, entry by entry of a turned one.
    pub(super) fn widened(&self, sets: &[Summary]) -> White {
        self.widened_by(&Spread::of(&self.axes, sets, &self.variances))
    }

    /// Tells recording and entries of each run's mean lap, and of each trend, and whether it is a mean lap.
    fn for_laps(&self, mut tell: impl FnMut(usize, Range<usize>, bool)) {
        for (run, (recording, _)) in self.layout.places().enumerate() {
            tell(recording, self.layout.run(run), true);
        }
        for recording in 0..self.layout.laps.len() {
            tell(recording, self.layout.trend(recording), false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::testing::{atlas, summaries, twice_as_wide};

    #[test]
    fn laps_twice_as_wide_have_four_times_the_variance_along_all_axes() {
        let atlas = atlas();
        let widened = atlas.widened(&twice_as_wide(3));
        let (laps, second) = (atlas.layout.laps_of(0), atlas.layout.second(0));
        for range in laps {
            assert!(range.clone().all(|i| (widened[i] - 4.0_f64.ln()).abs() < 1e-9));
        }
        assert!(second.clone().all(|i| widened[i] == 0.0));
    }

    #[test]
    fn of_the_declared_model_with_the_same_draws_nothing_is_chance() {
        let atlas = atlas();
        for sets in [1, 3] {
            assert!(atlas.widened(&summaries(sets)).amax() < 1e-12);
        }
    }

    #[test]
    fn turning_changes_no_distance() {
        let atlas = atlas();
        let white = atlas.white(&atlas.samples[0], &atlas.null);
        let turned = atlas.turned(&white);
        assert!((turned.norm() - white.norm()).abs() < 1e-9);
        for range in atlas.layout.laps_of(0) {
            let [before, after] = [&white, &turned].map(|all| all.rows(range.start, range.len()).norm());
            assert!((before - after).abs() < 1e-9);
        }
    }

    #[test]
    fn along_principal_axes_a_covariance_and_what_is_left_open_are_diagonal() {
        let covariance = DMatrix::from_row_slice(2, 2, &[5.0, 3.0, 3.0, 5.0]);
        let open = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]);
        let root = (&covariance + &open).cholesky().unwrap().l();
        let principal = Principal::new(&root, &open);
        // 5 + 3 along (1, 1), and 5 - 3 + 2 along (1, -1).
        let variances = principal.variances(&covariance);
        assert!((variances - DVector::from_vec(vec![8.0, 4.0])).norm() < 1e-12);
        let identity = &principal.turn * principal.turn.transpose();
        assert!((identity - DMatrix::identity(2, 2)).norm() < 1e-12);
    }
}
