//! Which probes could explain a residual, by the paths that were simulated beforehand.

use std::ops::Range;

use rayon::prelude::*;
use sim::UNLISTED;

use super::atlas::{Atlas, White};
use super::hypothesis::Hypothesis;
use super::layout::ramp_norm;
use super::part::{Part, Shape};

/// A probe at the size that explains most.
#[derive(Debug, Clone)]
pub(super) struct Screened {
    pub(super) hypothesis: Hypothesis,
    /// Half the squared distance to the residual that is gained, less the price of its parameters.
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
        self.screen_by(residual, White::clone)
    }

    /// The same by actions that are seen in another way, in which the residual is given.
    pub(super) fn screen_by(&self, residual: &White, seen: impl Fn(&White) -> White + Sync) -> Vec<Screened> {
        let mut all: Vec<Screened> = (0..self.probes.len())
            .into_par_iter()
            .flat_map_iter(|probe| {
                let mut nodes = self.nodes(probe);
                for (_, action) in &mut nodes {
                    *action = seen(action);
                }
                [Shape::Constant, Shape::ByRun, Shape::ByTime]
                    .map(|shape| self.screen_one(probe, &nodes, shape, residual))
            })
            .flatten()
            .collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        all
    }

    /// The best constant score over all probes: what the alarm looks at.
    pub(super) fn best_score(&self, residual: &White) -> f64 {
        let all = self.screen_constant(0..self.probes.len(), residual);
        all.map(|s| s.score).fold(0.0, f64::max)
    }

    /// Some probes of constant size, each at its best.
    pub(super) fn screen_constant(
        &self,
        probes: impl Iterator<Item = usize>,
        residual: &White,
    ) -> impl Iterator<Item = Screened> {
        probes.filter_map(|probe| self.screen_one(probe, &self.nodes(probe), Shape::Constant, residual))
    }

    /// The same, best first.
    pub(super) fn ranked_constant(
        &self,
        probes: impl Iterator<Item = usize>,
        residual: &White,
    ) -> Vec<Screened> {
        let mut screened: Vec<Screened> = self.screen_constant(probes, residual).collect();
        screened.sort_by(|a, b| b.score.total_cmp(&a.score));
        screened
    }

    /// Sizes and actions along a probe's path, the neutral size among them, in order of size.
    pub(super) fn nodes(&self, probe: usize) -> Vec<(f64, White)> {
        let p = &self.probes[probe];
        let simulated = p
            .sizes
            .iter()
            .zip(&self.paths[probe])
            .filter_map(|(&s, w)| w.as_ref().map(|w| (s, w.clone())));
        let mut nodes: Vec<(f64, White)> = simulated.collect();
        let Some(length) = nodes.first().map(|(_, w)| w.len()) else {
            return nodes;
        };
        if p.odd {
            let mirrored: Vec<_> = nodes.iter().map(|(s, w)| (2.0 * p.neutral - s, -w)).collect();
            nodes.extend(mirrored);
        }
        nodes.push((p.neutral, White::zeros(length)));
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        nodes
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
        shape: Shape,
        residual: &White,
    ) -> Option<Screened> {
        let p = &self.probes[probe];
        let runs = self.layout.runs();
        let everything = 0..residual.len();
        let (size_at, action, fitted) = match shape {
            Shape::Constant => {
                let (s, action) = nearest(nodes, residual, everything)?;
                (vec![s], action, p.free.len())
            }
            Shape::ByRun => {
                if runs < 2 {
                    return None;
                }
                let parts: Option<Vec<(f64, White)>> = (0..runs)
                    .map(|run| nearest(nodes, residual, self.layout.run(run)))
                    .collect();
                let parts = parts?;
                let mut action = at(nodes, parts.iter().map(|part| part.0).sum::<f64>() / runs as f64);
                for (run, (_, part)) in parts.iter().enumerate() {
                    let range = self.layout.run(run);
                    action
                        .rows_mut(range.start, range.len())
                        .copy_from(&part.rows(range.start, range.len()));
                }
                let sizes = parts.into_iter().map(|part| part.0).collect();
                let by_run = p.free.iter().filter(|free| p.moves(free.0)).count();
                (sizes, action, p.free.len() + by_run * (runs - 1))
            }
            // What changes in time by itself is no candidate for a change of that change.
            Shape::ByTime if p.drifts() => return None,
            Shape::ByTime => {
                let (s, action) = nearest(nodes, residual, everything)?;
                let change = self.change_per_lap(&tangent(nodes, s));
                let left = residual - &action;
                let slope = change.dot(&left) / change.norm_squared().max(f64::MIN_POSITIVE);
                (vec![s, slope], action + change * slope, p.free.len() + 1)
            }
        };
        let gain = residual.norm_squared() - (residual - &action).norm_squared();
        Some(Screened {
            hypothesis: Hypothesis::of(Part::screened(self, probe, shape, &size_at)),
            score: self.screened_score(probe, shape, fitted, 0.5 * gain),
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

/// Share of its last piece by which a path is trusted to go on straight.
pub(super) const BEYOND: f64 = 0.7;

/// What counts of a gain of which faults may take a share: sizes that may go over the runs follow them.
pub(super) fn worth(gain: f64, shape: Shape, faults: f64) -> f64 {
    /// What a pattern has to gain beside its numbers.
    const PATTERN: f64 = 4.0;
    match shape {
        Shape::Constant => gain,
        Shape::ByRun | Shape::ByTime => (1.0 - faults) * gain - PATTERN,
    }
}

/// The point of a path that is nearest to the residual in some entries, and its size. Beyond its ends the path goes on
/// straight for [`BEYOND`] of its last piece.
pub(super) fn nearest(
    nodes: &[(f64, White)],
    residual: &White,
    entries: Range<usize>,
) -> Option<(f64, White)> {
    let (first, count) = (entries.start, entries.len());
    let target = residual.rows(first, count);
    let mut best: Option<(f64, f64, White)> = None;
    for (i, pair) in nodes.windows(2).enumerate() {
        let ((s0, w0), (s1, w1)) = (&pair[0], &pair[1]);
        let (from, along) = (
            w0.rows(first, count),
            w1.rows(first, count) - w0.rows(first, count),
        );
        let square = along.norm_squared();
        if square == 0.0 {
            continue;
        }
        let low = if i == 0 { -BEYOND } else { 0.0 };
        let high = if i + 2 == nodes.len() { 1.0 + BEYOND } else { 1.0 };
        let share = ((target - from).dot(&along) / square).clamp(low, high);
        let distance = (target - from - along * share).norm_squared();
        if best.as_ref().is_none_or(|(least, ..)| distance < *least) {
            best = Some((distance, s0 + share * (s1 - s0), w0 + (w1 - w0) * share));
        }
    }
    best.map(|(_, s, w)| (s, w))
}

/// The path at a size, straight on beyond its ends.
pub(super) fn at(nodes: &[(f64, White)], size: f64) -> White {
    let (from, slope) = piece(nodes, size);
    &from.1 + slope * (size - from.0)
}

/// The change of the path with the size.
pub(super) fn tangent(nodes: &[(f64, White)], size: f64) -> White {
    piece(nodes, size).1
}

/// The piece of a path that holds a size: its first node and its slope.
fn piece(nodes: &[(f64, White)], size: f64) -> (&(f64, White), White) {
    let i = nodes
        .windows(2)
        .position(|pair| size < pair[1].0)
        .unwrap_or(nodes.len() - 2);
    let slope = (&nodes[i + 1].1 - &nodes[i].1) / (nodes[i + 1].0 - nodes[i].0);
    (&nodes[i], slope)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
