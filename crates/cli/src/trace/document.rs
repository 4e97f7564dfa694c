//! `trace.json`.

use diagnose::{Candidate, Explanation, FourNumbers, Quadratic, Verdict};
use serde_json::{Value, json};
use sim::Pattern;

use super::Trace;

/// Half width of a 95 % interval in standard errors.
const HALF_WIDTH_95: f64 = 1.96;

/// The document of a trace.
pub(crate) fn document(trace: &Trace) -> Value {
    let diagnosis = &trace.diagnosis;
    let answer = match diagnosis.verdict {
        Verdict::Faithful | Verdict::Unexplained => None,
        _ => diagnosis.explanations.first(),
    };
    let rivals = &diagnosis.explanations[..diagnosis.indistinguishable];
    let sets: Vec<Vec<&str>> = distinct(rivals.iter().map(Explanation::names));
    json!({
        "verdict": verdict(diagnosis.verdict),
        "residual": residual(&diagnosis.residual, answer),
        "effects": answer.map_or_else(Vec::new, |a| effects(a, rivals)),
        "alternative_sets": if sets.len() > 1 { sets } else { Vec::new() },
        "error": {
            "metric": "rms over the gates of the difference between the mean lateral position of simulated laps and of a held-out run, m",
            "before": trace.before_m, "after": trace.after_m, "floor": trace.floor_m,
            "held_out": trace.held_out.iter().map(|run| run.name.clone()).collect::<Vec<_>>(),
        },
        "candidates": diagnosis.explanations.iter().map(candidate).collect::<Vec<_>>(),
        "separate_with": Vec::<Value>::new(),
        "laps_simulated": trace.laps_simulated,
    })
}

pub(crate) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Faithful => "faithful",
        Verdict::Explained => "explained",
        Verdict::PartlyExplained => "partly explained",
        Verdict::Unexplained => "unexplained",
    }
}

fn quadratic(q: &Quadratic) -> Value {
    json!({ "q": q.q, "df": q.freedom, "excess": q.excess(), "p": q.p })
}

fn four(numbers: &FourNumbers) -> Value {
    json!({
        "mean": quadratic(&numbers.mean), "runs": quadratic(&numbers.runs),
        "trend": quadratic(&numbers.trend), "noise": quadratic(&numbers.noise),
    })
}

fn residual(numbers: &FourNumbers, answer: Option<&Explanation>) -> Value {
    let named = [
        ("mean", numbers.mean),
        ("runs", numbers.runs),
        ("trend", numbers.trend),
        ("noise", numbers.noise),
    ];
    let places: Vec<&str> = named
        .iter()
        .filter(|(_, q)| q.p < 0.002)
        .map(|(name, _)| *name)
        .collect();
    json!({
        "stage": answer.map(|a| a.effects[0].setting.spec.stage.name()),
        "significant": numbers.omnibus_p() < 0.002,
        "p": numbers.omnibus_p(),
        "where": places,
        "numbers": four(numbers),
    })
}

fn effects(answer: &Explanation, rivals: &[Explanation]) -> Vec<Value> {
    let count = answer.effects.len() as f64;
    let effect = |(place, effect): (usize, &Candidate)| {
        let name = effect.setting.spec.name;
        let others = rivals
            .iter()
            .filter_map(|rival| rival.names().get(place).copied())
            .filter(|n| *n != name);
        let mut alternatives: Vec<&str> = others.collect();
        alternatives.sort_unstable();
        alternatives.dedup();
        json!({
            "name": name,
            "stage": effect.setting.spec.stage.name(),
            "parameters": parameters(effect),
            "by": by(effect),
            "share": answer.share / count,
            "alternatives": alternatives,
        })
    };
    answer.effects.iter().enumerate().map(effect).collect()
}

fn by(effect: &Candidate) -> Value {
    match effect.setting.pattern {
        Pattern::Constant(_) => Value::Null,
        Pattern::ByRun(_) => "run".into(),
        Pattern::ByTime { .. } => "time".into(),
    }
}

/// The parameters with their intervals.
fn parameters(effect: &Candidate) -> Vec<Value> {
    let params = effect.setting.spec.params;
    let errors = &effect.standard_errors;
    let entry = |param: &sim::Param, name: String, values: Value, low: Value, high: Value| {
        let mut entry =
            json!({ "name": name, "value": values, "unit": param.unit, "low": low, "high": high });
        if let (Some(choice), None) = (
            entry["value"]
                .as_f64()
                .and_then(|v| param.choices.get(v as usize)),
            param.neutral,
        ) {
            entry["value"] = json!(choice);
        }
        entry
    };
    let bounds = |value: f64, error: f64| (value - HALF_WIDTH_95 * error, value + HALF_WIDTH_95 * error);
    match &effect.setting.pattern {
        Pattern::Constant(values) => (params.iter().enumerate())
            .map(|(i, p)| {
                let (low, high) = bounds(values[i], errors[i]);
                entry(p, p.name.into(), json!(values[i]), json!(low), json!(high))
            })
            .collect(),
        Pattern::ByTime { start, per_s } => {
            let mut all = Vec::new();
            for (i, p) in params.iter().enumerate() {
                let (low, high) = bounds(start[i], errors[i]);
                all.push(entry(p, p.name.into(), json!(start[i]), json!(low), json!(high)));
                if per_s[i] != 0.0 {
                    let (low, high) = bounds(per_s[i], errors[params.len() + i]);
                    all.push(entry(
                        p,
                        format!("{}_per_s", p.name),
                        json!(per_s[i]),
                        json!(low),
                        json!(high),
                    ));
                }
            }
            all
        }
        Pattern::ByRun(runs) => (params.iter().enumerate())
            .map(|(i, p)| {
                let values: Vec<f64> = runs.iter().map(|v| v[i]).collect();
                let bound = |r: usize| bounds(runs[r][i], errors[r * params.len() + i]);
                let low: Vec<f64> = (0..runs.len()).map(|r| bound(r).0).collect();
                let high: Vec<f64> = (0..runs.len()).map(|r| bound(r).1).collect();
                entry(p, p.name.into(), json!(values), json!(low), json!(high))
            })
            .collect(),
    }
}

fn candidate(explanation: &Explanation) -> Value {
    json!({
        "names": explanation.names(), "label": explanation.label,
        "score": explanation.score, "gain": explanation.gain, "share": explanation.share,
        "parameters": explanation.effects.iter().map(parameters).collect::<Vec<_>>(),
        "remainder": four(&explanation.remainder), "remainder_p": explanation.remainder.omnibus_p(),
    })
}

fn distinct<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut list = Vec::new();
    for item in items {
        if !list.contains(&item) {
            list.push(item);
        }
    }
    list
}
