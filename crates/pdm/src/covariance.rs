//! Scatter, what counts as no variance, and solving with a covariance.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A pivot of the correlation matrix below this counts as zero. It is `1 - r^2` of one coordinate given those before
/// it, and rounding leaves about `eps` times the number of coordinates (2e-14 for a hundred).
const SINGULAR_PIVOT: f64 = 1e-12;

/// The rows of `points` without their mean.
pub(crate) fn centred(points: &DMatrix<f64>) -> DMatrix<f64> {
    let mean = points.row_mean();
    DMatrix::from_fn(points.nrows(), points.ncols(), |row, column| {
        points[(row, column)] - mean[column]
    })
}

/// The sum of squares and products about the mean, one term of eq. 7.
pub(crate) fn scatter(points: &DMatrix<f64>) -> DMatrix<f64> {
    let centred = centred(points);
    centred.tr_mul(&centred)
}

/// The singular value of the centred matrix below which it is rounding: `max(K, N) * eps` times the norm of the
/// matrix *before* centring, because that is where the rounding comes from.
pub(crate) fn zero_singular_value(points: &DMatrix<f64>) -> f64 {
    points.nrows().max(points.ncols()) as f64 * f64::EPSILON * points.norm()
}

/// The variance below which the rows of `points` stand still.
pub(crate) fn zero_variance(points: &DMatrix<f64>) -> f64 {
    zero_singular_value(points).powi(2) / points.nrows().saturating_sub(1).max(1) as f64
}

/// A covariance ready to measure with: standard deviations and the Cholesky factor of the correlation matrix, which,
/// unlike that of the covariance, tells singular from badly scaled.
pub(crate) struct Metric {
    deviations: DVector<f64>,
    correlation: Cholesky<f64, Dyn>,
}

impl Metric {
    /// The metric of `covariance`, or nothing where that is singular.
    pub(crate) fn new(covariance: &DMatrix<f64>, zero_variance: f64) -> Option<Self> {
        let variances = covariance.diagonal();
        if variances.iter().any(|&variance| variance <= zero_variance) {
            return None;
        }
        let deviations = variances.map(f64::sqrt);
        let correlation = covariance.map_with_location(|i, j, value| value / (deviations[i] * deviations[j]));
        let correlation = Cholesky::new(correlation)?;
        let regular = correlation
            .l_dirty()
            .diagonal()
            .iter()
            .all(|pivot| pivot * pivot > SINGULAR_PIVOT);
        regular.then_some(Self {
            deviations,
            correlation,
        })
    }

    /// `sqrt(v^T S^-1 v)`, of eqs. 6 and 8.
    pub(crate) fn norm(&self, vector: &DVector<f64>) -> f64 {
        let scaled = vector.component_div(&self.deviations);
        let solved = self.correlation.l_dirty().solve_lower_triangular(&scaled);
        solved
            .expect("the pivots of the factor were checked to be positive")
            .norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_norm_is_that_of_the_inverse_by_hand() {
        let covariance = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 3.0]); // inverse (3 -1; -1 2) / 5
        let metric = Metric::new(&covariance, 0.0).unwrap();
        let norm = metric.norm(&DVector::from_row_slice(&[1.0, 2.0]));
        assert!((norm - (7.0_f64 / 5.0).sqrt()).abs() < 1e-15, "{norm}");
    }

    #[test]
    fn singular_is_told_from_badly_scaled() {
        let scaled = DMatrix::from_row_slice(2, 2, &[1e12, 0.5, 0.5, 1e-12]);
        assert!(Metric::new(&scaled, 0.0).is_some());
        let singular = DMatrix::from_row_slice(2, 2, &[1e12, 1.0, 1.0, 1e-12]);
        assert!(Metric::new(&singular, 0.0).is_none());
        let still = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1e-12]);
        assert!(Metric::new(&still, 1e-12).is_none());
    }

    #[test]
    fn equal_rows_do_not_vary_although_their_mean_is_rounded() {
        let points = DMatrix::from_element(20, 3, 0.1);
        assert!(scatter(&points)[(0, 0)] / 19.0 <= zero_variance(&points));
    }
}
