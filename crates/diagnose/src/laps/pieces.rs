//! Straight pieces of the paths that were simulated beforehand, one or two of which come nearest to a residual.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::atlas::{Atlas, White};
use super::hypothesis::Hypothesis;
use super::part::{Part, Shape};
use super::screen::{BEYOND, price};

/// A straight piece of a probe's path.
pub(super) struct Piece {
    pub(super) probe: usize,
    from_size: f64,
    to_size: f64,
    /// Shares of the piece that are allowed.
    low: f64,
    high: f64,
    from: White,
    along: White,
    /// Products of the two with themselves and with each other.
    from_square: f64,
    along_square: f64,
    along_from: f64,
}

/// Pieces as the columns of two matrices: where they start, and where they lead.
pub(super) struct Columns {
    pub(super) from: DMatrix<f64>,
    pub(super) along: DMatrix<f64>,
}

impl Columns {
    pub(super) fn of(pieces: &[Piece]) -> Self {
        let columns = |of: fn(&Piece) -> &White| {
            DMatrix::from_columns(&pieces.iter().map(|piece| of(piece).clone()).collect::<Vec<_>>())
        };
        Self {
            from: columns(|piece| &piece.from),
            along: columns(|piece| &piece.along),
        }
    }
}

impl Piece {
    /// A straight piece between two sizes, each with its action.
    fn new(
        probe: usize,
        [from_size, to_size]: [f64; 2],
        [low, high]: [f64; 2],
        from: &White,
        to: &White,
    ) -> Self {
        let along = to - from;
        Self {
            probe,
            from_size,
            to_size,
            low,
            high,
            from_square: from.norm_squared(),
            along_square: along.norm_squared(),
            along_from: along.dot(from),
            from: from.clone(),
            along,
        }
    }

    /// The squared distance to a target that the piece's best point gains, and its size, by the target's products with the piece.
    pub(super) fn best(&self, along_target: f64, from_target: f64) -> (f64, f64) {
        let square = self.along_square;
        let product = along_target - self.along_from;
        let share = (product / square.max(f64::MIN_POSITIVE)).clamp(self.low, self.high);
        let gain = 2.0 * from_target - self.from_square + share * (2.0 * product - share * square);
        (gain, self.at(share))
    }

    /// The size at a share of the piece.
    fn at(&self, share: f64) -> f64 {
        self.from_size + share * (self.to_size - self.from_size)
    }
}

/// Two probes at the sizes that together explain most.
#[derive(Debug, Clone)]
pub(super) struct ScreenedPair {
    pub(super) hypothesis: Hypothesis,
    pub(super) score: f64,
    /// What they leave of the residual, in squared distance.
    pub(super) left: f64,
    /// Along the paths of its probes.
    pub(super) sizes: [f64; 2],
}

impl Atlas {
    /// The pairs of constant probes of different effects that explain a residual best, best first, each pair of probes once.
    ///
    /// Their actions are taken to add up. Looking for both at once finds what one after the other does not: the best
    /// single explanation of two effects is often a third. Effects that jump are left out: their paths tell nothing.
    pub(super) fn screen_pairs(&self, residual: &White, most: usize) -> Vec<ScreenedPair> {
        let pieces = self.smooth_pieces();
        let Columns { from, along } = Columns::of(&pieces);
        let products = Products {
            along_along: along.tr_mul(&along),
            along_from: along.tr_mul(&from),
            from_from: from.tr_mul(&from),
            along_target: along.tr_mul(residual),
            from_target: from.tr_mul(residual),
        };
        let mut best: BTreeMap<(usize, usize), (f64, [f64; 2])> = BTreeMap::new();
        for (i, a) in pieces.iter().enumerate() {
            for (j, b) in pieces.iter().enumerate().skip(i + 1) {
                if self.probes[a.probe].spec == self.probes[b.probe].spec {
                    continue;
                }
                let (gain, shares) = products.best([i, j], [a, b]);
                let sizes = [a.at(shares[0]), b.at(shares[1])];
                let entry = best
                    .entry((a.probe, b.probe))
                    .or_insert((f64::NEG_INFINITY, sizes));
                if gain > entry.0 {
                    *entry = (gain, sizes);
                }
            }
        }
        let mut best: Vec<_> = (best.into_iter())
            .map(|((a, b), (gain, sizes))| ([a, b], self.score_of_pair([a, b], 0.5 * gain), gain, sizes))
            .collect();
        best.sort_by(|a, b| b.1.total_cmp(&a.1));
        let name = |probe: usize| self.probes[probe].spec.name;
        diverse(best.into_iter(), |(probes, ..)| (*probes, probes.map(name)), most)
            .map(|(probes, score, gain, sizes)| {
                let part = |i: usize| Part::screened(self, probes[i], Shape::Constant, &[sizes[i]]);
                ScreenedPair {
                    hypothesis: Hypothesis {
                        parts: vec![part(0), part(1)],
                    },
                    score,
                    left: residual.norm_squared() - gain,
                    sizes,
                }
            })
            .collect()
    }

    /// A pair's gain less the price of its numbers and of having been chosen.
    pub(super) fn score_of_pair(&self, probes: [usize; 2], gain: f64) -> f64 {
        let price_of = |probe: usize| {
            price(self.probes[probe].free.len(), self.layout.total_laps()) + self.choice(probe)
        };
        gain - probes.map(price_of).iter().sum::<f64>()
    }

    /// The paths of all probes that do not jump.
    pub(super) fn smooth_pieces(&self) -> Vec<Piece> {
        (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].jumps())
            .flat_map(|probe| self.pieces(probe))
            .collect()
    }

    fn pieces(&self, probe: usize) -> Vec<Piece> {
        let nodes = self.nodes(probe);
        let last = nodes.len().saturating_sub(2);
        let piece = |(i, pair): (usize, &[(f64, White)])| {
            let low = if i == 0 { -BEYOND } else { 0.0 };
            let high = if i == last { 1.0 + BEYOND } else { 1.0 };
            let sizes = [pair[0].0, pair[1].0];
            Piece::new(probe, sizes, [low, high], &pair[0].1, &pair[1].1)
        };
        nodes.windows(2).enumerate().map(piece).collect()
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

/// Scalar products of everything that a pair's distance needs.
struct Products {
    along_along: DMatrix<f64>,
    /// Rows: along; columns: from.
    along_from: DMatrix<f64>,
    from_from: DMatrix<f64>,
    along_target: DVector<f64>,
    from_target: DVector<f64>,
}

impl Products {
    /// The squared distance that the best point of two pieces gains, and its shares of them.
    fn best(&self, at: [usize; 2], pieces: [&Piece; 2]) -> (f64, [f64; 2]) {
        let [i, j] = at;
        // target - from_i - from_j, seen along each piece.
        let seen = |k: usize| self.along_target[k] - self.along_from[(k, i)] - self.along_from[(k, j)];
        let g = [seen(i), seen(j)];
        let [a, b, c] = [
            self.along_along[(i, i)],
            self.along_along[(j, j)],
            self.along_along[(i, j)],
        ];
        let clamp = |k: usize, share: f64| share.clamp(pieces[k].low, pieces[k].high);
        let determinant = a * b - c * c;
        let mut shares = [0.0, 0.0];
        if determinant > 1e-9 * a * b {
            shares = [
                (b * g[0] - c * g[1]) / determinant,
                (a * g[1] - c * g[0]) / determinant,
            ];
        }
        // Within the bounds a few turns of coordinate descent end at the constrained minimum.
        for _ in 0..4 {
            shares[0] = clamp(0, if a > 0.0 { (g[0] - c * shares[1]) / a } else { 0.0 });
            shares[1] = clamp(1, if b > 0.0 { (g[1] - c * shares[0]) / b } else { 0.0 });
        }
        let [s, t] = shares;
        let constant = 2.0 * (self.from_target[i] + self.from_target[j])
            - self.from_from[(i, i)]
            - self.from_from[(j, j)]
            - 2.0 * self.from_from[(i, j)];
        let gain = constant + 2.0 * (s * g[0] + t * g[1]) - s * s * a - t * t * b - 2.0 * s * t * c;
        (gain, shares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_best_point_of_a_piece_is_the_projection_within_its_bounds() {
        // From (1, 0) at size 2 straight up to (1, 4) at size 4, and half a piece beyond.
        let [from, to] = [[1.0, 0.0], [1.0, 4.0]].map(|v| White::from_vec(v.to_vec()));
        let piece = Piece::new(0, [2.0, 4.0], [0.0, 1.5], &from, &to);
        for (target, size, nearest) in [
            ([2.0, 3.0], 3.5, [1.0, 3.0]),
            ([0.0, 9.0], 5.0, [1.0, 6.0]),
            ([5.0, -1.0], 2.0, [1.0, 0.0]),
        ] {
            let [target, nearest] = [target, nearest].map(|v| White::from_vec(v.to_vec()));
            let (gain, found) = piece.best(piece.along.dot(&target), piece.from.dot(&target));
            let gained = target.norm_squared() - (&target - nearest).norm_squared();
            assert!((found - size).abs() < 1e-12 && (gain - gained).abs() < 1e-12);
        }
    }
}
