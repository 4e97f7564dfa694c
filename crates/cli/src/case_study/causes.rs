//! The causes that section IV-C of the paper names, and what traces say of them.

use diagnose::{Candidate, Explanation, Verdict};
use serde_json::{Value, json};

use crate::table::Table;
use crate::trace::{Trace, parameters};

/// What the paper's simulation leaves out.
#[derive(Debug, Clone, Copy)]
struct Cause {
    name: &'static str,
    /// The effects of the registry that stand for it.
    effects: &'static [&'static str],
}

/// In the order of section IV-C.
const CAUSES: [Cause; 6] = [
    Cause {
        name: "a cone of view instead of a ray",
        effects: &["cone-of-view"],
    },
    Cause {
        name: "slip and friction of stepper motors",
        effects: &[
            "slip-level",
            "slip-memory",
            "turn-scrub",
            "wheel-asymmetry",
            "wheel-scale",
            "motor-lag",
            "dead-band",
            "speed-step",
            "acceleration-limit",
        ],
    },
    Cause {
        name: "the shape of the walls",
        effects: &["outer-wall-offset", "inner-wall-offset", "wall-bump"],
    },
    Cause {
        name: "infra-red reflections",
        effects: &[
            "incidence-falloff",
            "outer-wall-reflectance",
            "inner-wall-reflectance",
            "reflectance-patch",
            "crosstalk",
        ],
    },
    Cause {
        name: "tracking noise",
        effects: &["camera-noise"],
    },
    Cause {
        name: "variable lighting",
        effects: &["ambient-offset", "directional-light"],
    },
];

/// What one trace says of a cause, the strongest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Presence {
    /// In every explanation that these laps do not tell apart.
    Present,
    /// Neither claimed nor ruled out.
    Open,
    /// Tried, and the answer explains the laps without it.
    NotNeeded,
    /// Nothing departs from the declared model, so nothing was searched.
    NotSeen,
    /// The search did not come to it, or there is no trace.
    NotTried,
}

/// What the traces say of a cause.
#[derive(Debug)]
pub(super) struct Finding {
    cause: Cause,
    presence: Presence,
    /// Name of the controller and what its trace says.
    said: Vec<(&'static str, String)>,
}

/// What traces, under the names of their controllers, say of each cause.
pub(super) fn find(traces: &[(&'static str, Option<&Trace>)]) -> Vec<Finding> {
    let finding = |cause: Cause| {
        let looked: Vec<_> = traces
            .iter()
            .map(|(name, trace)| (*name, cause.look(*trace)))
            .collect();
        Finding {
            cause,
            presence: looked
                .iter()
                .map(|(_, (presence, _))| *presence)
                .min()
                .unwrap_or(Presence::NotTried),
            said: looked.into_iter().map(|(name, (_, said))| (name, said)).collect(),
        }
    };
    CAUSES.into_iter().map(finding).collect()
}

impl Cause {
    fn among(&self, explanation: &Explanation) -> bool {
        self.of(explanation).next().is_some()
    }

    /// The effects of an explanation that stand for this cause.
    fn of<'e>(&self, explanation: &'e Explanation) -> impl Iterator<Item = &'e Candidate> {
        let own = self.effects;
        explanation
            .effects
            .iter()
            .filter(move |effect| own.contains(&effect.setting.spec.name))
    }

    fn look(&self, trace: Option<&Trace>) -> (Presence, String) {
        let Some(answer) = trace.map(|trace| &trace.answer) else {
            return (Presence::NotTried, "not traced".into());
        };
        if answer.verdict == Verdict::Faithful {
            return (
                Presence::NotSeen,
                "not seen: these laps do not depart from the model".into(),
            );
        }
        let rivals = &answer.explanations[..answer.indistinguishable];
        let without = rivals.iter().find(|rival| !self.among(rival));
        if let Some(claimed) = answer.claimed().filter(|claimed| self.among(claimed)) {
            let sizes: Vec<String> = self.of(claimed).map(size).collect();
            let sizes = sizes.join(" and ");
            return match without {
                None => (Presence::Present, format!("in the answer: {sizes}")),
                Some(rival) => (
                    Presence::Open,
                    format!(
                        "in the answer: {sizes}; but these laps do not tell it from {}",
                        rival.label()
                    ),
                ),
            };
        }
        let Some(tried) = answer.explanations.iter().find(|tried| self.among(tried)) else {
            return (
                Presence::NotTried,
                "not tried: the search did not come to it".into(),
            );
        };
        let label = tried.label();
        let behind = answer.explanations[0].score - tried.score;
        match answer.verdict {
            _ if rivals.iter().any(|rival| self.among(rival)) => (
                Presence::Open,
                format!("{label} would do as well as the answer: {behind:.1} behind it"),
            ),
            Verdict::Explained | Verdict::Faithful => (
                Presence::NotNeeded,
                format!("tried and not needed ({label}): {behind:.1} behind the answer"),
            ),
            Verdict::PartlyExplained => (
                Presence::Open,
                format!(
                    "tried ({label}): {behind:.1} behind the answer, which leaves a remainder, so it is not ruled out"
                ),
            ),
            Verdict::Unexplained => (
                Presence::Open,
                format!("tried ({label}): {behind:.1} behind the best, and nothing is claimed"),
            ),
        }
    }
}

/// An effect with its values and their intervals.
fn size(effect: &Candidate) -> String {
    let numbers = |value: &Value| -> Vec<String> {
        let list = value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
        list.iter()
            .filter_map(Value::as_f64)
            .map(|x| format!("{x:.4}"))
            .collect()
    };
    let parameter = |entry: &Value| {
        let name = entry["name"].as_str().unwrap_or_default();
        if let Some(word) = entry["value"].as_str() {
            return format!("{name} {word}");
        }
        let [values, low, high] = ["value", "low", "high"].map(|key| numbers(&entry[key]));
        let with_interval = |((value, low), high): ((&String, &String), &String)| match low == high {
            true => value.clone(),
            false => format!("{value} [{low}, {high}]"),
        };
        let each: Vec<String> = values.iter().zip(&low).zip(&high).map(with_interval).collect();
        format!("{name} {}", each.join(", "))
    };
    let parameters: Vec<String> = parameters(effect).iter().map(parameter).collect();
    let by = match effect.setting.pattern {
        sim::Pattern::Constant(_) => "",
        sim::Pattern::ByRun(_) => " by run",
        sim::Pattern::ByTime { .. } => " by time",
    };
    format!("{}{by} ({})", effect.setting.spec.name, parameters.join("; "))
}

impl Finding {
    /// Yes, no, or neither.
    fn present(&self) -> Option<bool> {
        match self.presence {
            Presence::Present => Some(true),
            Presence::NotNeeded => Some(false),
            Presence::Open | Presence::NotSeen | Presence::NotTried => None,
        }
    }

    fn word(&self) -> &'static str {
        match self.presence {
            Presence::Present => "yes",
            Presence::Open => "open",
            Presence::NotNeeded => "not needed",
            Presence::NotSeen => "not seen",
            Presence::NotTried => "not tried",
        }
    }

    pub(super) fn json(&self) -> Value {
        let evidence: Vec<String> = self
            .said
            .iter()
            .map(|(who, what)| format!("{who}: {what}"))
            .collect();
        json!({
            "cause": self.cause.name, "effects": self.cause.effects,
            "present": self.present(), "finding": self.word(), "evidence": evidence.join("; "),
        })
    }

    /// For a terminal.
    pub(super) fn text(&self) -> String {
        let mut text = format!("{:>10}  {}\n", self.word(), self.cause.name);
        for (who, what) in &self.said {
            text += &format!("            {who}: {what}\n");
        }
        text
    }
}

/// The causes with what the trace of each controller says.
pub(super) fn table(findings: &[Finding], controllers: [&str; 2]) -> Table {
    let [one, other] = controllers;
    let mut table = Table::new(
        "What section IV-C names, and what the traces say of it",
        &["cause", "effects that stand for it", "in these data", one, other],
    );
    for finding in findings {
        let head = [
            finding.cause.name.to_owned(),
            finding.cause.effects.join(", "),
            finding.word().to_owned(),
        ];
        let said = finding.said.iter().map(|(_, what)| what.clone());
        table.push(head.into_iter().chain(said));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_that_stands_for_a_cause_is_known() {
        for name in CAUSES.iter().flat_map(|cause| cause.effects) {
            assert!(sim::find(name).is_ok(), "{name}");
        }
    }

    #[test]
    fn without_a_trace_nothing_is_said_of_any_cause() {
        let found = find(&[("braitenberg", None), ("rule_based", None)]);
        assert_eq!(found.len(), CAUSES.len());
        assert!(
            found
                .iter()
                .all(|f| f.present().is_none() && f.word() == "not tried")
        );
        assert_eq!(
            found[0].json()["evidence"],
            "braitenberg: not traced; rule_based: not traced"
        );
    }
}
