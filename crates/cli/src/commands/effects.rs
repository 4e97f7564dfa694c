//! `lapwing effects`: the registry.

use anyhow::Result;
use serde_json::{Value, json};
use sim::{EFFECTS, Param};

use crate::args::Effects;
use crate::session::Session;
use crate::table::Table;

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
    let mut table = Table::new("", &["effect", "stage", "parameters [neutral]", "what it does"]);
    for spec in EFFECTS {
        let parameter = |param: &Param| match param.neutral {
            Some(neutral) => format!("{} [{neutral}]", param.name),
            None => param.name.to_owned(),
        };
        let parameters: Vec<String> = spec.params.iter().map(parameter).collect();
        table.push([spec.name, spec.stage.name(), &parameters.join(", "), spec.summary]);
    }
    session.print(&table.to_text())
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
