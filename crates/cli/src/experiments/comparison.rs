//! Clusters in the first two modes of one PDM, anew for every draw.

use anyhow::Result;
use pdm::{Cluster, Ellipse, Modes, Pdm, Projection, covariance_contrast, covariance_ellipse, hotelling};
use rayon::prelude::*;

use super::estimate::{Estimate, Tally};
use crate::interrupt;

/// Below this probability two clusters count as different.
const LEVEL: f64 = 0.05;

/// Clusters compared in D draws.
#[derive(Debug)]
pub(crate) struct Comparison {
    /// The model of the first draw, which figures show.
    pub(crate) pdm: Pdm,
    /// Each cluster in the first draw's modes.
    pub(crate) projections: Vec<Projection>,
    /// What was measured in each draw.
    pub(crate) draws: Vec<Space>,
}

/// The clusters in the modes of one draw.
#[derive(Debug)]
pub(crate) struct Space {
    /// One standard deviation round each cluster, m.
    pub(crate) ellipses: Vec<Ellipse>,
    pairs: Vec<Pair>,
}

/// How two clusters compare.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    /// Eq. 8.
    pub(crate) distance: f64,
    /// Of Hotelling's test.
    pub(crate) p: f64,
    /// Between the two covariances.
    pub(crate) contrast: f64,
}

impl Space {
    /// The pair of clusters `a` and `b`.
    pub(crate) fn pair(&self, a: usize, b: usize) -> &Pair {
        &self.pairs[a * self.ellipses.len() + b]
    }

    /// The distance of clusters `a` and `b`.
    pub(crate) fn distance(&self, a: usize, b: usize) -> f64 {
        self.pair(a, b).distance
    }

    /// Whether the means of clusters `a` and `b` differ at the level of 5 %.
    pub(crate) fn differ(&self, a: usize, b: usize) -> bool {
        self.pair(a, b).p < LEVEL
    }
}

impl Comparison {
    /// The comparison of the clusters of each draw, of which there is at least one, by a PDM of its own.
    ///
    /// # Errors
    /// What [`Pdm::fit`], [`Pdm::project`] and [`hotelling`] refuse; an interrupt.
    pub(crate) fn new(draws: &[Vec<&Cluster>]) -> Result<Self> {
        let model = |clusters: &Vec<&Cluster>| -> Result<(Pdm, Vec<Projection>)> {
            interrupt::check()?;
            let pdm = Pdm::fit(clusters.iter().copied())?; // eq. 2
            let projections = clusters
                .iter()
                .map(|cluster| pdm.project(cluster, Modes::First(2)));
            let projections = projections.collect::<Result<_, _>>()?;
            Ok((pdm, projections))
        };
        let (pdm, projections) = model(&draws[0])?;
        let others = draws[1..]
            .par_iter()
            .map(|clusters| space(&model(clusters)?.1))
            .collect::<Result<Vec<_>>>()?;
        let draws = std::iter::once(space(&projections)?).chain(others).collect();
        Ok(Self {
            pdm,
            projections,
            draws,
        })
    }

    /// A number of each draw.
    pub(crate) fn estimate(&self, number: impl Fn(&Space) -> f64) -> Estimate {
        Estimate::of(&self.draws.iter().map(number).collect::<Vec<_>>())
    }

    /// The distance of clusters `a` and `b`.
    pub(crate) fn distance(&self, a: usize, b: usize) -> Estimate {
        self.estimate(|draw| draw.distance(a, b))
    }

    /// In how many draws something is so.
    pub(crate) fn tally(&self, so: impl Fn(&Space) -> bool) -> Tally {
        Tally::of(self.draws.iter().map(so))
    }
}

fn space(projections: &[Projection]) -> Result<Space> {
    let pair = |x: &Projection, y: &Projection| -> Result<Pair> {
        let test = hotelling(x, y)?;
        Ok(Pair {
            distance: test.distance,
            p: test.p,
            contrast: covariance_contrast(x, y)?,
        })
    };
    let pairs = projections
        .iter()
        .flat_map(|x| projections.iter().map(move |y| pair(x, y)));
    let ellipses = projections
        .iter()
        .map(|projection| covariance_ellipse(projection, 1.0));
    Ok(Space {
        pairs: pairs.collect::<Result<_>>()?,
        ellipses: ellipses.collect::<Result<_, _>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_those_of_the_first_two_modes() {
        let square = |x: f64| -> Vec<Vec<f64>> {
            [[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [2.0, 2.0]]
                .map(|[a, b]| vec![a + x, b])
                .to_vec()
        };
        let [near, far] = [0.0, 4.0].map(|x| Cluster::new("square", &square(x)).unwrap());
        let comparison = Comparison::new(&[vec![&near, &far], vec![&near, &near]]).unwrap();
        let distance = comparison.distance(0, 1);
        assert!((distance.first - 12_f64.sqrt()).abs() < 1e-12, "{distance:?}"); // 4 apart, variance 4/3
        assert!(distance.low < 0.1 && comparison.draws[0].pair(0, 1).contrast < 1e-12);
        let differ = comparison.tally(|draw| draw.differ(0, 1));
        assert_eq!((differ.times, differ.draws), (1, 2));
    }
}
