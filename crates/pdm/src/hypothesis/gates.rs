//! Where along the lap two mean laps differ.

use crate::covariance::zero_variance;
use crate::{Cluster, Error};

/// The difference of the two mean laps at each gate, `x` minus `y`, over its standard error (Welch's z): `N` numbers.
///
/// Where the laps have one mean each is near a standard normal variate. A gate at which neither cluster varies counts
/// 0 where the means are one.
///
/// # Errors
/// [`Error::Dimension`] for clusters with different numbers of gates, [`Error::TooFewLaps`] for fewer than two laps in
/// one, [`Error::ConstantGate`] where the means differ at a gate at which neither varies.
///
/// ```
/// let x = pdm::Cluster::new("x", &[vec![-1.0, 4.0], vec![1.0, 4.0]])?;
/// let y = pdm::Cluster::new("y", &[vec![2.0, 4.0], vec![4.0, 4.0]])?;
/// let z = pdm::standardised_differences(&x, &y)?;
/// assert!((z[0] + 3.0 / 2_f64.sqrt()).abs() < 1e-12 && z[1] == 0.0);
/// # Ok::<(), pdm::Error>(())
/// ```
pub fn standardised_differences(x: &Cluster, y: &Cluster) -> Result<Vec<f64>, Error> {
    if x.dimension() != y.dimension() {
        return Err(Error::Dimension {
            name: y.name().to_owned(),
            dimension: y.dimension(),
            other: x.name().to_owned(),
            expected: x.dimension(),
        });
    }
    if x.len() < 2 || y.len() < 2 {
        let laps = [x, y]
            .map(|cluster| (cluster.name().to_owned(), cluster.len()))
            .to_vec();
        return Err(Error::TooFewLaps {
            laps,
            coordinates: 1,
            each: 2,
            total: 4,
        });
    }
    (0..x.dimension())
        .map(|gate| at_gate(x, y, gate).ok_or_else(|| constant_gate(x, y, gate)))
        .collect()
}

/// The largest size of the [`standardised_differences`], over all gates.
///
/// # Errors
/// As [`standardised_differences`].
pub fn max_standardised_difference(x: &Cluster, y: &Cluster) -> Result<f64, Error> {
    let differences = standardised_differences(x, y)?;
    Ok(differences
        .into_iter()
        .fold(0.0, |largest, z| z.abs().max(largest)))
}

/// Welch's z at one gate, or nothing where it would be infinite.
fn at_gate(x: &Cluster, y: &Cluster, gate: usize) -> Option<f64> {
    let [(mean_x, error_x, zero_x), (mean_y, error_y, zero_y)] = [x, y].map(|cluster| {
        let column = cluster.laps().columns(gate, 1).into_owned();
        let mean = column.mean();
        let sum: f64 = column.iter().map(|value| (value - mean).powi(2)).sum();
        let laps = cluster.len() as f64;
        (mean, sum / (laps - 1.0) / laps, zero_variance(&column))
    });
    let (difference, squared_error, zero) = (mean_x - mean_y, error_x + error_y, zero_x.max(zero_y));
    match squared_error > zero {
        true => Some(difference / squared_error.sqrt()),
        false if difference * difference <= zero => Some(0.0),
        false => None,
    }
}

fn constant_gate(x: &Cluster, y: &Cluster, gate: usize) -> Error {
    Error::ConstantGate {
        x: x.name().to_owned(),
        y: y.name().to_owned(),
        gate: gate + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{cluster, gaussian};

    #[test]
    fn the_differences_are_those_computed_by_hand() {
        let x = Cluster::new("x", &[vec![1.0, 0.0], vec![3.0, 0.0]]).unwrap(); // variances 2, 0
        let y = Cluster::new("y", &[vec![0.0, 1.0], vec![3.0, 2.0], vec![6.0, 3.0]]).unwrap(); // 9, 1
        let z = standardised_differences(&x, &y).unwrap();
        assert!(
            (z[0] + 0.5).abs() < 1e-15 && (z[1] + 2.0 * 3_f64.sqrt()).abs() < 1e-14,
            "{z:?}"
        );
        assert_eq!(max_standardised_difference(&x, &y), Ok(-z[1]));
    }

    #[test]
    fn a_gate_without_variance_is_never_nan() {
        let still = |name: &str, at: f64| Cluster::new(name, &vec![vec![0.1, at]; 20]).unwrap();
        let (x, y) = (still("x", 0.3), still("y", 0.7));
        assert_eq!(standardised_differences(&x, &x).unwrap(), [0.0, 0.0]);
        let refusal = standardised_differences(&x, &y).unwrap_err().to_string();
        assert_eq!(refusal, "`x` and `y` differ at gate 2 and neither varies there");
    }

    #[test]
    fn samples_that_do_not_fit_are_refused() {
        let [one, two, wide] =
            [(1, 2), (2, 2), (2, 3)].map(|(laps, gates)| cluster("c", &gaussian(1, laps, gates)));
        assert!(matches!(
            standardised_differences(&one, &two),
            Err(Error::TooFewLaps { .. })
        ));
        assert!(matches!(
            standardised_differences(&two, &wide),
            Err(Error::Dimension { .. })
        ));
    }

    #[test]
    fn laps_of_one_mean_differ_as_a_normal_variate() {
        // 40 + 40 laps of 500 gates: the variance of z is near 78/76, its standard error 0.065; 4 of them: false alarm 6e-5
        let [x, y] = [1, 2].map(|seed| cluster("c", &gaussian(seed, 40, 500)));
        let z = standardised_differences(&x, &y).unwrap();
        let variance = z.iter().map(|z| z * z).sum::<f64>() / 500.0;
        assert!((variance - 78.0 / 76.0).abs() < 0.26, "{variance}");
    }
}
