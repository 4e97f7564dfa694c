//! A normal variable that is cut at zero.

use statrs::function::erf::erfc;

/// Mean and variance of max(0, X), and the change of that mean with X's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub(crate) mean: f64,
    pub(crate) variance: f64,
    /// Probability that X is not cut, which is d mean / d (mean of X).
    pub(crate) open: f64,
}

/// The moments of a reading that is normal with this mean and standard deviation before it is cut to [0, inf).
#[inline]
pub(crate) fn cut(mean: f64, deviation: f64) -> Cut {
    let z = mean / deviation;
    if z > 6.0 {
        return Cut { mean, variance: deviation * deviation, open: 1.0 };
    }
    let open = 0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    let first = mean * open + deviation * density;
    let second = (mean * mean + deviation * deviation) * open + mean * deviation * density;
    Cut { mean: first, variance: (second - first * first).max(1e-6 * deviation * deviation), open }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_standard_normal_by_hand() {
        let half = cut(0.0, 1.0);
        assert!((half.mean - 1.0 / std::f64::consts::TAU.sqrt()).abs() < 1e-12);
        assert!((half.variance - (0.5 - 1.0 / std::f64::consts::TAU)).abs() < 1e-12);
        assert!((half.open - 0.5).abs() < 1e-12);
    }

    #[test]
    fn slope_is_the_open_share_and_far_above_nothing_is_cut() {
        for mean in [-9.0, 0.0, 4.0, 20.0] {
            let h = 1e-4;
            let slope = (cut(mean + h, 8.0).mean - cut(mean - h, 8.0).mean) / (2.0 * h);
            assert!((slope - cut(mean, 8.0).open).abs() < 1e-7, "{mean}");
        }
        assert_eq!(cut(100.0, 8.0), Cut { mean: 100.0, variance: 64.0, open: 1.0 });
    }
}
