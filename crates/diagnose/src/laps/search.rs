//! The search for explanations of one data set: single effects, sizes that must be scanned, effects together, and causes
//! without a name.

use std::collections::BTreeSet;
use std::fmt::Arguments;
use std::ops::Range;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::atlas::{Atlas, White};
use super::diagnosis::is_noise;
use super::hunt::Moved;
use super::hypothesis::{Freedom, Hypothesis, Part, Shape};
use super::intervals::Interval;
use super::observed::ObservedLap;
use super::pairs::ScreenedPair;
use super::refine::{CLOSE_SETS, Descent, Round, Settled};
use super::ripple::Ripple;
use super::scans::Scan;
use super::screen::Screened;
use super::simulated::FINAL_SETS;
use super::tests_of_fit::{FourNumbers, HOPELESS_P, Quadratic, SIGNIFICANT_P};
use super::trial::Trial;
use crate::{Candidate, Explanation, Watch};

/// An explanation and what simulates it.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) hypothesis: Hypothesis,
    /// Standard errors of its fitted numbers.
    pub(super) errors: Vec<(Freedom, f64)>,
    pub(super) explanation: Explanation,
    /// Standard deviation of its log-likelihood for the simulation's own error.
    pub(super) gain_error: f64,
    /// What it leaves of the data, in units of the declared model's scatter.
    pub(super) left: White,
    /// The same in units of its own scatter and of the simulation's error.
    residual: White,
}

/// A search for explanations of one data set.
pub(super) struct Search<'a> {
    pub(super) trial: Trial<'a>,
    pub(super) residual: &'a White,
    /// The laps of each run.
    pub(super) runs: &'a [Vec<ObservedLap>],
    pub(super) watch: &'a Watch<'a>,
    /// What effects that jump leave at sizes all over their range, once that was asked for.
    pub(super) scanned: OnceLock<Vec<Scan>>,
    /// Pairs that are looked for together, once they were asked for.
    pub(super) together: OnceLock<Vec<ScreenedPair>>,
    /// Where descents from the best of these led, once they were tried.
    pub(super) descended_together: OnceLock<Vec<Descent>>,
}

/// A rung of successive halving (Jamieson and Talwalkar 2016): a round of every descent, after which does not come back what lies
/// behind the best by more than a log-likelihood and a share of the best one's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rung {
    round: Round,
    behind: f64,
    share: f64,
}

const fn rung(round: Round, behind: f64, share: f64) -> Rung {
    Rung { round, behind, share }
}

/// Those of single effects.
const ROUNDS: [Rung; 5] = [
    rung(Round::Rough, 50.0, 0.2),
    rung(Round::Again, 30.0, 0.03),
    rung(Round::Full, 20.0, 0.004),
    rung(Round::Full, 15.0, 0.004),
    rung(Round::Full, 15.0, 0.004),
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

/// The same for hypotheses of many numbers that are linear in what they do.
const ROUNDS_OF_GROUPS: [Rung; 2] = [rung(Round::Rough, 30.0, 0.05), rung(Round::Full, 20.0, 0.015)];

/// The same from where there is hardly any way to go.
const ROUNDS_FROM_NEAR: [Rung; 2] = [rung(Round::Full, 30.0, 0.004), rung(Round::Full, 15.0, 0.004)];

/// Explanations beside which a further effect is sought: the best need not be part of the best with one more.
pub(super) const BASES: usize = 2;

/// Log-likelihood up to which a signal is weak.
pub(super) const WEAK: f64 = 400.0;

/// Log-likelihood above which it is strong: the right names leave next to nothing of another, and what is left by up to three
/// tells of a cause that has none.
pub(super) const STRONG: f64 = 2000.0;

/// Log-likelihood within which an effect that jumps is worth a closer look at its size.
const NEAR: f64 = 50.0;

/// Errors of a difference in log-likelihood that may be chance.
const ERRORS: f64 = 2.0;

impl<'a> Search<'a> {
    pub(super) fn atlas(&self) -> &'a Atlas {
        self.trial.atlas
    }
}

impl Search<'_> {
    /// The best single effects, tried to the end, best first.
    pub(super) fn singles(&self, screened: &[Screened]) -> Vec<Found> {
        let listed = self.shortlist(screened);
        let auditioned = self.auditioned(screened, &listed);
        let starts: Vec<&Hypothesis> = (listed.into_iter().chain(auditioned))
            .map(|s| &s.hypothesis)
            .collect();
        let found = self.try_rounds(starts.iter().copied(), &ROUNDS);
        let shows = |found: &Found| found.hypothesis.patterns_show(&found.errors);
        if found.first().is_none_or(shows) {
            return found;
        }
        // Sizes that go over the runs by chance gain by chance, and kept others from being tried to the end.
        let mut plain: Vec<Hypothesis> = Vec::new();
        for start in starts {
            let start = start
                .without_patterns(self.atlas())
                .unwrap_or_else(|| start.clone());
            if !plain.iter().any(|other| other.probes() == start.probes()) {
                plain.push(start);
            }
        }
        let mut again = self.try_rounds(plain.iter(), &ROUNDS);
        again.extend(found.into_iter().filter(shows));
        sort(&mut again);
        again
    }

    /// Of a weak signal the effects beside a shortlist that are likeliest at the sizes that a screening found: by the noise of its
    /// paths it tells little of them, and nothing of what they do to the scatter.
    fn auditioned<'s>(&self, screened: &'s [Screened], listed: &[&'s Screened]) -> Vec<&'s Screened> {
        const HEARD: usize = 20;
        const SHARE: f64 = 0.5;
        const SETS: u64 = 8;
        const TAKEN: usize = 4;
        let Some(best) = screened.first().filter(|best| best.score < WEAK) else {
            return Vec::new();
        };
        let probe = |s: &Screened| &self.atlas().probes[s.hypothesis.parts[0].probe];
        let mut heard: Vec<&Screened> = Vec::new();
        for candidate in screened {
            let known = |other: &&Screened| probe(other).acts_like(probe(candidate));
            let constant = candidate.hypothesis.is_constant();
            let new = !listed.iter().any(known) && !heard.iter().any(known);
            let may_win = candidate.may_win(best, SHARE);
            if heard.len() < HEARD && may_win && constant && new && !self.jumps(&candidate.hypothesis) {
                heard.push(candidate);
            }
        }
        let score = |candidate: &'s Screened| {
            let sets = self.atlas().enough(SETS, 1);
            let simulated = self.trial.evaluate(&candidate.hypothesis, sets)?;
            let fit = self.trial.fit(&simulated)?;
            Some((self.atlas().score_of(&candidate.hypothesis, fit.gain), candidate))
        };
        let mut scored: Vec<(f64, &Screened)> = heard.into_par_iter().filter_map(score).collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        scored
            .into_iter()
            .take(TAKEN)
            .map(|(_, candidate)| candidate)
            .collect()
    }

    /// Whether a hypothesis has an effect whose action jumps with its size.
    pub(super) fn jumps(&self, hypothesis: &Hypothesis) -> bool {
        let mut parts = hypothesis.parts.iter();
        parts.any(|part| self.atlas().probes[part.probe].jumps())
    }

    /// Whether an explanation has an effect that jumps at a size to which a descent led.
    pub(super) fn jumped(&self, found: &Found) -> bool {
        let held = found.hypothesis.parts.iter().all(|part| part.held.is_some());
        self.jumps(&found.hypothesis) && !held
    }

    /// The best explanations with a size that goes over the runs or in time, where what they leave does, all in all or along
    /// what a single effect does, tried to the end.
    pub(super) fn patterns<'f>(&self, best: impl Iterator<Item = &'f Found>) -> Vec<Found> {
        let mut starts: Vec<Hypothesis> = Vec::new();
        for found in best {
            let Some(left) = found.explanation.remainder else {
                continue;
            };
            let [runs, trend] = self.along_its_action(found);
            for (shape, left) in [
                (Shape::ByRun, [left.runs, runs]),
                (Shape::ByTime, [left.trend, trend]),
            ] {
                if left.iter().any(|left| left.p < SIGNIFICANT_P) {
                    starts.extend(found.hypothesis.over(shape, self.atlas()));
                }
            }
        }
        self.try_rounds(starts.iter(), &ROUNDS_OF_SEVERAL)
    }

    /// What an explanation leaves from run to run, and of a trend, along what it does to the mean lap of each recording: one number
    /// a run, which shows what is lost among all the numbers of a lap.
    fn along_its_action(&self, found: &Found) -> [Quadratic; 2] {
        let layout = &self.atlas().layout;
        let action = self.residual - &found.left;
        let recordings = layout.laps.len();
        let (mut squares, mut trends) = (0.0, 0.0);
        for recording in 0..recordings {
            let runs: Vec<Range<usize>> = (layout.places().enumerate())
                .filter(|(_, place)| place.0 == recording)
                .map(|(run, _)| layout.run(run))
                .collect();
            let mut along = White::zeros(layout.lap);
            for run in &runs {
                along += action.rows(run.start, run.len());
            }
            let along = along.normalize();
            let size = |range: &Range<usize>| along.dot(&found.residual.rows(range.start, range.len()));
            let sizes: Vec<f64> = runs.iter().map(size).collect();
            let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
            squares += sizes.iter().map(|size| (size - mean).powi(2)).sum::<f64>();
            trends += size(&layout.trend(recording)).powi(2);
        }
        [
            Quadratic::new(squares, layout.runs() - recordings),
            Quadratic::new(trends, recordings),
        ]
    }

    /// Explanations without what they do not need by the errors of their sizes, tried to the end from where the others are; see
    /// [`Hypothesis::simpler`].
    pub(super) fn simpler<'f>(&self, best: impl Iterator<Item = &'f Found>) -> Vec<Found> {
        let mut starts: Vec<Hypothesis> = Vec::new();
        for found in best {
            for start in found.hypothesis.simpler(&found.errors, self.atlas()) {
                if !starts.iter().any(|other| other.has_patterns_of(&start)) {
                    starts.push(start);
                }
            }
        }
        self.settle(self.descend(starts.iter(), &ROUNDS_FROM_NEAR, f64::NEG_INFINITY))
    }

    /// An explanation with a patch of a wall in place of a bump or the other way round, and with slip of the other kind, tried to the end:
    /// places were screened at a coarse grid, and of slip by the noise of paths.
    pub(super) fn otherwise(&self, best: &Found) -> Vec<Found> {
        let hypothesis = &best.hypothesis;
        let exchanged = |i: usize| {
            let part = &hypothesis.parts[i];
            let others = part.at_same_place(self.atlas()).into_iter();
            let others = others.chain(part.slipping_otherwise(self.atlas()));
            let rest = hypothesis.without(i);
            others.map(move |other| rest.with(&Hypothesis::of(other)))
        };
        let starts: Vec<Hypothesis> = (0..hypothesis.parts.len()).flat_map(exchanged).collect();
        self.try_rounds(starts.iter(), &ROUNDS)
    }

    /// Explanations near the best with the same effects at the other sensors, tried to the end: of one effect two were so far.
    pub(super) fn at_other_sensors(&self, found: &[Found]) -> Vec<Found> {
        const NEAR: f64 = 8.0;
        const MOST: usize = 3;
        let score = |found: &Found| found.explanation.score;
        let best = found.first().map_or(f64::INFINITY, score);
        let mut starts: Vec<Hypothesis> = Vec::new();
        for near in found.iter().take(MOST).filter(|found| score(found) > best - NEAR) {
            for (i, part) in near.hypothesis.parts.iter().enumerate() {
                let rest = near.hypothesis.without(i);
                for other in part.at_other_sensors(self.atlas()) {
                    let start = rest.with(&Hypothesis::of(other));
                    let mut known = found.iter().map(|found| &found.hypothesis).chain(&starts);
                    if !known.any(|known| known.probes() == start.probes()) {
                        starts.push(start);
                    }
                }
            }
        }
        self.settle(self.descend(starts.iter(), &ROUNDS, best))
    }

    /// Explanations with what explains best what they leave beside them, tried to the end.
    pub(super) fn further<'f>(&self, best: impl Iterator<Item = &'f Found>) -> Vec<Found> {
        /// Share of the best score below which a third effect does not make up for what the first two leave.
        const WORTH: f64 = 0.95;
        let mut starts: Vec<Hypothesis> = Vec::new();
        let bases = of_other_effects(best);
        let score = |found: &Found| found.explanation.score;
        let least = bases.first().map_or(0.0, |first| WORTH * score(first));
        for base in bases.into_iter().take(BASES).filter(|base| score(base) >= least) {
            let left = &base.left;
            self.tell(format_args!("what is beside {}", base.explanation.label()));
            let base = self.trial.base(base.hypothesis.clone());
            let further = self.beside(&base, left, &starts);
            starts.extend(further);
        }
        self.settle(self.descend_several(&starts, &ROUNDS_OF_SEVERAL, f64::NEG_INFINITY))
    }

    /// Descends from hypotheses of several effects; the best one is tried without its patterns too, one of them or all, and with
    /// its pattern given to another of its effects: what another effect left may have suggested it.
    pub(super) fn descend_several(
        &self,
        starts: &[Hypothesis],
        rounds: &[Rung],
        reached: f64,
    ) -> Vec<Descent> {
        let mut descents = self.descend(starts.iter(), rounds, reached);
        if let Some(best) = best_of(&descents) {
            let plain = best.hypothesis.without_patterns(self.atlas()).into_iter();
            let others: Vec<Hypothesis> = plain
                .chain(best.hypothesis.with_a_pattern_less(self.atlas()))
                .chain(best.hypothesis.with_pattern_elsewhere(self.atlas()))
                .collect();
            // A third effect moves the first two little: what is far behind stays there.
            let reached = if best.hypothesis.parts.len() > 2 {
                reached.max(best.score)
            } else {
                reached
            };
            descents.extend(self.descend(others.iter(), rounds, reached));
        }
        descents
    }

    /// The screened hypotheses worth a simulation: each probe in its best pattern, and without it, of one effect the best two.
    /// What acts at a place was screened at a coarse grid of places with one length, and is given more room.
    pub(super) fn shortlist<'s>(&self, screened: &'s [Screened]) -> Vec<&'s Screened> {
        const MOST: usize = 7;
        const OF_ONE_EFFECT: usize = 2;
        let Some(best) = screened.first() else {
            return Vec::new();
        };
        let probe = |s: &Screened| s.hypothesis.parts[0].probe;
        let spec = |s: &Screened| self.atlas().probes[probe(s)].spec;
        let mut list: Vec<&Screened> = Vec::new();
        for candidate in screened {
            if list.len() == MOST {
                break;
            }
            let share = if self.atlas().probes[probe(candidate)].has_place() {
                0.4
            } else {
                0.7
            };
            if !candidate.may_win(best, share) {
                continue;
            }
            let of_probe = |s: &&&Screened| probe(s) == probe(candidate);
            // A size by run may come first by the faults of a path alone.
            let plain = |s: &Screened| s.hypothesis.is_constant();
            let seen = list
                .iter()
                .filter(of_probe)
                .any(|s| plain(s) || !plain(candidate));
            let alike = list.iter().filter(|s| spec(s) == spec(candidate) && !of_probe(s));
            if !seen && alike.count() < OF_ONE_EFFECT {
                list.push(candidate);
            }
        }
        list
    }

    /// Causes without a name: the groups of basis functions that explain most with fewest coefficients, those that come near
    /// the best found so far tried to the end.
    pub(super) fn unnamed(&self, found: &[Found]) -> Vec<Found> {
        self.tell(format_args!("causes without a name"));
        let starts = self.trial.screen_groups(self.residual);
        self.settle(self.descend(starts.iter(), &ROUNDS_OF_GROUPS, near(found)))
    }

    /// A camera that looks at the floor at an angle, tried to the end if it may explain more than the best found so far.
    pub(super) fn tilted(&self, found: &[Found]) -> Vec<Found> {
        let best = found.first().map_or(0.0, |best| best.explanation.score);
        let tilt = self.trial.screen_tilt(self.residual);
        let start = tilt.filter(|(score, _)| *score > best).map(|(_, start)| start);
        self.try_rounds(start.iter(), &ROUNDS_OF_GROUPS)
    }

    /// An explanation with a cause without a name in place of an effect whose size is not steady but settles while a run goes
    /// on, tried to the end.
    pub(super) fn settling(&self, best: &Found) -> Vec<Found> {
        self.tell(format_args!("whether {} holds still", best.explanation.label()));
        let of_part = |part: usize| {
            let settling = self.trial.settling(self.runs, &best.hypothesis, part)?;
            Some((part, settling))
        };
        let Some((part, settling)) = (0..best.hypothesis.parts.len())
            .filter_map(of_part)
            .filter(|(_, settling)| settling.p() < SIGNIFICANT_P)
            .max_by(|a, b| a.1.sigmas.abs().total_cmp(&b.1.sigmas.abs()))
        else {
            return Vec::new();
        };
        let others = best.hypothesis.without(part);
        let Some(left) = self.left_by(&others) else {
            return Vec::new();
        };
        let starts: Vec<Hypothesis> = (self.trial)
            .screen_settling(&left, &settling)
            .iter()
            .map(|start| others.with(start))
            .collect();
        self.try_rounds(starts.iter(), &ROUNDS_OF_GROUPS)
    }

    /// The wheel that laps ripple with as if it were out of round, beside some effects, if that is not chance.
    pub(super) fn ripple(&self, others: &Hypothesis) -> Option<Ripple> {
        /// Probability below which it is not.
        const NO_CHANCE_P: f64 = 1e-5;
        self.tell(format_args!("how laps ripple"));
        let ripple = self.trial.ripple(self.runs, others);
        ripple.filter(|ripple| ripple.p() < NO_CHANCE_P)
    }

    /// The effects of a hypothesis that change more than chance.
    pub(super) fn without_noise(&self, hypothesis: &Hypothesis) -> Hypothesis {
        let mut others = hypothesis.clone();
        others
            .parts
            .retain(|part| !is_noise(self.atlas().probes[part.probe].spec.name));
        others
    }

    /// Effects with a wheel that is out of round, tried to the end.
    pub(super) fn out_of_round(&self, others: &Hypothesis, ripple: &Ripple) -> Vec<Found> {
        let start = others.with(&ripple.hypothesis(self.atlas()));
        self.try_rounds(std::iter::once(&start), &ROUNDS_OF_GROUPS)
    }

    /// Descends from every hypothesis and settles those that may be the best.
    fn try_rounds<'h>(
        &self,
        hypotheses: impl Iterator<Item = &'h Hypothesis>,
        rounds: &[Rung],
    ) -> Vec<Found> {
        self.settle(self.descend(hypotheses, rounds, f64::NEG_INFINITY))
    }

    /// Descends from every hypothesis round by round, dropping those that fall behind the best or a score that was reached
    /// already.
    fn descend<'h>(
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
        for &Rung { round, behind, share } in rounds {
            if alive.is_empty() {
                break;
            }
            self.tell(format_args!("{}", self.in_words(&alive)));
            alive = (alive.into_par_iter())
                .filter_map(|descent| self.trial.descend(descent, round))
                .collect();
            alive.sort_by(|a, b| b.score.total_cmp(&a.score));
            let Some(first) = alive.first() else {
                break;
            };
            let (best, error) = (first.score, first.score_error);
            let (hopeless, fits) = (is_hopeless(first), first.fits());
            let bar = best.max(reached);
            let may_be_chance = |d: &Descent| ERRORS * error.hypot(d.score_error);
            alive.retain(|d| d.within_reach() >= bar - behind.max(share * bar).max(may_be_chance(d)));
            alive = self.without_repeats(alive, |descent| &descent.hypothesis);
            if fits {
                let others = alive.split_off(FEW.min(alive.len()));
                alive.extend(others.into_iter().filter(|other| may_catch_up(other, best)));
            }
            if hopeless && round == Round::Full {
                break;
            }
            if hopeless {
                alive.truncate(FEW);
            }
        }
        alive
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

    pub(super) fn tell(&self, what: Arguments<'_>) {
        (self.watch)(&what.to_string());
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
        let settled = (self.hunted_again(descents).par_iter())
            .filter_map(|descent| self.trial.settle(descent))
            .collect();
        let mut found: Vec<Found> = (self.closer(settled).iter())
            .map(|settled| self.found(settled))
            .collect();
        sort(&mut found);
        self.without_repeats(found, |found| &found.hypothesis)
    }

    /// Descents with better sizes of the effects that jump, which were found beside others that have moved since: those of
    /// the best descent, for all that are near it, until they come to rest; and those of rivals, for themselves.
    fn hunted_again(&self, mut descents: Vec<Descent>) -> Vec<Descent> {
        /// How far the other effects have moved from one time to the next.
        const MOVED: [Moved; 3] = [Moved::Far, Moved::Little, Moved::Little];
        /// Share of the best score by which a descent may lie behind it and still be looked at.
        const SHARE: f64 = 0.03;
        let held = |part: &Part| part.held.is_some();
        for moved in MOVED {
            let best = best_of(&descents).map(|best| &best.hypothesis);
            let Some(best) = best.filter(|best| best.parts.len() > 1 && best.parts.iter().any(held)) else {
                break;
            };
            let before = best_of(&descents).map_or(0.0, |best| best.score);
            self.tell(format_args!("closer sizes of what jumps"));
            let Some(hunted) = self.trial.hunt_again(best, moved) else {
                break;
            };
            let rest =
                (hunted.parts.iter().zip(&best.parts)).all(|(now, before)| now.is_within_error_of(before));
            let known: Vec<Part> = hunted.parts.into_iter().filter(held).collect();
            let least = before - NEAR.max(SHARE * before);
            descents = (descents.into_par_iter())
                .filter_map(|descent| {
                    if descent.score < least {
                        return Some(descent);
                    }
                    let start = Descent::start(self.atlas(), &descent.hypothesis.with_held(&known));
                    self.trial.descend(start, Round::Full)
                })
                .collect();
            let in_vain = |best: &Descent| best.leaves_far_too_much() && is_slow(best, best.score - before);
            if rest || best_of(&descents).is_some_and(in_vain) {
                break;
            }
        }
        self.with_rivals_hunted(descents)
    }

    /// Descents of which those that are near the best have better sizes of their own of the effects that jump.
    fn with_rivals_hunted(&self, mut descents: Vec<Descent>) -> Vec<Descent> {
        const MOST: usize = 2;
        descents.sort_by(|a, b| b.score.total_cmp(&a.score));
        let best = descents.first().map_or(0.0, |best| best.score);
        let is_rival = |descent: &Descent| {
            let parts = &descent.hypothesis.parts;
            best - descent.score < NEAR && parts.len() > 1 && parts.iter().any(|part| part.held.is_some())
        };
        let hunted = |rival: &Descent| {
            let hunted = self.trial.hunt_again(&rival.hypothesis, Moved::Little)?;
            let start = Descent::start(self.atlas(), &hunted);
            self.trial.descend(start, Round::Full)
        };
        let rivals = descents.iter_mut().skip(1).filter(|rival| is_rival(rival));
        for rival in rivals.take(MOST) {
            if let Some(hunted) = hunted(rival).filter(|hunted| hunted.score > rival.score) {
                *rival = hunted;
            }
        }
        descents
    }

    /// Simulates the best hypothesis more often, and still more if others explain nearly as much; not if all leave far too
    /// much.
    fn closer(&self, settled: Vec<Settled>) -> Vec<Settled> {
        const CLOSE: f64 = 10.0;
        const CLOSE_SETS_OF_ALL: u64 = 240;
        /// Laps of a data set of which that many are simulated; of smaller ones more, in the same time.
        const USUAL_LAPS: u64 = 80;
        let best = (settled.iter().map(|s| s.refined.score)).fold(f64::NEG_INFINITY, f64::max);
        let leaves =
            |s: &Settled| FourNumbers::new(&s.refined.fit.residual, &self.atlas().layout).omnibus_p();
        let first = settled.iter().find(|s| s.refined.score == best);
        if first.is_some_and(|first| leaves(first) < HOPELESS_P) {
            return settled;
        }
        let error = |s: &Settled| s.refined.fit.gain_error;
        let best_error = first.map_or(0.0, error);
        let behind = |s: &Settled| CLOSE.max(ERRORS * best_error.hypot(error(s)));
        let (close, mut others): (Vec<_>, Vec<_>) =
            (settled.into_iter()).partition(|s| s.refined.score > best - behind(s));
        let smaller = (USUAL_LAPS / self.atlas().layout.total_laps() as u64).max(1);
        let sets = match close.len() as u64 {
            0 | 1 => FINAL_SETS,
            rivals => (smaller * CLOSE_SETS_OF_ALL / rivals).clamp(FINAL_SETS, smaller * CLOSE_SETS),
        };
        let sets = self.atlas().enough(sets, 1);
        others.extend(self.trial.settle_rivals(close, sets));
        others
    }

    /// What is left of the data in squared distance beyond what chance leaves.
    pub(super) fn excess(&self, left: &White) -> f64 {
        left.norm_squared() - self.chance()
    }

    /// The squared distance that chance leaves.
    pub(super) fn chance(&self) -> f64 {
        self.atlas().layout.len() as f64
    }

    pub(super) fn found(&self, settled: &Settled) -> Found {
        let Settled { refined, evaluated } = settled;
        let atlas = self.atlas();
        let remainder = FourNumbers::new(&refined.fit.residual, &atlas.layout);
        Found {
            gain_error: refined.fit.gain_error,
            left: atlas.white(self.trial.data, &evaluated.expectation),
            residual: refined.fit.residual.clone(),
            hypothesis: refined.hypothesis.clone(),
            errors: refined.errors.clone(),
            explanation: Explanation {
                effects: candidates(atlas, &refined.hypothesis, &refined.errors, &[], refined.fit.gain),
                score: refined.score,
                gain: refined.fit.gain,
                share: 1.0 - self.excess(&refined.fit.residual) / self.excess(self.residual),
                remainder_p: Some(remainder.omnibus_p()),
                remainder: Some(remainder),
            },
        }
    }
}

/// The effects of a hypothesis with the errors of its numbers and the intervals of those of which errors tell little, that of the
/// largest action first.
pub(super) fn candidates(
    atlas: &Atlas,
    hypothesis: &Hypothesis,
    errors: &[(Freedom, f64)],
    intervals: &[Interval],
    gain: f64,
) -> Vec<Candidate> {
    let settings = hypothesis.settings(atlas);
    let mut effects: Vec<(f64, Candidate)> = (settings.into_iter().enumerate())
        .map(|(part, setting)| {
            let candidate = Candidate {
                setting,
                gain,
                fitted: hypothesis.parts[part].fitted(part, errors),
                standard_errors: hypothesis.parts[part].errors(part, errors, atlas),
                intervals: hypothesis.parts[part].intervals(part, intervals),
            };
            (hypothesis.weight(part, atlas), candidate)
        })
        .collect();
    effects.sort_by(|a, b| b.0.total_cmp(&a.0));
    effects.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Progress of a round, as a share of what is missing, with which a descent does not arrive.
const SLOW: f64 = 0.1;

/// A score that is near the best found: what is only begun may still come to that.
pub(super) fn near(found: &[Found]) -> f64 {
    const NEAR: f64 = 0.8;
    (found.first()).map_or(f64::NEG_INFINITY, |best| NEAR * best.explanation.score)
}

/// Whether the best descent leaves far too much and does not get on: more rounds would not make an answer of it.
fn is_hopeless(descent: &Descent) -> bool {
    descent.leaves_far_too_much() && is_slow(descent, descent.progress)
}

/// Whether a descent that made such progress would not arrive at where it leaves nothing.
fn is_slow(descent: &Descent, progress: f64) -> bool {
    (descent.remainder).is_some_and(|left| progress < SLOW * 0.5 * left.excess())
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

/// Of explanations those that do not have the effects of an earlier one, whatever their patterns.
pub(super) fn of_other_effects<'f>(found: impl Iterator<Item = &'f Found>) -> Vec<&'f Found> {
    let mut known: BTreeSet<Vec<&str>> = BTreeSet::new();
    let is_new = |found: &&Found| {
        let mut names = found.explanation.names();
        names.sort_unstable();
        known.insert(names)
    };
    found.filter(is_new).collect()
}

/// Best first.
pub(super) fn sort(found: &mut [Found]) {
    found.sort_by(|a, b| b.explanation.score.total_cmp(&a.explanation.score));
}
