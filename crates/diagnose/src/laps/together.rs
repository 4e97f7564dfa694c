//! Two effects at once, by the paths that were simulated beforehand.

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

use super::atlas::{Atlas, White};
use super::hypothesis::Hypothesis;
use super::part::{Part, Shape};
use super::path::Node;
use super::screen::price;

/// Two probes at the sizes that together explain most.
#[derive(Debug, Clone)]
pub(super) struct ScreenedPair {
    pub(super) hypothesis: Hypothesis,
    pub(super) score: f64,
    /// What they leave of the residual, as a deviance.
    pub(super) left: f64,
    /// Along the paths of its probes.
    pub(super) sizes: [f64; 2],
}

impl Atlas {
    /// The pairs of constant probes of different effects that make a residual likeliest, best first, each pair of probes once.
    ///
    /// Their actions are taken to add up, and so are the logarithms of how much more they scatter. Looking for both at once finds what one
    /// after the other does not: the best single explanation of two effects is often a third. Effects that jump are left out: their
    /// paths tell nothing.
    pub(super) fn screen_pairs(&self, residual: &White, most: usize) -> Vec<ScreenedPair> {
        let pools = self.pools();
        let target = Pooled::new(&pools, &self.turned(residual));
        let pieces: Vec<PooledPiece> = (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].jumps())
            .flat_map(|probe| self.pooled_pieces(probe, &pools))
            .collect();
        let with_later = |i: usize| {
            let a = &pieces[i];
            let is_other = |b: &&PooledPiece| self.probes[a.probe].spec != self.probes[b.probe].spec;
            let pairs = pieces[i + 1..].iter().filter(is_other).map(|b| {
                let (deviance, shares) = target.likeliest([a, b]);
                ((a.probe, b.probe), (deviance, [a.at(shares[0]), b.at(shares[1])]))
            });
            pairs.collect::<Vec<_>>()
        };
        let all: Vec<Vec<_>> = (0..pieces.len()).into_par_iter().map(with_later).collect();
        let mut best: BTreeMap<(usize, usize), (f64, [f64; 2])> = BTreeMap::new();
        for (probes, found) in all.into_iter().flatten() {
            let known = best.entry(probes).or_insert(found);
            if found.0 < known.0 {
                *known = found;
            }
        }
        let before = residual.norm_squared();
        let mut best: Vec<([usize; 2], ScreenedPair)> = (best.into_iter())
            .map(|((a, b), (deviance, sizes))| {
                let pair = self.screened_pair([a, b], sizes, 0.5 * (before - deviance), deviance);
                ([a, b], pair)
            })
            .collect();
        best.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
        let of = |(probes, _): &([usize; 2], ScreenedPair)| {
            (*probes, probes.map(|probe| self.probes[probe].spec.name))
        };
        diverse(best.into_iter(), of, most)
            .map(|(_, pair)| pair)
            .collect()
    }

    /// Two probes at such sizes, which gain so much and leave such a deviance.
    pub(super) fn screened_pair(
        &self,
        probes: [usize; 2],
        sizes: [f64; 2],
        gain: f64,
        left: f64,
    ) -> ScreenedPair {
        let part = |i: usize| Part::screened(self, probes[i], Shape::Constant, &[sizes[i]]);
        ScreenedPair {
            hypothesis: Hypothesis {
                parts: vec![part(0), part(1)],
            },
            score: self.score_of_pair(probes, gain),
            left,
            sizes,
        }
    }

    /// A pair's gain less the price of its numbers and of having been chosen.
    pub(super) fn score_of_pair(&self, probes: [usize; 2], gain: f64) -> f64 {
        let price_of = |probe: usize| {
            price(self.probes[probe].free.len(), self.layout.total_laps()) + self.choice(probe)
        };
        gain - probes.map(price_of).iter().sum::<f64>()
    }

    fn pooled_pieces(&self, probe: usize, pools: &[Pool]) -> Vec<PooledPiece> {
        let path = self.path(probe, &self.nodes(probe), None);
        (path.ways())
            .map(|(nodes, bounds)| PooledPiece::new(pools, probe, nodes, bounds))
            .collect()
    }

    /// Runs that are alike, entry by entry, and every other entry for itself.
    fn pools(&self) -> Vec<Pool> {
        let mut pools = Vec::new();
        let mut first_run = 0;
        for (recording, laps) in self.layout.laps.iter().enumerate() {
            let runs: Vec<usize> = (first_run..first_run + laps.len()).collect();
            first_run += laps.len();
            if self.alike {
                let total: usize = laps.iter().sum();
                let share = |laps: usize| (laps as f64 / total as f64).sqrt();
                let entry = |i: usize| {
                    let of_run =
                        |(&run, &laps): (&usize, &usize)| (self.layout.run(run).start + i, share(laps));
                    runs.iter().zip(laps).map(of_run).collect()
                };
                pools.extend((0..self.layout.lap).map(entry));
            } else {
                let entries = runs.iter().flat_map(|&run| self.layout.run(run));
                pools.extend(entries.map(|entry| vec![(entry, 1.0)]));
            }
            let others = self.layout.trend(recording).chain(self.layout.second(recording));
            pools.extend(others.map(|entry| vec![(entry, 1.0)]));
        }
        pools
    }
}

/// Entries of a turned data set that no constant effect tells apart, and the share that each has of what they have in common.
type Pool = Vec<(usize, f64)>;

/// What the entries of each pool have in common.
fn pooled(pools: &[Pool], turned: &White) -> Vec<f64> {
    let in_common = |pool: &Pool| pool.iter().map(|(entry, share)| share * turned[*entry]).sum();
    pools.iter().map(in_common).collect()
}

/// What is to be explained, pool by pool.
struct Pooled {
    /// What the entries of each pool have in common.
    target: Vec<f64>,
    /// The square of what they have not: no constant effect explains it, but it is the likelier the wider they scatter.
    rest: Vec<f64>,
}

impl Pooled {
    fn new(pools: &[Pool], turned: &White) -> Self {
        let target = pooled(pools, turned);
        let rest = |(pool, common): (&Pool, &f64)| {
            let square: f64 = pool.iter().map(|(entry, _)| turned[*entry].powi(2)).sum();
            (square - common * common).max(0.0)
        };
        Self {
            rest: pools.iter().zip(&target).map(rest).collect(),
            target,
        }
    }

    /// The least deviance that two pieces leave, and their shares there. How wide both scatter is that of one of few shares of each: the
    /// ones that are nearest to where it leads.
    fn likeliest(&self, pieces: [&PooledPiece; 2]) -> (f64, [f64; 2]) {
        const TURNS: usize = 4;
        let nearest = |shares: [f64; 2]| [0, 1].map(|i| pieces[i].nearest(shares[i]));
        let mut at = nearest(pieces.map(|piece| 0.5 * (piece.bounds[0] + piece.bounds[1])));
        let mut found = self.likeliest_scattering(pieces, at);
        for _ in 1..TURNS {
            let there = nearest(found.1);
            if there == at {
                break;
            }
            at = there;
            found = self.likeliest_scattering(pieces, at);
        }
        found
    }

    /// The same where both scatter as they do at some of their shares.
    fn likeliest_scattering(&self, pieces: [&PooledPiece; 2], at: [usize; 2]) -> (f64, [f64; 2]) {
        let count = self.target.len();
        let [a, b] = pieces;
        let [a_weights, b_weights] = [0, 1].map(|i| &pieces[i].scatters[at[i]].weights[..count]);
        let (target, rest) = (&self.target[..count], &self.rest[..count]);
        let [(a_from, a_along), (b_from, b_along)] =
            pieces.map(|piece| (&piece.from[..count], &piece.along[..count]));
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        let (mut a_left, mut b_left, mut square) = (0.0, 0.0, 0.0);
        for k in 0..count {
            let weight = a_weights[k] * b_weights[k];
            let left = target[k] - a_from[k] - b_from[k];
            let [a, b] = [weight * a_along[k], weight * b_along[k]];
            aa += a * a_along[k];
            ab += a * b_along[k];
            bb += b * b_along[k];
            a_left += a * left;
            b_left += b * left;
            square += weight * (left * left + rest[k]);
        }
        let squares = Matrix2::new(aa, ab, ab, bb);
        let products = Vector2::new(a_left, b_left);
        let shares = within(squares, products, [a.bounds, b.bounds]);
        let explained = 2.0 * products.dot(&shares) - shares.dot(&(squares * shares));
        let wider = a.scatters[at[0]].log_determinant + b.scatters[at[1]].log_determinant;
        (square - explained + wider, shares.into())
    }
}

/// Where a quadratic form is least within bounds, by its matrix and its products with what is to be explained.
fn within(squares: Matrix2<f64>, products: Vector2<f64>, bounds: [[f64; 2]; 2]) -> Vector2<f64> {
    /// Turns of coordinate descent that end at the constrained minimum.
    const TURNS: usize = 4;
    /// Share of the product of its squares below which a determinant is not told from nothing.
    const SINGULAR: f64 = 1e-9;
    let is_regular = squares.determinant() > SINGULAR * squares[(0, 0)] * squares[(1, 1)];
    let inverse = is_regular.then(|| squares.try_inverse()).flatten();
    let mut shares = inverse.map_or(Vector2::zeros(), |inverse| inverse * products);
    let is_within = |shares: &Vector2<f64>| {
        let mut pairs = shares.iter().zip(bounds);
        pairs.all(|(share, [low, high])| (low..=high).contains(share))
    };
    if is_regular && is_within(&shares) {
        return shares;
    }
    for _ in 0..TURNS {
        for (i, [low, high]) in bounds.into_iter().enumerate() {
            let square = squares[(i, i)];
            let best = (products[i] - squares[(0, 1)] * shares[1 - i]) / square;
            shares[i] = if square > 0.0 { best } else { 0.0 }.clamp(low, high);
        }
    }
    shares
}

/// A straight piece of a probe's path, pool by pool.
struct PooledPiece {
    probe: usize,
    sizes: [f64; 2],
    /// Shares of the piece that are allowed.
    bounds: [f64; 2],
    from: Vec<f64>,
    along: Vec<f64>,
    /// At [`SCATTERS`] shares from the one bound to the other.
    scatters: Vec<PooledScatter>,
}

/// Shares of a piece at which it is known how wide it scatters.
const SCATTERS: usize = 9;

/// How wide a piece scatters at one of its shares.
struct PooledScatter {
    /// Reciprocals of the variances.
    weights: Vec<f64>,
    /// Of the variances of all entries.
    log_determinant: f64,
}

impl PooledPiece {
    fn new(pools: &[Pool], probe: usize, nodes: [&Node; 2], bounds: [f64; 2]) -> Self {
        let [from, to] = nodes.map(|node| pooled(pools, &node.action));
        // The entries of a pool scatter as its first one.
        let widened =
            nodes.map(|node| -> Vec<f64> { pools.iter().map(|pool| node.widened[pool[0].0]).collect() });
        let piece = Self {
            probe,
            sizes: nodes.map(|node| node.size),
            bounds,
            along: to.iter().zip(&from).map(|(to, from)| to - from).collect(),
            from,
            scatters: Vec::new(),
        };
        let scatter = |k: usize| {
            let share = piece.share(k);
            let widened = widened[0].iter().zip(&widened[1]);
            let widened = widened.map(|(from, to)| from + share * (to - from));
            let of_pools = widened.clone().zip(pools);
            PooledScatter {
                log_determinant: of_pools.map(|(widened, pool)| pool.len() as f64 * widened).sum(),
                weights: widened.map(|widened| (-widened).exp()).collect(),
            }
        };
        Self {
            scatters: (0..SCATTERS).map(scatter).collect(),
            ..piece
        }
    }

    /// One of the shares at which it is known how wide the piece scatters.
    fn share(&self, k: usize) -> f64 {
        let [low, high] = self.bounds;
        low + (high - low) * k as f64 / (SCATTERS - 1) as f64
    }

    /// The nearest of those.
    fn nearest(&self, share: f64) -> usize {
        let [low, high] = self.bounds;
        ((share - low) / (high - low) * (SCATTERS - 1) as f64).round() as usize
    }

    /// The size at a share of the piece.
    fn at(&self, share: f64) -> f64 {
        self.sizes[0] + share * (self.sizes[1] - self.sizes[0])
    }
}

/// The first pairs, of the same two effects at most two, and at most half of them with the same probe: one that explains much alone
/// does so with any other, and leaves no room for two of which neither does. `of` tells a pair's probes and their effects.
fn diverse<'n, T>(
    sorted: impl Iterator<Item = T>,
    of: impl Fn(&T) -> ([usize; 2], [&'n str; 2]),
    most: usize,
) -> impl Iterator<Item = T> {
    const ALIKE: usize = 2;
    let with_probe = most.div_ceil(2);
    let mut of_effects: BTreeMap<[&str; 2], usize> = BTreeMap::new();
    let mut of_probe: BTreeMap<usize, usize> = BTreeMap::new();
    let has_room = move |pair: &T| {
        let (probes, effects) = of(pair);
        let alike = of_effects.entry(effects).or_default();
        let is_full = |probe: &usize| of_probe.get(probe) == Some(&with_probe);
        if *alike == ALIKE || probes.iter().any(is_full) {
            return false;
        }
        *alike += 1;
        for probe in probes {
            *of_probe.entry(probe).or_default() += 1;
        }
        true
    };
    sorted.filter(has_room).take(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::spread::Spread;
    use crate::laps::testing::{atlas_of, twice_as_wide};

    #[test]
    fn a_strong_effect_leaves_room_for_pairs_without_it() {
        // The effect of each probe: a patch has two places.
        let effects = ["gain", "wall", "patch", "patch", "lag", "slip", "axle"];
        let pairs = [[0, 2], [0, 3], [2, 3], [0, 4], [0, 5], [1, 4], [5, 6], [1, 6]];
        let of = |pair: &[usize; 2]| (*pair, pair.map(|probe| effects[probe]));
        let kept: Vec<[usize; 2]> = diverse(pairs.into_iter(), of, 6).collect();
        assert_eq!(kept, [[0, 2], [0, 3], [2, 3], [0, 4], [1, 4], [5, 6]]);
        let same = [[0, 2], [0, 3], [0, 2], [1, 2]];
        assert_eq!(
            diverse(same.into_iter(), of, 9).collect::<Vec<_>>(),
            [[0, 2], [0, 3], [1, 2]]
        );
    }

    #[test]
    fn a_form_is_least_at_its_vertex_or_where_a_bound_meets_it() {
        let squares = Matrix2::new(2.0, 1.0, 1.0, 2.0);
        let least = |products: [f64; 2], bounds| within(squares, products.into(), bounds);
        let wide = [[-9.0, 9.0]; 2];
        // 2 x + y = 4, x + 2 y = 5.
        assert!((least([4.0, 5.0], wide) - Vector2::new(1.0, 2.0)).norm() < 1e-12);
        // y no more than 1: 2 x + 1 = 4.
        let found = least([4.0, 5.0], [[-9.0, 9.0], [0.0, 1.0]]);
        assert!((found - Vector2::new(1.5, 1.0)).norm() < 1e-12);
        let same = Matrix2::from_element(1.0);
        let found = within(same, Vector2::new(3.0, 3.0), [[0.0, 1.0]; 2]);
        assert_eq!(found, Vector2::new(1.0, 1.0));
    }

    #[test]
    fn pools_tell_of_two_paths_what_all_entries_do() {
        let mut atlas = atlas_of(&["wheel-scale", "axle-length"]);
        let wide = Spread::of(&atlas.axes, &twice_as_wide(2), &atlas.variances);
        for departure in atlas.paths[1].iter_mut().flatten() {
            departure.spread = wide.clone();
        }
        for alike in [true, false] {
            atlas.alike = alike;
            let residual = atlas.white(&atlas.samples[3], &atlas.null) * 3.0;
            let pools = atlas.pools();
            let target = Pooled::new(&pools, &atlas.turned(&residual));
            let [a, b] = [0, 1].map(|probe| atlas.pooled_pieces(probe, &pools).remove(1));
            let (deviance, shares) = target.likeliest_scattering([&a, &b], [3, 6]);
            let at = |piece: &PooledPiece, share: f64| {
                let path = atlas.path(piece.probe, &atlas.nodes(piece.probe), None);
                path.at(piece.at(share))
            };
            let node = Node {
                size: 0.0,
                action: at(&a, shares[0]).action + at(&b, shares[1]).action,
                widened: at(&a, a.share(3)).widened + at(&b, b.share(6)).widened,
            };
            let expected = node.deviance(&atlas.turned(&residual));
            assert!(
                (deviance - expected).abs() < 1e-6 * expected,
                "{deviance} {expected}"
            );
            assert!(node.widened.amax() > 0.1);
        }
    }
}
