//! Two effects at once: which go together, and pairs tried to the end.

use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

use super::atlas::Atlas;
use super::hunt::{Hunt, Moved};
use super::hypothesis::Hypothesis;
use super::part::Part;
use super::path::tangent;
use super::refine::Descent;
use super::rounds::{ERRORS, ROUNDS_OF_SEVERAL, Rung, best_of, is_slow};
use super::search::{BASES, Found, NEARLY_ALL, STRONG, Search, of_other_effects};
use super::together::ScreenedPair;
use super::verdict::WORTH;

/// Hypotheses of several effects that were descended from, and where that led.
pub(super) struct Tried {
    rounds: &'static [Rung],
    /// A score that was reached without them.
    reached: f64,
    starts: Vec<Hypothesis>,
    descents: Vec<Descent>,
}

impl Tried {
    pub(super) fn new(rounds: &'static [Rung], reached: f64) -> Self {
        Self {
            rounds,
            reached,
            starts: Vec::new(),
            descents: Vec::new(),
        }
    }

    /// What was descended from.
    pub(super) fn starts(&self) -> &[Hypothesis] {
        &self.starts
    }

    /// Where descents led.
    pub(super) fn descents(&self) -> &[Descent] {
        &self.descents
    }

    /// Whether the best may be better than what was reached without them.
    fn may_be_better(&self) -> bool {
        best_of(&self.descents).is_some_and(|best| best.score + ERRORS * best.score_error > self.reached)
    }

    /// Whether a descent led to where a hypothesis has its effects, whatever their sizes.
    fn has_been_at(&self, hypothesis: &Hypothesis, atlas: &Atlas) -> bool {
        let is_there = |descent: &Descent| hypothesis.is_at_places_of(&descent.hypothesis, atlas);
        self.descents.iter().any(is_there)
    }

    /// Whether the best leaves nothing that even hints at another one.
    pub(super) fn leaves_no_hint(&self) -> bool {
        best_of(&self.descents).is_some_and(Descent::leaves_no_hint)
    }

    /// Whether the best leaves nothing significant.
    pub(super) fn fits(&self) -> bool {
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
        self.try_together(&mut tried, &[]);
        self.with_exchanged(tried)
    }

    /// The best pairs, tried to the end until one leaves nothing significant: those that together explain most as far as actions add
    /// up, the best single effects with what explains their remainder best, and sizes that jump with another effect, which come
    /// first where they promise more, and where the best single effect is one. Before these come last, sizes that jump are tried for
    /// themselves and added to the single effects, if that was not done yet; first of all where they promise as much as the best of
    /// these explains.
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
        let mut hunts = if scanned {
            self.promising_hunts()
        } else {
            Vec::new()
        };
        if let Some(best) = singles.first().filter(|best| best.explanation.fits())
            && !self.may_be_worth_it(best, &hunts)
        {
            return Vec::new();
        }
        let mut tried = Tried::new(&ROUNDS_OF_SEVERAL, f64::NEG_INFINITY);
        let beats_others = |left: f64| self.together().first().is_none_or(|best| left < best.left);
        let jumps_first = hunts.first().is_some_and(|hunt| beats_others(hunt.left));
        if jumps_first {
            self.descend_on_jumping(&mut tried, self.pairs_that_jump(&hunts));
        }
        if let Some(single) = singles.first()
            && !tried.fits()
        {
            self.descend_on_jumping(&mut tried, self.pairs_about(single));
        }
        if !tried.fits() {
            self.try_together(&mut tried, singles);
        }
        if !tried.fits() {
            let singles = of_other_effects(singles.iter()).into_iter().take(BASES);
            let further = self.beside_found(singles, &tried.starts);
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
            self.descend_on_jumping(&mut tried, self.pairs_that_jump(&hunts));
        }
        self.with_exchanged(tried)
    }

    /// Whether a pair may gain what its numbers must beside a single effect that leaves nothing significant, as far as paths and hunts
    /// tell.
    fn may_be_worth_it(&self, single: &Found, hunts: &[Hunt]) -> bool {
        let least = single.explanation.score + WORTH;
        let hunted = hunts.first().map(|hunt| self.gained(hunt.left));
        hunted.is_some_and(|gain| gain > least)
            || self.together().first().is_some_and(|best| best.score > least)
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

    /// Adds the best of the pairs that are looked for together, from which is descended once: from where a single effect came to
    /// rest if one of theirs is about there.
    pub(super) fn try_together(&self, tried: &mut Tried, singles: &[Found]) {
        const PAIRS: usize = 5;
        let best = self.together().iter().take(PAIRS);
        let best: Vec<Hypothesis> = best
            .map(|pair| self.at_places_of(singles, &pair.hypothesis))
            .collect();
        let descend = || self.descend_several(&best, &ROUNDS_OF_SEVERAL, f64::NEG_INFINITY);
        (tried.descents).extend(self.descended_together.get_or_init(descend).iter().cloned());
        tried.starts.extend(best);
    }

    /// A hypothesis with the numbers of single effects that have a place in place of those that are about there.
    fn at_places_of(&self, singles: &[Found], hypothesis: &Hypothesis) -> Hypothesis {
        let mut moved = hypothesis.clone();
        for part in &mut moved.parts {
            let is_about_there = |found: &&Found| match found.hypothesis.parts.as_slice() {
                [found] => part.is_at_place_of(found, self.atlas()),
                _ => false,
            };
            if self.atlas().probes[part.probe].has_place()
                && let Some(found) = singles.iter().find(is_about_there)
            {
                *part = found.hypothesis.parts[0].clone();
            }
        }
        moved
    }

    /// Pairs that together explain most as far as actions add up, as simulations where they were screened rank them; simulated
    /// once.
    fn together(&self) -> &[ScreenedPair] {
        const HEARD: usize = 96;
        self.together.get_or_init(|| {
            self.tell(format_args!("which two effects go together"));
            self.heard_pairs(self.atlas().screen_pairs(self.residual, HEARD))
        })
    }

    /// Whether pairs that are looked for together promise more than the best of what was tried.
    pub(super) fn together_promise_more_than(&self, tried: &Tried) -> bool {
        let best = best_of(&tried.descents).map_or(tried.reached, |best| best.score);
        self.together().first().is_some_and(|first| first.score > best)
    }

    /// Whether the best leaves so little of a strong signal, and not far too much for chance, that an effect that jumps does not stand for
    /// either of its own.
    fn explains_most(&self, tried: &Tried) -> bool {
        const LITTLE: f64 = 0.1;
        best_of(&tried.descents)
            .filter(|best| best.score > STRONG && !best.leaves_far_too_much())
            .and_then(Descent::missing)
            .is_some_and(|missing| missing < LITTLE * self.signal())
    }

    /// Descends from further hypotheses.
    pub(super) fn descend_on(&self, tried: &mut Tried, further: Vec<Hypothesis>) {
        let best = best_of(&tried.descents).map_or(tried.reached, |best| best.score);
        (tried.descents).extend(self.descend_several(&further, tried.rounds, best));
        tried.starts.extend(further);
    }

    /// The same of pairs with a size that jumps, and from better sizes of the best of them as long as these get on and leave far too
    /// much: where the other effect has moved since, they may lie some per cent off.
    fn descend_on_jumping(&self, tried: &mut Tried, further: Vec<Hypothesis>) {
        const LOOKS: [(Moved, usize); 3] = [(Moved::Far, 2), (Moved::Little, 1), (Moved::Little, 1)];
        /// Share of what the best leaves by which a pair may lie behind it.
        const BEHIND: f64 = 0.5;
        let mut known = tried.descents.len();
        self.descend_on(tried, further);
        let mut before = f64::NEG_INFINITY;
        for (moved, most) in LOOKS {
            let Some(best) = best_of(&tried.descents).filter(|best| best.leaves_far_too_much()) else {
                break;
            };
            let least = best.score - BEHIND * best.missing().unwrap_or_default();
            let mut near: Vec<&Descent> = (tried.descents[known..].iter())
                .filter(|descent| descent.score > least && descent.hypothesis.has_held())
                .collect();
            if near.is_empty() || is_slow(best, best.score - before) {
                break;
            }
            near.sort_by(|a, b| b.score.total_cmp(&a.score));
            self.tell(format_args!("closer sizes of what jumps"));
            let closer = (near.into_iter().take(most))
                .filter_map(|descent| self.trial.hunt_again(&descent.hypothesis, moved))
                .collect();
            (known, before) = (tried.descents.len(), best.score);
            self.descend_on(tried, closer);
        }
    }

    /// Pairs after [`Search::exchange`], tried to the end.
    pub(super) fn with_exchanged(&self, tried: Tried) -> Vec<Found> {
        self.with_exchanged_beside(tried, None)
    }

    /// The same with only those exchanged that are beside the effect of a probe, if there is a `certain` one.
    pub(super) fn with_exchanged_beside(&self, mut tried: Tried, certain: Option<usize>) -> Vec<Found> {
        self.exchange(&mut tried, certain);
        self.settle_tried(tried)
    }

    /// Pairs tried to the end, if the best may be better than what was reached without them: what is no better than fewer effects lacks
    /// none.
    pub(super) fn settle_tried(&self, tried: Tried) -> Vec<Found> {
        if tried.may_be_better() {
            self.settle(tried.descents)
        } else {
            Vec::new()
        }
    }

    /// Adds pairs with either effect of the best one exchanged for others than were tried, and then the effects that were not kept so far
    /// of those that come near it; only the effect beside a `certain` one if there is such.
    fn exchange(&self, tried: &mut Tried, certain: Option<usize>) {
        /// Log-likelihood by which pairs may be behind the best, and either be the right one.
        const NEAR: f64 = 6.0;
        if !tried.may_be_better() {
            return;
        }
        let mut kept: Vec<Part> = Vec::new();
        for near in [0.0, NEAR] {
            let mut keep = self.worth_keeping(&tried.descents, near, &kept);
            keep.retain(|part| certain.is_none_or(|certain| part.probe == certain));
            if keep.is_empty() {
                break;
            }
            let names: Vec<&str> = (keep.iter())
                .map(|part| self.atlas().probes[part.probe].spec.name)
                .collect();
            self.tell(format_args!("what else goes with {}", names.join(" or ")));
            let mut exchanged = self.beside_each(&keep, &tried.starts);
            // A place is screened at a grid: from a neighbour of where one was found the same would be found again.
            exchanged.retain(|pair| !tried.has_been_at(pair, self.atlas()));
            self.descend_on(tried, exchanged);
            kept.extend(keep);
        }
    }

    /// The effects of the best descent and of others that are so near it, but for those that do about what others do that were kept
    /// already: none where the best leaves far too much, which lacks a third effect rather than another second one.
    fn worth_keeping(&self, descents: &[Descent], near: f64, kept: &[Part]) -> Vec<Part> {
        const MOST: usize = 2;
        let Some(best) = best_of(descents).filter(|best| !best.leaves_far_too_much()) else {
            return Vec::new();
        };
        let mut near: Vec<&Descent> = (descents.iter())
            .filter(|descent| descent.score >= best.score - near)
            .collect();
        near.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut keep: Vec<Part> = Vec::new();
        for part in near.iter().flat_map(|descent| &descent.hypothesis.parts) {
            let mut known = kept.iter().chain(&keep);
            if keep.len() < MOST && !known.any(|known| self.atlas().do_alike(part, known)) {
                keep.push(part.clone());
            }
        }
        keep
    }

    /// The best of the pairs that were screened, with the scores and sizes that simulations of both together give them, best first:
    /// actions do not quite add up. Few data sets tell which are worth more (a race).
    fn heard_pairs(&self, mut pairs: Vec<ScreenedPair>) -> Vec<ScreenedPair> {
        /// Data sets by which those that are left are told apart, and how many are.
        const RACE: [u64; 2] = [1, 4];
        const LEFT: usize = 16;
        for sets in RACE {
            let heard = pairs
                .into_par_iter()
                .filter_map(|pair| self.heard_pair(pair, sets));
            pairs = heard.collect();
            pairs.sort_by(|a, b| b.score.total_cmp(&a.score));
            pairs.truncate(LEFT);
        }
        pairs
    }

    /// A pair after one step of Gauss and Newton's method along the paths of its probes; `None` where the robot crashes.
    fn heard_pair(&self, pair: ScreenedPair, sets: u64) -> Option<ScreenedPair> {
        let atlas = self.atlas();
        let probes = [0, 1].map(|i| pair.hypothesis.parts[i].probe);
        let (left, scatter) = self.trial.heard(&pair.hypothesis, sets)?;
        let weights = scatter.weights();
        let moves = [0, 1].map(|i| atlas.turned(&tangent(&atlas.nodes(probes[i]), pair.sizes[i])));
        let [a, b] = [0, 1].map(|i| moves[i].component_mul(&weights));
        let squares = Matrix2::new(
            a.dot(&moves[0]),
            a.dot(&moves[1]),
            a.dot(&moves[1]),
            b.dot(&moves[1]),
        );
        let products = Vector2::new(a.dot(&left), b.dot(&left));
        let step = squares.try_inverse()? * products;
        let sizes = [0, 1].map(|i| pair.sizes[i] + step[i]);
        let deviance = scatter.deviance(&left) - step.dot(&products);
        let gain = self.gained(deviance);
        Some(atlas.screened_pair(probes, sizes, gain, deviance))
    }
}
