//! Which names are one answer, because the data cannot tell them apart.

use crate::labels::{Controller, Label, Level};

/// Names that count as one, for some data.
struct Class {
    level: Level,
    /// `None`: for both.
    controller: Option<Controller>,
    names: &'static [&'static str],
}

const CLASSES: &[Class] = &[
    // Equal in principle with camera data alone: how fast the wheels turn is all that laps see of either.
    Class {
        level: Level::L1,
        controller: Some(Controller::Braitenberg),
        names: &["wheel-scale", "controller-speed"],
    },
    // The rule-based controller knows one speed, so that a rounded speed is a scaled one.
    Class {
        level: Level::L1,
        controller: Some(Controller::RuleBased),
        names: &["wheel-scale", "controller-speed", "speed-step"],
    },
    // Nearly equal: readings are taken far beyond d0, where the response is a power of the distance.
    Class {
        level: Level::L1,
        controller: Some(Controller::Braitenberg),
        names: &["reading-gain", "distance-scale", "controller-gain"],
    },
    // Nearly equal where only threshold crossings matter.
    Class {
        level: Level::L1,
        controller: Some(Controller::RuleBased),
        names: &[
            "reading-gain",
            "distance-scale",
            "response-exponent",
            "crosstalk",
            "controller-gain",
        ],
    },
    // The rule-based controller knows one turn rate; a log of its commands does not add another.
    Class {
        level: Level::L1,
        controller: Some(Controller::RuleBased),
        names: &["axle-length", "turn-scrub"],
    },
    Class {
        level: Level::L2,
        controller: Some(Controller::RuleBased),
        names: &["axle-length", "turn-scrub"],
    },
    // A log tells the controller's speed from the wheels', but not a rounded speed from a scaled one.
    Class {
        level: Level::L2,
        controller: Some(Controller::RuleBased),
        names: &["wheel-scale", "speed-step"],
    },
    // A log of readings and commands splits the decide stage off; these stay.
    Class {
        level: Level::L2,
        controller: None,
        names: &["reading-gain", "distance-scale"],
    },
    // With the few laps that come with a log.
    Class {
        level: Level::L2,
        controller: None,
        names: &["slip-level", "slip-memory"],
    },
];

/// Whether two names are one answer to the data of a set.
pub(crate) fn alike(label: &Label, a: &str, b: &str) -> bool {
    are_one(label.level, label.controller, a, b)
}

/// Whether two names are one answer to such data of a robot with that controller.
pub(crate) fn are_one(level: Level, controller: Controller, a: &str, b: &str) -> bool {
    let applies = |class: &&Class| class.level == level && class.controller.is_none_or(|of| of == controller);
    a == b
        || CLASSES
            .iter()
            .filter(applies)
            .any(|class| class.names.contains(&a) && class.names.contains(&b))
}

/// Whether two lists hold the same names but for their order and for names that are one answer.
pub(crate) fn same_set(label: &Label, a: &[&str], b: &[&str]) -> bool {
    let Some((first, rest)) = a.split_first() else {
        return b.is_empty();
    };
    a.len() == b.len()
        && (0..b.len()).any(|i| {
            let mut others = b.to_vec();
            let partner = others.remove(i);
            alike(label, first, partner) && same_set(label, rest, &others)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Kind;

    fn label(level: Level, controller: Controller) -> Label {
        Label {
            name: "x".into(),
            level,
            kind: Kind::Single,
            controller,
            effects: Vec::new(),
            by_run: false,
            stages: Vec::new(),
            parameters: Vec::new(),
        }
    }

    #[test]
    fn classes_depend_on_the_controller_and_on_the_log() {
        let laps = label(Level::L1, Controller::Braitenberg);
        let turns = label(Level::L1, Controller::RuleBased);
        let log = label(Level::L2, Controller::Braitenberg);
        assert!(alike(&laps, "reading-gain", "controller-gain"));
        assert!(!alike(&log, "reading-gain", "controller-gain"));
        assert!(alike(&log, "distance-scale", "reading-gain"));
        assert!(alike(&turns, "crosstalk", "response-exponent"));
        assert!(!alike(&laps, "crosstalk", "response-exponent"));
        assert!(alike(&laps, "cone-of-view", "cone-of-view"));
    }

    #[test]
    fn classes_name_effects() {
        for name in CLASSES.iter().flat_map(|class| class.names) {
            assert!(sim::find(name).is_ok(), "{name}");
        }
    }

    #[test]
    fn sets_match_one_to_one() {
        let laps = label(Level::L1, Controller::Braitenberg);
        let truth = ["reading-gain", "slip-level"];
        assert!(same_set(&laps, &truth, &["slip-level", "distance-scale"]));
        assert!(!same_set(&laps, &truth, &["reading-gain", "distance-scale"]));
        assert!(!same_set(&laps, &truth, &["reading-gain"]));
        let twice = ["reading-gain", "distance-scale"];
        assert!(same_set(&laps, &twice, &["distance-scale", "controller-gain"]));
    }
}
