//! How differently two clusters spread.

use crate::{Error, Projection};

/// How far the covariances of two clusters are apart: `sqrt(sum_r ln^2 l_r)` over the generalised eigenvalues `l_r` of
/// the one with respect to the other.
///
/// It is 0 for equal covariances, the same either way round and under every invertible linear map of the modes; twice
/// the spread in one of the modes gives `ln 4` (Forstner and Moonen, "A metric for covariance matrices", 1999).
///
/// # Errors
/// [`Error::Dimension`] for projections with different numbers of modes, [`Error::TooFewLaps`] where a cluster does not
/// have more laps than modes, [`Error::SingularCovariance`] where one does not vary in some direction.
///
/// ```
/// let x = pdm::Projection::new("x", &[vec![-1.0], vec![1.0]])?;
/// let y = pdm::Projection::new("y", &[vec![4.0], vec![8.0]])?;
/// assert!((pdm::covariance_contrast(&x, &y)? - 4_f64.ln()).abs() < 1e-12); // variances 2 and 8
/// # Ok::<(), pdm::Error>(())
/// ```
pub fn covariance_contrast(x: &Projection, y: &Projection) -> Result<f64, Error> {
    let modes = x.points().ncols();
    if y.points().ncols() != modes {
        return Err(Error::Dimension {
            name: y.name().to_owned(),
            dimension: y.points().ncols(),
            other: x.name().to_owned(),
            expected: modes,
        });
    }
    x.carries(modes)?;
    y.carries(modes)?;
    let singular = |cluster: &Projection| Error::SingularCovariance {
        clusters: vec![cluster.name().to_owned()],
        modes,
    };
    // In coordinates where the first covariance is the unit matrix, the eigenvalues of the second.
    let factor = x.covariance()?.cholesky().ok_or_else(|| singular(x))?;
    let half = factor.l().solve_lower_triangular(&y.covariance()?);
    let half = half.ok_or_else(|| singular(x))?.transpose();
    let whole = factor.l().solve_lower_triangular(&half);
    let ratios = whole.ok_or_else(|| singular(x))?.symmetric_eigenvalues();
    if ratios.iter().any(|&ratio| ratio <= 0.0) {
        return Err(singular(y));
    }
    Ok(ratios.iter().map(|ratio| ratio.ln().powi(2)).sum::<f64>().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    use crate::samples::gaussian;

    fn projection(points: &DMatrix<f64>) -> Projection {
        let rows: Vec<Vec<f64>> = points
            .row_iter()
            .map(|row| row.iter().copied().collect())
            .collect();
        Projection::new("x", &rows).unwrap()
    }

    #[test]
    fn stretched_axes_count_by_their_logarithms() {
        let cross = |a: f64, b: f64| {
            let rows = [vec![-a, 0.0], vec![a, 0.0], vec![0.0, -b], vec![0.0, b]];
            Projection::new("cross", &rows).unwrap()
        };
        let contrast = covariance_contrast(&cross(1.0, 2.0), &cross(3.0, 1.0)).unwrap();
        let should = (2.0 * 3_f64.ln()).hypot(2.0 * 2_f64.ln());
        assert!((contrast - should).abs() < 1e-12, "{contrast} should be {should}");
    }

    #[test]
    fn it_is_symmetric_and_survives_a_linear_map() {
        let (x, y, map) = (gaussian(1, 20, 3), gaussian(2, 30, 3), gaussian(3, 3, 3));
        let one = covariance_contrast(&projection(&x), &projection(&y)).unwrap();
        let back = covariance_contrast(&projection(&y), &projection(&x)).unwrap();
        let mapped = covariance_contrast(&projection(&(&x * &map)), &projection(&(&y * &map))).unwrap();
        assert!(
            one > 0.1 && (one - back).abs() < 1e-10 && (one - mapped).abs() < 1e-9,
            "{one} {back} {mapped}"
        );
        assert!(covariance_contrast(&projection(&x), &projection(&x)).unwrap() < 1e-7);
    }

    #[test]
    fn what_does_not_vary_is_refused() {
        let (x, line) = (gaussian(1, 20, 2), DMatrix::from_fn(9, 2, |row, _| row as f64));
        for (a, b) in [(&x, &line), (&line, &x)] {
            let refusal = covariance_contrast(&projection(a), &projection(b));
            assert!(refusal.is_err() || refusal.unwrap() > 20.0); // rounding may leave a sliver of variance
        }
        let few = Projection::new("few", &[vec![1.0, 2.0], vec![2.0, 4.5]]).unwrap();
        assert!(matches!(
            covariance_contrast(&projection(&x), &few),
            Err(Error::TooFewLaps { .. })
        ));
    }
}
