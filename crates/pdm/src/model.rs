//! The Point Distribution Model: mean lap, modes, and the way there and back.

use nalgebra::{DMatrix, DVector};

use crate::covariance::{centred, zero_singular_value};
use crate::decomposition::Decomposition;
use crate::{Cluster, Error, Projection};

/// Components this close to the largest, as a fraction of it, count as equally large when the sign is chosen.
const SIGN_TIE: f64 = 1e-9;

/// How many modes to compare in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Modes {
    /// The first so many, at least 1.
    First(usize),
    /// Every mode with variance that the covariance can carry: all `R` of the model, but at most `n_x + n_y - 2` in
    /// the pooled covariance of a pair (so that `df2 >= 1`) and at most `n - 1` in that of one cluster.
    All,
}

impl Default for Modes {
    /// The first two, as in the paper's figures.
    fn default() -> Self {
        Self::First(2)
    }
}

/// A Point Distribution Model: the mean of `K` laps and the `R` modes in which they vary.
///
/// ```
/// use pdm::{Cluster, Modes, Pdm};
///
/// let laps = Cluster::new("a", &[vec![1.0, 1.0], vec![3.0, 3.0], vec![2.0, 2.0]])?;
/// let pdm = Pdm::fit([&laps])?;
/// assert_eq!(pdm.degrees_of_freedom(), 1); // both gates move together
/// assert!((pdm.eigenvalues()[0] - 2.0).abs() < 1e-12);
/// assert!((pdm.reconstruct(&[2_f64.sqrt()])?[0] - 3.0).abs() < 1e-12);
/// # Ok::<(), pdm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Pdm {
    mean: DVector<f64>,
    modes: DMatrix<f64>,
    eigenvalues: Vec<f64>,
    zero_variance: f64,
}

impl Pdm {
    /// The model of all laps of all `clusters` together (eq. 2), most variance first.
    ///
    /// The modes come from the singular value decomposition of the centred `K x N` matrix, so there may be more gates
    /// than laps. Of each mode the component largest in size (the first of equals) is positive. Modes whose variance
    /// is rounding are dropped: those with a singular value up to `max(K, N) * eps` times the norm of all laps.
    ///
    /// # Errors
    /// [`Error::Dimension`] for clusters with different numbers of gates, [`Error::TooFewLaps`] for fewer than two laps
    /// in all, [`Error::NoVariance`] for laps that are all the same.
    pub fn fit<'a>(clusters: impl IntoIterator<Item = &'a Cluster>) -> Result<Self, Error> {
        let clusters: Vec<_> = clusters.into_iter().collect();
        let laps = stacked(&clusters)?;
        let (count, gates) = laps.shape();
        if count < 2 {
            let laps = clusters
                .iter()
                .map(|cluster| (cluster.name().to_owned(), cluster.len()))
                .collect();
            return Err(Error::TooFewLaps {
                laps,
                coordinates: gates,
                each: 1,
                total: 2,
            });
        }
        let zero = zero_singular_value(&laps);
        let svd =
            Decomposition::new(&centred(&laps), zero).ok_or(Error::NoConvergence { laps: count, gates })?;
        let rank = svd.values.len().min(gates).min(count - 1); // eq. 3
        if rank == 0 {
            return Err(Error::NoVariance { laps: count });
        }
        let divisor = (count - 1) as f64;
        Ok(Self {
            mean: laps.row_mean().transpose(),
            modes: signed(svd.vectors.columns(0, rank).into_owned()),
            eigenvalues: svd.values[..rank]
                .iter()
                .map(|value| value * value / divisor)
                .collect(),
            zero_variance: zero * zero / divisor,
        })
    }

    /// The mean lap, `N` numbers.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }

    /// The modes `P` of eq. 2, `N x R`, one per column, orthonormal.
    #[must_use]
    pub fn modes(&self) -> &DMatrix<f64> {
        &self.modes
    }

    /// The variance in each of the `R` modes, with divisor `K - 1`, largest first, in the square of the laps' unit.
    #[must_use]
    pub fn eigenvalues(&self) -> &[f64] {
        &self.eigenvalues
    }

    /// The fraction of the variance that lies in each of the `R` modes; they sum to 1.
    #[must_use]
    pub fn explained(&self) -> Vec<f64> {
        let total: f64 = self.eigenvalues.iter().sum();
        self.eigenvalues.iter().map(|value| value / total).collect()
    }

    /// The number of modes with variance `R <= min(N, K - 1)` (eq. 3), at least 1.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        self.eigenvalues.len()
    }

    /// The laps of `cluster` in the space of the modes (eq. 5), `K x modes`. The cluster need not be one of the fit.
    ///
    /// # Errors
    /// [`Error::Dimension`] for laps with another number of gates, [`Error::Modes`] for no mode or more than `R`.
    pub fn project(&self, cluster: &Cluster, modes: Modes) -> Result<Projection, Error> {
        if cluster.dimension() != self.mean.len() {
            return Err(Error::Dimension {
                name: cluster.name().to_owned(),
                dimension: cluster.dimension(),
                other: "the model".to_owned(),
                expected: self.mean.len(),
            });
        }
        let available = self.degrees_of_freedom();
        let count = match modes {
            Modes::First(wanted) if wanted == 0 || wanted > available => {
                return Err(Error::Modes { wanted, available });
            }
            Modes::First(wanted) => wanted,
            Modes::All => available,
        };
        let from_mean = cluster
            .laps()
            .map_with_location(|_, gate, value| value - self.mean[gate]);
        let points = from_mean * self.modes.columns(0, count);
        Ok(Projection::in_modes(
            cluster.name(),
            points,
            modes,
            self.zero_variance,
        ))
    }

    /// The lap at `b` in the space of the modes (eq. 4), `N` numbers; modes that `b` is too short for are at rest.
    ///
    /// # Errors
    /// [`Error::Modes`] where `b` is longer than `R`.
    pub fn reconstruct(&self, b: &[f64]) -> Result<Vec<f64>, Error> {
        let available = self.degrees_of_freedom();
        if b.len() > available {
            return Err(Error::Modes {
                wanted: b.len(),
                available,
            });
        }
        let deformation = self.modes.columns(0, b.len()) * DVector::from_column_slice(b);
        Ok((&self.mean + deformation).as_slice().to_vec())
    }
}

/// All laps below each other, `K x N`.
fn stacked(clusters: &[&Cluster]) -> Result<DMatrix<f64>, Error> {
    let Some(first) = clusters.first() else {
        return Err(Error::Empty {
            name: "the model".to_owned(),
            laps: 0,
            gates: 0,
        });
    };
    if let Some(odd) = clusters
        .iter()
        .find(|cluster| cluster.dimension() != first.dimension())
    {
        return Err(Error::Dimension {
            name: odd.name().to_owned(),
            dimension: odd.dimension(),
            other: first.name().to_owned(),
            expected: first.dimension(),
        });
    }
    let rows: Vec<_> = clusters
        .iter()
        .flat_map(|cluster| cluster.laps().row_iter())
        .collect();
    Ok(DMatrix::from_rows(&rows))
}

/// The same modes, each turned so that its largest component is positive: the decomposition leaves the sign open.
fn signed(mut modes: DMatrix<f64>) -> DMatrix<f64> {
    for mut mode in modes.column_iter_mut() {
        let largest = mode.amax() * (1.0 - SIGN_TIE);
        if mode
            .iter()
            .find(|value| value.abs() >= largest)
            .is_some_and(|&value| value < 0.0)
        {
            mode.neg_mut();
        }
    }
    modes
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::samples::{close, cluster, gaussian};

    /// `laps` laps of `gates` gates that move in `factors` ways about a mean of their own.
    fn laps(seed: u64, laps: usize, gates: usize, factors: usize) -> DMatrix<f64> {
        let mean = gaussian(seed + 2, 1, gates) * 10.0;
        let moved = gaussian(seed, laps, factors) * gaussian(seed + 1, factors, gates);
        moved.map_with_location(|_, gate, value| value + mean[gate])
    }

    fn largest(matrix: DMatrix<f64>) -> f64 {
        matrix.amax()
    }

    #[test]
    fn four_points_have_the_model_computed_by_hand() {
        // centred (3 4; -3 -4; 4 -3; -4 3) / 5 times 5, 5, 1, 1: variances 50/3 and 2/3 along (3 4)/5 and (4 -3)/5
        let points = [vec![4.0, 6.0], vec![-2.0, -2.0], vec![1.8, 1.4], vec![0.2, 2.6]];
        let pdm = Pdm::fit([&Cluster::new("a", &points).unwrap()]).unwrap();
        let is = [
            pdm.mean(),
            pdm.eigenvalues(),
            pdm.modes().as_slice(),
            &pdm.explained(),
        ]
        .concat();
        let should = [
            1.0,
            2.0,
            50.0 / 3.0,
            2.0 / 3.0,
            0.6,
            0.8,
            0.8,
            -0.6,
            25.0 / 26.0,
            1.0 / 26.0,
        ];
        assert_eq!(is.len(), should.len());
        for (is, should) in is.iter().zip(should) {
            assert!(close(*is, should, 1e-14), "{is} should be {should}");
        }
    }

    #[test]
    fn the_model_takes_all_laps_of_all_clusters() {
        let all = laps(3, 9, 4, 4);
        let parts = [
            cluster("a", &all.rows(0, 2).into_owned()),
            cluster("b", &all.rows(2, 7).into_owned()),
        ];
        assert_eq!(
            Pdm::fit(&parts).unwrap(),
            Pdm::fit([&cluster("all", &all)]).unwrap()
        );
    }

    #[test]
    fn what_cannot_be_fitted_or_projected_says_why() {
        let [one, two] = [
            cluster("one", &laps(1, 1, 3, 1)),
            cluster("two", &laps(1, 4, 2, 2)),
        ];
        let refusal = |clusters: &[&Cluster]| Pdm::fit(clusters.iter().copied()).unwrap_err().to_string();
        assert_eq!(
            refusal(&[]),
            "`the model` has 0 laps of 0 gates: at least one of each is needed"
        );
        assert_eq!(
            refusal(&[&one]),
            "`one` has 1 lap: 3 modes or gates need at least 1 laps each and 2 together; give more laps or compare in fewer modes"
        );
        assert_eq!(refusal(&[&one, &two]), "`two` has 2 coordinates, `one` has 3");
        let same = Cluster::new("same", &vec![vec![0.1, 0.7]; 20]).unwrap();
        assert_eq!(
            refusal(&[&same]),
            "all 20 laps are the same: there is no mode to compare them in"
        );

        let pdm = Pdm::fit([&two]).unwrap();
        let refusal = |laps, modes| pdm.project(laps, modes).unwrap_err().to_string();
        assert_eq!(
            refusal(&one, Modes::All),
            "`one` has 3 coordinates, `the model` has 2"
        );
        assert_eq!(
            refusal(&two, Modes::First(3)),
            "3 modes wanted, from 1 to 2 are available"
        );
        assert_eq!(
            refusal(&two, Modes::First(0)),
            "0 modes wanted, from 1 to 2 are available"
        );
        assert_eq!(
            pdm.reconstruct(&[0.0; 3]),
            Err(Error::Modes {
                wanted: 3,
                available: 2
            })
        );
        assert_eq!(pdm.reconstruct(&[]).unwrap(), pdm.mean());
    }

    #[test]
    fn twenty_laps_of_a_hundred_gates_have_nineteen_modes() {
        for (count, gates, most) in [
            (20, 100, 19),
            (100, 20, 20),
            (160, 100, 100),
            (2, 5, 1),
            (5, 1, 1),
        ] {
            let pdm = Pdm::fit([&cluster("a", &laps(7, count, gates, gates))]).unwrap();
            assert_eq!(pdm.degrees_of_freedom(), most, "{count} laps of {gates} gates");
        }
    }

    #[test]
    fn the_projection_has_no_covariance_between_modes() {
        let all = cluster("a", &laps(5, 30, 6, 6));
        let pdm = Pdm::fit([&all]).unwrap();
        let points = pdm.project(&all, Modes::default()).unwrap();
        let should = DMatrix::from_diagonal(&DVector::from_column_slice(&pdm.eigenvalues()[..2]));
        let off = largest(points.covariance().unwrap() - &should) / should.amax();
        assert!(off < 1e-13, "{off}");
    }

    proptest! {
        #[test]
        fn with_all_modes_the_way_there_and_back_gives_the_laps(
            seed in 0..1_000_000_u64, count in 2..25_usize, gates in 1..25_usize
        ) {
            let all = cluster("a", &laps(seed, count, gates, gates));
            let pdm = Pdm::fit([&all]).unwrap();
            let points = pdm.project(&all, Modes::All).unwrap();
            for (lap, point) in all.laps().row_iter().zip(points.points().row_iter()) {
                let point: Vec<_> = point.iter().copied().collect();
                let back = pdm.reconstruct(&point).unwrap();
                let off = lap.iter().zip(back).map(|(lap, back)| (lap - back).abs()).fold(0.0, f64::max);
                prop_assert!(off < 1e-11, "{off}");
            }
        }

        #[test]
        fn modes_are_orthonormal_and_share_out_the_variance(
            seed in 0..1_000_000_u64, count in 2..25_usize, gates in 1..25_usize, factors in 1..6_usize
        ) {
            let laps = laps(seed, count, gates, factors);
            let pdm = Pdm::fit([&cluster("a", &laps)]).unwrap();
            let rank = pdm.degrees_of_freedom();
            prop_assert_eq!(rank, factors.min(gates).min(count - 1));
            let square = pdm.modes().tr_mul(pdm.modes());
            let off = largest(square - DMatrix::identity(rank, rank));
            prop_assert!(off < 1e-12, "{off}");
            prop_assert!((pdm.explained().iter().sum::<f64>() - 1.0).abs() < 1e-14);
            prop_assert!(pdm.eigenvalues().is_sorted_by(|a, b| a >= b));
            let centred = centred(&laps);
            let covariance = centred.tr_mul(&centred) / (count - 1) as f64; // eq. 2 as it stands
            let values = DMatrix::from_diagonal(&DVector::from_column_slice(pdm.eigenvalues()));
            let off = largest(&covariance - pdm.modes() * values * pdm.modes().transpose());
            prop_assert!(off <= 1e-12 * covariance.amax().max(1.0), "{off}");
        }

        #[test]
        fn the_largest_component_of_a_mode_is_positive(seed in 0..1_000_000_u64) {
            let pdm = Pdm::fit([&cluster("a", &laps(seed, 12, 7, 7))]).unwrap();
            for mode in pdm.modes().column_iter() {
                prop_assert!(mode.amax() == mode.max());
            }
        }
    }
}
