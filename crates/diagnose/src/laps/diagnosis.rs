//! The answer: which effects, how sure, what else it could be.

use std::sync::OnceLock;

use sim::{Pattern, Setting};

use super::atlas::{Atlas, Simulate};
use super::hypothesis::Hypothesis;
use super::memo::Memo;
use super::observed::ObservedLap;
use super::ripple::Ripple;
use super::screen::Screened;
use super::search::{Found, STRONG, Search, candidates, of_other_effects, sort};
use super::tests_of_fit::{ALARM_P, FourNumbers};
use super::trial::Trial;
use crate::answer::{ALTERNATIVE, indistinguishable};
use crate::{Answer, Cause, Error, Explanation, Verdict, Watch};

/// Score of the best probe from which a data set counts as departing from the declared model, whatever the omnibus says.
pub(super) const ALARM_SCORE: f64 = 7.0;
/// Probability of what is left below which something is left that is worth a search, however small a share it is.
const SURELY_P: f64 = 1e-6;
/// Probability of what is left from which on it may still be chance.
const HARDLY_P: f64 = 1e-4;
/// Share of the excess that an explanation must explain to stand in spite of a significant remainder.
const ENOUGH: f64 = 0.98;
/// The same for several effects, which have more freedom to be wrong.
const ALL_BUT: f64 = 0.995;
/// Share that several effects, or one without a name, must explain to be claimed in part.
const MOST: f64 = 0.9;
/// What an explanation that is claimed in part may leave, as a multiple of what chance makes of it.
const FAR: f64 = 20.0;
/// The same of names that leave more than faults of the model: right ones of robots with up to three effects leave at most 2.3 times
/// as much, backlash and sensors that see less far under other names three to six times.
const FAR_BY_NAME: f64 = 3.0;
/// Share up to which an explanation does not stand that leaves what is not likely, be it not significant: of weak signals chance
/// alone explains as much.
const TOO_LITTLE: f64 = 0.7;
/// Score from which one explains more than chance offers all the same, if what it leaves is no less likely than this.
const CLEAR: f64 = 20.0;
const CLEAR_P: f64 = 0.01;
/// A share that is less by so much is as good.
const AS_GOOD: f64 = 0.01;
/// Log-likelihood that each number of a further effect must gain.
const WORTH: f64 = 10.0;
/// The same where what comes before stands without it.
const WORTH_BESIDE: f64 = 15.0;
/// Share of what is explained already that further effects must gain, unless they alone fit: at very high signal no model is
/// exact.
const FAULTS: f64 = 2e-4;
/// Share that one effect must explain for what is left to be a fault of the model rather than a cause without a name.
const ALL_BUT_FAULTS: f64 = 0.999;

/// Single effects of which the sizes are let go over the runs or in time, and several together.
const PATTERNS_OF: usize = 3;
const PATTERNS_OF_SEVERAL: usize = 2;

/// Whether an explanation leaves nothing significant, or next to nothing.
fn suffices(explanation: &Explanation) -> bool {
    let enough = if explanation.effects.len() > 1 {
        ALL_BUT
    } else {
        ENOUGH
    };
    explanation.fits() || explanation.share >= enough && explanation.leaves_more_likely_than(SURELY_P)
}

/// Whether an explanation needs no further effect.
fn stands_alone(explanation: &Explanation) -> bool {
    (explanation.fits() || suffices(explanation) && explanation.share >= ALL_BUT)
        && !is_doubtful(explanation, TOO_LITTLE)
}

/// Whether nothing that is left calls for an effect that no descent finds.
fn leaves_nothing_to_ask(explanation: &Explanation) -> bool {
    suffices(explanation) && !is_doubtful(explanation, MOST)
}

/// Whether an explanation with a share below this leaves what is not likely either.
fn is_doubtful(explanation: &Explanation, share: f64) -> bool {
    const DOUBTFUL_P: f64 = 0.1;
    explanation.share <= share && !explanation.leaves_more_likely_than(DOUBTFUL_P)
}

/// What laps tell about a model.
#[derive(Debug, Clone)]
pub struct LapDiagnosis {
    /// How the data depart from the declared model.
    pub residual: FourNumbers,
    /// What is claimed.
    pub answer: Answer,
}

impl Atlas {
    /// What the laps of several runs tell about the declared model; `watch` is told what is being tried.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn diagnose(
        &self,
        simulate: &Simulate<'_>,
        runs: &[Vec<ObservedLap>],
        watch: &Watch<'_>,
    ) -> Result<LapDiagnosis, Error> {
        let memo = Memo::new(simulate);
        let simulate: &Simulate<'_> = &|effects, set| memo.simulate(effects, set);
        let data = self.observed(runs)?;
        let residual = self.white(&data, &self.null);
        let numbers = FourNumbers::new(&residual, &self.layout);
        let screened = self.screen(&residual);
        let trial = Trial {
            atlas: self,
            simulate,
            data: &data,
        };
        let search = Search {
            trial,
            residual: &residual,
            runs,
            watch,
            scanned: OnceLock::new(),
            together: OnceLock::new(),
            descended_together: OnceLock::new(),
        };
        let ripple = search.ripple(&Hypothesis::nothing());
        let alarm = numbers.omnibus_p() < ALARM_P || self.best_score(&residual) > ALARM_SCORE;
        if !alarm && ripple.is_none() {
            return Ok(LapDiagnosis {
                residual: numbers,
                answer: Answer::faithful(runs.len()),
            });
        }
        let mut found = match ripple {
            Some(ripple) => explain_ripple(&search, &screened, &ripple),
            None => explain(&search, search.singles(&screened)),
        };
        // Candidates share their draws, so that much of the error is common to them: it counts where it is large.
        let behind = ALTERNATIVE.max(2.0 * found.first().map_or(0.0, |best| best.gain_error));
        let indistinguishable = indistinguishable(found.iter().map(|found| &found.explanation), behind);
        let verdict = found.first().map(|best| verdict_of(&best.explanation));
        let verdict = verdict.unwrap_or(Verdict::Unexplained);
        if verdict == Verdict::Explained {
            let equal = found[..indistinguishable].iter();
            let equal = equal.take_while(|found| suffices(&found.explanation)).count();
            self.most_probable_first(&mut found[..equal]);
        }
        let (mut left_out, mut cause) = (vec![Vec::new(); runs.len()], None);
        if verdict != Verdict::Unexplained
            && let Some(answer) = found.first_mut()
        {
            watch(&format!("the size of {}", answer.explanation.label()));
            let look = trial.look_closely(&answer.hypothesis, &answer.errors);
            let explanation = &mut answer.explanation;
            explanation.effects =
                candidates(self, &look.found, &look.errors, &look.intervals, explanation.gain);
            left_out = if runs.len() > 1 {
                trial.leave_out(runs, &look)?
            } else {
                vec![explanation.settings(); runs.len()]
            };
            cause = Cause::of(&explanation.effects[0].setting);
        }
        Ok(LapDiagnosis {
            residual: numbers,
            answer: Answer {
                verdict,
                explanations: found.into_iter().map(|f| f.explanation).collect(),
                indistinguishable,
                left_out,
                cause,
            },
        })
    }
}

/// Every explanation of laps that ripple as with a wheel out of round, the answer first: that wheel, unless what explains the rest
/// of the laps makes them ripple too.
fn explain_ripple(search: &Search<'_>, screened: &[Screened], ripple: &Ripple) -> Vec<Found> {
    let nothing = Hypothesis::nothing();
    let wheel = search.out_of_round(&nothing, ripple);
    let singles = search.singles(screened);
    let rival = singles.first().map_or(0.0, |best| best.explanation.score);
    if first_is(&wheel, |wheel| {
        leaves_nothing_to_ask(wheel) && wheel.score > rival
    }) {
        return with_first(true, wheel, singles);
    }
    let found = explain(search, singles);
    let Some(best) = found.first() else {
        return wheel;
    };
    let Some(ripple) = search.ripple(&best.hypothesis) else {
        return found;
    };
    // Noise may have stood for the wheel.
    let quiet = search.without_noise(&best.hypothesis);
    let mut beside = search.out_of_round(&best.hypothesis, &ripple);
    if !quiet.parts.is_empty() && quiet.parts.len() < best.hypothesis.parts.len() {
        beside.extend(search.out_of_round(&quiet, &ripple));
    }
    beside.extend(wheel);
    sort(&mut beside);
    unless_steady(found, beside)
}

/// Every explanation that was tried to the end, the answer first; `found` are those by single effects.
fn explain(search: &Search<'_>, mut found: Vec<Found>) -> Vec<Found> {
    if !first_is(&found, leaves_nothing_to_ask) {
        let tilted = search.tilted(&found);
        if first_is(&tilted, leaves_nothing_to_ask) {
            return with_first(true, tilted, found);
        }
    }
    // Of an effect that jumps a descent finds the nearest good size, not the best.
    let jumps = found.first().is_some_and(|best| search.jumped(best));
    let needs_no_scan = |best: &Explanation| {
        // What explains most and leaves something lacks a second effect rather than another name.
        let lacks_another = best.share > MOST && !jumps && !goes_over_runs_or_time(best);
        suffices(best) && !is_doubtful(best, ENOUGH) || lacks_another && !best.fits()
    };
    if !first_is(&found, needs_no_scan) {
        let clear = search.clear_pairs();
        if first_is(&clear, leaves_nothing_to_ask) {
            found = preferred(found, clear);
            if first_is(&found, |best| best.effects.len() > 1) {
                return held_still(search, simplified(search, found));
            }
        }
        search.scan(&mut found);
    }
    found.extend(search.patterns(found.iter().take(PATTERNS_OF)));
    sort(&mut found);
    let leaves_next_to_nothing = |best: &Explanation| best.share >= ENOUGH && !goes_over_runs_or_time(best);
    let pairs = match found.first() {
        Some(best) if stands_alone(&best.explanation) || leaves_next_to_nothing(&best.explanation) => {
            let (stands, faults) = (stands_alone(&best.explanation), faults_beside(&best.explanation));
            search.pairs_with(best, stands, faults)
        }
        _ => search.pairs(&mut found),
    };
    found = preferred(found, pairs);
    if first_is(&found, |best| best.effects.len() > 1 && !suffices(best)) {
        let several = (found.iter()).filter(|found| found.explanation.effects.len() > 1);
        let patterns = search.patterns(of_other_effects(several).into_iter().take(PATTERNS_OF_SEVERAL));
        found = preferred(found, patterns);
    }
    if !first_is(&found, |best| suffices(best) || best.share > MOST) {
        let beside = search.scans_beside(&found);
        found = preferred(found, beside);
    }
    if let Some(best) = found.first().filter(|best| best.explanation.effects.len() > 1)
        && !suffices(&best.explanation)
    {
        let as_many = best.explanation.effects.len();
        let alike = found
            .iter()
            .filter(|other| other.explanation.effects.len() == as_many);
        let further = search.further(alike);
        found = preferred(found, further);
    }
    // No cause without a name explains what several with theirs explain nearly all of, or one but for the faults of models.
    let nearly_all =
        |best: &Explanation| best.share >= ALL_BUT_FAULTS || best.effects.len() > 1 && best.share >= ENOUGH;
    if !first_is(&found, |best| suffices(best) || nearly_all(best)) {
        let unnamed = search.unnamed(&found);
        found = unless_named(found, unnamed);
    }
    held_still(search, with_others_alike(search, simplified(search, found)))
}

/// Explanations with those that are the first but for a bump or patch at the same place of a wall or another kind of slip, and
/// those near it but for other sensors, in their order.
fn with_others_alike(search: &Search<'_>, mut found: Vec<Found>) -> Vec<Found> {
    let Some(best) = found.first().filter(|best| is_claimed(&best.explanation)) else {
        return found;
    };
    let mut others = search.otherwise(best);
    others.extend(search.at_other_sensors(&found));
    for other in others {
        if (found.iter()).any(|known| known.hypothesis.is_near(&other.hypothesis, search.atlas())) {
            continue;
        }
        let comes_before = |one: &Found| {
            one.explanation.score < other.explanation.score
                || one.explanation.effects.len() != other.explanation.effects.len()
        };
        let place = found.iter().position(comes_before).unwrap_or(found.len());
        found.insert(place, other);
    }
    found
}

/// Explanations of which the first, if it claims several effects, needs each of them and each of their patterns: an effect that may do
/// nothing has stood for sizes of the others that were not the best ones yet.
fn simplified(search: &Search<'_>, found: Vec<Found>) -> Vec<Found> {
    let Some(best) = found.first().map(|best| &best.explanation) else {
        return found;
    };
    if best.effects.len() < 2 || best.has_no_name() || verdict_of(best) == Verdict::Unexplained {
        return found;
    }
    let rivals = indistinguishable(found.iter().map(|found| &found.explanation), ALTERNATIVE);
    let mut fewer = search.simpler(found[..rivals].iter());
    if fewer.is_empty() {
        return found;
    }
    let needed = best.effects.len();
    let (first, rest): (Vec<Found>, Vec<Found>) = found
        .into_iter()
        .partition(|found| found.explanation.effects.len() >= needed);
    fewer.extend(rest);
    preferred(fewer, first)
}

/// Explanations of which the first, if a name is claimed, holds still within the runs: else what was seen to settle comes first.
fn held_still(search: &Search<'_>, found: Vec<Found>) -> Vec<Found> {
    if let Some(best) = found.first().filter(|best| is_claimed(&best.explanation)) {
        let settling = search.settling(best);
        return unless_steady(found, settling);
    }
    found
}

/// Whether names are claimed.
fn is_claimed(best: &Explanation) -> bool {
    verdict_of(best) != Verdict::Unexplained && !best.has_no_name()
}

/// Whether an explanation has a size by run or by time, which may follow what a further effect does.
fn goes_over_runs_or_time(best: &Explanation) -> bool {
    !best
        .settings()
        .iter()
        .all(|setting| matches!(setting.pattern, Pattern::Constant(_)))
}

fn first_is(found: &[Found], holds: impl Fn(&Explanation) -> bool) -> bool {
    found.first().is_some_and(|best| holds(&best.explanation))
}

/// What is claimed of the best explanation.
fn verdict_of(best: &Explanation) -> Verdict {
    if heaps_noise(best) {
        return Verdict::Unexplained;
    }
    if suffices(best) {
        let clear = best.score >= CLEAR && best.leaves_more_likely_than(CLEAR_P);
        return if is_doubtful(best, TOO_LITTLE) && !clear {
            Verdict::Unexplained
        } else {
            Verdict::Explained
        };
    }
    // Laps have heavier tails than their covariance says.
    let may_be_chance = best.leaves_more_likely_than(HARDLY_P);
    let enough = match best.effects.len() {
        _ if best.has_no_name() => MOST,
        _ if best.score <= STRONG && !may_be_chance => return Verdict::Unexplained,
        1 => ENOUGH,
        _ => MOST,
    };
    let few_enough = if best.has_no_name() || best.share >= ALL_BUT_FAULTS {
        FAR
    } else {
        FAR_BY_NAME
    };
    let left = best.remainder.map_or(0.0, |left| left.times_chance());
    if best.share >= enough && left <= few_enough {
        Verdict::PartlyExplained
    } else {
        Verdict::Unexplained
    }
}

/// Whether an explanation needs several effects on noise: they are more likely one that has no name.
fn heaps_noise(explanation: &Explanation) -> bool {
    noises(explanation) > 1
}

/// The number of effects on noise.
fn noises(explanation: &Explanation) -> usize {
    let names = explanation.names();
    names.iter().filter(|name| is_noise(name)).count()
}

/// Whether an effect changes nothing but chance.
pub(super) fn is_noise(name: &str) -> bool {
    ["slip-level", "slip-memory", "reading-noise", "camera-noise"].contains(&name)
}

/// More effects come before fewer only if each number of the further ones gains enough, and if they fit where the fewer do
/// not or explain more of what the fewer leave.
fn preferred(fewer: Vec<Found>, more: Vec<Found>) -> Vec<Found> {
    let (Some(first), Some(further)) = (fewer.first(), more.first()) else {
        return if fewer.is_empty() { more } else { fewer };
    };
    let count = |f: &Found| f.explanation.effects.iter().map(|c| c.fitted).sum::<usize>();
    let (a, b) = (&first.explanation, &further.explanation);
    let numbers = count(further).saturating_sub(count(first));
    // Patterns have a price of their own, which tells where as many numbers were fitted.
    let gained = if numbers == 0 {
        b.score - a.score
    } else {
        b.gain - a.gain
    };
    // Noise that is too large covers what it does not explain.
    let covered = if noises(a) > 0 { AS_GOOD } else { 0.0 };
    let better = b.fits() || b.share >= ALL_BUT || !suffices(a) && b.share > a.share - covered;
    let worth = if suffices(a) { WORTH_BESIDE } else { WORTH };
    let faults = if b.fits() {
        faults_beside(a)
    } else {
        FAULTS * a.gain
    };
    let wins = gained > faults.max(worth * numbers.max(1) as f64) && better && !heaps_noise(b);
    with_first(wins, more, fewer)
}

/// What the faults of models may gain beside an explanation: more effects that fit must gain more if it stands without them.
fn faults_beside(explanation: &Explanation) -> f64 {
    if suffices(explanation) {
        FAULTS * explanation.gain
    } else {
        0.0
    }
}

/// Two lists as one, the first of them first if it wins.
fn with_first(wins: bool, one: Vec<Found>, other: Vec<Found>) -> Vec<Found> {
    let (mut list, rest) = if wins { (one, other) } else { (other, one) };
    list.extend(rest);
    list
}

/// A cause without a name comes before names that explain no more than it, or less if they explain nearly all.
fn unless_named(named: Vec<Found>, unnamed: Vec<Found>) -> Vec<Found> {
    let Some(best) = unnamed.first() else {
        return named;
    };
    let wins = suffices(&best.explanation)
        || named.first().is_none_or(|first| {
            let (a, b) = (&first.explanation, &best.explanation);
            if a.share >= ENOUGH {
                b.score > a.score + WORTH
            } else {
                b.share > a.share - AS_GOOD
            }
        });
    with_first(wins, unnamed, named)
}

/// What was seen to settle comes before a size that is always the same if it explains about as much.
fn unless_steady(steady: Vec<Found>, settling: Vec<Found>) -> Vec<Found> {
    let (Some(first), Some(best)) = (steady.first(), settling.first()) else {
        return steady;
    };
    let wins = best.explanation.share > first.explanation.share - AS_GOOD;
    with_first(wins, settling, steady)
}

impl Atlas {
    /// What the laps of several runs leave of an answer that they were not asked for: how they depart from the
    /// declared model, and from the model with these effects; the latter is `None` where the robot then crashes.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn confirm(
        &self,
        simulate: &Simulate<'_>,
        runs: &[Vec<ObservedLap>],
        effects: &[Setting],
    ) -> Result<(FourNumbers, Option<FourNumbers>), Error> {
        let memo = Memo::new(simulate);
        let simulate: &Simulate<'_> = &|effects, set| memo.simulate(effects, set);
        let data = self.observed(runs)?;
        let before = FourNumbers::new(&self.white(&data, &self.null), &self.layout);
        if effects.is_empty() {
            return Ok((before, Some(before)));
        }
        let trial = Trial {
            atlas: self,
            simulate,
            data: &data,
        };
        let after = trial.remainder(effects);
        Ok((
            before,
            after.map(|residual| FourNumbers::new(&residual, &self.layout)),
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use sim::find;

    use super::*;
    use crate::Candidate;
    use crate::laps::tests_of_fit::Quadratic;

    /// An explanation by some names that leaves what has a probability, with its share of the excess and its score.
    fn by(names: &[&str], remainder_p: f64, share: f64, score: f64) -> Explanation {
        let candidate = |name: &&str| Candidate {
            setting: Setting::constant(find(name).expect("a name"), [1.1]),
            standard_errors: vec![0.01],
            intervals: BTreeMap::new(),
            gain: score,
            fitted: 1,
        };
        Explanation {
            effects: names.iter().map(candidate).collect(),
            score,
            gain: score,
            share,
            remainder_p: Some(remainder_p),
            remainder: None,
        }
    }

    #[test]
    fn what_leaves_nothing_significant_or_next_to_nothing_is_explained() {
        for (p, share) in [(0.3, 0.9), (0.002, 0.9), (2e-6, 0.985)] {
            let one = by(&["wheel-scale"], p, share, 500.0);
            assert_eq!(verdict_of(&one), Verdict::Explained, "{p} {share}");
        }
        let two = ["wheel-scale", "reading-gain"];
        assert_eq!(verdict_of(&by(&two, 2e-6, 0.996, 5000.0)), Verdict::Explained);
        assert_ne!(verdict_of(&by(&two, 2e-6, 0.985, 5000.0)), Verdict::Explained);
    }

    #[test]
    fn what_leaves_much_is_claimed_in_part_where_little_else_could_be_it() {
        let two = ["wheel-scale", "reading-gain"];
        for (names, p, share, score, claimed) in [
            (&two[..], 1e-30, 0.95, 5000.0, true),
            (&two[..], 1e-30, 0.85, 5000.0, false),
            // Of a weak signal what is left must be hardly more than chance.
            (&two[..], 1e-30, 0.95, 1500.0, false),
            (&two[..], 3e-4, 0.95, 1500.0, true),
            (&two[..], 3e-5, 0.95, 1500.0, false),
            (&two[..1], 1e-30, 0.97, 5000.0, false),
            (&two[..1], 1e-30, 0.99, 5000.0, true),
        ] {
            let verdict = verdict_of(&by(names, p, share, score));
            let expected = if claimed {
                Verdict::PartlyExplained
            } else {
                Verdict::Unexplained
            };
            assert_eq!(verdict, expected, "{names:?} {p} {share} {score}");
        }
    }

    #[test]
    fn names_that_leave_several_times_what_chance_does_are_not_claimed() {
        let leaving = |times: f64, share: f64| {
            let quadratic = |freedom: usize| Quadratic::new(times * freedom as f64, freedom);
            let remainder = FourNumbers {
                mean: quadratic(120),
                runs: quadratic(360),
                trend: quadratic(120),
                noise: quadratic(21),
            };
            Explanation {
                remainder: Some(remainder),
                ..by(&["wheel-scale", "reading-gain"], 1e-30, share, 5000.0)
            }
        };
        for (times, share, claimed) in [
            (2.5, 0.98, true),
            (3.5, 0.98, false),
            (3.5, 0.9995, true),
            (25.0, 0.9995, false),
        ] {
            let verdict = verdict_of(&leaving(times, share));
            assert_eq!(
                verdict == Verdict::PartlyExplained,
                claimed,
                "{times} {share} {verdict:?}"
            );
        }
    }

    #[test]
    fn effects_on_noise_do_not_heap_up() {
        let noises = by(&["slip-level", "camera-noise"], 0.5, 1.0, 500.0);
        assert_eq!(verdict_of(&noises), Verdict::Unexplained);
    }
}
