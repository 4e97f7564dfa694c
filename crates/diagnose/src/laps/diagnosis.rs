//! The answer: which effects, how sure, what else it could be.

use std::sync::{Mutex, OnceLock};

use sim::{Setting, Vec2};

use super::atlas::{Atlas, Simulate};
use super::hypothesis::Hypothesis;
use super::memo::Memo;
use super::observed::ObservedRun;
use super::ripple::Ripple;
use super::screen::Screened;
use super::search::{Found, Search, candidates, of_other_effects, sort};
use super::tests_of_fit::{ALARM_P, Departures};
use super::trial::Trial;
use super::verdict::{
    ALL_BUT, ALL_BUT_FAULTS, ENOUGH, MOST, goes_over_runs_or_time, heaps_noise, hides_what_is_left,
    is_claimed, is_doubtful, leaves_nothing_to_ask, preferred, stands_alone, suffices, unless_as_good,
    unless_named, verdict_of, with_first,
};
use crate::answer::{indistinguishable, with_rivals_first};
use crate::{Answer, Cause, Error, Explanation, Verdict, Watch};

/// Score of the best probe from which a data set counts as departing from the declared model, whatever the omnibus says.
pub(super) const ALARM_SCORE: f64 = 7.0;
/// Explanations by several effects of which the sizes are let go over the runs or in time.
const PATTERNS_OF_SEVERAL: usize = 2;

/// What laps tell about a model.
#[derive(Debug, Clone)]
pub struct LapDiagnosis {
    /// How the data depart from the declared model.
    pub residual: Departures,
    /// Probability of what raised the alarm, if anything did, else of the omnibus.
    pub p: f64,
    /// What is claimed.
    pub answer: Answer,
}

impl Atlas {
    /// What the laps of several runs tell about the declared model; `places` along the track, in m from the arena's middle, are where
    /// parts of the floor are looked for that differ from the rest, and `watch` is told what is being tried.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn diagnose(
        &self,
        simulate: &Simulate<'_>,
        runs: &[ObservedRun],
        places: &[Vec2],
        watch: &Watch<'_>,
    ) -> Result<LapDiagnosis, Error> {
        let memo = Memo::new(simulate);
        let simulate: &Simulate<'_> = &|effects, set, extent| memo.simulate(effects, set, extent);
        let data = self.observed(runs)?;
        let residual = self.white(&data, &self.null);
        let numbers = Departures::new(&residual, &self.layout);
        let screened = self.screen(&residual);
        let trial = Trial::new(self, simulate, &data);
        let search = Search {
            trial,
            residual: &residual,
            runs,
            places,
            watch,
            scanned: OnceLock::new(),
            together: OnceLock::new(),
            descended_together: OnceLock::new(),
            heard: Mutex::default(),
        };
        let ripple = search.ripple(&Hypothesis::nothing());
        let mut constant = screened.iter().filter(|s| s.hypothesis.is_constant());
        let best_constant = constant.next().map_or(0.0, |best| best.score);
        // A score has the price of having been chosen, so that chance comes by it as seldom as by so likely an effect.
        let alarms = [
            (numbers.omnibus_p() < ALARM_P).then(|| numbers.omnibus_p()),
            (best_constant > ALARM_SCORE).then(|| (-best_constant).exp()),
            ripple.as_ref().map(Ripple::p),
        ];
        let alarm_p = alarms.into_iter().flatten().reduce(f64::min);
        let Some(p) = alarm_p else {
            return Ok(LapDiagnosis {
                residual: numbers,
                p: numbers.omnibus_p(),
                answer: Answer::faithful(runs.len()),
            });
        };
        let mut found = match ripple {
            Some(ripple) => explain_ripple(&search, &screened, &ripple),
            None => explain(&search, search.singles(&screened)),
        };
        let same = |one: &Found, other: &Found| one.hypothesis.has_patterns_of(&other.hypothesis);
        let indistinguishable = with_rivals_first(&mut found, |found| &found.explanation, same);
        explained_first(&mut found[..indistinguishable]);
        if verdict_of_first(&found) == Verdict::Explained {
            let equal = found[..indistinguishable].iter();
            let equal = equal.take_while(|found| suffices(&found.explanation)).count();
            self.most_probable_first(&mut found[..equal]);
        }
        // The most probable answer may be one that is not to be claimed.
        let verdict = verdict_of_first(&found);
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
            p,
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
    unless_as_good(found, beside)
}

/// Every explanation that was tried to the end, the answer first; `found` are those by single effects.
fn explain(search: &Search<'_>, mut found: Vec<Found>) -> Vec<Found> {
    if !first_is(&found, leaves_nothing_to_ask) {
        let tilted = search.tilted(&found);
        if first_is(&tilted, leaves_nothing_to_ask) {
            return with_first(true, tilted, found);
        }
    }
    let mut unnamed: Option<Vec<Found>> = None;
    // Of an effect that jumps a descent finds the nearest good size, not the best.
    let jumps = found.first().is_some_and(|best| search.jumped(best));
    let needs_no_scan = |best: &Explanation| {
        // What explains most and leaves something lacks a second effect rather than another name.
        let lacks_another =
            best.share > MOST && !jumps && !goes_over_runs_or_time(best) && !hides_what_is_left(best);
        suffices(best) && !is_doubtful(best, ENOUGH) || lacks_another && !best.fits()
    };
    if !first_is(&found, needs_no_scan) {
        let clear = search.clear_pairs();
        if first_is(&clear, leaves_nothing_to_ask) {
            found = preferred(found, clear);
            if first_is(&found, |best| best.effects.len() > 1) {
                return questioned(search, found);
            }
        }
        if jumps {
            search.scan(&mut found);
        }
        // A part of the floor shows soon; for what else goes with the place sizes that jump must be known, which may be it.
        for look in [Search::areas, Search::over_the_floor] {
            if search.is_strong() && !first_is(&found, needs_no_scan) {
                let tried = look(search);
                if first_is(&tried, leaves_nothing_to_ask) {
                    return with_first(true, tried, found);
                }
                unnamed.get_or_insert_default().extend(tried);
            }
            if !search.was_scanned() {
                search.scan(&mut found);
            }
        }
    }
    // A rounding may be what a name explains nearly.
    if !search.was_scanned() && first_is(&found, |best| suffices(best) && is_doubtful(best, ALL_BUT)) {
        search.scan(&mut found);
    }
    found.extend(search.patterns(worth_a_pattern(&found)));
    sort(&mut found);
    // What changes in the course of the runs may settle, and then needs no other effect.
    if first_is(&found, |best| {
        best.settings().iter().any(Setting::goes_by_time) && stands_alone(best)
    }) {
        found = held_still(search, found);
        if first_is(&found, |best| best.has_no_name() && stands_alone(best)) {
            return found;
        }
    }
    let leaves_next_to_nothing = |best: &Explanation| {
        best.share >= ENOUGH && !goes_over_runs_or_time(best) && !hides_what_is_left(best)
    };
    let pairs = match found.first() {
        Some(best) if stands_alone(&best.explanation) || leaves_next_to_nothing(&best.explanation) => {
            search.pairs_with_first(&mut found)
        }
        _ => search.pairs(&mut found),
    };
    found = preferred(found, pairs);
    if first_is(&found, |best| best.effects.len() > 1 && !suffices(best)) {
        let several = (found.iter()).filter(|found| found.explanation.effects.len() > 1);
        let patterns = search.patterns(of_other_effects(several).into_iter().take(PATTERNS_OF_SEVERAL));
        found = preferred(found, patterns);
    }
    if !first_is(&found, suffices) {
        let opposite = search.on_wall_opposite(&found);
        found = preferred(found, opposite);
    }
    if !first_is(&found, suffices) {
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
        if !first_is(&found, suffices) {
            let mut others = search.in_place_of_least(&found);
            others.retain(|other| !heaps_noise(&other.explanation));
            found = in_their_places(found, others, search.atlas());
        }
    }
    // No cause without a name explains what several with theirs explain nearly all of, or one but for the faults of models.
    let nearly_all =
        |best: &Explanation| best.share >= ALL_BUT_FAULTS || best.effects.len() > 1 && best.share >= ENOUGH;
    if !first_is(&found, |best| suffices(best) || nearly_all(best)) {
        let mut unnamed = unnamed.unwrap_or_else(|| search.areas());
        unnamed.extend(search.unnamed(&found));
        sort(&mut unnamed);
        found = unless_named(found, unnamed);
    }
    questioned(search, found)
}

/// Explanations after what the first may need less of, or something alike in place of, and whether it holds still.
fn questioned(search: &Search<'_>, found: Vec<Found>) -> Vec<Found> {
    held_still(search, with_others_alike(search, simplified(search, found)))
}

/// Explanations with those that are the first, or what may be there besides, but for a bump or patch at the same place of a wall or
/// another kind of slip, those that are the first but for the wall opposite, and those near it but for other sensors, in their order.
fn with_others_alike(search: &Search<'_>, found: Vec<Found>) -> Vec<Found> {
    let Some(first) = found.first().filter(|first| is_claimed(&first.explanation)) else {
        return found;
    };
    let mut others = search.otherwise(first, &found);
    let further = found
        .iter()
        .filter(|other| first.explanation.lacks_as(&other.explanation));
    let further = further.max_by(|a, b| a.explanation.score.total_cmp(&b.explanation.score));
    others.extend(further.map_or_else(Vec::new, |further| search.otherwise(further, &found)));
    others.extend(search.at_other_sensors(&found));
    // Where the first does not suffice that was tried before.
    if suffices(&first.explanation) {
        others.extend(search.on_wall_opposite(&found));
    }
    in_their_places(found, others, search.atlas())
}

/// Explanations with others where these come by their scores among those of as many effects, but for what was found already.
fn in_their_places(mut found: Vec<Found>, others: Vec<Found>, atlas: &Atlas) -> Vec<Found> {
    for other in others {
        if (found.iter()).any(|known| known.hypothesis.is_near(&other.hypothesis, atlas)) {
            continue;
        }
        let score = other.explanation.score;
        let as_many = |one: &Found| one.explanation.effects.len() == other.explanation.effects.len();
        let place = (found.iter())
            .position(|one| as_many(one) && one.explanation.score < score)
            .or_else(|| found.iter().rposition(as_many).map(|last| last + 1))
            .unwrap_or(found.len());
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
    let rivals = indistinguishable(found.iter().map(|found| &found.explanation));
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
        return unless_as_good(found, settling);
    }
    found
}

/// Explanations of which the sizes are let go over the runs or in time: where the first leaves nothing to ask, those that may come near
/// it.
fn worth_a_pattern(found: &[Found]) -> impl Iterator<Item = &Found> {
    const MOST: usize = 3;
    const NEAR: f64 = 0.5;
    let score = |found: &Found| found.explanation.score;
    let least = if first_is(found, leaves_nothing_to_ask) {
        NEAR * score(&found[0])
    } else {
        f64::NEG_INFINITY
    };
    found.iter().take(MOST).filter(move |found| score(found) > least)
}

/// Of explanations that the data hardly tell apart one that explains them comes first, where the best leaves something significant.
fn explained_first(alike: &mut [Found]) {
    let is = |verdict: Verdict| move |found: &Found| verdict_of(&found.explanation) == verdict;
    if alike.first().is_some_and(is(Verdict::PartlyExplained))
        && let Some(place) = alike.iter().position(is(Verdict::Explained))
    {
        alike[..=place].rotate_right(1);
    }
}

fn verdict_of_first(found: &[Found]) -> Verdict {
    let first = found.first();
    first.map_or(Verdict::Unexplained, |best| verdict_of(&best.explanation))
}

fn first_is(found: &[Found], holds: impl Fn(&Explanation) -> bool) -> bool {
    found.first().is_some_and(|best| holds(&best.explanation))
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
        runs: &[ObservedRun],
        effects: &[Setting],
    ) -> Result<(Departures, Option<Departures>), Error> {
        let memo = Memo::new(simulate);
        let simulate: &Simulate<'_> = &|effects, set, extent| memo.simulate(effects, set, extent);
        let data = self.observed(runs)?;
        let before = Departures::new(&self.white(&data, &self.null), &self.layout);
        if effects.is_empty() {
            return Ok((before, Some(before)));
        }
        let trial = Trial::new(self, simulate, &data);
        let after = trial.remainder(effects);
        Ok((
            before,
            after.map(|residual| Departures::new(&residual, &self.layout)),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::atlas::Extent;
    use crate::laps::testing::{aside, atlas, simulated};

    #[test]
    fn where_every_simulation_stops_nothing_is_explained() {
        let atlas = atlas();
        let runs = simulated(&aside(5.0), 1000, Extent::Whole).unwrap();
        let stopped: &Simulate<'_> = &|_, _, _| None;
        let diagnosis = atlas.diagnose(stopped, &runs, &[], &|_| ()).unwrap();
        assert_eq!(diagnosis.answer.verdict, Verdict::Unexplained);
        assert!(diagnosis.answer.explanations.is_empty());
    }

    #[test]
    fn laps_of_too_few_gates_are_refused() {
        let few = |effects: &[Setting], set: u64, extent: Extent| {
            let mut runs = simulated(effects, set, extent)?;
            for lap in runs.iter_mut().flat_map(|run| &mut run.laps) {
                lap.seen.offsets_m.truncate(19);
            }
            Some(runs)
        };
        let made = Atlas::without_effects(&few, &[], true, &|| ());
        assert_eq!(made.unwrap_err(), Error::TooFewGates { gates: 19, least: 20 });
    }
}
