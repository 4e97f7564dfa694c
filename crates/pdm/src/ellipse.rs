//! The ellipse that stands for a cluster in a drawing.

use crate::{Error, Projection};

/// An ellipse in the plane of the first two modes, in the unit of the laps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// The mean point.
    pub centre: [f64; 2],
    /// The half axes, the longer one first, not negative.
    pub semi_axes: [f64; 2],
    /// The direction of the longer axis from the first mode to the second, in (-pi/2, pi/2].
    pub angle_rad: f64,
}

impl Ellipse {
    /// What it encloses, in the square of the laps' unit.
    #[must_use]
    pub fn area(&self) -> f64 {
        std::f64::consts::PI * self.semi_axes[0] * self.semi_axes[1]
    }
}

/// The points at Mahalanobis distance `sigmas` from the cluster in its first two modes (eq. 6).
///
/// Of a Gaussian cluster the share `1 - exp(-sigmas^2 / 2)` lies inside. A cluster that stands still gives a point.
///
/// # Errors
/// [`Error::Modes`] for a projection in one mode, [`Error::TooFewLaps`] for a single lap, [`Error::Sigmas`] for `sigmas`
/// that is not positive.
///
/// ```
/// let cross = [vec![-3.0, 0.0], vec![3.0, 0.0], vec![0.0, -1.0], vec![0.0, 1.0]];
/// let ellipse = pdm::covariance_ellipse(&pdm::Projection::new("cross", &cross)?, 1.0)?;
/// assert!((ellipse.semi_axes[0] - 6_f64.sqrt()).abs() < 1e-12); // variance 18 / 3
/// # Ok::<(), pdm::Error>(())
/// ```
pub fn covariance_ellipse(projection: &Projection, sigmas: f64) -> Result<Ellipse, Error> {
    let available = projection.points().ncols();
    if available < 2 {
        return Err(Error::Modes { wanted: 2, available });
    }
    if !sigmas.is_finite() || sigmas <= 0.0 {
        return Err(Error::Sigmas { sigmas });
    }
    let covariance = projection.covariance()?;
    let (xx, yy, xy) = (covariance[(0, 0)], covariance[(1, 1)], covariance[(0, 1)]);
    let middle = (xx + yy) / 2.0;
    let spread = ((xx - yy) / 2.0).hypot(xy);
    let half_axis = |variance: f64| sigmas * variance.max(0.0).sqrt(); // rounding may leave it below zero
    let mean = projection.row_mean();
    Ok(Ellipse {
        centre: [mean[0], mean[1]],
        semi_axes: [half_axis(middle + spread), half_axis(middle - spread)],
        angle_rad: 0.5 * (2.0 * xy).atan2(xx - yy),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_cross_gives_a_turned_ellipse() {
        for angle_rad in [-1.2_f64, -0.4, 0.0, 0.7, 1.5] {
            let (sin, cos) = angle_rad.sin_cos();
            let at = |along: f64, across: f64| {
                vec![
                    5.0 + cos * along - sin * across,
                    -2.0 + sin * along + cos * across,
                    9.0,
                ]
            };
            let cross = [at(-3.0, 0.0), at(3.0, 0.0), at(0.0, -1.0), at(0.0, 1.0)];
            let cross = Projection::new("cross", &cross).unwrap();
            let ellipse = covariance_ellipse(&cross, 2.0).unwrap();
            let expected = [
                5.0,
                -2.0,
                2.0 * 6_f64.sqrt(),
                2.0 * (2_f64 / 3.0).sqrt(),
                angle_rad,
            ];
            let [x, y] = ellipse.centre;
            let [long, short] = ellipse.semi_axes;
            for (is, should) in [x, y, long, short, ellipse.angle_rad].iter().zip(expected) {
                assert!((is - should).abs() < 1e-12, "{is} should be {should}");
            }
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let line = Projection::new("line", &[vec![1.0], vec![2.0]]).unwrap();
        assert_eq!(
            covariance_ellipse(&line, 1.0),
            Err(Error::Modes {
                wanted: 2,
                available: 1
            })
        );
        let point = Projection::new("point", &[vec![1.0, 2.0]]).unwrap();
        let refusal = covariance_ellipse(&point, 1.0).unwrap_err().to_string();
        assert_eq!(
            refusal,
            "`point` has 1 lap: 1 modes or gates need at least 2 laps each and 2 together; give more laps or compare in fewer modes"
        );
        let still = Projection::new("still", &[vec![1.0, 2.0], vec![1.0, 2.0]]).unwrap();
        assert_eq!(covariance_ellipse(&still, 1.0).unwrap().semi_axes, [0.0, 0.0]);
        assert_eq!(
            covariance_ellipse(&still, 0.0),
            Err(Error::Sigmas { sigmas: 0.0 })
        );
    }
}
