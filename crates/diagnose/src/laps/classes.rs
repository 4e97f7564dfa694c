//! Names that are one answer to laps alone: the most probable answer is the one whose names together are.

use sim::UNLISTED;

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

/// Brings the best explanation of the most probable answer to the front. Explanations of the same classes are one answer,
/// as probable as they are together.
pub(super) fn most_probable_first(found: &mut [Found]) {
    let scores: Vec<(Vec<&str>, f64)> = (found.iter())
        .map(|found| (classes_of(&found.explanation), found.explanation.score))
        .collect();
    if scores.iter().any(|(classes, _)| classes.contains(&UNLISTED.name)) {
        return;
    }
    found[..=most_probable(&scores)].rotate_right(1);
}

/// The best scored of the most probable of some answers, each with the log-likelihood of one way to it, best first.
fn most_probable<T: PartialEq>(scores: &[(T, f64)]) -> usize {
    let Some(best) = scores.first() else {
        return 0;
    };
    let together = |answer: &T| -> f64 {
        let own = scores.iter().filter(|(other, _)| other == answer);
        own.map(|(_, score)| (score - best.1).exp()).sum()
    };
    let mut first = 0;
    for (i, (answer, _)) in scores.iter().enumerate() {
        if together(answer) > together(&scores[first].0) {
            first = i;
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ways_to_an_answer_count_together() {
        assert_eq!(most_probable(&[("a", 9.0), ("b", 8.8), ("b", 8.5)]), 1);
        assert_eq!(most_probable(&[("a", 9.0), ("b", 8.0), ("b", 7.5)]), 0);
        assert_eq!(most_probable(&[("a", 9.0), ("c", 8.9), ("b", 8.8)]), 0);
    }

    #[test]
    fn classes_name_effects() {
        for name in CLASSES.concat() {
            assert!(sim::find(name).is_ok(), "{name}");
        }
    }
}
