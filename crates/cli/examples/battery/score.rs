//! Whether an answer is right.

use std::collections::BTreeSet;

use anyhow::Result;
use serde::Deserialize;
use serde_json::Value;

use crate::classes::{alike, same_set};
use crate::labels::{Kind, Label};
use crate::parameters::{ParameterError, comparable, errors, which_is_right};
use crate::program::Timing;

/// What `trace.json` says.
#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Trace {
    pub(crate) verdict: String,
    #[serde(default)]
    pub(crate) residual: Residual,
    #[serde(default)]
    pub(crate) effects: Vec<Effect>,
    #[serde(default)]
    pub(crate) alternative_sets: Vec<Vec<String>>,
    #[serde(default)]
    pub(crate) candidates: Vec<Tried>,
    #[serde(default)]
    pub(crate) error: Error,
    #[serde(default)]
    pub(crate) baselines: Option<Baselines>,
}

#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Residual {
    pub(crate) stage: Option<String>,
    pub(crate) p: Option<f64>,
}

#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Effect {
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) stage: Option<String>,
    #[serde(default)]
    pub(crate) parameters: Vec<Interval>,
    #[serde(default)]
    pub(crate) by: Option<String>,
    #[serde(default)]
    pub(crate) share: Option<f64>,
    #[serde(default)]
    pub(crate) alternatives: Vec<String>,
}

/// A parameter in an answer; lists where it goes by run.
#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Interval {
    pub(crate) name: String,
    pub(crate) value: Value,
    #[serde(default)]
    pub(crate) low: Value,
    #[serde(default)]
    pub(crate) high: Value,
}

/// An explanation that was tried to the end, the answer's first.
#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Tried {
    /// Probability that chance leaves what it leaves.
    #[serde(default)]
    pub(crate) remainder_p: Option<f64>,
}

#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Error {
    pub(crate) before: Option<f64>,
    pub(crate) after: Option<f64>,
    pub(crate) floor: Option<f64>,
}

/// The best three names by simpler ways.
#[derive(Debug, Clone, Default, Deserialize)]
pub(crate) struct Baselines {
    pub(crate) mean_lap_rms: Vec<String>,
    pub(crate) two_modes: Vec<String>,
}

impl Trace {
    /// # Errors
    /// A document of another form.
    pub(crate) fn new(document: &Value) -> Result<Self> {
        Ok(Self::deserialize(document)?)
    }

    /// Of a set that the program could not trace.
    pub(crate) fn failed(message: &str) -> Self {
        Self {
            verdict: format!("could not run: {message}"),
            ..Self::default()
        }
    }
}

/// Probability below which the omnibus sees something.
const SEEN_P: f64 = 0.01;

/// A data set with its truth and its answer.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    pub(crate) label: Label,
    pub(crate) trace: Trace,
    pub(crate) timing: Timing,
    /// Error of the true model on the same runs, m, where that is known.
    pub(crate) truth_m: Option<f64>,
}

impl Outcome {
    /// The name that comes first; `None` where nothing is claimed.
    pub(crate) fn first(&self) -> Option<&str> {
        self.trace.effects.first().map(|effect| effect.name.as_str())
    }

    fn truth(&self) -> &str {
        self.label.effects.first().map_or("", String::as_str)
    }

    pub(crate) fn names(&self) -> Vec<&str> {
        (self.trace.effects.iter())
            .map(|effect| effect.name.as_str())
            .collect()
    }

    /// Whether the omnibus misses the effect, so that `faithful` is the right answer.
    pub(crate) fn below_detection(&self) -> bool {
        matches!(self.label.kind, Kind::Single | Kind::Outside)
            && self.trace.verdict == "faithful"
            && self.trace.residual.p.is_some_and(|p| p > SEEN_P)
    }

    /// Whether one of two effects is the answer, and the omnibus misses the other one beside it.
    pub(crate) fn hides_one(&self) -> bool {
        let [name] = self.names()[..] else {
            return false;
        };
        let left = self
            .trace
            .candidates
            .first()
            .and_then(|answer| answer.remainder_p);
        self.label.kind == Kind::Pair
            && (self.label.effects.iter()).any(|truth| alike(&self.label, name, truth))
            && left.is_some_and(|p| p > SEEN_P)
    }

    /// Whether the true name comes first.
    pub(crate) fn exact(&self) -> bool {
        self.first() == Some(self.truth())
    }

    /// Whether a name comes first that is one answer with the true one.
    pub(crate) fn in_class(&self) -> bool {
        self.first()
            .is_some_and(|first| alike(&self.label, first, self.truth()))
    }

    /// Every name that is reported for one effect: the first, its alternatives, and alternative answers of one effect.
    pub(crate) fn reported(&self) -> BTreeSet<&str> {
        let Some(first) = self.trace.effects.first() else {
            return BTreeSet::new();
        };
        let single = self.trace.alternative_sets.iter().filter(|set| set.len() == 1);
        let others = first.alternatives.iter().chain(single.flatten());
        others.chain([&first.name]).map(String::as_str).collect()
    }

    /// Whether the true name is among those reported.
    pub(crate) fn in_reported(&self) -> bool {
        self.reported().contains(self.truth())
    }

    /// The same, with names that are one answer.
    pub(crate) fn class_in_reported(&self) -> bool {
        let reported = self.reported();
        reported.iter().any(|name| alike(&self.label, name, self.truth()))
    }

    /// Whether the answer is in the right stage.
    pub(crate) fn stage_right(&self) -> bool {
        let answer = (self.trace.residual.stage.as_ref())
            .or_else(|| self.trace.effects.first().and_then(|first| first.stage.as_ref()));
        answer.is_some() && answer == self.label.stages.first()
    }

    /// Whether an effect outside the list is refused, or characterised in the right stage.
    pub(crate) fn refused_or_characterised(&self) -> bool {
        let unlisted = |first: &Effect| {
            let stage = first.stage.as_ref().or(self.trace.residual.stage.as_ref());
            first.name == "unlisted" && stage == self.label.stages.first()
        };
        self.trace.verdict == "unexplained" || self.trace.effects.first().is_some_and(unlisted)
    }

    /// Whether the answer is the true effects and no other.
    pub(crate) fn all_right(&self) -> bool {
        self.is_truth(&self.names())
    }

    /// Whether the true effects are one of the answers reported.
    pub(crate) fn all_reported(&self) -> bool {
        let alternative = |set: &Vec<String>| {
            let names: Vec<&str> = set.iter().map(String::as_str).collect();
            self.is_truth(&names)
        };
        self.all_right() || self.trace.alternative_sets.iter().any(alternative)
    }

    fn is_truth(&self, names: &[&str]) -> bool {
        let truth: Vec<&str> = self.label.effects.iter().map(String::as_str).collect();
        !truth.is_empty() && same_set(&self.label, &truth, names)
    }

    /// Whether a size that goes by run is recognised as such.
    pub(crate) fn by_run_right(&self) -> bool {
        let by = self.trace.effects.first().and_then(|first| first.by.as_deref());
        by == Some("run") && self.in_class()
    }

    /// Whether what the set asks for was answered.
    pub(crate) fn right(&self) -> bool {
        match self.label.kind {
            Kind::Null => self.trace.verdict == "faithful",
            Kind::Single if self.label.by_run => self.by_run_right(),
            Kind::Single => self.below_detection() || self.in_class(),
            Kind::Outside => self.below_detection() || self.refused_or_characterised(),
            Kind::Pair => self.all_right(),
        }
    }

    /// The errors of the sizes, where a single effect is named right and its sizes have one meaning.
    pub(crate) fn parameter_errors(&self) -> Vec<ParameterError> {
        let first = self.trace.effects.first();
        let Some(first) = first.filter(|_| self.label.kind == Kind::Single && self.exact()) else {
            return Vec::new();
        };
        if !comparable(&first.name) {
            return Vec::new();
        }
        errors(&first.name, &self.label.parameters, &first.parameters)
    }

    /// Whether the effect is named right and its sensor or wall is not.
    pub(crate) fn other_place(&self) -> bool {
        let first = self.trace.effects.first();
        let first = first.filter(|_| self.label.kind == Kind::Single && self.exact());
        first.is_some_and(|first| !which_is_right(&first.name, &self.label.parameters, &first.parameters))
    }

    /// Error after over floor.
    pub(crate) fn after_over_floor(&self) -> Option<f64> {
        let ratio = self.trace.error.after? / self.trace.error.floor?;
        ratio.is_finite().then_some(ratio)
    }

    /// Error after over that of the true model on the same runs: what chance does to a run it does to both.
    pub(crate) fn after_over_truth(&self) -> Option<f64> {
        Some(self.trace.error.after? / self.truth_m?)
    }

    /// Where a simpler way puts the truth: right by name, right by class.
    pub(crate) fn baseline(&self, names: impl Fn(&Baselines) -> &[String]) -> Option<[bool; 2]> {
        let names = names(self.trace.baselines.as_ref()?);
        let first = names.first().map_or("", String::as_str);
        Some([first == self.truth(), alike(&self.label, first, self.truth())])
    }

    /// The answer in a few words.
    pub(crate) fn answer(&self) -> String {
        let effect = |effect: &Effect| {
            let by = effect
                .by
                .as_ref()
                .map_or_else(String::new, |by| format!(" by {by}"));
            let share = effect
                .share
                .map_or_else(String::new, |share| format!(" {:.1} %", 100.0 * share));
            let others = match effect.alternatives.as_slice() {
                [] => String::new(),
                names => format!(" (or {})", names.join(", ")),
            };
            format!("{}{by}{share}{others}", effect.name)
        };
        let effects: Vec<String> = self.trace.effects.iter().map(effect).collect();
        match effects.as_slice() {
            [] => self.trace.verdict.clone(),
            _ => format!("{}: {}", self.trace.verdict, effects.join(" + ")),
        }
    }

    /// Truth and answer in one line.
    pub(crate) fn line(&self) -> String {
        let Label {
            name,
            level,
            controller,
            ..
        } = &self.label;
        let truth = match self.label.title() {
            none if none.is_empty() => "no effect".to_owned(),
            title => format!("{title} ({})", self.label.sizes()),
        };
        let mark = if self.right() { "" } else { "WRONG " };
        format!(
            "{mark}{name} {} {}, {truth} -> {}",
            level.name(),
            controller.name(),
            self.answer()
        )
    }
}

#[cfg(test)]
#[path = "score_tests.rs"]
mod tests;
