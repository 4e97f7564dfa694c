//! Nonlinear least squares.

use nalgebra::{DMatrix, DVector};

/// A minimum of a sum of squares.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Minimum {
    pub(crate) parameters: DVector<f64>,
    /// Sum of squared residuals there.
    pub(crate) squares: f64,
    /// (J^T J)^-1 there: the parameters' covariance in units of the residual variance; `None` where it is singular.
    pub(crate) covariance: Option<DMatrix<f64>>,
}

/// The minimum near `start` by Levenberg and Marquardt's method (Marquardt 1963, scaled diagonal). `model` returns the
/// residuals and their Jacobian (residuals x parameters).
pub(crate) fn minimise(
    start: DVector<f64>,
    model: impl Fn(&DVector<f64>) -> (DVector<f64>, DMatrix<f64>),
) -> Minimum {
    const MOST_STEPS: usize = 500;
    let mut parameters = start;
    let (mut residuals, mut jacobian) = model(&parameters);
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&residuals);
        let mut damped = normal.clone();
        for i in 0..normal.nrows() {
            damped[(i, i)] += damping * normal[(i, i)].max(1e-12);
        }
        let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else {
            break;
        };
        let trial = &parameters - &step;
        let (trial_residuals, trial_jacobian) = model(&trial);
        // Written so that a NaN is no improvement.
        if trial_residuals.norm_squared() <= residuals.norm_squared() {
            let small = step.norm() <= 1e-12 * (1.0 + parameters.norm());
            (parameters, residuals, jacobian) = (trial, trial_residuals, trial_jacobian);
            damping = (damping * 0.2).max(1e-15);
            if small {
                break;
            }
        } else {
            damping *= 4.0;
            if damping > 1e15 {
                break;
            }
        }
    }
    let covariance = jacobian
        .tr_mul(&jacobian)
        .cholesky()
        .map(|factor| factor.inverse());
    Minimum {
        squares: residuals.norm_squared(),
        parameters,
        covariance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_by_hand() {
        // y = 1, 3, 4 at x = 0, 1, 2: slope 1.5, intercept 7/6, squares 1/6.
        let (xs, ys) = ([0.0, 1.0, 2.0], [1.0, 3.0, 4.0]);
        let minimum = minimise(DVector::from_vec(vec![0.0, 0.0]), |p| {
            (
                DVector::from_iterator(3, (0..3).map(|i| p[0] + p[1] * xs[i] - ys[i])),
                DMatrix::from_fn(3, 2, |i, j| if j == 0 { 1.0 } else { xs[i] }),
            )
        });
        assert!((minimum.parameters[0] - 7.0 / 6.0).abs() < 1e-9);
        assert!((minimum.parameters[1] - 1.5).abs() < 1e-9);
        assert!((minimum.squares - 1.0 / 6.0).abs() < 1e-9);
        let covariance = minimum.covariance.unwrap();
        assert!((covariance[(1, 1)] - 0.5).abs() < 1e-9);
    }
}
