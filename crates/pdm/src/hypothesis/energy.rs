//! The energy test: do two samples have one distribution, whatever its form?

use nalgebra::DMatrix;
use rand::rngs::ChaCha8Rng;
use rand::{SeedableRng, seq::SliceRandom};
use rayon::prelude::*;

use crate::{Error, Points, TestResult};

/// Statistics closer than this, as a fraction of the sum of all distances, are the same one summed in another order.
const TIE: f64 = 1e-13;

/// The energy test of two samples (Szekely and Rizzo, "Testing for equal distributions in high dimension", 2004).
///
/// The statistic is `n_x n_y / (n_x + n_y) (2 E|X - Y| - E|X - X'| - E|Y - Y'|)` with means over all pairs of points,
/// in the unit of the laps; it sees a change of mean, of covariance and of form. `p` is the share of relabelled samples,
/// this one included, with at least that statistic, `(1 + count) / (1 + permutations)`, so it is never zero. Each
/// permutation has a random stream of its own: the result depends on `seed` and not on the number of threads.
///
/// # Errors
/// [`Error::Dimension`] for samples with different numbers of coordinates, [`Error::NoPermutations`] for none.
///
/// ```
/// let x = pdm::Cluster::new("x", &[vec![0.0], vec![1.0], vec![2.0]])?;
/// let y = pdm::Cluster::new("y", &[vec![10.0], vec![11.0], vec![12.0]])?;
/// let energy = pdm::energy_test(&x, &y, 199, 1)?;
/// assert!((energy.statistic - 1.5 * (20.0 - 16.0 / 9.0)).abs() < 1e-12);
/// # Ok::<(), pdm::Error>(())
/// ```
pub fn energy_test(
    x: &impl Points,
    y: &impl Points,
    permutations: usize,
    seed: u64,
) -> Result<TestResult, Error> {
    let dimension = |sample: &DMatrix<f64>| sample.ncols();
    if dimension(x.points()) != dimension(y.points()) {
        return Err(Error::Dimension {
            name: y.name().to_owned(),
            dimension: dimension(y.points()),
            other: x.name().to_owned(),
            expected: dimension(x.points()),
        });
    }
    if permutations == 0 {
        return Err(Error::NoPermutations);
    }
    let pairs = Pairs::new(x.points(), y.points());
    let observed = pairs.statistic(&pairs.labels);
    let least = observed - TIE * pairs.total;
    let count = (1..=permutations as u64)
        .into_par_iter()
        .filter(|&index| pairs.statistic(&pairs.relabelled(seed, index)) >= least)
        .count();
    Ok(TestResult {
        statistic: observed,
        p: (1 + count) as f64 / (1 + permutations) as f64,
        method: format!("energy distance, {permutations} permutations"),
    })
}

/// The distances between all points of both samples.
struct Pairs {
    /// `distances[i][j]` for `j < i`.
    distances: Vec<Vec<f64>>,
    /// The sum of all distances.
    total: f64,
    /// Whether each point belongs to the first sample.
    labels: Vec<bool>,
}

impl Pairs {
    fn new(x: &DMatrix<f64>, y: &DMatrix<f64>) -> Self {
        // one point per column, where a matrix keeps its numbers together
        let points: Vec<_> = x
            .row_iter()
            .chain(y.row_iter())
            .map(|row| row.transpose())
            .collect();
        let distances: Vec<Vec<f64>> = (0..points.len())
            .map(|i| {
                points[..i]
                    .iter()
                    .map(|other| (&points[i] - other).norm())
                    .collect()
            })
            .collect();
        let total = distances.iter().flatten().sum();
        let labels = (0..points.len()).map(|index| index < x.nrows()).collect();
        Self {
            distances,
            total,
            labels,
        }
    }

    /// The labels in the order of permutation `index`.
    fn relabelled(&self, seed: u64, index: u64) -> Vec<bool> {
        let mut stream = ChaCha8Rng::seed_from_u64(seed);
        stream.set_stream(index);
        let mut labels = self.labels.clone();
        labels.shuffle(&mut stream);
        labels
    }

    /// The energy statistic where the points with a label are the first sample.
    fn statistic(&self, labels: &[bool]) -> f64 {
        let [mut within_x, mut within_y] = [0.0; 2];
        for (i, row) in self.distances.iter().enumerate() {
            let same: f64 = row
                .iter()
                .zip(labels)
                .map(|(distance, &label)| if label == labels[i] { *distance } else { 0.0 })
                .sum();
            *(if labels[i] { &mut within_x } else { &mut within_y }) += same;
        }
        let nx = labels.iter().filter(|&&label| label).count() as f64;
        let ny = labels.len() as f64 - nx;
        let between = self.total - within_x - within_y;
        // pairs within a sample were counted once, the mean counts them twice
        let energy = 2.0 * (between / (nx * ny) - within_x / (nx * nx) - within_y / (ny * ny));
        nx * ny / (nx + ny) * energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{close, cluster, gaussian, projection, shifted};

    #[test]
    fn the_statistic_is_the_one_computed_by_hand() {
        // |X-Y|: 3, 5, 4 and 2, 4, 3, mean 3.5; |X-X'| mean 0.5; |Y-Y'| 2 (2 + 1 + 1) / 9
        let x = cluster("x", &DMatrix::from_row_slice(2, 1, &[0.0, 1.0]));
        let y = cluster("y", &DMatrix::from_row_slice(3, 1, &[3.0, 5.0, 4.0]));
        let energy = energy_test(&x, &y, 9, 1).unwrap();
        let should = 6.0 / 5.0 * (7.0 - 0.5 - 8.0 / 9.0);
        assert!(
            close(energy.statistic, should, 1e-14),
            "{} should be {should}",
            energy.statistic
        );
        assert_eq!(energy.method, "energy distance, 9 permutations");
    }

    #[test]
    fn equal_samples_are_not_apart() {
        let x = cluster("x", &gaussian(1, 6, 3));
        let energy = energy_test(&x, &x, 99, 1).unwrap();
        assert!(energy.statistic.abs() < 1e-14, "{}", energy.statistic);
        assert_eq!(energy.p, 1.0);
    }

    #[test]
    fn the_share_of_relabellings_approaches_the_exact_one() {
        // 6 points in order, 3 and 3: of the 20 ways to label them, 2 are as far apart
        let x = cluster("x", &DMatrix::from_row_slice(3, 1, &[0.0, 0.1, 0.2]));
        let y = cluster("y", &DMatrix::from_row_slice(3, 1, &[1.0, 1.1, 1.2]));
        let p = energy_test(&x, &y, 20_000, 1).unwrap().p;
        // 4 standard deviations of 20000 draws at 0.1: false alarm 6e-5
        assert!((p - 0.1).abs() < 0.0085, "{p}");
    }

    #[test]
    fn the_result_is_the_same_for_any_number_of_threads() {
        let (x, y) = (
            cluster("x", &gaussian(1, 12, 5)),
            cluster("y", &gaussian(2, 9, 5)),
        );
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| energy_test(&x, &y, 499, 3).unwrap())
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn value_stability() {
        let (x, y) = (cluster("x", &gaussian(1, 6, 2)), cluster("y", &gaussian(2, 5, 2)));
        let counts = [1, 2].map(|seed| (energy_test(&x, &y, 999, seed).unwrap().p * 1000.0).round());
        assert_eq!(counts, [443.0, 462.0]);
    }

    #[test]
    fn samples_that_do_not_fit_are_refused() {
        let (x, y) = (
            cluster("x", &gaussian(1, 6, 2)),
            projection("y", &gaussian(2, 5, 3)),
        );
        assert_eq!(
            energy_test(&x, &y, 9, 1).unwrap_err().to_string(),
            "`y` has 3 coordinates, `x` has 2"
        );
        assert_eq!(energy_test(&x, &x, 0, 1), Err(Error::NoPermutations));
    }

    /// How many of 400 seeded pairs, 15 laps each of 3 gates, are told apart at 5 % in 99 permutations.
    fn rejections(change: impl Fn(DMatrix<f64>) -> DMatrix<f64>) -> usize {
        (0..400)
            .filter(|seed| {
                let x = cluster("x", &gaussian(2 * seed, 15, 3));
                let y = cluster("y", &change(gaussian(2 * seed + 1, 15, 3)));
                energy_test(&x, &y, 99, *seed).unwrap().p <= 0.05
            })
            .count()
    }

    #[test]
    fn one_distribution_is_rejected_as_often_as_it_should() {
        // 20 expected; 5..=39 hold 1 - 1e-4 of the binomial distribution: the test's false-alarm rate
        let count = rejections(|same| same);
        assert!((5..=39).contains(&count), "{count} of 400 at 5 %");
    }

    #[test]
    fn a_shift_and_a_change_of_covariance_are_seen() {
        let shift = rejections(|y| shifted(&y, &[1.2, 0.0, 0.0]));
        let spread = rejections(|y| y * 2.5);
        assert!(
            shift >= 250 && spread >= 250,
            "{shift} and {spread} of 400 at 5 %"
        );
    }
}
