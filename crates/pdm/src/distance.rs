//! From a point to a cluster, and from a cluster to a cluster.

use nalgebra::DVector;

use crate::covariance::{Metric, scatter};
use crate::{Error, Modes, Projection};

/// The Mahalanobis distance of a point in the space of the modes from a cluster (eq. 6), in standard deviations.
///
/// With [`Modes::All`] it is measured in at most `n - 1` modes.
///
/// # Errors
/// [`Error::Dimension`] for a point with another number of modes, [`Error::TooFewLaps`] where the cluster does not have
/// more laps than modes, [`Error::SingularCovariance`] where it does not vary in some direction.
pub fn mahalanobis(point: &[f64], cluster: &Projection) -> Result<f64, Error> {
    let (laps, available) = cluster.points().shape();
    if point.len() != available {
        return Err(Error::Dimension {
            name: "the point".to_owned(),
            dimension: point.len(),
            other: cluster.name().to_owned(),
            expected: available,
        });
    }
    let modes = match cluster.modes() {
        Modes::First(_) => available,
        Modes::All => available.min(laps - 1).max(1),
    };
    cluster.carries(modes)?;
    let covariance = scatter(&cluster.first(modes)) / (laps - 1) as f64;
    let metric =
        Metric::new(&covariance, cluster.zero_variance()).ok_or_else(|| Error::SingularCovariance {
            clusters: vec![cluster.name().to_owned()],
            modes,
        })?;
    let mean = cluster.row_mean();
    Ok(metric.norm(&DVector::from_fn(modes, |mode, _| point[mode] - mean[mode])))
}

/// The distance of the means of two clusters, measured with their pooled covariance (eq. 8 with eq. 7).
///
/// It is in standard deviations and stays the same under every invertible linear map of the modes. With [`Modes::All`]
/// it is measured in at most `n_x + n_y - 2` modes, and so says little beside that of a pair with more laps or fewer. Both
/// must be projections of the same model.
///
/// # Errors
/// [`Error::Dimension`] for projections with different numbers of modes, [`Error::TooFewLaps`] where a cluster has fewer
/// than two laps or both together fewer than modes plus two, [`Error::SingularCovariance`] where they do not vary in
/// some direction.
///
/// ```
/// let x = pdm::Projection::new("x", &[vec![-1.0], vec![1.0]])?;
/// let y = pdm::Projection::new("y", &[vec![5.0], vec![7.0]])?;
/// assert!((pdm::distance(&x, &y)? - 18_f64.sqrt()).abs() < 1e-12); // 6 apart, variance 2
/// # Ok::<(), pdm::Error>(())
/// ```
pub fn distance(x: &Projection, y: &Projection) -> Result<f64, Error> {
    let modes = shared_modes(x, y)?;
    let degrees = x.points().nrows() + y.points().nrows() - 2;
    let pooled = (scatter(&x.first(modes)) + scatter(&y.first(modes))) / degrees as f64; // eq. 7
    let zero_variance = x.zero_variance().max(y.zero_variance());
    let metric = Metric::new(&pooled, zero_variance).ok_or_else(|| Error::SingularCovariance {
        clusters: vec![x.name().to_owned(), y.name().to_owned()],
        modes,
    })?;
    let apart = (x.row_mean() - y.row_mean()).transpose();
    Ok(metric.norm(&apart.rows(0, modes).into_owned())) // eq. 8
}

/// The number of modes in which a pair is compared.
pub(crate) fn shared_modes(x: &Projection, y: &Projection) -> Result<usize, Error> {
    let (nx, available) = x.points().shape();
    let (ny, other) = y.points().shape();
    if available != other {
        return Err(Error::Dimension {
            name: y.name().to_owned(),
            dimension: other,
            other: x.name().to_owned(),
            expected: available,
        });
    }
    let carried = (nx + ny).saturating_sub(2);
    let modes = match (x.modes(), y.modes()) {
        (Modes::All, Modes::All) => available.min(carried).max(1),
        _ => available,
    };
    if nx < 2 || ny < 2 || carried < modes {
        let laps = vec![(x.name().to_owned(), nx), (y.name().to_owned(), ny)];
        return Err(Error::TooFewLaps {
            laps,
            coordinates: modes,
            each: 2,
            total: (modes + 2).max(4),
        });
    }
    Ok(modes)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;
    use crate::samples::{close, cluster, gaussian, projection, shifted};
    use crate::{Cluster, Pdm};

    fn projected(clusters: &[Cluster], modes: Modes) -> Vec<Projection> {
        let pdm = Pdm::fit(clusters).unwrap();
        clusters
            .iter()
            .map(|cluster| pdm.project(cluster, modes).unwrap())
            .collect()
    }

    #[test]
    fn four_points_have_the_distances_computed_by_hand() {
        let points = DMatrix::from_row_slice(4, 2, &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 2.0, 2.0]); // covariance 4/3 I
        let x = projection("x", &points);
        let from_point = mahalanobis(&[1.0, 3.0], &x).unwrap();
        assert!((from_point - 3_f64.sqrt()).abs() < 1e-15, "{from_point}");
        // scatters diag(4, 4) and diag(4, 36) over 6: W = diag(4/3, 20/3)
        let stretched = DMatrix::from_row_slice(4, 2, &[3.0, 0.0, 5.0, 0.0, 3.0, 6.0, 5.0, 6.0]);
        let y = projection("y", &stretched);
        let should = (9.0_f64 * 3.0 / 4.0 + 4.0 * 3.0 / 20.0).sqrt();
        let is = distance(&x, &y).unwrap();
        assert!((is - should).abs() < 1e-14, "{is} should be {should}");
        assert_eq!(distance(&x, &x).unwrap(), 0.0);
    }

    #[test]
    fn all_modes_are_those_that_the_pooled_covariance_carries() {
        let [a, b, c] = [1, 2, 3].map(|seed| cluster("c", &gaussian(seed, 4, 30)));
        let all = projected(&[a, b, c], Modes::All);
        assert_eq!(all[0].points().ncols(), 11);
        assert_eq!(shared_modes(&all[0], &all[1]), Ok(6));
        assert!(distance(&all[0], &all[1]).unwrap().is_finite());
        assert!(mahalanobis(&[0.0; 11], &all[0]).unwrap().is_finite());
    }

    #[test]
    fn too_few_laps_are_named_and_counted() {
        let [one, two, three] = [1, 2, 3].map(|laps| projection("p", &gaussian(1, laps, 2)));
        let refusal = |x: &Projection, y: &Projection| distance(x, y).unwrap_err().to_string();
        let expected = "`p` has 1 lap, `p` has 3 laps: 2 modes or gates need at least 2 laps each and 4 together; give more laps or compare in fewer modes";
        assert_eq!(refusal(&one, &three), expected);
        let wide = projection("w", &gaussian(1, 3, 5));
        let expected = "`w` has 3 laps, `w` has 3 laps: 5 modes or gates need at least 2 laps each and 7 together; give more laps or compare in fewer modes";
        assert_eq!(refusal(&wide, &wide), expected);
        assert_eq!(refusal(&two, &wide), "`w` has 5 coordinates, `p` has 2");
        let expected = "`p` has 2 laps: 2 modes or gates need at least 3 laps each and 3 together; give more laps or compare in fewer modes";
        assert_eq!(mahalanobis(&[0.0, 0.0], &two).unwrap_err().to_string(), expected);
        assert!(mahalanobis(&[0.0], &three).is_err());
    }

    #[test]
    fn clusters_that_do_not_vary_in_some_direction_are_named() {
        let line = |name: &str, offset: f64| {
            let laps: Vec<_> = (0..5)
                .map(|i| vec![f64::from(i), 0.1 + offset, 2.0 * f64::from(i) + offset])
                .collect();
            Cluster::new(name, &laps).unwrap()
        };
        let pair = projected(&[line("a", 0.0), line("b", 3.0)], Modes::All);
        let expected = "the covariance of `a` and `b` is singular in 2 modes: compare in fewer";
        assert_eq!(distance(&pair[0], &pair[1]).unwrap_err().to_string(), expected);
        let expected = "the covariance of `a` is singular in 2 modes: compare in fewer";
        assert_eq!(
            mahalanobis(&[0.0, 0.0], &pair[0]).unwrap_err().to_string(),
            expected
        );
        // two that stand still but for rounding, in a model with a third that does not
        let still = |name: &str, at: f64| Cluster::new(name, &vec![vec![at, 0.3]; 7]).unwrap();
        let moving = cluster("m", &gaussian(1, 9, 2));
        let three = projected(&[still("a", 0.1), still("b", 0.2), moving], Modes::default());
        assert!(matches!(
            distance(&three[0], &three[1]),
            Err(Error::SingularCovariance { .. })
        ));
        assert!(distance(&three[0], &three[2]).is_ok());
    }

    proptest! {
        #[test]
        fn the_distance_survives_an_invertible_linear_map(
            seed in 0..1_000_000_u64, nx in 4..20_usize, ny in 4..20_usize, scale in -6..6_i32
        ) {
            let map = (DMatrix::identity(4, 4) * 2.0 + gaussian(seed, 4, 4) * 0.4) * 10_f64.powi(scale);
            prop_assume!(map.determinant().abs() > 0.1 * 10_f64.powi(4 * scale));
            let x = gaussian(seed + 1, nx, 4);
            let y = shifted(&gaussian(seed + 2, ny, 4), &[1.0, 0.0, -2.0, 0.5]);
            let before = projected(&[cluster("x", &x), cluster("y", &y)], Modes::All);
            let after = projected(&[cluster("x", &(&x * &map)), cluster("y", &(&y * &map))], Modes::All);
            let [before, after] = [before, after].map(|pair| distance(&pair[0], &pair[1]).unwrap());
            prop_assert!(close(before, after, 1e-9), "{before} {after}");
            let plain = distance(&projection("x", &x), &projection("y", &y)).unwrap();
            prop_assert!(close(before, plain, 1e-9), "{before} {plain}");
        }

        #[test]
        fn the_distance_is_the_same_both_ways(seed in 0..1_000_000_u64) {
            let [x, y] = [projection("x", &gaussian(seed, 7, 3)), projection("y", &gaussian(seed + 1, 5, 3))];
            prop_assert!(close(distance(&x, &y).unwrap(), distance(&y, &x).unwrap(), 1e-14));
        }
    }
}
