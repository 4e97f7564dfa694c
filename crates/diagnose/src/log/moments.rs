//! A normal variable that is cut at zero and perhaps rounded before.

use super::tail::Tail;

/// Mean and variance of what becomes of X, and the change of that mean with X's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub(crate) mean: f64,
    pub(crate) variance: f64,
    /// d mean / d (mean of X): for a plain cut the probability that X is above it.
    pub(crate) open: f64,
}

/// The moments of a reading that is normal with this mean and standard deviation before it is rounded to multiples of
/// `step` and cut to [0, inf). What is sure has a variance of `declared` ones all the same, by the declared
/// model's standard deviation: one that followed the candidate's would make quiet readings likelier where all are 0.
#[inline]
pub(crate) fn cut(mean: f64, deviation: f64, step: f64, declared: f64) -> Cut {
    /// Variance of a reading that is surely 0, in units of the declared one's: it is then about twice as likely, like
    /// its probability, as one that is 0 half of the time, and one that is not 0 after all is no proof of the contrary.
    const SHUT: f64 = 0.16;
    if step >= FINE * deviation && step > 0.0 {
        return rounded(mean, deviation, step, declared);
    }
    let deviation = blurred(deviation, step);
    let z = mean / deviation;
    if z > 6.0 {
        return Cut {
            mean,
            variance: deviation * deviation,
            open: 1.0,
        };
    }
    // Most sensors see no wall.
    let (open, density) = if z == 0.0 {
        (0.5, 1.0 / std::f64::consts::TAU.sqrt())
    } else {
        let Tail { beyond, density } = Tail::at(-z);
        (beyond, density / std::f64::consts::TAU.sqrt())
    };
    let first = mean * open + deviation * density;
    let second = (mean * mean + deviation * deviation) * open + mean * deviation * density;
    let shut = (1.0 - 2.0 * open).max(0.0);
    Cut {
        mean: first,
        variance: (1.0 - shut) * (second - first * first) + shut * SHUT * declared * declared,
        open,
    }
}

/// A number's part of a likelihood: its density, or the probability of a value that many have, times sqrt(2 pi), as a factor and the
/// square in an exponential's exponent of -square / 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Likelihood {
    pub(crate) factor: f64,
    pub(crate) square: f64,
}

impl Likelihood {
    pub(crate) const ONE: Self = Self {
        factor: 1.0,
        square: 0.0,
    };

    /// Both numbers'.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            factor: self.factor * other.factor,
            square: self.square + other.square,
        }
    }

    pub(crate) fn ln(self) -> f64 {
        self.factor.ln() - 0.5 * self.square
    }
}

/// The likelihood of a reading that is normal with this mean and standard deviation before it is cut to [0, inf) (Tobin 1958) and
/// rounded to multiples of a step that is [`FINE`]: what is less than half of it is 0. That of the moments in its
/// place is no longer greatest at the truth where most readings are 0.
#[inline]
pub(crate) fn likelihood_of_cut(reading: f64, mean: f64, deviation: f64, step: f64) -> Likelihood {
    /// Standard deviations below 0 from where on a mean is as good as any lower one: a reading that is not 0 after all is no
    /// proof of the contrary.
    const SHUT: f64 = 3.0;
    /// Standard deviations above 0 from where on the tail is a series.
    const FAR: f64 = 8.0;
    let deviation = blurred(deviation, step);
    let mean = mean.max(-SHUT * deviation);
    if reading > 0.0 {
        let z = (reading - mean) / deviation;
        return Likelihood {
            factor: 1.0 / deviation,
            square: z * z,
        };
    }
    let z = (mean - 0.5 * step) / deviation;
    if z > FAR {
        // The tail's density over z: it is less than any number soon (Abramowitz and Stegun 26.2.12).
        let per_square = 1.0 / (z * z);
        return Likelihood {
            factor: (1.0 - per_square * (1.0 - 3.0 * per_square * (1.0 - 5.0 * per_square))) / z,
            square: z * z,
        };
    }
    Likelihood {
        factor: Tail::at(z).beyond * std::f64::consts::TAU.sqrt(),
        square: 0.0,
    }
}

/// A standard deviation with that of rounding to a fine step, which is as good as noise (Sheppard's correction).
#[inline]
fn blurred(deviation: f64, step: f64) -> f64 {
    (deviation * deviation + step * step / 12.0).sqrt()
}

/// Step, as a share of the standard deviation, below which rounding is as good as noise.
pub(crate) const FINE: f64 = 0.5;

/// The moments of [`cut`] for multiples k of a step, by the probabilities of reaching each.
fn rounded(mean: f64, deviation: f64, step: f64, declared: f64) -> Cut {
    let sure = (((mean - 7.0 * deviation) / step).floor().max(0.0)) as usize;
    let most = (((mean + 7.0 * deviation) / step).ceil().max(0.0)) as usize + 1;
    let (mut first, mut second, mut open) = (0.0, 0.0, 0.0);
    for k in sure + 1..=most {
        let z = ((k as f64 - 0.5) * step - mean) / deviation;
        let Tail { beyond, density } = Tail::at(z);
        first += beyond;
        // About the multiple that is surely reached: k^2 - (k - 1)^2 of it.
        second += (2.0 * (k - sure) as f64 - 1.0) * beyond;
        open += density;
    }
    Cut {
        mean: step * (sure as f64 + first),
        variance: (step * step * (second - first * first)).max(0.01 * declared * declared),
        open: open * step / (deviation * std::f64::consts::TAU.sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_standard_normal_by_hand() {
        let half = cut(0.0, 1.0, 0.0, 1.0);
        assert!((half.mean - 1.0 / std::f64::consts::TAU.sqrt()).abs() < 1e-12);
        assert!((half.variance - (0.5 - 1.0 / std::f64::consts::TAU)).abs() < 1e-12);
        assert!((half.open - 0.5).abs() < 1e-12);
        // Surely 0; a count more or less is no proof of the contrary.
        let shut = cut(-9.0, 1.0, 0.0, 1.0);
        assert!(
            shut.mean < 1e-9 && shut.variance > 0.1 && shut.open < 1e-9,
            "{shut:?}"
        );
    }

    #[test]
    fn a_likelihood_of_cut_readings_sums_to_one_and_is_greatest_at_the_truth() {
        const DEVIATION: f64 = 8.0;
        const STEP: f64 = 1e-3;
        let density = |reading: f64, mean: f64| {
            likelihood_of_cut(reading, mean, DEVIATION, STEP).ln().exp() / std::f64::consts::TAU.sqrt()
        };
        // What is expected, over readings that have one mean, of something that depends on them.
        let expected = |mean: f64, of: &dyn Fn(f64) -> f64| {
            let above = (1..80_000).map(|i| f64::from(i) * STEP);
            density(0.0, mean) * of(0.0) + above.map(|y| STEP * density(y, mean) * of(y)).sum::<f64>()
        };
        for mean in [-20.0, -8.0, 0.0, 13.0] {
            assert!((expected(mean, &|_| 1.0) - 1.0).abs() < 1e-6, "{mean}");
            let at = |guess: f64| expected(mean, &|y| likelihood_of_cut(y, guess, DEVIATION, STEP).ln());
            let slope = (at(mean + 0.01) - at(mean - 0.01)) / 0.02;
            assert!(slope.abs() < 1e-6, "{mean}: {slope}");
        }
    }

    #[test]
    fn a_zero_is_the_less_likely_the_farther_off_it_is() {
        let ln = |z: f64| likelihood_of_cut(0.0, z, 1.0, 0.0).ln();
        // On both sides of where the series begins it is the tail of a normal distribution.
        assert!((ln(8.0) - ln(8.0 + 1e-9)).abs() < 1e-5);
        for (z, next) in (0..1000).map(|i| (0.1 * f64::from(i), 0.1 * f64::from(i + 1))) {
            assert!(ln(next) < ln(z) && ln(next).is_finite(), "{z}");
        }
        // Its slope is that of -z^2/2 - ln z.
        assert!((ln(60.0) - ln(59.0) + 59.5 + (60.0_f64 / 59.0).ln()).abs() < 1e-4);
    }

    #[test]
    fn quiet_readings_are_no_likelier_where_all_are_zero() {
        for step in [0.0, 40.0] {
            let of = |deviation| cut(-27.0, deviation, step, 4.0).variance;
            assert!((of(1.0) / of(4.0) - 1.0).abs() < 1e-6, "{step}");
        }
        // Where half of them are, they are.
        let open = |deviation: f64| cut(0.0, deviation, 0.0, 4.0).variance;
        assert!((open(2.0) / open(4.0) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn slope_is_the_open_share_and_far_above_nothing_is_cut() {
        for (mean, step) in [
            (-9.0, 0.0),
            (0.0, 0.0),
            (4.0, 0.0),
            (20.0, 0.0),
            (30.0, 20.0),
            (100.0, 35.0),
        ] {
            let h = 1e-4;
            let slope = (cut(mean + h, 8.0, step, 8.0).mean - cut(mean - h, 8.0, step, 8.0).mean) / (2.0 * h);
            assert!(
                (slope - cut(mean, 8.0, step, 8.0).open).abs() < 1e-6,
                "{mean} {step}"
            );
        }
        assert_eq!(
            cut(100.0, 8.0, 0.0, 8.0),
            Cut {
                mean: 100.0,
                variance: 64.0,
                open: 1.0
            }
        );
    }

    #[test]
    fn a_coarse_step_is_a_coin() {
        // Half way between two multiples, with little noise: either, with equal chance.
        let coin = cut(150.0, 5.0, 100.0, 5.0);
        assert!((coin.mean - 150.0).abs() < 1e-9 && (coin.variance - 2500.0).abs() < 1e-6);
    }
}
