//! Mean laps across the track: how far apart, and in what way.

use pdm::Cluster;

/// How a mean lap differs from another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Difference {
    /// Root mean square over the gates, m.
    pub(crate) rms_m: f64,
    /// Mean over the gates, positive to the left, m.
    pub(crate) offset_m: f64,
    /// What is left without the mean: root mean square, m.
    pub(crate) shape_m: f64,
    /// Correlation of the two over the gates, -1 to 1: how alike they swing.
    pub(crate) correlation: f64,
}

impl Difference {
    /// How the mean lap of `lap` differs from that of `reference`.
    pub(crate) fn new(lap: &Cluster, reference: &Cluster) -> Self {
        let (lap, reference) = (lap.mean(), reference.mean());
        let difference: Vec<f64> = lap.iter().zip(&reference).map(|(a, b)| a - b).collect();
        let offset_m = mean(&difference);
        Self {
            rms_m: root_mean_square(difference.iter().copied()),
            offset_m,
            shape_m: root_mean_square(difference.iter().map(|d| d - offset_m)),
            correlation: correlation(&lap, &reference),
        }
    }
}

/// How far laps are from their mean lap: root mean square over laps and gates, m.
pub(crate) fn spread_m(cluster: &Cluster) -> f64 {
    let (mean, laps) = (cluster.mean(), cluster.laps());
    let squares = laps
        .row_iter()
        .map(|lap| lap.iter().zip(&mean).map(|(a, b)| (a - b) * (a - b)).sum::<f64>());
    (squares.sum::<f64>() / ((laps.nrows() - 1).max(1) * laps.ncols()) as f64).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}

fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let (mean_x, mean_y) = (mean(x), mean(y));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| f(x - mean_x, y - mean_y)).sum()
    };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_is_no_change_of_shape() {
        let reference = Cluster::new("d", &[vec![1.0, -1.0, 2.0, 0.0]]).unwrap();
        let moved = Cluster::new("m", &[vec![4.0, 2.0, 5.0, 3.0], vec![4.0, 2.0, 5.0, 3.0]]).unwrap();
        let difference = Difference::new(&moved, &reference);
        let is = [
            difference.rms_m,
            difference.offset_m,
            difference.shape_m,
            difference.correlation,
        ];
        for (is, should) in is.iter().zip([3.0, 3.0, 0.0, 1.0]) {
            assert!((is - should).abs() < 1e-12, "{is} should be {should}");
        }
    }

    #[test]
    fn spread_has_the_divisor_of_a_variance() {
        let laps = Cluster::new("a", &[vec![0.0, 1.0], vec![2.0, 1.0]]).unwrap();
        assert!((spread_m(&laps) - 1.0).abs() < 1e-12); // variances 2 and 0
    }
}
