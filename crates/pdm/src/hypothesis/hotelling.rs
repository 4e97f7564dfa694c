//! Hotelling's test: do two Gaussian clusters of one covariance have one mean?

use statrs::function::beta::beta_reg;

use crate::distance::shared_modes;
use crate::{Error, Projection, distance};

/// What Hotelling's two-sample test found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hotelling {
    /// The distance of the clusters (eq. 8).
    pub distance: f64,
    /// Hotelling's `t^2` (eq. 9).
    pub t2: f64,
    /// `t^2` scaled to the F distribution, `t2 (n_x + n_y - modes - 1) / ((n_x + n_y - 2) modes)`.
    pub f: f64,
    /// The number of modes that were compared.
    pub df1: usize,
    /// `n_x + n_y - modes - 1`, at least 1.
    pub df2: usize,
    /// The probability of such a distance or a larger one where the means are one; 0 only below the smallest `f64`.
    pub p: f64,
}

/// The test that two clusters have one mean, exact for Gaussian clusters of one covariance (eq. 9).
///
/// # Errors
/// As [`distance`].
pub fn hotelling(x: &Projection, y: &Projection) -> Result<Hotelling, Error> {
    let modes = shared_modes(x, y)?;
    let distance = distance(x, y)?;
    let (nx, ny) = (x.points().nrows(), y.points().nrows());
    let degrees = (nx + ny - 2) as f64;
    let df2 = nx + ny - modes - 1;
    let t2 = (nx * ny) as f64 / (nx + ny) as f64 * distance * distance; // eq. 9
    Ok(Hotelling {
        distance,
        t2,
        f: t2 * df2 as f64 / (degrees * modes as f64),
        df1: modes,
        df2,
        p: upper_tail(t2 / degrees, modes, df2),
    })
}

/// `P(F > f)` with `ratio = f df1 / df2`, by the incomplete beta function that is small where the tail is, so that far
/// tails keep their digits.
fn upper_tail(ratio: f64, df1: usize, df2: usize) -> f64 {
    beta_reg(df2 as f64 / 2.0, df1 as f64 / 2.0, 1.0 / (1.0 + ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{close, gaussian, projection, shifted};
    use crate::{Cluster, Modes, Pdm};

    #[test]
    fn the_tail_agrees_with_fifty_digits() {
        // mpmath 1.4.1, betainc(df2/2, df1/2, 0, 1/(1+ratio), regularized=True) in 50 digits
        for (ratio, df1, df2, p) in [
            (0.5, 1, 1, 0.608_173_447_969_392_8),
            (3.0, 3, 5, 0.057_668_885_622_437_31),
            (250.0, 38, 2, 0.073_043_281_273_045_41),
            (1e6, 1, 97, 8.080_049_995_491_241e-293),
            (40.0, 10, 380, 1.931_441_521_383_978e-299),
            (1e-3, 5, 60, 0.999_951_278_817_088_3),
            (1e30, 7, 20, 1.4183862686157224e-298),
        ] {
            let is = upper_tail(ratio, df1, df2);
            assert!(close(is, p, 1e-11), "{ratio} {df1} {df2}: {is:e} should be {p:e}");
        }
        assert_eq!(upper_tail(0.0, 2, 7), 1.0);
    }

    #[test]
    fn in_two_modes_the_tail_is_a_power() {
        for ratio in [1e-6, 0.1, 1.0, 20.0, 1000.0] {
            for df2 in [1, 2, 37, 97, 1997] {
                let [is, should] = [upper_tail(ratio, 2, df2), (1.0 + ratio).powf(-0.5 * df2 as f64)];
                assert!(
                    close(is, should, 1e-10),
                    "{ratio} {df2}: {is:e} should be {should:e}"
                );
            }
        }
    }

    #[test]
    fn the_numbers_are_those_computed_by_hand() {
        let square = [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [2.0, 2.0]]; // covariance 4/3 I
        let [x, y] = [("x", 0.0), ("y", 4.0)].map(|(name, right)| {
            let points = square.map(|[x, y]| vec![x + right, y]);
            Projection::new(name, &points).unwrap()
        });
        let test = hotelling(&x, &y).unwrap();
        assert_eq!((test.df1, test.df2), (2, 5));
        let should = [12_f64.sqrt(), 24.0, 10.0, 5_f64.powf(-2.5)];
        for (is, should) in [test.distance, test.t2, test.f, test.p].iter().zip(should) {
            assert!(close(*is, should, 1e-13), "{is} should be {should}");
        }
    }

    #[test]
    fn all_modes_leave_a_degree_of_freedom() {
        let laps =
            |name: &str, seed| Cluster::new(name, &crate::samples::rows(&gaussian(seed, 5, 40))).unwrap();
        let (x, y) = (laps("x", 1), laps("y", 2));
        let pdm = Pdm::fit([&x, &y]).unwrap();
        let [x, y] = [x, y].map(|cluster| pdm.project(&cluster, Modes::All).unwrap());
        let test = hotelling(&x, &y).unwrap();
        assert_eq!((test.df1, test.df2), (8, 1));
        assert!(test.p > 0.0 && test.p <= 1.0, "{test:?}");
    }

    /// The share of 2000 seeded pairs, 12 and 9 laps in 3 modes, in which the means are told apart at 5 %.
    fn rejections(shift: &[f64]) -> usize {
        (0..2000)
            .filter(|seed| {
                let x = projection("x", &gaussian(2 * seed, 12, 3));
                let y = projection("y", &shifted(&gaussian(2 * seed + 1, 9, 3), shift));
                hotelling(&x, &y).unwrap().p <= 0.05
            })
            .count()
    }

    #[test]
    fn one_mean_is_rejected_as_often_as_it_should() {
        // 100 expected; 64..=140 hold 1 - 1e-4 of the binomial distribution: the test's false-alarm rate
        let count = rejections(&[0.0; 3]);
        assert!((64..=140).contains(&count), "{count} of 2000 at 5 %");
    }

    #[test]
    fn two_means_are_told_apart() {
        let count = rejections(&[1.5, 0.0, -1.0]);
        assert!(count >= 1600, "{count} of 2000 at 5 %");
    }
}
