//! A second effect beside a single one that explains nearly all.

use super::hunt::Moved;
use super::hypothesis::Hypothesis;
use super::pairs::Tried;
use super::rounds::{ROUNDS_BESIDE, ROUNDS_OF_LITTLE, best_of};
use super::screen::Screened;
use super::search::{BASES, Found, Search, of_other_effects};
use super::verdict::{ALL_BUT_FAULTS, faults_beside, is_worth_its_numbers, stands_alone, suffices};

/// What could go with a single effect, by what it explains of that one's remainder.
enum Promise {
    /// Nothing.
    None,
    /// A little: these may be listed, but hardly claimed.
    Little(Vec<Hypothesis>),
    /// Enough to be claimed.
    Enough(Vec<Hypothesis>),
}

impl Search<'_> {
    /// The best pairs of a single effect that explains nearly all, the first of those found, tried to the end: those with what explains
    /// best what it leaves. A size that jumps is looked for more closely first, and is then the first of those found.
    pub(super) fn pairs_with_first(&self, found: &mut Vec<Found>) -> Vec<Found> {
        let Some(single) = found.first().cloned() else {
            return Vec::new();
        };
        let single = &single;
        let reached = single.explanation.score + fair_share_of_faults(single);
        let mut tried = Tried::new(&ROUNDS_BESIDE, reached);
        let jumps = self.jumps(&single.hypothesis);
        let surely_lacks = !suffices(&single.explanation);
        if !stands_alone(&single.explanation) && !single.explanation.fits() {
            self.descend_on(&mut tried, self.pairs_about(single));
        }
        if jumps && surely_lacks && !tried.leaves_no_hint() {
            self.descend_on(&mut tried, self.jumping_beside(found.iter()));
        }
        let mut promises = false;
        if !tried.fits() {
            match self.promise_beside(single) {
                Promise::None => {}
                // Sizes that jump are rough.
                Promise::Little(_) if jumps => {}
                Promise::Little(pairs) => {
                    let descents = self.descend(pairs.iter(), &ROUNDS_OF_LITTLE, f64::NEG_INFINITY);
                    return self.settle_roughly(descents);
                }
                Promise::Enough(pairs) => {
                    if let Some(closer) = self.with_closer_sizes(single) {
                        found[0] = closer;
                        return self.pairs_with_first(found);
                    }
                    promises = true;
                    self.descend_on(&mut tried, pairs);
                    if stands_alone(&single.explanation) {
                        // What is not worth its numbers lacks no other name.
                        let ends = self.settle_roughly(tried.descents().to_vec());
                        if let Some(closer) = self.at_sizes_of_best(single, &ends) {
                            found[0] = closer;
                        }
                        let alone = &found[0].explanation;
                        let is_worth_it = |pair: &Found| is_worth_its_numbers(alone, &pair.explanation);
                        if !ends.iter().any(is_worth_it) {
                            return ends;
                        }
                        // What leaves so little that something else makes up for it may be a rounding.
                        if !jumps {
                            self.descend_on(&mut tried, self.jumping_beside(found.iter().take(1)));
                        }
                    }
                }
            }
        }
        // Two effects that have nothing of the single one may do together what it does nearly, and come first where they promise more
        // than what was tried.
        let may_be_others = self.lacks_more_than_faults(single);
        let others_first = may_be_others && !tried.fits() && self.together_promise_more_than(&tried);
        if others_first {
            self.try_together(&mut tried, found);
        }
        // A further effect may do more beside another single one than what the first is ahead.
        if self.is_strong() && !single.explanation.fits() && !jumps && !tried.fits() {
            let beside = self.beside_next(found, tried.starts());
            self.descend_on(&mut tried, beside);
        }
        if may_be_others && !others_first && !tried.fits() {
            self.try_together(&mut tried, found);
        }
        if promises && !jumps && surely_lacks && !tried.fits() {
            self.descend_on(&mut tried, self.jumping_beside(found.iter()));
        }
        let certain = Self::certain_in(&tried, found);
        self.with_exchanged_beside(tried, certain)
    }

    /// Others than the first of some single effects that explain nearly as much, with what explains best what they leave.
    fn beside_next(&self, found: &[Found], tried: &[Hypothesis]) -> Vec<Hypothesis> {
        let least = found
            .first()
            .map_or(0.0, |first| NEARLY * first.explanation.score);
        let others = of_other_effects(found.iter()).into_iter().skip(1).take(BASES);
        self.beside_found(others.filter(|other| other.explanation.score > least), tried)
    }

    /// The probe of the first of some single effects, where the best of several effects has it and leaves nothing significant, and every
    /// other single effect explains clearly less, or is farther behind than a second one would make up for: it is not to be exchanged.
    fn certain_in(tried: &Tried, found: &[Found]) -> Option<usize> {
        /// Times what the other effect gains by which another single one may be behind, and come before the first beside some effect.
        const TIMES: f64 = 2.0;
        let (first, others) = found.split_first()?;
        let best = best_of(tried.descents())?;
        let score = |found: &Found| found.explanation.score;
        let least = score(first) - TIMES * (best.score - score(first));
        let least = least.max(NEARLY * score(first));
        let is_rival =
            |other: &Found| other.explanation.names() != first.explanation.names() && score(other) > least;
        let probe = first.hypothesis.parts[0].probe;
        let has_it = best.hypothesis.parts.iter().any(|part| part.probe == probe);
        (has_it && best.fits() && !others.iter().any(is_rival)).then_some(probe)
    }

    /// Whether a single effect surely leaves something of a strong signal that is more than faults of models.
    fn lacks_more_than_faults(&self, single: &Found) -> bool {
        let single = &single.explanation;
        self.is_strong() && !suffices(single) && single.share < ALL_BUT_FAULTS
    }

    /// What explains best what a single effect leaves, if anything gains there what a further effect must, and a fair share of what the
    /// faults of models may. Beside one that stands alone it must promise more to be claimed, and by one size: effects change the
    /// scatter, and sizes that go over the runs follow that.
    fn promise_beside(&self, single: &Found) -> Promise {
        /// Scores, by paths and as simulated, of the least that could turn out to be worth its numbers.
        const ENOUGH: f64 = 5.0;
        /// The same by paths beside what stands alone, and of what may be listed there.
        const ENOUGH_BESIDE: f64 = 10.0;
        const LITTLE: f64 = 2.0;
        let stands = stands_alone(&single.explanation);
        let (little, enough) = if stands {
            (LITTLE, ENOUGH_BESIDE)
        } else {
            (ENOUGH, ENOUGH)
        };
        let least = fair_share_of_faults(single);
        let promises = |screened: &[Screened], score: f64| {
            screened
                .first()
                .is_some_and(|best| best.score >= score.max(least))
        };
        self.tell(format_args!("what is beside {}", single.explanation.label()));
        let base = self.trial.base(single.hypothesis.clone());
        let mut screened = self.screened_beside(&base, &single.left);
        screened.retain(|other| !stands || other.hypothesis.is_constant());
        if !promises(&screened, little) {
            return Promise::None;
        }
        let by_paths = promises(&screened, enough);
        let heard = self.hear_screened(base, single.left.clone(), screened);
        let pairs = self.with_heard(&heard, &[]);
        let [is_enough, is_little] = [ENOUGH, little].map(|least| promises(&heard.others, least));
        if !stands {
            self.remember(heard, single);
        }
        if by_paths && is_enough {
            Promise::Enough(pairs)
        } else if is_little {
            Promise::Little(pairs)
        } else {
            Promise::None
        }
    }

    /// An explanation at better sizes of what jumps, if there are any: sizes are rough, and a further effect would make up for what they
    /// are off.
    fn with_closer_sizes(&self, found: &Found) -> Option<Found> {
        /// Log-likelihood that is worth it.
        const BETTER: f64 = 5.0;
        if !found.hypothesis.has_held() {
            return None;
        }
        self.tell(format_args!("closer sizes of {}", found.explanation.label()));
        let hunted = self.trial.hunt_again(&found.hypothesis, Moved::Little)?;
        let closer = self.settled(&hunted)?;
        (closer.explanation.score > found.explanation.score + BETTER).then_some(closer)
    }

    /// An explanation at the sizes that jump of the best of others with more effects, if these are better without those too.
    fn at_sizes_of_best(&self, found: &Found, others: &[Found]) -> Option<Found> {
        let there = found.hypothesis.with_held(&others.first()?.hypothesis.parts);
        if there == found.hypothesis {
            return None;
        }
        let closer = self.settled(&there)?;
        (closer.explanation.score > found.explanation.score).then_some(closer)
    }
}

/// Share of the best one's score above which another single effect explains nearly as much.
const NEARLY: f64 = 0.97;

/// A fair share of what the faults of models may gain beside a single effect.
fn fair_share_of_faults(single: &Found) -> f64 {
    const FAIR_SHARE: f64 = 0.3;
    FAIR_SHARE * faults_beside(&single.explanation)
}
