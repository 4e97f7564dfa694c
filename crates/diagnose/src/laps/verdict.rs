//! Which explanation stands, which comes before which, and what is claimed.

use sim::Pattern;

use super::search::{Found, STRONG};
use super::tests_of_fit::HOPELESS_P;
use crate::{Explanation, Verdict};

/// Probability of what is left below which something is left that is worth a search, however small a share it is.
const SURELY_P: f64 = 1e-6;
/// Probability of what is left from which on it may still be chance.
const HARDLY_P: f64 = 1e-4;
/// Share of the excess that an explanation must explain to stand in spite of a significant remainder.
pub(super) const ENOUGH: f64 = 0.98;
/// The same for several effects, which have more freedom to be wrong.
pub(super) const ALL_BUT: f64 = 0.995;
/// Share that several effects, or one without a name, must explain to be claimed in part.
pub(super) const MOST: f64 = 0.9;
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
pub(super) const WORTH: f64 = 10.0;
/// The same where what comes before stands without it.
const WORTH_BESIDE: f64 = 15.0;
/// Share that one effect must explain for what is left to be a fault of the model rather than a cause without a name.
pub(super) const ALL_BUT_FAULTS: f64 = 0.999;

/// Whether an explanation leaves nothing significant, or next to nothing.
pub(super) fn suffices(explanation: &Explanation) -> bool {
    let enough = if explanation.effects.len() > 1 {
        ALL_BUT
    } else {
        ENOUGH
    };
    explanation.fits() || explanation.share >= enough && explanation.leaves_more_likely_than(SURELY_P)
}

/// Whether an explanation needs no further effect.
pub(super) fn stands_alone(explanation: &Explanation) -> bool {
    (explanation.fits() || suffices(explanation) && explanation.share >= ALL_BUT)
        && !is_doubtful(explanation, TOO_LITTLE)
}

/// Whether nothing that is left calls for an effect that no descent finds.
pub(super) fn leaves_nothing_to_ask(explanation: &Explanation) -> bool {
    suffices(explanation) && !is_doubtful(explanation, MOST)
}

/// Whether an explanation with a share below this leaves what is not likely either.
pub(super) fn is_doubtful(explanation: &Explanation, share: f64) -> bool {
    const DOUBTFUL_P: f64 = 0.1;
    explanation.share <= share && !explanation.leaves_more_likely_than(DOUBTFUL_P)
}

/// Whether names are claimed.
pub(super) fn is_claimed(best: &Explanation) -> bool {
    verdict_of(best) != Verdict::Unexplained && !best.has_no_name()
}

/// Whether an explanation leaves far too much, or surely something and is not to be claimed.
pub(super) fn is_no_answer(best: &Explanation) -> bool {
    !best.leaves_more_likely_than(HOPELESS_P)
        || verdict_of(best) == Verdict::Unexplained && !best.leaves_more_likely_than(SURELY_P)
}

/// Whether an explanation has a size by run or by time, which may follow what a further effect does.
pub(super) fn goes_over_runs_or_time(best: &Explanation) -> bool {
    !best
        .settings()
        .iter()
        .all(|setting| matches!(setting.pattern, Pattern::Constant(_)))
}

/// What is claimed of the best explanation.
pub(super) fn verdict_of(best: &Explanation) -> Verdict {
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
        1 if !may_be_chance => ENOUGH,
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
pub(super) fn heaps_noise(explanation: &Explanation) -> bool {
    explanation.noises() > 1
}

/// Whether an explanation by noise leaves something surely: in units of its own scatter all that is left is little, and the share that it
/// explains says nothing.
pub(super) fn hides_what_is_left(best: &Explanation) -> bool {
    best.noises() > 0 && !best.leaves_more_likely_than(SURELY_P)
}

/// More effects come before fewer only if each number of the further ones gains enough, and if they fit where the fewer do
/// not or explain more of what the fewer leave.
pub(super) fn preferred(fewer: Vec<Found>, more: Vec<Found>) -> Vec<Found> {
    let (Some(first), Some(further)) = (fewer.first(), more.first()) else {
        return if fewer.is_empty() { more } else { fewer };
    };
    let (a, b) = (&first.explanation, &further.explanation);
    let (gained, numbers) = gained_by(a, b);
    // Noise that is too large covers what it does not explain.
    let covered = if a.noises() > 0 { AS_GOOD } else { 0.0 };
    let better = b.fits() || b.share >= ALL_BUT || !suffices(a) && b.share > a.share - covered;
    let worth = if suffices(a) { WORTH_BESIDE } else { WORTH };
    let faults = if b.fits() { faults_beside(a) } else { a.faults() };
    let wins = gained > faults.max(worth * numbers) && better && !heaps_noise(b);
    with_first(wins, more, fewer)
}

/// Whether a further effect gains what one is worth that comes after an explanation which leaves something.
pub(super) fn is_worth_its_numbers(fewer: &Explanation, more: &Explanation) -> bool {
    let (gained, numbers) = gained_by(fewer, more);
    gained > WORTH * numbers
}

/// What more effects gain over fewer, and the number of numbers that it takes, one at least.
fn gained_by(fewer: &Explanation, more: &Explanation) -> (f64, f64) {
    let numbers = more.fitted().saturating_sub(fewer.fitted());
    // Patterns have a price of their own, which tells where as many numbers were fitted.
    let gained = if numbers == 0 {
        more.score - fewer.score
    } else {
        more.gain - fewer.gain
    };
    (gained, numbers.max(1) as f64)
}

/// What the faults of models may gain beside an explanation: more effects that fit must gain more if it stands without them.
pub(super) fn faults_beside(explanation: &Explanation) -> f64 {
    if suffices(explanation) {
        explanation.faults()
    } else {
        0.0
    }
}

/// Two lists as one, the first of them first if it wins.
pub(super) fn with_first(wins: bool, one: Vec<Found>, other: Vec<Found>) -> Vec<Found> {
    let (mut list, rest) = if wins { (one, other) } else { (other, one) };
    list.extend(rest);
    list
}

/// A cause without a name comes before names that explain no more than it, or less if they explain nearly all.
pub(super) fn unless_named(named: Vec<Found>, unnamed: Vec<Found>) -> Vec<Found> {
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

/// What something of its own speaks for, as what was seen to settle, comes before others if it explains about as much.
pub(super) fn unless_as_good(others: Vec<Found>, seen: Vec<Found>) -> Vec<Found> {
    let (Some(first), Some(best)) = (others.first(), seen.first()) else {
        return others;
    };
    let wins = best.explanation.share > first.explanation.share - AS_GOOD;
    with_first(wins, seen, others)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use sim::{Setting, find};

    use super::*;
    use crate::Candidate;
    use crate::laps::tests_of_fit::{Departures, Quadratic};

    /// An explanation by some names that leaves what has a probability, with its share of the excess and its score.
    fn by(names: &[&str], remainder_p: f64, share: f64, score: f64) -> Explanation {
        let candidate = |name: &&str| Candidate {
            setting: Setting::constant(find(name).expect("a name"), [1.1]),
            standard_errors: vec![0.01],
            intervals: BTreeMap::new(),
            gain: score,
            fitted: 1,
            weight: 1.0,
        };
        Explanation {
            effects: names.iter().map(candidate).collect(),
            score,
            gain: score,
            gain_error: 0.0,
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
            (&two[..1], 3e-4, 0.97, 400.0, true),
            (&two[..1], 3e-5, 0.97, 400.0, false),
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
            let remainder = Departures {
                mean: quadratic(120),
                runs: quadratic(360),
                trend: quadratic(120),
                noise: quadratic(21),
                start: quadratic(4),
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
    fn what_is_surely_left_by_what_is_not_claimed_is_no_answer() {
        let one = ["wheel-scale"];
        for (p, share, score, no_answer) in [
            (0.3, 0.9, 500.0, false),
            // It may be chance yet, or is next to nothing.
            (1e-5, 0.9, 500.0, false),
            (1e-5, 0.985, 500.0, false),
            (1e-9, 0.9, 500.0, true),
            // Claimed in part, unless far too much is left to look any closer.
            (1e-9, 0.99, 5000.0, false),
            (1e-30, 0.99, 5000.0, true),
        ] {
            let found = by(&one, p, share, score);
            assert_eq!(is_no_answer(&found), no_answer, "{p} {share} {score}");
        }
    }

    #[test]
    fn a_further_effect_is_worth_ten_units_a_number() {
        let one = by(&["wheel-scale"], 0.3, 0.99, 500.0);
        for (score, worth) in [(509.0, false), (511.0, true)] {
            let two = by(&["wheel-scale", "reading-gain"], 0.3, 0.99, score);
            assert_eq!(is_worth_its_numbers(&one, &two), worth, "{score}");
        }
    }

    #[test]
    fn effects_on_noise_do_not_heap_up() {
        let noises = by(&["slip-level", "camera-noise"], 0.5, 1.0, 500.0);
        assert_eq!(verdict_of(&noises), Verdict::Unexplained);
    }
}
