//! The nonlinear response of an infra-red sensor from measured pairs.

use nalgebra::{DMatrix, DVector};
use sim::Response;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::Error;
use crate::least_squares::{Minimum, minimise};

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
    /// Fewer than five pairs with positive readings at three or more distances, a negative distance, or pairs that do
    /// not determine the three numbers.
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
        let minimum = fit(&used).ok_or(Error::Undetermined)?;
        let covariance = minimum.covariance.as_ref().ok_or(Error::Undetermined)?;
        let freedom = (used.len() - 3) as f64;
        let residual_log = (minimum.squares / freedom).sqrt();
        let t95 = StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
        let estimate = |i: usize| {
            // Of the logarithm's error to first order.
            let value = minimum.parameters[i].exp();
            let standard_error = value * residual_log * covariance[(i, i)].sqrt();
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
            let other = fit(&others).ok_or(Error::Undetermined)?;
            Ok(self::response(&other.parameters).reading(used[i][0]) / used[i][1] - 1.0)
        };
        Ok(Self {
            a_counts: estimate(0),
            d0_m: estimate(1),
            exponent: estimate(2),
            residual_log,
            relative_residuals: used.iter().map(|p| p[1] / response.reading(p[0]) - 1.0).collect(),
            left_out: (0..used.len()).map(left_out).collect::<Result<_, Error>>()?,
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

/// The best of several descents over (log a, log d0, log p): far from the knee the surface has flat arms.
fn fit(pairs: &[[f64; 2]]) -> Option<Minimum> {
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
        .filter(|minimum| minimum.squares.is_finite())
        .min_by(|a, b| a.squares.total_cmp(&b.squares))
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
}
