//! `trace.json`.

use diagnose::{Candidate, Cause, Channel, Decided, Departures, Detectable, Explanation, Quadratic, Verdict};
use serde_json::{Value, json};
use sim::Pattern;

use super::Trace;
use super::answer::{FromLogs, rivals};
use super::errors::{Eq8, Errors, LapTimes, Starts};
use super::limits::CHANNELS;
use super::next::Experiment;

/// The document of a trace.
pub(crate) fn document(trace: &Trace) -> Value {
    let answer = &trace.answer;
    let claimed = answer.claimed();
    let rivals = rivals(answer);
    let sets = rivals.iter().chain(answer.further());
    let sets: Vec<Vec<&str>> = distinct(sets.map(Explanation::names));
    let mut document = json!({
        "verdict": answer.verdict.name(),
        "residual": residual(trace),
        "effects": claimed.map_or_else(Vec::new, |a| effects(a, rivals, trace.laps_alone())),
        "alternative_sets": if sets.len() > 1 { sets } else { Vec::new() },
        "error": {
            "metric": "rms over the gates of the difference between the mean lateral position of simulated laps and of a held-out run, m",
            "before": trace.mean_m(|e| &e.before_m), "after": trace.mean_m(|e| &e.after_m),
            "floor": trace.mean_m(|e| &e.floor_m),
            "held_out": if trace.judged_by_the_fitted { Vec::new() } else { trace.held_out().map(|run| run.name.clone()).collect() },
            "laps": trace.errors.iter().map(laps).collect::<Vec<_>>(),
            "start_of_runs": trace.errors.iter().map(|errors| errors.starts.as_ref().map(starts)).collect::<Vec<_>>(),
        },
        "candidates": answer.explanations.iter().map(|e| candidate(e, trace.laps_alone())).collect::<Vec<_>>(),
        "separate_with": trace.experiments.iter().map(experiment).collect::<Vec<_>>(),
        "detectable": trace.detectable.iter().map(detectable).collect::<Vec<_>>(),
        "remarks": trace.remarks,
        "laps_simulated": trace.laps_simulated,
    });
    if let Some(baselines) = &trace.baselines {
        document["baselines"] = json!({
            "mean_lap_rms": baselines.mean_lap_rms, "two_modes": baselines.two_modes,
        });
    }
    if let Some(found) = &trace.from_logs {
        document["logs"] = logs(found);
    }
    document
}

/// An experiment with what it would tell.
fn experiment(experiment: &Experiment) -> Value {
    let declared: serde_json::Map<String, Value> = (experiment.declared.iter())
        .map(|(key, value)| ((*key).to_owned(), json!(value)))
        .collect();
    let against: Vec<Value> = (experiment.separations.iter())
        .map(|(name, sigma)| json!({ "name": name, "sigma": sigma }))
        .collect();
    json!({
        "experiment": experiment.name, "declared": declared, "against": against,
        "sigma": experiment.least(), "laps": experiment.laps, "laps_for_5_sigma": experiment.laps_needed(),
    })
}

/// The smallest sizes of an effect that these data show.
fn detectable(detectable: &Detectable) -> Value {
    json!({
        "name": detectable.spec.name, "label": detectable.label, "parameter": detectable.parameter,
        "unit": detectable.unit, "below": detectable.below, "above": detectable.above,
    })
}

/// What the logs say by themselves, and whether the laps agree.
fn logs(found: &FromLogs) -> Value {
    let logs = &found.logs;
    let (decide, effects, share) = match &logs.decide {
        Decided::AsDeclared => ("as declared", Vec::new(), None),
        Decided::Changed(effects) => ("changed", effects.iter().map(one_effect).collect(), None),
        Decided::NoController { share, .. } => ("no controller of this kind", Vec::new(), Some(*share)),
        Decided::Unknown => ("unknown", Vec::new(), None),
    };
    json!({
        "decide": { "verdict": decide, "effects": effects, "commands_unexplained": share },
        "p": logs.p, "control_steps": logs.steps,
        "innovations": CHANNELS.iter().zip(&logs.channels).map(channel).collect::<Vec<_>>(),
        "walls_cut_at": { "points_per_span": logs.corners.per_span, "before": logs.corners.before },
        "confirmed_by_laps": found.confirmed,
        "laps_after": found.after.as_ref().map(departures),
    })
}

/// How white the filter's innovations of one measured number are: 1, 3 and 0 under the model.
fn channel((measured, channel): (&&str, &Channel)) -> Value {
    json!({
        "measured": measured, "count": channel.count, "mean_square": channel.mean_square, "kurtosis": channel.kurtosis,
        "correlation": channel.correlation,
    })
}

fn quadratic(q: &Quadratic) -> Value {
    json!({ "q": q.q, "df": q.freedom, "excess": q.excess(), "p": q.p })
}

/// Lap times, and eq. 8 in some modes, before and after.
fn laps(errors: &Errors) -> Value {
    let LapTimes {
        measured_s,
        before_s,
        after_s,
        chance_s,
    } = errors.lap_times;
    let eq_8 =
        |of: Eq8| json!({ "modes": of.modes, "before": of.before, "after": of.after, "chance": of.chance });
    json!({
        "lap_time_s": { "measured": measured_s, "before": before_s, "after": after_s, "chance": chance_s },
        "eq_8": errors.eq_8.map(eq_8),
        "with_own_sizes_m": errors.own_m,
    })
}

fn starts(starts: &Starts) -> Value {
    const M_PER_MM: f64 = 1e-3;
    let [before, after, chance] = starts.errors_mm().map(|mm| M_PER_MM * mm);
    json!({ "before": before, "after": after, "chance": chance })
}

fn departures(numbers: &Departures) -> Value {
    (numbers.named().into_iter())
        .map(|(name, number)| (name.to_owned(), quadratic(&number)))
        .collect::<serde_json::Map<_, _>>()
        .into()
}

fn residual(trace: &Trace) -> Value {
    let numbers = &trace.residual;
    let stage = match (&trace.answer.cause, trace.answer.claimed()) {
        (Some(cause), _) => Some(cause.stage),
        (None, Some(claimed)) => claimed.effects.first().map(Candidate::stage),
        (None, None) => None,
    };
    json!({
        "stage": stage.map(sim::Stage::name),
        "significant": trace.answer.verdict != Verdict::Faithful,
        "p": trace.p,
        "where": numbers.departing(),
        "acts_on": trace.answer.cause.as_ref().map(|cause| &cause.acts_on),
        "depends_on": trace.answer.cause.as_ref().map(|cause| &cause.depends_on),
        "numbers": departures(numbers),
    })
}

fn effects(answer: &Explanation, rivals: &[Explanation], laps: Option<&Departures>) -> Vec<Value> {
    let (names, parts) = (answer.names(), answer.parts());
    let rivals: Vec<Vec<&str>> = rivals
        .iter()
        .map(|rival| in_place(&names, rival.names()))
        .collect();
    let effect = |(place, effect): (usize, &Candidate)| {
        let others = rivals.iter().filter_map(|rival| rival.get(place).copied());
        let mut alternatives: Vec<&str> = others.filter(|other| *other != names[place]).collect();
        alternatives.sort_unstable();
        alternatives.dedup();
        let mut entry = one_effect(effect);
        // Where no share of the excess can be stated, it is the share of what is explained.
        entry["share"] = json!(answer.explained(laps).unwrap_or(1.0) * parts[place]);
        entry["alternatives"] = json!(alternatives);
        entry
    };
    answer.effects.iter().enumerate().map(effect).collect()
}

/// A rival's names in such an order that those of the answer stand in their places, and the others in the places that remain.
fn in_place<'n>(answer: &[&str], rival: Vec<&'n str>) -> Vec<&'n str> {
    let (shared, others): (Vec<&str>, Vec<&str>) = rival.into_iter().partition(|name| answer.contains(name));
    let mut others = others.into_iter();
    answer
        .iter()
        .filter_map(|name| {
            let same = shared.iter().find(|shared| *shared == name).copied();
            same.or_else(|| others.next())
        })
        .collect()
}

/// An effect by itself; one without a name says what it acts on and depends on.
fn one_effect(effect: &Candidate) -> Value {
    let mut entry = json!({
        "name": effect.setting.spec.name,
        "stage": effect.stage().name(),
        "parameters": parameters(effect),
        "by": by(effect),
    });
    if let (Some(cause), Pattern::Constant(values)) = (Cause::of(&effect.setting), &effect.setting.pattern) {
        entry["acts_on"] = json!(cause.acts_on);
        entry["depends_on"] = json!(cause.depends_on);
        entry["basis"] = json!(effect.setting.spec.params[2].choices[values[2] as usize]);
        entry["coefficients"] = json!(values[3..]);
        entry["standard_errors"] = json!(effect.standard_errors.get(3..));
    }
    entry
}

fn by(effect: &Candidate) -> Value {
    match effect.setting.pattern {
        Pattern::Constant(_) => Value::Null,
        Pattern::ByRun(_) => "run".into(),
        Pattern::ByTime { .. } => "time".into(),
    }
}

/// The parameters with their intervals.
pub(crate) fn parameters(effect: &Candidate) -> Vec<Value> {
    let params = effect.setting.spec.params;
    let entry = |param: &sim::Param, name: String, value: Value, low: Value, high: Value| {
        let one_named = |value: &Value| {
            let choice = value.as_f64().and_then(|v| param.choices.get(v as usize));
            choice
                .filter(|_| param.neutral.is_none())
                .map_or_else(|| value.clone(), |choice| json!(choice))
        };
        let named = |value: &Value| match value {
            Value::Array(runs) => runs.iter().map(one_named).collect(),
            _ => one_named(value),
        };
        json!({
            "name": name, "value": named(&value), "unit": param.unit, "low": named(&low), "high": named(&high),
        })
    };
    let one = |param: &sim::Param, name: String, value: f64, place: usize| {
        let [low, high] = effect.interval(place);
        entry(param, name, json!(value), json!(low), json!(high))
    };
    let each = params.iter().enumerate();
    match &effect.setting.pattern {
        Pattern::Constant(values) => each.map(|(i, p)| one(p, p.name.into(), values[i], i)).collect(),
        Pattern::ByTime { start, per_s } => each
            .flat_map(|(i, p)| {
                let change = || one(p, format!("{}_per_s", p.name), per_s[i], params.len() + i);
                let changes = (per_s[i] != 0.0).then(change);
                std::iter::once(one(p, p.name.into(), start[i], i)).chain(changes)
            })
            .collect(),
        Pattern::ByRun(runs) => each
            .map(|(i, p)| {
                let values: Vec<f64> = runs.iter().map(|values| values[i]).collect();
                let ends = (0..runs.len()).map(|run| effect.interval(run * params.len() + i));
                let (low, high): (Vec<f64>, Vec<f64>) = ends.map(|[low, high]| (low, high)).unzip();
                entry(p, p.name.into(), json!(values), json!(low), json!(high))
            })
            .collect(),
    }
}

fn candidate(explanation: &Explanation, laps: Option<&Departures>) -> Value {
    json!({
        "names": explanation.names(), "label": explanation.label(),
        "score": explanation.score, "gain": explanation.gain, "gain_error": explanation.gain_error, "share": explanation.explained(laps),
        "parameters": explanation.effects.iter().map(parameters).collect::<Vec<_>>(),
        "remainder": explanation.remainder.as_ref().map(departures), "remainder_p": explanation.remainder_p,
    })
}

/// Each item once, in the order in which they first come.
pub(super) fn distinct<T: PartialEq>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut list = Vec::new();
    for item in items {
        if !list.contains(&item) {
            list.push(item);
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternatives_stand_for_the_effect_that_they_replace() {
        assert_eq!(
            in_place(&["light", "slip"], vec!["memory", "light"]),
            ["light", "memory"]
        );
        assert_eq!(
            in_place(&["light", "slip"], vec!["light", "memory"]),
            ["light", "memory"]
        );
        assert_eq!(in_place(&["gain"], vec!["scale"]), ["scale"]);
        assert_eq!(
            in_place(&["gain", "slip"], vec!["lag", "memory"]),
            ["lag", "memory"]
        );
    }
}
