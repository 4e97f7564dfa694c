//! Paths that were simulated beforehand: what a probe does at its sizes, straight between them.

use std::ops::Range;

use super::atlas::{Atlas, Departure, White};

impl Atlas {
    /// Sizes and actions along a probe's path, the neutral size among them, in order of size.
    pub(super) fn nodes(&self, probe: usize) -> Vec<(f64, White)> {
        self.along(probe, |departure| departure.action.clone())
    }

    /// The path of a probe with such [`Atlas::nodes`], which scatters so much more than in their units as it is, and as is given.
    pub(super) fn path(&self, probe: usize, nodes: &[(f64, White)], widened: Option<&White>) -> Path {
        let own = self.along(probe, |departure| self.widened_by(&departure.spread));
        let node = |((size, action), (_, own)): (&(f64, White), (f64, White))| Node {
            size: *size,
            action: self.turned(action),
            widened: match widened {
                Some(widened) => own + widened,
                None => own,
            },
        };
        Path(nodes.iter().zip(own).map(node).collect())
    }

    /// Something of what a probe does at its sizes, the neutral one among them, in order of size.
    fn along(&self, probe: usize, of: impl Fn(&Departure) -> White) -> Vec<(f64, White)> {
        let p = &self.probes[probe];
        let simulated = p.sizes.iter().zip(&self.paths[probe]);
        let simulated = simulated.filter_map(|(&size, departure)| Some((size, of(departure.as_ref()?))));
        let mut all: Vec<(f64, White)> = simulated.collect();
        let Some(length) = all.first().map(|(_, first)| first.len()) else {
            return all;
        };
        if p.odd {
            let mirrored: Vec<_> = all.iter().map(|(s, w)| (2.0 * p.neutral - s, -w)).collect();
            all.extend(mirrored);
        }
        all.push((p.neutral, White::zeros(length)));
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }
}

/// Share of its last piece by which a path is trusted to go on straight.
const BEYOND: f64 = 0.7;

/// A point of a probe's path: what a size leads one to expect of a turned data set; its entries are independent.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) size: f64,
    pub(super) action: White,
    /// Logarithms of the entries' variances.
    pub(super) widened: White,
}

impl Node {
    /// Where nothing is done to what is expected.
    pub(super) fn at_rest(widened: White) -> Self {
        Self {
            size: 0.0,
            action: White::zeros(widened.len()),
            widened,
        }
    }

    /// The reciprocals of the entries' variances.
    pub(super) fn weights(&self) -> White {
        self.widened.map(|widened| (-widened).exp())
    }

    /// Twice the negative logarithm of how likely it makes a turned data set, but for a constant.
    pub(super) fn deviance(&self, target: &White) -> f64 {
        Stretch::new([self, self], 0..target.len()).deviance(target, 0.0)
    }

    /// Takes some entries of another.
    pub(super) fn take(&mut self, entries: Range<usize>, other: &Self) {
        for (own, other) in [
            (&mut self.action, &other.action),
            (&mut self.widened, &other.widened),
        ] {
            let others = other.rows(entries.start, entries.len());
            own.rows_mut(entries.start, entries.len()).copy_from(&others);
        }
    }
}

/// Some entries of the straight way from one node to the next.
struct Stretch<'a> {
    nodes: [&'a Node; 2],
    entries: Range<usize>,
}

impl<'a> Stretch<'a> {
    fn new(nodes: [&'a Node; 2], entries: Range<usize>) -> Self {
        Self { nodes, entries }
    }

    /// The node at a share of the way.
    fn at(&self, share: f64) -> Node {
        let [from, to] = self.nodes;
        Node {
            size: from.size + share * (to.size - from.size),
            action: &from.action + (&to.action - &from.action) * share,
            widened: &from.widened + (&to.widened - &from.widened) * share,
        }
    }

    /// The deviance of that node in these entries.
    fn deviance(&self, target: &White, share: f64) -> f64 {
        let entries = |white: &'a White| &white.as_slice()[self.entries.clone()];
        let [from, to] = self
            .nodes
            .map(|node| entries(&node.action).iter().zip(entries(&node.widened)));
        let target = &target.as_slice()[self.entries.clone()];
        (from.zip(to).zip(target))
            .map(|(((from, from_widened), (to, to_widened)), target)| {
                let left = target - from - share * (to - from);
                let widened = from_widened + share * (to_widened - from_widened);
                left * left * (-widened).exp() + widened
            })
            .sum()
    }

    /// The share of the way within bounds with the least deviance, and that: the vertex of a parabola through the best of a few shares
    /// and its neighbours.
    fn likeliest(&self, target: &White, [low, high]: [f64; 2]) -> (f64, f64) {
        /// Of a whole way.
        const STEPS: f64 = 4.0;
        let count = ((high - low) * STEPS).round() as usize;
        let step = (high - low) / count as f64;
        let at = |share: f64| (self.deviance(target, share), share);
        let shares: Vec<(f64, f64)> = (0..=count).map(|k| at(low + step * k as f64)).collect();
        let best = (0..=count).min_by(|&a, &b| shares[a].0.total_cmp(&shares[b].0));
        let best = best.expect("a way has shares");
        let middle = best.clamp(1, count - 1);
        let [before, here, after] = [middle - 1, middle, middle + 1].map(|k| shares[k].0);
        let curvature = before - 2.0 * here + after;
        if curvature > 0.0 {
            let vertex = shares[middle].1 + 0.5 * step * (before - after) / curvature;
            let vertex = at(vertex.clamp(low, high));
            if vertex.0 < shares[best].0 {
                return vertex;
            }
        }
        shares[best]
    }
}

/// A probe's path, straight between its nodes.
pub(super) struct Path(Vec<Node>);

impl Path {
    /// Of sizes and their actions, in order of size, none of which changes how anything scatters.
    pub(super) fn of(nodes: impl Iterator<Item = (f64, White)>) -> Self {
        let node = |(size, action): (f64, White)| Node {
            size,
            widened: White::zeros(action.len()),
            action,
        };
        Self(nodes.map(node).collect())
    }

    /// Its straight ways from node to node, each with the shares of it that are allowed: beyond its ends the path goes on straight for
    /// [`BEYOND`] of its last piece.
    pub(super) fn ways(&self) -> impl Iterator<Item = ([&Node; 2], [f64; 2])> {
        let last = self.0.len().saturating_sub(2);
        (self.0.windows(2).enumerate()).map(move |(i, pair)| ([&pair[0], &pair[1]], bounds(i, last)))
    }

    /// The node that makes a turned data set likeliest in some entries.
    pub(super) fn likeliest(&self, target: &White, entries: Range<usize>) -> Option<Node> {
        let best = |(nodes, bounds)| {
            let stretch = Stretch::new(nodes, entries.clone());
            (stretch.likeliest(target, bounds), stretch)
        };
        let best = self.ways().map(best).min_by(|a, b| a.0.0.total_cmp(&b.0.0));
        best.map(|((_, share), stretch)| stretch.at(share))
    }

    /// The node at a size, straight on beyond its ends.
    pub(super) fn at(&self, size: f64) -> Node {
        let next = self.0.iter().position(|node| size < node.size);
        let next = next.unwrap_or(self.0.len()).clamp(1, self.0.len() - 1);
        let nodes = [&self.0[next - 1], &self.0[next]];
        let share = (size - nodes[0].size) / (nodes[1].size - nodes[0].size);
        Stretch::new(nodes, 0..0).at(share)
    }
}

/// The shares that are allowed of one of a path's pieces, the last of which has such a number.
fn bounds(piece: usize, last: usize) -> [f64; 2] {
    let low = if piece == 0 { -BEYOND } else { 0.0 };
    let high = if piece == last { 1.0 + BEYOND } else { 1.0 };
    [low, high]
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

    fn node(size: f64, action: [f64; 2], widened: f64) -> Node {
        Node {
            size,
            action: White::from_vec(action.to_vec()),
            widened: White::from_element(2, widened),
        }
    }

    #[test]
    fn of_a_path_that_scatters_as_declared_the_nearest_point_is_the_likeliest() {
        // From (1, 0) at size 2 straight up to (1, 4) at size 4, and most of a piece beyond either end.
        let path = Path(vec![node(2.0, [1.0, 0.0], 0.0), node(4.0, [1.0, 4.0], 0.0)]);
        for (target, size) in [([2.0, 3.0], 3.5), ([0.0, 9.0], 5.4), ([5.0, -1.0], 1.5)] {
            let target = White::from_vec(target.to_vec());
            let found = path.likeliest(&target, 0..2).unwrap();
            assert!((found.size - size).abs() < 1e-12, "{}", found.size);
            let left = (&target - &found.action).norm_squared();
            assert!((found.deviance(&target) - left).abs() < 1e-12);
        }
    }

    #[test]
    fn of_a_path_that_only_scatters_more_the_likeliest_variance_is_the_mean_square() {
        let path = Path(vec![node(0.0, [0.0; 2], 0.0), node(1.0, [0.0; 2], 9.0_f64.ln())]);
        let target = White::from_vec(vec![3.0_f64.sqrt(), -1.0]);
        let found = path.likeliest(&target, 0..2).unwrap();
        assert!((found.widened[0] - 2.0_f64.ln()).abs() < 0.05, "{found:?}");
        // Each of two entries: its square in units of the variance, and the logarithm of that.
        let least = 2.0 * (1.0 + 2.0_f64.ln());
        assert!((found.deviance(&target) - least).abs() < 0.002);
        assert_eq!(found.weights(), found.widened.map(|widened| 1.0 / widened.exp()));
    }

    #[test]
    fn a_path_goes_on_straight_beyond_its_ends() {
        let path = Path(vec![
            node(0.0, [0.0; 2], 0.0),
            node(1.0, [2.0, 0.0], 0.5),
            node(3.0, [2.0, 8.0], 0.5),
        ]);
        for (size, action, widened) in [
            (-1.0, [-2.0, 0.0], -0.5),
            (0.5, [1.0, 0.0], 0.25),
            (1.0, [2.0, 0.0], 0.5),
            (4.0, [2.0, 12.0], 0.5),
        ] {
            let found = path.at(size);
            assert_eq!(found.action.as_slice(), action);
            assert_eq!((found.size, found.widened[1]), (size, widened));
        }
    }
}
