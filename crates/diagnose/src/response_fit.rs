//! The nonlinear response of an infra-red sensor from measured pairs.

use nalgebra::{DMatrix, DVector};
use sim::Response;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::error::{Error, Toward};
use crate::least_squares::{Minimum, minimise};

/// Largest standard error of a logarithm: the number is known within a factor of e.
const LOOSEST: f64 = 1.0;
/// How many times nearer than the nearest pair, or farther than the farthest, d0 may lie.
const REACH: f64 = 10.0;

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Half width of its 95 % interval, from Student's t.
    pub half_width_95: f64,
}

/// reading = a / (1 + (d / d0)^p), fitted by least squares on log reading.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseFit {
    /// a, counts.
    pub a_counts: Estimate,
    /// d0, m.
    pub d0_m: Estimate,
    /// p.
    pub exponent: Estimate,
    /// Root mean square of log reading - log fit, with the degrees of freedom n - 3 as divisor.
    pub residual_log: f64,
    /// For each pair measured / fit - 1, in the order of the pairs that were used.
    pub relative_residuals: Vec<f64>,
    /// For each pair fit to the others / measured - 1.
    pub left_out: Vec<f64>,
    /// The pairs used: distance m and reading counts.
    pub pairs: Vec<[f64; 2]>,
    /// Pairs set aside because a reading of 0 or less has no logarithm.
    pub set_aside: usize,
}

impl ResponseFit {
    /// The fit to pairs of (distance m, reading counts).
    ///
    /// # Errors
    /// Fewer than five pairs with positive readings at three or more distances, a negative distance, readings that do not
    /// fall with distance, or pairs that do not determine the three numbers.
    pub fn new(pairs: &[[f64; 2]]) -> Result<Self, Error> {
        if let Some(bad) = pairs
            .iter()
            .find(|p| !(p[0] >= 0.0 && p[0].is_finite() && p[1].is_finite()))
        {
            return Err(Error::Pair {
                distance_m: bad[0],
                reading: bad[1],
            });
        }
        let used: Vec<[f64; 2]> = pairs.iter().copied().filter(|p| p[1] > 0.0).collect();
        let mut distances: Vec<f64> = used.iter().map(|p| p[0]).collect();
        distances.sort_by(f64::total_cmp);
        distances.dedup();
        if used.len() < 5 || distances.len() < 3 {
            return Err(Error::TooFewPairs {
                pairs: used.len(),
                distances: distances.len(),
            });
        }
        if !falling(&used) {
            return Err(Error::NotFalling);
        }
        let minimum = fit(&used);
        let freedom = (used.len() - 3) as f64;
        let residual_log = (minimum.squares / freedom).sqrt();
        let log_errors = log_errors(&used, &minimum, residual_log)?;
        let t95 = StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
        let estimate = |i: usize| {
            // Of the logarithm's error to first order.
            let value = minimum.parameters[i].exp();
            let standard_error = value * log_errors[i];
            Estimate {
                value,
                standard_error,
                half_width_95: t95 * standard_error,
            }
        };
        let response = response(&minimum.parameters);
        let left_out = |i: usize| {
            let others: Vec<[f64; 2]> = used
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, p)| *p)
                .collect();
            self::response(&fit(&others).parameters).reading(used[i][0]) / used[i][1] - 1.0
        };
        Ok(Self {
            a_counts: estimate(0),
            d0_m: estimate(1),
            exponent: estimate(2),
            residual_log,
            relative_residuals: used.iter().map(|p| p[1] / response.reading(p[0]) - 1.0).collect(),
            left_out: (0..used.len()).map(left_out).collect(),
            set_aside: pairs.len() - used.len(),
            pairs: used,
        })
    }

    /// The fitted response.
    pub fn response(&self) -> Response {
        Response::Improved {
            a_counts: self.a_counts.value,
            d0_m: self.d0_m.value,
            exponent: self.exponent.value,
        }
    }

    /// Root mean square of the relative errors on pairs left out of the fit in turn.
    pub fn leave_one_out_relative_error(&self) -> f64 {
        (self.left_out.iter().map(|e| e * e).sum::<f64>() / self.left_out.len() as f64).sqrt()
    }
}

fn response(log_parameters: &DVector<f64>) -> Response {
    let [a_counts, d0_m, exponent] = [0, 1, 2].map(|i| log_parameters[i].exp());
    Response::Improved {
        a_counts,
        d0_m,
        exponent,
    }
}

/// Whether readings fall with distance, by the slope of their logarithms.
fn falling(pairs: &[[f64; 2]]) -> bool {
    let mean_m = pairs.iter().map(|p| p[0]).sum::<f64>() / pairs.len() as f64;
    let first = pairs[0][1]; // by ratios, so that equal readings have a slope of exactly 0
    let moment = |p: &[f64; 2]| (p[0] - mean_m) * (p[1] / first).ln();
    pairs.iter().map(moment).sum::<f64>() < 0.0
}

/// Standard errors of log a, log d0 and log p.
///
/// # Errors
/// One of them above [`LOOSEST`], or a d0 beyond the [`REACH`] of the pairs.
fn log_errors(pairs: &[[f64; 2]], minimum: &Minimum, residual_log: f64) -> Result<[f64; 3], Error> {
    let errors = minimum
        .covariance
        .as_ref()
        .map_or([f64::INFINITY; 3], |covariance| {
            [0, 1, 2].map(|i| residual_log * covariance[(i, i)].sqrt())
        });
    let distances = pairs.iter().map(|p| p[0]).filter(|&d| d > 0.0);
    let (nearest, farthest) = distances.fold((f64::INFINITY, 0.0_f64), |(near, far), d| {
        (near.min(d), far.max(d))
    });
    let d0 = minimum.parameters[1].exp();
    let in_reach = (nearest / REACH..=farthest * REACH).contains(&d0);
    if in_reach && errors.iter().all(|&error| error <= LOOSEST) {
        return Ok(errors);
    }
    let loosest = ["a", "d0", "p"]
        .into_iter()
        .zip(errors)
        .max_by(|x, y| x.1.total_cmp(&y.1));
    // Far away readings fall at least as 1 / d; where they fall less the pairs are those of the near part.
    let (middle, p) = ((nearest * farthest).sqrt(), minimum.parameters[2].exp());
    let steepness = p / (1.0 + (d0 / middle).powf(p));
    let (toward, from_m) = if steepness > 1.0 {
        (Toward::Nearer, nearest)
    } else {
        (Toward::Farther, farthest)
    };
    Err(Error::Undetermined {
        parameter: loosest.filter(|_| in_reach).map_or("d0", |(name, _)| name),
        toward,
        from_m,
    })
}

/// The best of several descents over (log a, log d0, log p): far from the knee the surface has flat arms.
fn fit(pairs: &[[f64; 2]]) -> Minimum {
    let largest = pairs.iter().map(|p| p[1]).fold(f64::MIN, f64::max);
    let farthest = pairs.iter().map(|p| p[0]).fold(f64::MIN, f64::max);
    let starts = [0.01, 0.05, 0.2, 0.6]
        .into_iter()
        .flat_map(|share| [1.5, 4.0].map(|p: f64| (share * farthest, p)));
    starts
        .map(|(d0, p): (f64, f64)| {
            let start = DVector::from_vec(vec![largest.ln(), d0.ln(), p.ln()]);
            minimise(start, |parameters| residuals(pairs, parameters))
        })
        .min_by(|a, b| a.squares.total_cmp(&b.squares))
        .expect("there are starts")
}

/// log a - log(1 + (d / d0)^p) - log reading, and its derivatives.
fn residuals(pairs: &[[f64; 2]], parameters: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let (log_a, log_d0, p) = (parameters[0], parameters[1], parameters[2].exp());
    let mut residuals = DVector::zeros(pairs.len());
    let mut jacobian = DMatrix::zeros(pairs.len(), 3);
    for (i, [distance, reading]) in pairs.iter().enumerate() {
        // (d / d0)^p and its share of 1 + itself; a distance of 0 has neither.
        let log_ratio = if *distance > 0.0 {
            distance.ln() - log_d0
        } else {
            0.0
        };
        let power = if *distance > 0.0 {
            (p * log_ratio).exp()
        } else {
            0.0
        };
        let share = power / (1.0 + power);
        residuals[i] = log_a - power.ln_1p() - reading.ln();
        jacobian[(i, 0)] = 1.0;
        jacobian[(i, 1)] = p * share;
        jacobian[(i, 2)] = -share * log_ratio * p;
    }
    (residuals, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The e-puck's pairs of the declared model.
    const PAIRS: [[f64; 2]; 10] = [
        [0.0, 4095.0],
        [0.005, 2133.33],
        [0.010, 1465.73],
        [0.015, 601.46],
        [0.020, 383.84],
        [0.030, 234.93],
        [0.040, 158.03],
        [0.050, 120.0],
        [0.060, 104.09],
        [0.070, 67.19],
    ];

    #[test]
    fn recovers_the_declared_response_from_the_ten_pairs() {
        let fit = ResponseFit::new(&PAIRS).unwrap();
        assert!((fit.a_counts.value - 4202.93).abs() < 0.005, "{:?}", fit.a_counts);
        assert!((fit.d0_m.value - 0.005_219_53).abs() < 5e-9, "{:?}", fit.d0_m);
        assert!(
            (fit.exponent.value - 1.572_816_92).abs() < 2e-7,
            "{:?}",
            fit.exponent
        );
    }

    #[test]
    fn exact_pairs_give_their_response_back() {
        let truth = Response::Improved {
            a_counts: 900.0,
            d0_m: 0.02,
            exponent: 3.0,
        };
        let pairs: Vec<[f64; 2]> = (0..20)
            .map(|i| f64::from(i) * 0.004)
            .map(|d| [d, truth.reading(d)])
            .collect();
        let fit = ResponseFit::new(&pairs).unwrap();
        assert!((fit.a_counts.value / 900.0 - 1.0).abs() < 1e-9);
        assert!((fit.d0_m.value / 0.02 - 1.0).abs() < 1e-9);
        assert!((fit.exponent.value / 3.0 - 1.0).abs() < 1e-9);
        assert!(fit.leave_one_out_relative_error() < 1e-8);
    }

    #[test]
    fn what_cannot_be_fitted_is_refused() {
        assert!(matches!(
            ResponseFit::new(&PAIRS[..4]),
            Err(Error::TooFewPairs { pairs: 4, .. })
        ));
        let mut pairs = PAIRS.to_vec();
        pairs[3][1] = f64::NAN;
        assert!(matches!(ResponseFit::new(&pairs), Err(Error::Pair { .. })));
        pairs[3][1] = 0.0;
        assert_eq!(ResponseFit::new(&pairs).unwrap().set_aside, 1);
    }

    #[test]
    fn pairs_that_leave_the_response_open_are_refused() {
        let refusal = |reading: &dyn Fn(f64) -> f64| {
            let pairs: Vec<[f64; 2]> = (1..=8)
                .map(|i| f64::from(i) * 0.01)
                .map(|d| [d, reading(d)])
                .collect();
            ResponseFit::new(&pairs).unwrap_err()
        };
        assert_eq!(refusal(&|_| 100.0), Error::NotFalling);
        assert_eq!(refusal(&|d| 1e4 * d), Error::NotFalling);
        let nearer = Error::Undetermined {
            parameter: "d0",
            toward: Toward::Nearer,
            from_m: 0.01,
        };
        assert_eq!(refusal(&|d| 0.5 * d.powf(-1.5)), nearer);
        // Far below the distance where the reading has halved.
        let farther = Error::Undetermined {
            parameter: "d0",
            toward: Toward::Farther,
            from_m: 0.08,
        };
        let scattered = |d: f64| 1.0 + 0.01 * (1e4 * d).sin();
        assert_eq!(
            refusal(&|d| 1e3 * scattered(d) / (1.0 + (d / 0.5).powi(2))),
            farther
        );
    }
}
