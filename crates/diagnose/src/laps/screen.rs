//! Which probes could explain a residual, by the paths that were simulated beforehand.

use super::atlas::{Atlas, White};
use super::hypothesis::{Hypothesis, Part, Shape};

/// A probe at the size that explains most.
#[derive(Debug, Clone)]
pub(super) struct Screened {
    pub(super) hypothesis: Hypothesis,
    /// Half the squared distance to the residual that is gained, less the price of its parameters.
    pub(super) score: f64,
}

/// Half the logarithm of the number of laps for each fitted number (Schwarz 1978).
pub(super) fn price(parameters: usize, laps: usize) -> f64 {
    0.5 * parameters as f64 * (laps as f64).ln()
}

impl Atlas {
    /// Every probe in every pattern at its best size, best first.
    pub(super) fn screen(&self, residual: &White) -> Vec<Screened> {
        let mut all: Vec<Screened> = (0..self.probes.len())
            .flat_map(|probe| {
                let nodes = self.nodes(probe);
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
        (0..self.probes.len())
            .filter_map(|probe| self.screen_one(probe, &self.nodes(probe), Shape::Constant, residual))
            .map(|s| s.score)
            .fold(0.0, f64::max)
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

    fn screen_one(
        &self,
        probe: usize,
        nodes: &[(f64, White)],
        shape: Shape,
        residual: &White,
    ) -> Option<Screened> {
        let p = &self.probes[probe];
        let size = residual.len();
        let runs = self.laps.len();
        let lap = self.null.trend.len();
        let (size_at, action, fitted) = match shape {
            Shape::Constant => {
                let (s, action) = nearest(nodes, residual, 0, size)?;
                (vec![s], action, p.free.len())
            }
            Shape::ByRun => {
                if runs < 2 {
                    return None;
                }
                let mut action = White::zeros(size);
                let mut sizes = Vec::with_capacity(runs);
                for r in 0..runs {
                    let (s, part) = nearest(nodes, residual, r * lap, lap)?;
                    action.rows_mut(r * lap, lap).copy_from(&part.rows(r * lap, lap));
                    sizes.push(s);
                }
                let middle = at(nodes, sizes.iter().sum::<f64>() / runs as f64);
                let rest = runs * lap;
                action
                    .rows_mut(rest, size - rest)
                    .copy_from(&middle.rows(rest, size - rest));
                (sizes, action, p.free.len() - 1 + runs)
            }
            Shape::ByTime => {
                let (s, mut action) = nearest(nodes, residual, 0, size)?;
                // The change of one run's mean lap with the size, as the trend's entries see it.
                let tangent = tangent(nodes, s).rows(0, lap) * ((runs as f64) / self.laps[0] as f64).sqrt();
                let left = residual.rows(runs * lap, lap) - action.rows(runs * lap, lap);
                let slope = tangent.dot(&left) / tangent.norm_squared().max(f64::MIN_POSITIVE);
                action.rows_mut(runs * lap, lap).axpy(slope, &tangent, 1.0);
                (vec![s, slope], action, p.free.len() + 1)
            }
        };
        let gain = residual.norm_squared() - (residual - &action).norm_squared();
        let laps = self.laps.iter().sum();
        let score = 0.5 * gain - price(fitted, laps);
        Some(Screened {
            hypothesis: Hypothesis {
                parts: vec![Part::screened(self, probe, shape, &size_at)],
            },
            score,
        })
    }
}

/// The point of a path that is nearest to the residual in `count` entries from `first`, and its size. Beyond its ends the path
/// goes on straight for half its last piece.
fn nearest(nodes: &[(f64, White)], residual: &White, first: usize, count: usize) -> Option<(f64, White)> {
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
        let low = if i == 0 { -0.5 } else { 0.0 };
        let high = if i + 2 == nodes.len() { 1.5 } else { 1.0 };
        let share = ((target - from).dot(&along) / square).clamp(low, high);
        let distance = (target - from - along * share).norm_squared();
        if best.as_ref().is_none_or(|(least, ..)| distance < *least) {
            best = Some((distance, s0 + share * (s1 - s0), w0 + (w1 - w0) * share));
        }
    }
    best.map(|(_, s, w)| (s, w))
}

/// The path at a size, straight on beyond its ends.
fn at(nodes: &[(f64, White)], size: f64) -> White {
    let (from, slope) = piece(nodes, size);
    &from.1 + slope * (size - from.0)
}

/// The change of the path with the size.
fn tangent(nodes: &[(f64, White)], size: f64) -> White {
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
