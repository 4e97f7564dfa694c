//! The upper tail of the standard normal distribution and its density, from a table: a filter asks for them several times a reading.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::LazyLock;

use statrs::function::erf::erfc;

/// P(X > z) of a standard normal X, and its density times sqrt(2 pi), exp(-z^2 / 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tail {
    pub(super) beyond: f64,
    pub(super) density: f64,
}

/// Standard deviations to either side of 0 that the table reaches: beyond them lies less than 1e-18.
const REACH: f64 = 9.0;
/// Nodes of the table per standard deviation.
const NODES: f64 = 32.0;

static TABLE: LazyLock<Vec<Tail>> = LazyLock::new(|| {
    let at = |node: usize| {
        let z = node as f64 / NODES - REACH;
        Tail {
            beyond: 0.5 * erfc(z * FRAC_1_SQRT_2),
            density: (-0.5 * z * z).exp(),
        }
    };
    (0..=(2.0 * REACH * NODES) as usize).map(at).collect()
});

impl Tail {
    /// From the nearest node by the Taylor series of the density, in Hermite's polynomials, and its integral (Abramowitz and Stegun 26.2.32):
    /// within a relative 1e-9.
    #[inline]
    pub(super) fn at(z: f64) -> Self {
        if z.abs() > REACH {
            return Self {
                beyond: if z > 0.0 { 0.0 } else { 1.0 },
                density: 0.0,
            };
        }
        let node = ((z + REACH) * NODES).round();
        let Some(&Self { beyond, density }) = TABLE.get(node as usize) else {
            // Not a number.
            return Self {
                beyond: z,
                density: z,
            };
        };
        let z0 = node / NODES - REACH;
        let d = z - z0;
        let square = z0 * z0;
        let second = square - 1.0;
        let third = z0 * (square - 3.0);
        let fourth = square * (square - 6.0) + 3.0;
        let fifth = z0 * (square * (square - 10.0) + 15.0);
        let integral = 1.0
            + d * (-z0 / 2.0
                + d * (second / 6.0 + d * (-third / 24.0 + d * (fourth / 120.0 - d * fifth / 720.0))));
        // exp(-z^2 / 2) = exp(-z0^2 / 2) exp(u).
        let u = -d * (z0 + 0.5 * d);
        let series =
            1.0 + u * (1.0 + u / 2.0 * (1.0 + u / 3.0 * (1.0 + u / 4.0 * (1.0 + u / 5.0 * (1.0 + u / 6.0)))));
        Self {
            beyond: beyond - density / TAU.sqrt() * d * integral,
            density: density * series,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_the_error_function_s() {
        for i in -90_000..=90_000 {
            let z = f64::from(i) * 1e-4;
            let tail = Tail::at(z);
            let density = (-0.5 * z * z).exp();
            let beyond = 0.5 * erfc(z * FRAC_1_SQRT_2);
            assert!((tail.density / density - 1.0).abs() < 1e-9, "{z}");
            assert!((tail.beyond - beyond).abs() < 1e-9 * beyond, "{z}");
        }
    }

    #[test]
    fn far_off_there_is_nothing_or_all() {
        assert_eq!((Tail::at(40.0).beyond, Tail::at(40.0).density), (0.0, 0.0));
        assert_eq!((Tail::at(-40.0).beyond, Tail::at(-40.0).density), (1.0, 0.0));
        assert!(Tail::at(f64::NAN).beyond.is_nan());
    }
}
