//! Two effects at once: over the paths that were simulated beforehand, and by simulation.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::atlas::{Atlas, White};
use super::hunt::{Hunt, Moved};
use super::hypothesis::Hypothesis;
use super::part::{Part, Shape};
use super::refine::Descent;
use super::rounds::{ROUNDS_BESIDE, ROUNDS_OF_SEVERAL, Rung, best_of};
use super::screen::{BEYOND, Screened, price, tangent};
use super::search::{BASES, Found, NEARLY_ALL, STRONG, Search, of_other_effects};
use super::verdict::{faults_beside, stands_alone, suffices};

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
    sizes: [f64; 2],
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
        let mut best: std::collections::BTreeMap<(usize, usize), (f64, [f64; 2])> =
            std::collections::BTreeMap::new();
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
        let mut pairs: Vec<ScreenedPair> = best
            .into_iter()
            .map(|((a, b), (gain, sizes))| {
                let part = |probe, size| Part::screened(self, probe, Shape::Constant, &[size]);
                let hypothesis = Hypothesis {
                    parts: vec![part(a, sizes[0]), part(b, sizes[1])],
                };
                ScreenedPair {
                    hypothesis,
                    score: self.score_of_pair([a, b], 0.5 * gain),
                    left: residual.norm_squared() - gain,
                    sizes,
                }
            })
            .collect();
        pairs.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.diverse(pairs, most)
    }

    /// A pair's gain less the price of its numbers and of having been chosen.
    pub(super) fn score_of_pair(&self, probes: [usize; 2], gain: f64) -> f64 {
        let price_of = |probe: usize| {
            price(self.probes[probe].free.len(), self.layout.total_laps()) + self.choice(probe)
        };
        gain - probes.map(price_of).iter().sum::<f64>()
    }

    /// The best pairs, of the same two effects at most two.
    fn diverse(&self, sorted: Vec<ScreenedPair>, most: usize) -> Vec<ScreenedPair> {
        const ALIKE: usize = 2;
        let names = |pair: &ScreenedPair| -> Vec<&str> {
            pair.hypothesis
                .parts
                .iter()
                .map(|part| self.probes[part.probe].spec.name)
                .collect()
        };
        let mut kept: Vec<ScreenedPair> = Vec::new();
        for pair in sorted {
            let alike = kept.iter().filter(|other| names(other) == names(&pair)).count();
            if kept.len() < most && alike < ALIKE {
                kept.push(pair);
            }
        }
        kept
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

/// Hypotheses of several effects that were descended from, and where that led.
struct Tried {
    rounds: &'static [Rung],
    /// A score that was reached without them.
    reached: f64,
    starts: Vec<Hypothesis>,
    descents: Vec<Descent>,
}

impl Tried {
    fn new(rounds: &'static [Rung], reached: f64) -> Self {
        Self {
            rounds,
            reached,
            starts: Vec::new(),
            descents: Vec::new(),
        }
    }

    /// Whether the best leaves nothing significant.
    fn fits(&self) -> bool {
        best_of(&self.descents).is_some_and(Descent::fits)
    }
}

impl Search<'_> {
    /// Pairs that are looked for together, and explain nearly all of a strong signal where they are simulated, tried to the end.
    pub(super) fn clear_pairs(&self) -> Vec<Found> {
        if !self.is_strong() {
            return Vec::new();
        }
        let best = self.together().first();
        if best.is_none_or(|best| best.score < NEARLY_ALL * self.signal()) {
            return Vec::new();
        }
        let mut tried = Tried::new(&ROUNDS_OF_SEVERAL, f64::NEG_INFINITY);
        self.try_together(&mut tried);
        self.with_exchanged(tried)
    }

    /// The best pairs, tried to the end until one leaves nothing significant: those that together explain most as far as actions add
    /// up, the best single effects with what explains their remainder best, and sizes that jump with another effect, which come
    /// first where they promise more. Before these come last, sizes that jump are tried for themselves and added to the single
    /// effects, if that was not done yet; first of all where they promise as much as the best of these explains.
    pub(super) fn pairs(&self, singles: &mut Vec<Found>) -> Vec<Found> {
        let fits = |singles: &[Found]| singles.first().is_some_and(|best| best.explanation.fits());
        let mut scanned = self.was_scanned();
        if !scanned && self.jumps_promise_as_much(singles) {
            self.scan(singles);
            if fits(singles) {
                return Vec::new();
            }
            scanned = true;
        }
        let mut tried = Tried::new(&ROUNDS_OF_SEVERAL, f64::NEG_INFINITY);
        let mut hunts = if scanned {
            self.promising_hunts()
        } else {
            Vec::new()
        };
        let beats_others = |left: f64| self.together().first().is_none_or(|best| left < best.left);
        let jumps_first = hunts.first().is_some_and(|hunt| beats_others(hunt.left));
        if jumps_first {
            self.descend_on(&mut tried, self.pairs_that_jump(&hunts));
        }
        if !tried.fits() {
            self.try_together(&mut tried);
        }
        if !tried.fits() {
            let mut known = tried.starts.clone();
            for single in of_other_effects(singles.iter()).into_iter().take(BASES) {
                let base = self.trial.base(single.hypothesis.clone());
                let beside = self.beside(&base, &single.left, &known);
                known.extend(beside);
            }
            let further = known.split_off(tried.starts.len());
            self.descend_on(&mut tried, further);
        }
        if !tried.fits() && !jumps_first && !self.explains_most(&tried) {
            if !scanned {
                self.scan(singles);
                if fits(singles) {
                    return self.settle(tried.descents);
                }
            }
            if hunts.is_empty() {
                hunts = self.hunts_of_pairs(&self.screened_pairs_that_jump());
            }
            self.descend_on(&mut tried, self.pairs_that_jump(&hunts));
        }
        self.with_exchanged(tried)
    }

    /// Pairs with a size that jumps, if these promise more than those that are looked for together: they promise rather more than they
    /// keep.
    fn promising_hunts(&self) -> Vec<Hunt> {
        let screened = self.screened_pairs_that_jump();
        let promise = screened.first().map_or(f64::NEG_INFINITY, |best| best.score);
        if self.together().first().is_some_and(|best| promise < best.score) {
            return Vec::new();
        }
        self.hunts_of_pairs(&screened)
    }

    /// Adds the best of the pairs that are looked for together, from which is descended once.
    fn try_together(&self, tried: &mut Tried) {
        const PAIRS: usize = 5;
        let best = self.together().iter().take(PAIRS);
        let best: Vec<Hypothesis> = best.map(|pair| pair.hypothesis.clone()).collect();
        let descend = || self.descend_several(&best, &ROUNDS_OF_SEVERAL, f64::NEG_INFINITY);
        (tried.descents).extend(self.descended_together.get_or_init(descend).iter().cloned());
        tried.starts.extend(best);
    }

    /// Pairs that together explain most as far as actions add up, as simulations where they were screened rank them; simulated
    /// once.
    fn together(&self) -> &[ScreenedPair] {
        const HEARD: usize = 48;
        self.together.get_or_init(|| {
            self.tell(format_args!("which two effects go together"));
            self.heard_pairs(self.atlas().screen_pairs(self.residual, HEARD))
        })
    }

    /// The best pairs of a single effect that explains nearly all, the first of those found, tried to the end: those with what explains
    /// best what it leaves, if anything gains there what a further effect must, and a fair share of what the faults of models may.
    /// Beside an effect that stands alone it must promise more, and by one size: effects change the scatter, and sizes that go over
    /// the runs follow that. A size that jumps is looked for more closely first, and is then the first of those found.
    pub(super) fn pairs_with_first(&self, found: &mut Vec<Found>) -> Vec<Found> {
        const FAIR_SHARE: f64 = 0.3;
        /// Score of the least that could turn out to be worth its numbers.
        const PROMISING: f64 = 5.0;
        const PROMISING_BESIDE: f64 = 10.0;
        let Some(single) = found.first() else {
            return Vec::new();
        };
        let (stands, faults) = (
            stands_alone(&single.explanation),
            faults_beside(&single.explanation),
        );
        let least = FAIR_SHARE * faults;
        let mut tried = Tried::new(&ROUNDS_BESIDE, single.explanation.score + least);
        let jumps = self.jumps(&single.hypothesis);
        let surely_lacks = !suffices(&single.explanation);
        if jumps && surely_lacks {
            self.descend_on(&mut tried, self.jumping_beside(found));
        }
        if !stands && !single.explanation.fits() && !tried.fits() {
            self.descend_on(&mut tried, self.pairs_about(single));
        }
        if tried.fits() {
            return self.with_exchanged(tried);
        }
        self.tell(format_args!("what is beside {}", single.explanation.label()));
        let base = self.trial.base(single.hypothesis.clone());
        let mut screened = self.screened_beside(&base, &single.left);
        screened.retain(|other| !stands || other.hypothesis.is_constant());
        let enough = if stands { PROMISING_BESIDE } else { PROMISING };
        let promises = |screened: &[Screened], enough: f64| {
            screened
                .first()
                .is_some_and(|best| best.score >= enough.max(least))
        };
        if !promises(&screened, enough) {
            return self.with_exchanged(tried);
        }
        let heard = self.heard_beside(&base, screened);
        if !promises(&heard, PROMISING) {
            return self.with_exchanged(tried);
        }
        if let Some(closer) = self.with_closer_sizes(single) {
            found.insert(0, closer);
            return self.pairs_with_first(found);
        }
        self.descend_on(&mut tried, self.beside_of(&heard, &base, &single.left, &[]));
        if !jumps && surely_lacks && !tried.fits() {
            self.descend_on(&mut tried, self.jumping_beside(found));
        }
        self.with_exchanged(tried)
    }

    /// An explanation at better sizes of what jumps, if there are any: sizes are rough, and a further effect would make up for what they
    /// are off.
    fn with_closer_sizes(&self, found: &Found) -> Option<Found> {
        /// Log-likelihood that is worth it.
        const BETTER: f64 = 5.0;
        if found.hypothesis.parts.iter().all(|part| part.held.is_none()) {
            return None;
        }
        self.tell(format_args!("closer sizes of {}", found.explanation.label()));
        let hunted = self.trial.hunt_again(&found.hypothesis, Moved::Little)?;
        let closer = self.settled(&hunted)?;
        (closer.explanation.score > found.explanation.score + BETTER).then_some(closer)
    }

    /// Whether the best leaves so little of a strong signal that an effect that jumps does not stand for either of its own.
    fn explains_most(&self, tried: &Tried) -> bool {
        const LITTLE: f64 = 0.1;
        let all = self.excess(self.residual);
        let left = |best: &Descent| best.remainder.map(|left| left.excess());
        best_of(&tried.descents)
            .filter(|best| best.score > STRONG)
            .and_then(left)
            .is_some_and(|left| left < LITTLE * all)
    }

    /// Descends from further hypotheses.
    fn descend_on(&self, tried: &mut Tried, further: Vec<Hypothesis>) {
        let best = best_of(&tried.descents).map_or(tried.reached, |best| best.score);
        (tried.descents).extend(self.descend_several(&further, tried.rounds, best));
        tried.starts.extend(further);
    }

    /// Pairs with either effect of the best one exchanged for others than were tried, tried to the end.
    fn with_exchanged(&self, mut tried: Tried) -> Vec<Found> {
        // What is no better than fewer effects lacks none.
        const ERRORS: f64 = 2.0;
        let may_be_better = |best: &Descent| best.score + ERRORS * best.score_error > tried.reached;
        if !best_of(&tried.descents).is_some_and(may_be_better) {
            return Vec::new();
        }
        // What leaves far too much lacks a third effect rather than another second one.
        let lacks_none = |best: &&Descent| !best.leaves_far_too_much();
        if let Some(best) = best_of(&tried.descents).filter(lacks_none) {
            let names = self.in_words(std::slice::from_ref(best));
            self.tell(format_args!("what else goes with either of {names}"));
            let exchanged = self.exchanged(best, &tried.starts);
            self.descend_on(&mut tried, exchanged);
        }
        self.settle(tried.descents)
    }

    /// Pairs that were screened with the scores and sizes that simulations of both together give them, best first: actions do not quite
    /// add up.
    pub(super) fn heard_pairs(&self, screened: Vec<ScreenedPair>) -> Vec<ScreenedPair> {
        let heard = |pair: ScreenedPair| self.heard_pair(pair);
        let mut pairs: Vec<ScreenedPair> = screened.into_par_iter().filter_map(heard).collect();
        pairs.sort_by(|a, b| b.score.total_cmp(&a.score));
        pairs
    }

    /// A pair after one step of Gauss and Newton's method along the paths of its probes; `None` where the robot crashes.
    fn heard_pair(&self, pair: ScreenedPair) -> Option<ScreenedPair> {
        const SETS: u64 = 4;
        let atlas = self.atlas();
        let probes = [0, 1].map(|i| pair.hypothesis.parts[i].probe);
        let nothing = atlas.at_rest(Hypothesis::nothing());
        let settings = pair.hypothesis.settings(atlas);
        let left = self.trial.left_beside(&nothing, &settings, 0..SETS)?;
        let [a, b] = [0, 1].map(|i| tangent(&atlas.nodes(probes[i]), pair.sizes[i]));
        let squares = Matrix2::new(a.norm_squared(), a.dot(&b), a.dot(&b), b.norm_squared());
        let products = Vector2::new(a.dot(&left), b.dot(&left));
        let step = squares.try_inverse()? * products;
        let sizes = [0, 1].map(|i| pair.sizes[i] + step[i]);
        let part = |i: usize| Part::screened(atlas, probes[i], Shape::Constant, &[sizes[i]]);
        let gain = 0.5 * (self.residual.norm_squared() - left.norm_squared() + step.dot(&products));
        Some(ScreenedPair {
            hypothesis: Hypothesis {
                parts: vec![part(0), part(1)],
            },
            score: atlas.score_of_pair(probes, gain),
            left: self.residual.norm_squared() - 2.0 * gain,
            sizes,
        })
    }
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
