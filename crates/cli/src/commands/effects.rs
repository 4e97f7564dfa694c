//! `lapwing effects`: the registry.

use anyhow::Result;
use serde_json::{Value, json};
use sim::{EFFECTS, Param, Spec};

use crate::args::Effects;
use crate::session::Session;
use crate::table::four_digits;

pub(crate) fn run(session: &Session, args: &Effects) -> Result<()> {
    if args.json {
        let effects = EFFECTS.iter().map(|spec| {
            json!({
                "name": spec.name,
                "stage": spec.stage.name(),
                "summary": spec.summary,
                "parameters": spec.params.iter().map(parameter).collect::<Vec<_>>(),
            })
        });
        return session.print_json(&effects.collect());
    }
    session.print(&EFFECTS.iter().map(text).collect::<String>())
}

/// An effect's name and stage, what it does, and its parameters, a line each.
fn text(spec: &Spec) -> String {
    let parameters = spec
        .params
        .iter()
        .map(|param| format!("    {}\n", in_words(param)));
    let (name, stage, summary) = (spec.name, spec.stage.name(), spec.summary);
    format!(
        "{name} ({stage})\n  {summary}\n{}",
        parameters.collect::<String>()
    )
}

/// A parameter with its range and unit, or its choices, and the value at which it changes nothing.
fn in_words(param: &Param) -> String {
    let mut text = match param.choices {
        [] => format!(
            "{} [{}, {}]",
            param.name,
            four_digits(param.low),
            four_digits(param.high)
        ),
        choices => format!("{} {}", param.name, choices.join(" or ")),
    };
    if !param.unit.is_empty() {
        text += &format!(" {}", param.unit);
    }
    if let Some(neutral) = param.neutral {
        text += &format!(", neutral {neutral}");
    }
    text
}

fn parameter(param: &Param) -> Value {
    let mut parameter = json!({
        "name": param.name, "unit": param.unit, "neutral": param.neutral, "low": param.low, "high": param.high,
    });
    if !param.choices.is_empty() {
        parameter["choices"] = json!(param.choices);
    }
    parameter
}
