//! Names that are one answer to laps alone: the most probable answer is the one whose names together are.

use super::atlas::Atlas;
use super::screen::price;
use super::search::Found;
use crate::Explanation;

/// Effects that laps on any course hardly tell apart: how fast the wheels turn is all that they see of the first two, and
/// sensors that work far beyond d0 answer with a power of the distance.
const CLASSES: [&[&str]; 2] = [
    &["wheel-scale", "controller-speed"],
    &["reading-gain", "distance-scale", "controller-gain"],
];

/// What a name stands for: the first of its class, or itself.
fn stands_for(name: &'static str) -> &'static str {
    let class = CLASSES.iter().find(|class| class.contains(&name));
    class.map_or(name, |class| class[0])
}

/// The classes of an explanation's effects, in order.
fn classes_of(explanation: &Explanation) -> Vec<&'static str> {
    let mut classes: Vec<&str> = explanation.names().into_iter().map(stands_for).collect();
    classes.sort_unstable();
    classes
}

impl Atlas {
    /// Brings the best explanation of the most probable answer to the front. Explanations of the same classes are one answer, as
    /// probable as they are together.
    pub(super) fn most_probable_first(&self, found: &mut [Found]) {
        if found.iter().any(|found| found.explanation.has_no_name()) {
            return;
        }
        // A score has Schwarz's price, the same for every number, in place of the share of its range that the data leave it.
        let schwarz = price(1, self.layout.total_laps());
        let way = |found: &Found| {
            let Found {
                hypothesis,
                errors,
                correlation,
                ..
            } = found;
            let shares = hypothesis.shares_left(errors, self);
            Way {
                answer: classes_of(&found.explanation),
                score: found.explanation.score,
                occam: shares.iter().map(|share| share.ln() + schwarz).sum::<f64>()
                    + hypothesis.made_up_for(errors, correlation, self),
            }
        };
        let ways: Vec<_> = found.iter().map(way).collect();
        if let Some(first) = most_probable(&ways) {
            found[..=first].rotate_right(1);
        }
    }
}

/// One way to an answer.
struct Way<T> {
    answer: T,
    /// Log-likelihood less the price of the fitted numbers.
    score: f64,
    /// What the logarithm of how probable it makes the data has beyond that.
    occam: f64,
}

/// The most probable way to the most probable answer. Where ranges are needed to tell which that is, which are known to a factor of
/// two, it has to be more probable by that much.
fn most_probable<T: PartialEq>(ways: &[Way<T>]) -> Option<usize> {
    const KNOWN_TO: f64 = 2.0;
    let likeliest = most_probable_by(ways, |way| way.score)?;
    let evidence = |way: &Way<T>| way.score + way.occam;
    let first = most_probable_by(ways, evidence)?;
    let gained = together(ways, first, evidence) / together(ways, likeliest, evidence);
    Some(if gained > KNOWN_TO { first } else { likeliest })
}

/// The way of the highest logarithm of a probability to the answer whose ways are the most probable together.
fn most_probable_by<T: PartialEq>(ways: &[Way<T>], of: impl Fn(&Way<T>) -> f64 + Copy) -> Option<usize> {
    let rank = |i: usize| (together(ways, i, of), of(&ways[i]));
    (0..ways.len()).reduce(|best, i| if rank(i) > rank(best) { i } else { best })
}

/// How probable the ways to one of the answers are together, in units of the most probable way of all.
fn together<T: PartialEq>(ways: &[Way<T>], one: usize, of: impl Fn(&Way<T>) -> f64) -> f64 {
    let most = ways.iter().map(&of).fold(f64::NEG_INFINITY, f64::max);
    let own = ways.iter().filter(|way| way.answer == ways[one].answer);
    own.map(|way| (of(way) - most).exp()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ways<'a>(of: &[(&'a str, f64, f64)]) -> Vec<Way<&'a str>> {
        let way = |&(answer, score, occam): &(&'a str, f64, f64)| Way { answer, score, occam };
        of.iter().map(way).collect()
    }

    #[test]
    fn two_ways_to_an_answer_count_together() {
        let first = |scores: &[(&str, f64)]| {
            let all: Vec<_> = scores
                .iter()
                .map(|(answer, score)| (*answer, *score, -1.0))
                .collect();
            most_probable(&ways(&all))
        };
        assert_eq!(first(&[("a", 9.0), ("b", 8.8), ("b", 8.5)]), Some(1));
        assert_eq!(first(&[("a", 9.0), ("b", 8.0), ("b", 7.5)]), Some(0));
        assert_eq!(first(&[("a", 9.0), ("c", 8.9), ("b", 8.8)]), Some(0));
        assert_eq!(first(&[]), None);
    }

    #[test]
    fn what_does_so_over_more_of_its_range_comes_first() {
        let [narrow, wide, wider] = [-3.0, -2.5, -1.0];
        assert_eq!(
            most_probable(&ways(&[("a", 9.0, narrow), ("b", 8.5, wider)])),
            Some(1)
        );
        assert_eq!(
            most_probable(&ways(&[("a", 9.0, narrow), ("b", 6.5, wider)])),
            Some(0)
        );
        // No more than ranges are known.
        assert_eq!(
            most_probable(&ways(&[("a", 9.0, narrow), ("b", 8.9, wide)])),
            Some(0)
        );
    }

    #[test]
    fn classes_name_effects() {
        for name in CLASSES.concat() {
            assert!(sim::find(name).is_ok(), "{name}");
        }
    }
}
