//! Infra-red proximity sensors: where they sit, what they answer to a distance, how much they vary.

use track::Vec2;

use crate::Error;
use crate::cast::LANES;

/// The readings of S0 to S7, ADC counts.
pub type Readings = [f64; LANES];

/// Place and direction of a sensor on the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Where the ray starts, in the body frame (x forward, y left), m.
    pub position: Vec2,
    /// Where the ray goes, counter-clockwise from straight ahead, rad.
    pub angle_rad: f64,
}

impl Mount {
    /// Unit vector along its ray, in the body frame.
    pub(crate) fn axis(&self) -> Vec2 {
        Vec2::new(self.angle_rad.cos(), self.angle_rad.sin())
    }
}

/// Reading against distance, before noise.
#[derive(Debug, Clone, PartialEq)]
pub enum Response {
    /// a / (1 + (d / d0)^p): the improved model of Fig. 8.
    Improved {
        /// Reading at no distance, counts.
        a_counts: f64,
        /// Distance at which half of it is left, m.
        d0_m: f64,
        /// Exponent.
        exponent: f64,
    },
    /// Straight between the rows of a table of (distance m, reading counts), held at its ends: the original model of Fig. 8.
    Table(Vec<[f64; 2]>),
}

impl Response {
    /// The reading at a distance in metres, counts.
    ///
    /// ```
    /// use sim::Response;
    /// let original = Response::Table(vec![[0.0, 3800.0], [0.1, 300.0]]);
    /// assert_eq!(original.reading(0.05), 2050.0);
    /// ```
    pub fn reading(&self, distance_m: f64) -> f64 {
        match self {
            Self::Improved {
                a_counts,
                d0_m,
                exponent,
            } => a_counts / (1.0 + power(distance_m * (1.0 / d0_m), *exponent)),
            Self::Table(rows) => interpolate(rows, [distance_m])[0],
        }
    }

    /// The readings at eight distances, counts: bit for bit those of [`Response::reading`], computed together.
    #[inline]
    pub fn readings(&self, distances_m: &[f64; LANES]) -> Readings {
        match self {
            Self::Improved {
                a_counts,
                d0_m,
                exponent,
            } => {
                let per_m = 1.0 / d0_m;
                distances_m.map(|d| a_counts / (1.0 + power(d * per_m, *exponent)))
            }
            Self::Table(rows) => interpolate(rows, *distances_m),
        }
    }

    /// The response taken at `factor` times the distance.
    pub fn at_scaled_distance(&self, factor: f64) -> Self {
        match self {
            Self::Improved {
                a_counts,
                d0_m,
                exponent,
            } => Self::Improved {
                a_counts: *a_counts,
                d0_m: d0_m / factor,
                exponent: *exponent,
            },
            Self::Table(rows) => {
                Self::Table(rows.iter().map(|[d, reading]| [d / factor, *reading]).collect())
            }
        }
    }

    /// The response with its exponent times `factor`; a table has none and stays.
    pub fn with_scaled_exponent(&self, factor: f64) -> Self {
        match self {
            Self::Improved {
                a_counts,
                d0_m,
                exponent,
            } => Self::Improved {
                a_counts: *a_counts,
                d0_m: *d0_m,
                exponent: exponent * factor,
            },
            Self::Table(_) => self.clone(),
        }
    }
}

/// x^p for x >= 0, within 1e-13 of it: 2^(p log2 x). Written without branches and library calls, so that eight of them
/// fill the processor's lanes and every machine computes the same bits; short chains, because the robot waits for it.
#[inline(always)]
pub(crate) fn power(x: f64, p: f64) -> f64 {
    let value = exp2(
        p * log2(if x > f64::MIN_POSITIVE {
            x
        } else {
            f64::MIN_POSITIVE
        }),
    );
    if x > 0.0 || p == 0.0 { value } else { 0.0 }
}

/// The binary logarithm of a normal positive number x = 2^k m, m between sqrt(1/2) and sqrt(2): k plus the series of
/// log2 m = 2/ln 2 artanh s, s = (m - 1)/(m + 1), whose remainder is below 1e-15 s.
#[inline(always)]
fn log2(x: f64) -> f64 {
    const C: [f64; 9] = artanh_coefficients();
    const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    const FRACTION: u64 = 0x000f_ffff_ffff_ffff;
    const TWO_52: u64 = 0x4330_0000_0000_0000;
    let bits = x.to_bits() + (ONE - SQRT_HALF);
    let exponent = f64::from_bits((bits >> 52) | TWO_52) - (4_503_599_627_370_496.0 + 1023.0);
    let m = f64::from_bits((bits & FRACTION) + SQRT_HALF);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (C[0] + z * C[1]) + z2 * (C[2] + z * C[3]);
    let high = (C[4] + z * C[5]) + z2 * (C[6] + z * C[7]);
    exponent + s * (low + z4 * (high + z4 * C[8]))
}

/// 2^x for a number cut to [-1000, 1000]: 2^n times the Taylor series of the rest, whose remainder is below 1e-14.
#[inline(always)]
fn exp2(x: f64) -> f64 {
    const C: [f64; 12] = exp2_coefficients();
    // Adding it rounds to a whole number and leaves that in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52
    let x = if x > -1000.0 { x } else { -1000.0 };
    let x = if x < 1000.0 { x } else { 1000.0 };
    let shifted = x + ROUND;
    let scale = f64::from_bits((shifted.to_bits() + 1023) << 52);
    let r = x - (shifted - ROUND); // in [-1/2, 1/2]
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (C[0] + r * C[1]) + r2 * (C[2] + r * C[3]);
    let middle = (C[4] + r * C[5]) + r2 * (C[6] + r * C[7]);
    let high = (C[8] + r * C[9]) + r2 * (C[10] + r * C[11]);
    scale * (low + r4 * (middle + r4 * high))
}

/// 2 / (ln 2 (2 k + 1)).
const fn artanh_coefficients() -> [f64; 9] {
    let mut c = [0.0; 9];
    let mut k = 0;
    while k < c.len() {
        c[k] = 2.0 * std::f64::consts::LOG2_E / (2 * k + 1) as f64;
        k += 1;
    }
    c
}

/// (ln 2)^k / k!.
const fn exp2_coefficients() -> [f64; 12] {
    let mut c = [1.0; 12];
    let mut k = 1;
    while k < c.len() {
        c[k] = c[k - 1] * std::f64::consts::LN_2 / k as f64;
        k += 1;
    }
    c
}

/// Straight between the rows, held at the ends; all lanes go through all rows.
#[inline]
fn interpolate<const N: usize>(rows: &[[f64; 2]], x: [f64; N]) -> [f64; N] {
    let Some(([_, first], [end, last])) = rows.first().zip(rows.last()) else {
        return [0.0; N];
    };
    let mut y = [*first; N];
    for pair in rows.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        for (y, x) in y.iter_mut().zip(x) {
            *y = if x > x0 {
                y0 + (y1 - y0) * (x - x0) / (x1 - x0)
            } else {
                *y
            };
        }
    }
    for (y, x) in y.iter_mut().zip(x) {
        *y = if x >= *end { *last } else { *y };
    }
    y
}

/// Standard deviation of a reading: sqrt((fraction * reading)^2 + counts^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadingNoise {
    /// Share of the reading.
    pub fraction: f64,
    /// What is there without a reading, counts.
    pub counts: f64,
}

impl ReadingNoise {
    /// The standard deviation of one reading, counts.
    #[inline]
    pub fn deviation(&self, reading: f64) -> f64 {
        let relative = self.fraction * reading;
        (relative * relative + self.counts * self.counts).sqrt()
    }
}

/// How the rays of one sensor become one reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Combine {
    /// Weighted mean of the responses of its rays.
    Responses,
    /// Response of the weighted mean of its distances, as Webots does; a ray that sees no wall counts as the range.
    Distances,
}

/// A sensor's field of view as rays about its axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// Directions from the axis as unit vectors (cos, sin), with their weights, which sum to 1.
    rays: Vec<(Vec2, f64)>,
    /// How the rays become one reading.
    pub combine: Combine,
}

impl Beam {
    /// Rays of a sensor at most: a hundred times as many as make a cone smooth.
    pub const MOST_RAYS: usize = 10_000;

    /// One ray along the axis.
    pub fn single() -> Self {
        Self {
            rays: vec![(Vec2::X, 1.0)],
            combine: Combine::Responses,
        }
    }

    /// `count` rays at equal steps over the cone of `half_angle_rad` to either side of the axis, weighted by
    /// cos(pi/2 * angle / half_angle) at the middle of each ray's share of the cone: full on the axis, nothing at the
    /// edge. One ray, or no angle, is [`Beam::single`].
    ///
    /// # Errors
    /// A count outside [1, [`Self::MOST_RAYS`]], or an angle outside [0, pi/2].
    pub fn cone(count: usize, half_angle_rad: f64, combine: Combine) -> Result<Self, Error> {
        check("sensor.rays", count as f64, 1.0, Self::MOST_RAYS as f64)?;
        check(
            "sensor.half_angle_rad",
            half_angle_rad,
            0.0,
            std::f64::consts::FRAC_PI_2,
        )?;
        if count == 1 || half_angle_rad == 0.0 {
            return Ok(Self::single());
        }
        let share = |i: usize| (2.0 * i as f64 + 1.0) / count as f64 - 1.0; // in (-1, 1)
        let weight = |i: usize| (std::f64::consts::FRAC_PI_2 * share(i)).cos();
        let total: f64 = (0..count).map(weight).sum();
        let ray = |i: usize| {
            let angle = half_angle_rad * share(i);
            (Vec2::new(angle.cos(), angle.sin()), weight(i) / total)
        };
        Ok(Self {
            rays: (0..count).map(ray).collect(),
            combine,
        })
    }

    /// Directions from the axis as (cos, sin) with their weights.
    pub fn rays(&self) -> &[(Vec2, f64)] {
        &self.rays
    }
}

/// Refuses a number outside [low, high], NaN included.
pub(crate) fn check(key: &str, value: f64, low: f64, high: f64) -> Result<(), Error> {
    if value >= low && value <= high {
        Ok(())
    } else {
        Err(Error::OutOfRange {
            key: key.into(),
            value,
            low,
            high,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMPROVED: Response = Response::Improved {
        a_counts: 4202.93,
        d0_m: 0.005_219_53,
        exponent: 1.572_816_92,
    };

    #[test]
    fn improved_response_by_hand() {
        assert_eq!(IMPROVED.reading(0.0), 4202.93);
        assert!((IMPROVED.reading(0.005_219_53) - 0.5 * 4202.93).abs() < 1e-9);
        let far = 4202.93 / (1.0 + (0.05_f64 / 0.005_219_53).powf(1.572_816_92));
        assert!((IMPROVED.reading(0.05) / far - 1.0).abs() < 1e-13);
    }

    #[test]
    fn the_power_is_the_library_s_within_1e_13() {
        for i in 0..4000 {
            let x = 1e-6 * 1.005_f64.powi(i); // to 460
            for p in [0.3, 1.0, 1.572_816_92, 4.0, 20.0] {
                let expected = x.powf(p);
                assert!(
                    (power(x, p) / expected - 1.0).abs() < 1e-13,
                    "{x}^{p}: {} for {expected}",
                    power(x, p)
                );
            }
        }
        assert_eq!(power(0.0, 1.5), 0.0);
        assert_eq!(power(0.0, 0.0), 1.0);
        assert_eq!(power(1.0, 7.0), 1.0);
    }

    #[test]
    fn eight_readings_are_one_reading_eight_times() {
        let table = Response::Table(vec![[0.0, 3800.0], [0.04, 1200.0], [0.1, 300.0]]);
        for response in [IMPROVED, table] {
            let distances = [0.0, 1e-9, 0.003, 0.04, 0.05, 0.0999, 0.1, f64::INFINITY];
            assert_eq!(
                response.readings(&distances),
                distances.map(|d| response.reading(d))
            );
        }
    }

    #[test]
    fn a_table_is_held_at_its_ends() {
        let table = Response::Table(vec![[0.01, 3800.0], [0.04, 1200.0], [0.1, 300.0]]);
        for (d, reading) in [
            (0.0, 3800.0),
            (0.01, 3800.0),
            (0.04, 1200.0),
            (0.07, 750.0),
            (0.1, 300.0),
            (1.0, 300.0),
        ] {
            assert!(
                (table.reading(d) - reading).abs() < 1e-9,
                "{d}: {}",
                table.reading(d)
            );
        }
    }

    #[test]
    fn original_response_is_a_line() {
        let original = Response::Table(vec![[0.0, 3800.0], [0.1, 300.0]]);
        for (d, reading) in [(0.0, 3800.0), (0.1, 300.0), (0.025, 2925.0)] {
            assert!((original.reading(d) - reading).abs() < 1e-9);
        }
    }

    #[test]
    fn scaled_distance_is_the_response_at_the_scaled_distance() {
        for response in [IMPROVED, Response::Table(vec![[0.0, 3800.0], [0.1, 300.0]])] {
            let scaled = response.at_scaled_distance(1.3).reading(0.04);
            assert!((scaled / response.reading(1.3 * 0.04) - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn beam_is_symmetric_and_its_weights_sum_to_one() {
        for count in [2, 3, 7, 100] {
            let beam = Beam::cone(count, 0.3, Combine::Responses).unwrap();
            let total: f64 = beam.rays().iter().map(|(_, w)| w).sum();
            let lean: f64 = beam.rays().iter().map(|(d, w)| w * d.y).sum();
            assert!((total - 1.0).abs() < 1e-12 && lean.abs() < 1e-12);
        }
        assert_eq!(Beam::cone(9, 0.0, Combine::Responses).unwrap(), Beam::single());
        assert!(Beam::cone(0, 0.1, Combine::Responses).is_err());
        assert!(Beam::cone(3, f64::NAN, Combine::Responses).is_err());
    }
}
