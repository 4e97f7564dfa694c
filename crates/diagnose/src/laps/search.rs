//! The search for explanations of one data set: single effects, sizes that must be scanned, effects together, and causes
//! without a name.

use std::collections::BTreeSet;
use std::fmt::Arguments;
use std::ops::Range;
use std::sync::{Mutex, OnceLock};

use nalgebra::DMatrix;
use sim::Vec2;

use super::atlas::{Atlas, White};
use super::beside::HeardBesideSingle;
use super::hypothesis::Hypothesis;
use super::intervals::Interval;
use super::observed::ObservedRun;
use super::part::{Freedom, Part, Shape};
use super::refine::{Descent, Settled};
use super::ripple::Ripple;
use super::rounds::{
    ERRORS, ROUNDS, ROUNDS_BESIDE, ROUNDS_FROM_NEAR, ROUNDS_OF_GROUPS, ROUNDS_OF_SEVERAL, Rung, best_of, near,
};
use super::scans::Scan;
use super::screen::Screened;
use super::steadiness::Settling;
use super::tests_of_fit::{Departures, Quadratic, SIGNIFICANT_P};
use super::together::ScreenedPair;
use super::trial::Trial;
use crate::answer::is_noise;
use crate::{Candidate, Explanation, Watch};

/// An explanation and what simulates it.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub(super) hypothesis: Hypothesis,
    /// Standard errors of its fitted numbers.
    pub(super) errors: Vec<(Freedom, f64)>,
    /// How these go together.
    pub(super) correlation: DMatrix<f64>,
    pub(super) explanation: Explanation,
    /// What it leaves of the data, in units of the declared model's scatter.
    pub(super) left: White,
    /// The same in units of its own scatter and of the simulation's error.
    pub(super) residual: White,
}

/// A search for explanations of one data set.
pub(super) struct Search<'a> {
    pub(super) trial: Trial<'a>,
    pub(super) residual: &'a White,
    /// The laps of each run.
    pub(super) runs: &'a [ObservedRun],
    /// Places along the track, from the arena's middle, m.
    pub(super) places: &'a [Vec2],
    pub(super) watch: &'a Watch<'a>,
    /// What effects that jump leave at sizes all over their range, once that was asked for.
    pub(super) scanned: OnceLock<Vec<Scan>>,
    /// Pairs that are looked for together, once they were asked for.
    pub(super) together: OnceLock<Vec<ScreenedPair>>,
    /// Where descents from the best of these led, once they were tried.
    pub(super) descended_together: OnceLock<Vec<Descent>>,
    /// What was heard beside single effects.
    pub(super) heard: Mutex<Vec<HeardBesideSingle>>,
}

/// Explanations beside which a further effect is sought: the best need not be part of the best with one more.
pub(super) const BASES: usize = 2;

/// Log-likelihood up to which a signal is weak.
pub(super) const WEAK: f64 = 400.0;

/// Log-likelihood above which it is strong: the right names leave next to nothing of another, and what is left by up to three
/// tells of a cause that has none.
pub(super) const STRONG: f64 = 2000.0;

/// Share of the signal of which hardly another cause explains as much.
pub(super) const NEARLY_ALL: f64 = 0.9;

impl<'a> Search<'a> {
    pub(super) fn atlas(&self) -> &'a Atlas {
        self.trial.atlas
    }
}

impl Search<'_> {
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
            for start in (found.hypothesis).simpler(&found.errors, &found.correlation, self.atlas()) {
                if !starts.iter().any(|other| other.has_patterns_of(&start)) {
                    starts.push(start);
                }
            }
        }
        self.settle(self.descend(starts.iter(), &ROUNDS_FROM_NEAR, f64::NEG_INFINITY))
    }

    /// One of some explanations with a patch of a wall in place of a bump or the other way round, and with slip of the other kind,
    /// tried to the end unless it is among them: places were screened at a coarse grid, and of slip by the noise of paths.
    pub(super) fn otherwise(&self, one: &Found, found: &[Found]) -> Vec<Found> {
        let hypothesis = &one.hypothesis;
        let exchanged = |i: usize| {
            let part = &hypothesis.parts[i];
            let others = part.at_same_place(self.atlas()).into_iter();
            let others = others.chain(part.slipping_otherwise(self.atlas()));
            let rest = hypothesis.without(i);
            others.map(move |other| rest.with(&Hypothesis::of(other)))
        };
        let is_new = |start: &Hypothesis| {
            let known = |found: &Found| start.is_at_places_of(&found.hypothesis, self.atlas());
            !found.iter().any(known)
        };
        let starts = (0..hypothesis.parts.len()).flat_map(exchanged).filter(is_new);
        let starts: Vec<Hypothesis> = starts.collect();
        self.settle_near(self.descend(starts.iter(), &ROUNDS, f64::NEG_INFINITY))
    }

    /// The first of some explanations with what acts on the wall opposite in place of a bump or a patch, tried to the end: one that
    /// is longer than those that were simulated beforehand shows less by its path than another one across the track.
    pub(super) fn on_wall_opposite(&self, found: &[Found]) -> Vec<Found> {
        /// Places tried for each part.
        const MOST: usize = 4;
        let Some(best) = found.first() else {
            return Vec::new();
        };
        let probes = &self.atlas().probes;
        let mut starts: Vec<Hypothesis> = Vec::new();
        for (i, part) in best.hypothesis.parts.iter().enumerate() {
            let own = &probes[part.probe];
            let is_opposite = |&probe: &usize| probes[probe].is_opposite(own, &part.values[0]);
            let opposite: Vec<usize> = (0..probes.len()).filter(is_opposite).collect();
            if opposite.is_empty() {
                continue;
            }
            self.tell(format_args!("what is on the wall opposite"));
            let rest = best.hypothesis.without(i);
            let Some(left) = self.left_by(&rest) else {
                continue;
            };
            let screened = self.atlas().ranked_constant(opposite.into_iter(), &left);
            starts.extend(screened.iter().take(MOST).map(|s| rest.with(&s.hypothesis)));
        }
        let several = best.hypothesis.parts.len() > 1;
        let rounds: &[Rung] = if several { &ROUNDS_OF_SEVERAL } else { &ROUNDS };
        self.settle_near(self.descend(starts.iter(), rounds, best.explanation.score))
    }

    /// Explanations near the best with the same effects at the other sensors, tried to the end: of one effect two were so far.
    pub(super) fn at_other_sensors(&self, found: &[Found]) -> Vec<Found> {
        const NEAR: f64 = 8.0;
        const MOST: usize = 3;
        /// Log-likelihood by which a descent may be behind and still end near the best.
        const BEHIND: f64 = 25.0;
        let score = |found: &Found| found.explanation.score;
        let best = found.first().map_or(f64::INFINITY, score);
        let mut starts: Vec<Hypothesis> = Vec::new();
        for near in found.iter().take(MOST).filter(|found| score(found) > best - NEAR) {
            for (i, part) in near.hypothesis.parts.iter().enumerate() {
                let rest = near.hypothesis.without(i);
                for other in self.screened_at_other_sensors(part, &rest) {
                    let start = rest.with(&other);
                    let mut known = found.iter().map(|found| &found.hypothesis).chain(&starts);
                    if !known.any(|known| known.probes() == start.probes()) {
                        starts.push(start);
                    }
                }
            }
        }
        // The other effects of several explain nearly all wherever the sensor is.
        let several = found.first().is_some_and(|best| best.hypothesis.parts.len() > 1);
        let rounds: &[Rung] = if several { &ROUNDS_BESIDE } else { &ROUNDS };
        let mut descents = self.descend(starts.iter(), rounds, best);
        descents.retain(|descent| descent.score > best - BEHIND.max(ERRORS * descent.score_error));
        self.settle_near(descents)
    }

    /// The effect of a part at the other sensors where it may win by what it explains, beside some effects, of what these leave; none of
    /// what acts on all.
    fn screened_at_other_sensors(&self, part: &Part, others: &Hypothesis) -> Vec<Hypothesis> {
        const SHARE: f64 = 0.7;
        let probes = &self.atlas().probes;
        let own = &probes[part.probe];
        if !probes.iter().any(|probe| probe.is_at_other_sensor(own)) {
            return Vec::new();
        }
        let Some(left) = self.left_by(others) else {
            return Vec::new();
        };
        let of_effect = (0..probes.len()).filter(|&probe| probes[probe].spec == own.spec);
        let screened = self.atlas().ranked_constant(of_effect, &left);
        let Some(best) = screened.first() else {
            return Vec::new();
        };
        let is_at_other = |s: &Screened| probes[s.probe()].is_at_other_sensor(own);
        (screened.iter())
            .filter(|s| is_at_other(s) && s.score > 0.0 && s.may_win(best, SHARE))
            .map(|s| s.hypothesis.clone())
            .collect()
    }

    /// Explanations with what explains best what they leave beside them, tried to the end.
    pub(super) fn further<'f>(&self, best: impl Iterator<Item = &'f Found>) -> Vec<Found> {
        /// Share of the best score below which a third effect does not make up for what the first two leave.
        const WORTH: f64 = 0.95;
        /// Pairs beside which a third effect is sought: the second one of several may do about the same and stand for it.
        const BASES_OF_THREE: usize = 2 * BASES;
        let bases = of_other_effects(best);
        let score = |found: &Found| found.explanation.score;
        let least = bases.first().map_or(0.0, |first| WORTH * score(first));
        let bases = bases.into_iter().take(BASES_OF_THREE);
        let starts = self.beside_found(bases.filter(|base| score(base) >= least), &[]);
        self.settle(self.descend_several(&starts, &ROUNDS_BESIDE, f64::NEG_INFINITY))
    }

    /// The first of some explanations, if it has three effects, with others in place of the constant one that acts least: those that
    /// go best with the other two, tried to the end. That one was found beside a pair of which one effect was given up since.
    pub(super) fn in_place_of_least(&self, found: &[Found]) -> Vec<Found> {
        let Some(best) = found.first().filter(|best| best.hypothesis.parts.len() == 3) else {
            return Vec::new();
        };
        let hypothesis = &best.hypothesis;
        let weight = |&part: &usize| hypothesis.weight(part, self.atlas());
        let least = (0..hypothesis.parts.len())
            .filter(|&part| hypothesis.parts[part].shape == Shape::Constant)
            .min_by(|a, b| weight(a).total_cmp(&weight(b)));
        let Some(rest) = least.map(|least| hypothesis.without(least)) else {
            return Vec::new();
        };
        let Some(left) = self.left_by(&rest) else {
            return Vec::new();
        };
        let starts = self.beside(self.trial.base(rest), left, std::slice::from_ref(hypothesis));
        self.settle(self.descend_several(&starts, &ROUNDS_BESIDE, f64::NEG_INFINITY))
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

    /// Causes without a name that go with the heading or the place and explain nearly all of a strong signal as far as linear algebra
    /// tells, tried to the end; none where a size that jumps and another effect promise as much.
    pub(super) fn over_the_floor(&self) -> Vec<Found> {
        let least = NEARLY_ALL * self.signal();
        if (self.screened_pairs_that_jump().first()).is_some_and(|best| best.score >= least) {
            return Vec::new();
        }
        self.tell(format_args!("what goes with the place"));
        let starts = self.trial.screen_groups_over_the_floor(self.residual, least);
        self.try_rounds(starts.iter(), &ROUNDS_OF_GROUPS)
    }

    /// An explanation with a cause without a name in place of an effect whose size is not steady but settles while a run goes
    /// on, tried to the end.
    pub(super) fn settling(&self, best: &Found) -> Vec<Found> {
        self.tell(format_args!("whether {} holds still", best.explanation.label()));
        let sigmas = |settling: &[Settling]| settling.first().map_or(0.0, |settling| settling.sigmas.abs());
        let Some((part, settling)) = (0..best.hypothesis.parts.len())
            .filter_map(|part| Some((part, self.trial.settling(self.runs, &best.hypothesis, part)?)))
            .filter(|(_, settling)| !settling.is_empty())
            .max_by(|a, b| sigmas(&a.1).total_cmp(&sigmas(&b.1)))
        else {
            return Vec::new();
        };
        let others = best.hypothesis.without(part);
        let Some(left) = self.left_by(&others) else {
            return Vec::new();
        };
        let starts: Vec<Hypothesis> = (settling.iter())
            .flat_map(|settling| self.trial.screen_settling(&left, settling))
            .map(|start| others.with(&start))
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
        self.try_rounds(std::iter::once(&start), &ROUNDS_OF_SEVERAL)
    }

    pub(super) fn tell(&self, what: Arguments<'_>) {
        (self.watch)(&what.to_string());
    }

    /// Whether the data depart far from the declared model.
    pub(super) fn is_strong(&self) -> bool {
        self.signal() >= STRONG
    }

    /// The log-likelihood that an explanation gains which leaves what chance does.
    pub(super) fn signal(&self) -> f64 {
        0.5 * self.excess(self.residual)
    }

    /// The log-likelihood gained by what leaves such a deviance of the data.
    pub(super) fn gained(&self, left: f64) -> f64 {
        0.5 * (self.residual.norm_squared() - left)
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
        let remainder = Departures::new(&refined.fit.residual, &atlas.layout);
        Found {
            left: atlas.white(self.trial.data, &evaluated.expectation),
            residual: refined.fit.residual.clone(),
            hypothesis: refined.hypothesis.clone(),
            errors: refined.errors.clone(),
            correlation: refined.correlation.clone(),
            explanation: Explanation {
                effects: candidates(atlas, &refined.hypothesis, &refined.errors, &[], refined.fit.gain),
                score: refined.score,
                gain: refined.fit.gain,
                gain_error: refined.fit.gain_error,
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
    let mut effects: Vec<Candidate> = (settings.into_iter().enumerate())
        .map(|(part, setting)| Candidate {
            setting,
            gain,
            fitted: hypothesis.parts[part].fitted(part, errors),
            standard_errors: hypothesis.parts[part].errors(part, errors, atlas),
            intervals: hypothesis.parts[part].intervals(part, intervals),
            weight: hypothesis.weight(part, atlas),
        })
        .collect();
    effects.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    effects
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
