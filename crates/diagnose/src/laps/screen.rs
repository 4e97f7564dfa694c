//! Which probes could explain a residual, by the paths that were simulated beforehand.

use rayon::prelude::*;
use sim::UNLISTED;

use super::atlas::{Atlas, White};
use super::hypothesis::Hypothesis;
use super::layout::ramp_norm;
use super::part::{Part, Shape};
use super::path::{Node, Path, tangent};

/// A probe at the size that explains most.
#[derive(Debug, Clone)]
pub(super) struct Screened {
    pub(super) hypothesis: Hypothesis,
    /// Log-likelihood that is gained as far as its path tells, less the price of its parameters.
    pub(super) score: f64,
}

impl Screened {
    /// Its only probe.
    pub(super) fn probe(&self) -> usize {
        self.hypothesis.parts[0].probe
    }

    /// Whether no more than the noise and the faults of paths may have put it behind the best: it has such a share of that one's
    /// score, but for what noise makes at any signal.
    pub(super) fn may_win(&self, best: &Self, share: f64) -> bool {
        const NOISE: f64 = 20.0;
        self.score >= share * best.score - NOISE
    }
}

/// Half the logarithm of the number of laps for each fitted number (Schwarz 1978).
pub(super) fn price(parameters: usize, laps: usize) -> f64 {
    0.5 * parameters as f64 * (laps as f64).ln()
}

impl Atlas {
    /// Every probe in every pattern at its best size, best first.
    pub(super) fn screen(&self, residual: &White) -> Vec<Screened> {
        self.screen_by(residual, White::clone, None)
    }

    /// The same by actions that are seen in another way, in which the residual is given, of data that scatter so much more, entry by
    /// entry of a turned data set, than in these units.
    pub(super) fn screen_by(
        &self,
        residual: &White,
        seen: impl Fn(&White) -> White + Sync,
        widened: Option<&White>,
    ) -> Vec<Screened> {
        const SHAPES: [Shape; 3] = [Shape::Constant, Shape::ByRun, Shape::ByTime];
        let target = Target::new(self, residual, widened);
        let screened = |probe: usize| {
            let mut nodes = self.nodes(probe);
            for (_, action) in &mut nodes {
                *action = seen(action);
            }
            let path = self.path(probe, &nodes, widened);
            SHAPES.map(|shape| self.screen_one(probe, &nodes, &path, shape, &target))
        };
        let all = (0..self.probes.len()).into_par_iter().flat_map_iter(screened);
        best_first(all.flatten().collect())
    }

    /// Some probes of constant size, each at its best, best first.
    pub(super) fn ranked_constant(
        &self,
        probes: impl Iterator<Item = usize>,
        residual: &White,
    ) -> Vec<Screened> {
        let target = Target::new(self, residual, None);
        let screened = |probe: usize| {
            let nodes = self.nodes(probe);
            let path = self.path(probe, &nodes, None);
            self.screen_one(probe, &nodes, &path, Shape::Constant, &target)
        };
        best_first(probes.filter_map(screened).collect())
    }

    /// The price of having chosen one probe among those of its effect: the logarithm of how many there are, less what is
    /// fitted of the choice.
    pub(super) fn choice(&self, probe: usize) -> f64 {
        let chosen = &self.probes[probe];
        let alike = self
            .probes
            .iter()
            .filter(|p| p.spec == chosen.spec && *p.spec != UNLISTED)
            .count();
        if chosen.fits_direction() {
            return 0.0;
        }
        (alike.max(1) as f64).ln()
    }

    /// What a size that grows by one from lap to lap does to the trends, by what it does to the mean laps.
    fn change_per_lap(&self, tangent: &White) -> White {
        let mut change = White::zeros(tangent.len());
        let mut runs = 0;
        for (recording, laps) in self.layout.laps.iter().enumerate() {
            let of_run = self.layout.run(runs);
            // The mean laps are in units of the first run's error, the trends are means over the runs in those of such a mean.
            let runs_here = laps.len() as f64;
            let growth = laps.iter().map(|&n| ramp_norm(n)).sum::<f64>() / runs_here;
            let factor = (runs_here / laps[0] as f64).sqrt() * growth;
            change
                .rows_mut(self.layout.trend(recording).start, self.layout.lap)
                .axpy(factor, &tangent.rows(of_run.start, of_run.len()), 1.0);
            runs += laps.len();
        }
        change
    }

    fn screen_one(
        &self,
        probe: usize,
        nodes: &[(f64, White)],
        path: &Path,
        shape: Shape,
        target: &Target,
    ) -> Option<Screened> {
        let p = &self.probes[probe];
        let runs = self.layout.runs();
        let everything = 0..target.turned.len();
        let (size_at, node, fitted) = match shape {
            Shape::Constant => {
                let node = path.likeliest(&target.turned, everything)?;
                (vec![node.size], node, p.free.len())
            }
            Shape::ByRun => {
                if runs < 2 {
                    return None;
                }
                let parts: Option<Vec<Node>> = (0..runs)
                    .map(|run| path.likeliest(&target.turned, self.layout.run(run)))
                    .collect();
                let parts = parts?;
                let mut node = path.at(parts.iter().map(|part| part.size).sum::<f64>() / runs as f64);
                for (run, part) in parts.iter().enumerate() {
                    node.take(self.layout.run(run), part);
                }
                let sizes = parts.into_iter().map(|part| part.size).collect();
                let by_run = p.free.iter().filter(|free| p.moves(free.0)).count();
                (sizes, node, p.free.len() + by_run * (runs - 1))
            }
            // What changes in time by itself is no candidate for a change of that change.
            Shape::ByTime if p.drifts() => return None,
            Shape::ByTime => {
                let node = path.likeliest(&target.turned, everything)?;
                let change = self.turned(&self.change_per_lap(&tangent(nodes, node.size)));
                let weighted = change.component_mul(&node.weights());
                let left = &target.turned - &node.action;
                let slope = weighted.dot(&left) / weighted.dot(&change).max(f64::MIN_POSITIVE);
                let action = &node.action + change * slope;
                (vec![node.size, slope], Node { action, ..node }, p.free.len() + 1)
            }
        };
        let gain = 0.5 * (target.deviance - node.deviance(&target.turned));
        Some(Screened {
            hypothesis: Hypothesis::of(Part::screened(self, probe, shape, &size_at)),
            score: self.screened_score(probe, shape, fitted, gain),
        })
    }

    /// What counts of a gain of a constant probe.
    pub(super) fn score_of_constant(&self, probe: usize, gain: f64) -> f64 {
        self.screened_score(probe, Shape::Constant, self.probes[probe].free.len(), gain)
    }

    fn screened_score(&self, probe: usize, shape: Shape, fitted: usize, gain: f64) -> f64 {
        worth(gain, shape, FAULTS) - price(fitted, self.layout.total_laps()) - self.choice(probe)
    }
}

/// A vector less its components along orthonormal directions.
pub(super) fn without_directions(mut vector: White, directions: &[White]) -> White {
    for direction in directions {
        let along = direction.dot(&vector);
        vector.axpy(-along, direction, 1.0);
    }
    vector
}

/// Share of a gain that faults of the paths may take: they are straight between few sizes.
const FAULTS: f64 = 0.01;

/// What counts of a gain of which faults may take a share: sizes that may go over the runs follow them.
pub(super) fn worth(gain: f64, shape: Shape, faults: f64) -> f64 {
    /// What a pattern has to gain beside its numbers.
    const PATTERN: f64 = 4.0;
    match shape {
        Shape::Constant => gain,
        Shape::ByRun | Shape::ByTime => (1.0 - faults) * gain - PATTERN,
    }
}

/// Best first.
fn best_first(mut screened: Vec<Screened>) -> Vec<Screened> {
    screened.sort_by(|a, b| b.score.total_cmp(&a.score));
    screened
}

/// What is to be explained.
struct Target {
    turned: White,
    /// Of what explains nothing of it.
    deviance: f64,
}

impl Target {
    /// A residual of data that scatter so much more than in its units.
    fn new(atlas: &Atlas, residual: &White, widened: Option<&White>) -> Self {
        let turned = atlas.turned(residual);
        let deviance = match widened {
            Some(widened) => Node::at_rest(widened.clone()).deviance(&turned),
            None => turned.norm_squared(),
        };
        Self { turned, deviance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::atlas::observed;
    use crate::laps::spread::Spread;
    use crate::laps::summary::Summary;
    use crate::laps::testing::{atlas_of, summaries, twice_as_wide};

    #[test]
    fn what_follows_is_taken_off() {
        let directions = [
            White::from_vec(vec![1.0, 0.0, 0.0]),
            White::from_vec(vec![0.0, 0.6, 0.8]),
        ];
        let left = without_directions(White::from_vec(vec![7.0, 3.0, -1.0]), &directions);
        // (3, -1) less its projection of 1 on (0.6, 0.8).
        assert!((left - White::from_vec(vec![0.0, 2.4, -1.8])).norm() < 1e-15);
    }

    #[test]
    fn what_only_scatters_more_explains_laps_that_do() {
        let mut atlas = atlas_of(&["wheel-scale", "axle-length"]);
        let wide = twice_as_wide(2);
        for departure in atlas.paths[1].iter_mut().flatten() {
            departure.action.fill(0.0);
            departure.spread = Spread::of(&atlas.axes, &wide, &atlas.variances);
        }
        let score = |sets: &[Summary]| {
            let residual = atlas.white(&observed(&sets[0]), &atlas.null);
            let screened = atlas.screen(&residual);
            [0, 1].map(|probe| screened.iter().find(|s| s.probe() == probe).map(|s| s.score))
        };
        let [mean, scatter] = score(&wide);
        // Laps of variance 4 in three draws of 60 entries: half of 180 (4 - 1 - ln 4).
        assert!(mean < Some(10.0) && scatter > Some(100.0), "{mean:?} {scatter:?}");
        let [mean, scatter] = score(&summaries(1));
        assert!(mean < Some(2.0) && scatter < Some(2.0), "{mean:?} {scatter:?}");
    }
}
