//! Descents to the most likely sizes of many hypotheses, of which fewer are left after every round.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::hunt::Moved;
use super::hypothesis::Hypothesis;
use super::part::Part;
use super::refine::{CLOSE_SETS, Descent, Round, Settled};
use super::search::{Found, STRONG, Search, sort};
use super::simulated::FINAL_SETS;
use super::verdict::is_no_answer;

/// A rung of successive halving (Jamieson and Talwalkar 2016): a round of every descent, after which does not come back what lies
/// behind the best by more than a log-likelihood and a share of the best one's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rung {
    round: Round,
    behind: f64,
    /// The log-likelihood behind a best one of one number: one of several seems better in the course of the rounds than in the end.
    behind_one: f64,
    share: f64,
}

const fn rung(round: Round, behind: f64, share: f64) -> Rung {
    Rung {
        round,
        behind,
        behind_one: behind,
        share,
    }
}

impl Rung {
    const fn of_one(self, behind_one: f64) -> Self {
        Self { behind_one, ..self }
    }

    /// The log-likelihood by which a descent may be behind a best one of so many numbers, with a score that is to be reached; less where
    /// the best `fits`, and leaves nothing significant: what is behind it is told apart by what it leaves.
    fn allowed_behind(&self, numbers: usize, score: f64, fits: bool) -> f64 {
        const FITTING: f64 = 15.0;
        const LESS: f64 = 0.2;
        let behind = match numbers {
            0 | 1 => self.behind_one,
            _ if fits => self.behind.min(FITTING),
            _ => self.behind,
        };
        let share = if fits { LESS * self.share } else { self.share };
        behind.max(share * score)
    }
}

/// Those of single effects.
pub(super) const ROUNDS: [Rung; 5] = [
    rung(Round::Rough, 50.0, 0.2).of_one(25.0),
    rung(Round::Again, 30.0, 0.03).of_one(8.0),
    rung(Round::Full, 20.0, 0.004).of_one(8.0),
    rung(Round::Full, 15.0, 0.004).of_one(8.0),
    rung(Round::Full, 15.0, 0.004).of_one(8.0),
];

/// The same for several effects together, of which more are tried.
pub(super) const ROUNDS_OF_SEVERAL: [Rung; 6] = [
    rung(Round::Rough, 50.0, 0.06),
    rung(Round::Again, 30.0, 0.02),
    rung(Round::Again, 25.0, 0.006),
    rung(Round::Full, 15.0, 0.004),
    rung(Round::Full, 15.0, 0.004),
    rung(Round::Full, 15.0, 0.004),
];

/// The same beside an effect that explains nearly all, from where there is not far to go.
pub(super) const ROUNDS_BESIDE: [Rung; 6] = [
    rung(Round::Rough, 50.0, 0.001),
    rung(Round::Again, 30.0, 0.0005),
    rung(Round::Again, 25.0, 0.0002),
    rung(Round::Full, 15.0, 0.0001),
    rung(Round::Full, 15.0, 0.0001),
    rung(Round::Full, 15.0, 0.0001),
];

/// The same of what may be listed but hardly claimed.
pub(super) const ROUNDS_OF_LITTLE: [Rung; 3] = [ROUNDS_BESIDE[0], ROUNDS_BESIDE[1], ROUNDS_BESIDE[2]];

/// The same for hypotheses of many numbers that are linear in what they do.
pub(super) const ROUNDS_OF_GROUPS: [Rung; 2] =
    [rung(Round::Rough, 30.0, 0.05), rung(Round::Full, 20.0, 0.015)];

/// The same from where there is hardly any way to go.
pub(super) const ROUNDS_FROM_NEAR: [Rung; 2] =
    [rung(Round::Full, 30.0, 0.004), rung(Round::Full, 15.0, 0.004)];

/// Log-likelihood within which descents are judged together, and an effect that jumps is worth a closer look at its size.
pub(super) const NEAR: f64 = 50.0;

/// Looks at sizes ever better beside others that follow, as many more where each still gains much, and log-likelihood by which one must
/// change a descent for the next to matter.
const LOOKS: usize = 3;
const MATTERS: f64 = 5.0;

/// Errors of a difference in log-likelihood that may be chance.
pub(super) const ERRORS: f64 = 2.0;

impl Search<'_> {
    /// Descends from every hypothesis and settles those that may be the best.
    pub(super) fn try_rounds<'h>(
        &self,
        hypotheses: impl Iterator<Item = &'h Hypothesis>,
        rounds: &[Rung],
    ) -> Vec<Found> {
        self.settle(self.descend(hypotheses, rounds, f64::NEG_INFINITY))
    }

    /// Descends from every hypothesis round by round, dropping those that fall behind the best or a score that was reached
    /// already.
    pub(super) fn descend<'h>(
        &self,
        hypotheses: impl Iterator<Item = &'h Hypothesis>,
        rounds: &[Rung],
        reached: f64,
    ) -> Vec<Descent> {
        /// Descents that go on where none seems to come to an end, or the others seem to lose.
        const FEW: usize = 3;
        let mut alive: Vec<Descent> = hypotheses
            .map(|start| Descent::start(self.atlas(), start))
            .collect();
        for rung in rounds {
            let round = rung.round;
            if alive.is_empty() {
                break;
            }
            if round == Round::Full {
                without_also_rans(&mut alive, FEW);
            }
            self.tell(format_args!("{}", self.in_words(&alive)));
            alive = self.round(alive, round);
            self.trial.judge_together(&mut alive);
            alive.sort_by(|a, b| b.score.total_cmp(&a.score));
            let Some(first) = alive.first() else {
                break;
            };
            let (best, error) = (first.score, first.score_error);
            let (hopeless, fits) = (is_hopeless(first), first.fits());
            let bar = best.max(reached);
            let behind = rung.allowed_behind(first.hypothesis.fitted(self.atlas()), bar, fits);
            alive.retain(|d| d.within_reach() >= bar - behind.max(d.behind_by_chance(error)));
            alive = self.without_repeats(alive, |descent| &descent.hypothesis);
            if fits {
                let others = alive.split_off(FEW.min(alive.len()));
                alive.extend(others.into_iter().filter(|other| may_catch_up(other, best)));
            }
            if hopeless {
                alive.truncate(FEW);
                // What is only begun may still come to something.
                if round == Round::Full || alive.iter().all(is_hopeless) {
                    break;
                }
            }
        }
        alive
    }

    /// A round of every descent. The first with an effect goes before others with the same, which take from it what a look around told
    /// of that; of strong signals places alone, as slopes that are a little off leave the more the more an effect does.
    fn round(&self, descents: Vec<Descent>, round: Round) -> Vec<Descent> {
        /// Signal up to which other effects are shared too.
        const FAINT: f64 = 5.0 * STRONG;
        let is_faint = self.signal() < FAINT;
        let is_shared = |part: &Part| is_faint || self.atlas().probes[part.probe].has_place();
        let all = |descents: Vec<Descent>| {
            (descents.into_par_iter()).filter_map(|descent| self.trial.descend(descent, round))
        };
        let mut known: BTreeSet<usize> = BTreeSet::new();
        let shares_an_effect = |Descent { hypothesis, .. }: &Descent| {
            let several = hypothesis.parts.len() > 1;
            let shared = || hypothesis.parts.iter().filter(|part| is_shared(part));
            let shares = several && shared().any(|part| known.contains(&part.probe));
            if !shares {
                known.extend(shared().map(|part| part.probe));
            }
            shares
        };
        let (mut others, first): (Vec<Descent>, Vec<Descent>) =
            descents.into_iter().partition(shares_an_effect);
        let mut done: Vec<Descent> = all(first).collect();
        for other in &mut others {
            done.iter()
                .for_each(|first| other.take_slopes_of(first, is_shared, self.atlas()));
        }
        done.par_extend(all(others));
        done
    }

    /// The effects that are descended from, a few by name.
    pub(super) fn in_words(&self, alive: &[Descent]) -> String {
        const NAMED: usize = 3;
        let mut all: Vec<String> = Vec::new();
        for descent in alive {
            let names =
                (descent.hypothesis.parts.iter()).map(|part| self.atlas().probes[part.probe].spec.name);
            let name = names.collect::<Vec<_>>().join(" + ");
            if !all.contains(&name) {
                all.push(name);
            }
        }
        let others = all.len().saturating_sub(NAMED);
        all.truncate(NAMED);
        let named = all.join(", ");
        if others > 0 {
            format!("{named} and {others} more")
        } else {
            named
        }
    }

    /// Descents or explanations, best first, without those that came to where a better one is.
    fn without_repeats<T>(&self, sorted: Vec<T>, hypothesis: fn(&T) -> &Hypothesis) -> Vec<T> {
        let mut kept: Vec<T> = Vec::new();
        for one in sorted {
            let repeats = |better: &T| hypothesis(&one).is_near(hypothesis(better), self.atlas());
            if !kept.iter().any(repeats) {
                kept.push(one);
            }
        }
        kept
    }

    /// The ends of descents simulated often enough to judge them, best first.
    pub(super) fn settle(&self, descents: Vec<Descent>) -> Vec<Found> {
        self.settle_hunted(&self.hunted_again(descents, Moved::Far))
    }

    /// The same of descents from where sizes that jump had come to rest beside others that have moved little since.
    pub(super) fn settle_near(&self, descents: Vec<Descent>) -> Vec<Found> {
        self.settle_hunted(&self.hunted_again(descents, Moved::Little))
    }

    /// The same of what may be listed but hardly claimed: sizes that jump get one closer look, and rivals are not told apart any closer.
    pub(super) fn settle_roughly(&self, descents: Vec<Descent>) -> Vec<Found> {
        self.sorted(&self.ends(&self.best_hunted(descents, Moved::Little, 1)))
    }

    fn settle_hunted(&self, descents: &[Descent]) -> Vec<Found> {
        self.sorted(&self.closer(self.ends(descents)))
    }

    /// The ends of descents, those near the best judged together.
    fn ends(&self, descents: &[Descent]) -> Vec<Settled> {
        let best = best_of(descents);
        let settle = |descent: &Descent| {
            let is_far = best.is_some_and(|best| descent.is_far_behind(best));
            (is_far.then(|| self.trial.settle_as_judged(descent)).flatten())
                .or_else(|| self.trial.settle(descent))
        };
        let settled = descents.par_iter().filter_map(settle);
        let (mut near, others) = near_and_others(settled.collect(), NEAR);
        if near.len() > 1 {
            near = self.trial.settle_rivals(near, 0);
        }
        near.extend(others);
        near
    }

    fn sorted(&self, settled: &[Settled]) -> Vec<Found> {
        let mut found: Vec<Found> = settled.iter().map(|settled| self.found(settled)).collect();
        sort(&mut found);
        self.without_repeats(found, |found| &found.hypothesis)
    }

    /// Descents with better sizes of the effects that jump, which were found beside others that have moved since: those of the best
    /// descent, for those that are near it, and those of rivals, for themselves.
    fn hunted_again(&self, descents: Vec<Descent>, at_first: Moved) -> Vec<Descent> {
        self.with_rivals_hunted(self.best_hunted(descents, at_first, 2 * LOOKS))
    }

    /// Descents with the sizes of what jumps that are better for the best descent where they are near it, until they come to rest or no
    /// longer matter, after so many looks at most.
    fn best_hunted(&self, mut descents: Vec<Descent>, at_first: Moved, looks: usize) -> Vec<Descent> {
        /// Share of the best score by which a descent may lie behind it and still follow at the first look, log-likelihood by which it
        /// may later, and how many do.
        const SHARE: f64 = 0.03;
        const CLOSE: f64 = 15.0;
        const MOST: [usize; 2] = [4, 2];
        for look in 0..looks {
            let Some(best) = best_of(&descents) else {
                break;
            };
            let (best, before) = (&best.hypothesis, best.score);
            let (moved, behind, most) = if look == 0 {
                (at_first, NEAR.max(SHARE * before), MOST[0])
            } else {
                (Moved::Little, CLOSE, MOST[1])
            };
            if best.parts.len() < 2 || !best.has_held() {
                break;
            }
            self.tell(format_args!("closer sizes of what jumps"));
            let Some(hunted) = self.trial.hunt_again(best, moved) else {
                break;
            };
            let rest =
                (hunted.parts.iter().zip(&best.parts)).all(|(now, before)| now.is_within_error_of(before));
            let known: Vec<Part> = (hunted.parts.into_iter())
                .filter(|part| part.held.is_some())
                .collect();
            let least = before - behind;
            descents.sort_by(|a, b| b.score.total_cmp(&a.score));
            descents = (descents.into_par_iter().enumerate())
                .filter_map(|(place, descent)| {
                    if descent.score < least || place >= most {
                        return Some(descent);
                    }
                    let there = descent.hypothesis.with_held(&known);
                    if there == descent.hypothesis {
                        return Some(descent);
                    }
                    let start = match moved {
                        Moved::Far if !rest => Descent::start(self.atlas(), &there),
                        _ => descent.at(there),
                    };
                    self.trial.descend(start, Round::Full)
                })
                .collect();
            let ends = |best: &Descent| {
                let gained = best.score - before;
                let matters = if look + 1 < LOOKS {
                    gained.abs() > MATTERS
                } else {
                    gained > NEAR
                };
                !matters || best.leaves_far_too_much() && is_slow(best, gained)
            };
            if rest || best_of(&descents).is_some_and(ends) {
                break;
            }
        }
        descents
    }

    /// Descents of which those that are near the best have better sizes of their own of the effects that jump; where the best leaves
    /// no hint of another effect, none can beat it by much, and only those so near that they may come to be as likely.
    fn with_rivals_hunted(&self, mut descents: Vec<Descent>) -> Vec<Descent> {
        const MOST: usize = 2;
        const CLOSE: f64 = 10.0;
        descents.sort_by(|a, b| b.score.total_cmp(&a.score));
        let Some(best) = descents.first() else {
            return descents;
        };
        let behind = if best.leaves_no_hint() { CLOSE } else { NEAR };
        let least = best.score - behind;
        let is_rival = |descent: &Descent| {
            let hypothesis = &descent.hypothesis;
            descent.score > least && hypothesis.parts.len() > 1 && hypothesis.has_held()
        };
        let hunted = |rival: &Descent| {
            let hunted = self.trial.hunt_again(&rival.hypothesis, Moved::Little)?;
            let there = rival.hypothesis.with_held(&hunted.parts);
            (self.trial).descend(rival.clone().at(there), Round::Full)
        };
        let rivals = descents.iter_mut().skip(1).filter(|rival| is_rival(rival));
        for rival in rivals.take(MOST) {
            for _ in 0..LOOKS {
                let Some(hunted) = hunted(rival).filter(|hunted| hunted.score > rival.score) else {
                    break;
                };
                let gained = hunted.score - rival.score;
                let rests = hunted.is_within_errors_of(&rival.hypothesis, self.atlas());
                *rival = hunted;
                if gained <= MATTERS || rests {
                    break;
                }
            }
        }
        descents
    }

    /// Simulates the best hypothesis more often, and still more if others explain nearly as much; not if it leaves far too much, or
    /// surely something and is not to be claimed.
    fn closer(&self, settled: Vec<Settled>) -> Vec<Settled> {
        const CLOSE_SETS_OF_ALL: u64 = 160;
        /// Laps of a data set of which that many are simulated; of smaller ones more, in the same time.
        const USUAL_LAPS: u64 = 80;
        let score = |s: &&Settled| s.refined.score;
        let best = settled.iter().max_by(|a, b| score(a).total_cmp(&score(b)));
        if best.is_some_and(|best| is_no_answer(&self.found(best).explanation)) {
            return settled;
        }
        let smaller = (USUAL_LAPS / self.atlas().layout.total_laps() as u64).max(1);
        let (close, mut others) = close_and_others(settled);
        let again = self
            .trial
            .settle_rivals(close, self.atlas().enough(FINAL_SETS, 1));
        let (close, further) = close_and_others(again);
        others.extend(further);
        let rivals = close.len() as u64;
        if rivals < 2 {
            others.extend(close);
            return others;
        }
        let sets = (smaller * CLOSE_SETS_OF_ALL / rivals).clamp(FINAL_SETS, smaller * CLOSE_SETS);
        others.extend(self.trial.settle_rivals(close, self.atlas().enough(sets, 1)));
        others
    }
}

/// Hypotheses that may be as good as the best as far as these simulations tell, and the others.
fn close_and_others(settled: Vec<Settled>) -> (Vec<Settled>, Vec<Settled>) {
    const CLOSE: f64 = 10.0;
    near_and_others(settled, CLOSE)
}

/// Hypotheses that are so near the best, or within the errors of these simulations, and the others.
fn near_and_others(settled: Vec<Settled>, near: f64) -> (Vec<Settled>, Vec<Settled>) {
    let score = |s: &Settled| (s.refined.score, s.refined.fit.gain_error);
    let best = settled.iter().map(score).max_by(|a, b| a.0.total_cmp(&b.0));
    let (best, best_error) = best.unwrap_or_default();
    let is_near = |s: &Settled| {
        let (score, error) = score(s);
        score > best - near.max(ERRORS * best_error.hypot(error))
    };
    settled.into_iter().partition(is_near)
}

/// Progress of a round, as a share of what is missing, with which a descent does not arrive.
const SLOW: f64 = 0.1;

/// A score that is near the best found: what is only begun may still come to that.
pub(super) fn near(found: &[Found]) -> f64 {
    const NEAR: f64 = 0.8;
    (found.first()).map_or(f64::NEG_INFINITY, |best| NEAR * best.explanation.score)
}

/// Leaves so few of descents, best first, and those that are near the best, where that leaves far too much: what is behind it lacks
/// something else too.
fn without_also_rans(descents: &mut Vec<Descent>, few: usize) {
    let Some(best) = descents.first().filter(|best| best.leaves_far_too_much()) else {
        return;
    };
    let least = best.score - NEAR;
    let near = descents
        .iter()
        .take_while(|descent| descent.score >= least)
        .count();
    descents.truncate(near.max(few));
}

/// Whether the best descent leaves far too much and does not get on: more rounds would not make an answer of it.
fn is_hopeless(descent: &Descent) -> bool {
    descent.leaves_far_too_much() && is_slow(descent, descent.progress)
}

/// Whether a descent that made such progress would not arrive at where it leaves nothing.
pub(super) fn is_slow(descent: &Descent, progress: f64) -> bool {
    descent.missing().is_some_and(|missing| progress < SLOW * missing)
}

/// Whether a descent is near a better one, or comes nearer.
fn may_catch_up(descent: &Descent, best: f64) -> bool {
    const NEAR: f64 = 25.0;
    let missing = best - descent.score;
    missing < NEAR || descent.progress > SLOW * missing
}

/// The descent with the best score.
pub(super) fn best_of(descents: &[Descent]) -> Option<&Descent> {
    descents.iter().max_by(|a, b| a.score.total_cmp(&b.score))
}
