//! The answer of a trace in sentences.

use diagnose::{Candidate, Cause, Decided, Explanation, Verdict};
use sim::Pattern;

use crate::figures::MM;
use crate::table::{four_digits, probability, with_error, with_interval};
use crate::trace::Trace;
use crate::trace::answer::rivals;
use crate::trace::document::distinct;
use crate::trace::limits::{decide_in_words, next_in_words};
use crate::trace::remarks::sizes_by_run_in_words;
use crate::trace::unnamed::in_words;

/// The answer in sentences.
pub(crate) fn summary(trace: &Trace) -> String {
    let diagnosis = &trace.answer;
    let answer = diagnosis.explanations.first();
    let said = match (diagnosis.verdict, answer) {
        (Verdict::Faithful, _) => {
            format!(
                "Faithful: the {} do not depart from the declared model by more than chance allows.",
                trace.source()
            )
        }
        (Verdict::Unexplained, _) | (_, None) => unexplained(trace),
        (v, Some(answer)) => {
            let what = described(trace, &answer.effects);
            let rest = if v == Verdict::Explained && answer.remainder_p.is_some() && !answer.fits() {
                " What remains is significant but small."
            } else if v == Verdict::PartlyExplained {
                " What remains is significant and matters."
            } else {
                " Nothing significant remains."
            };
            let mut word = v.name().to_owned();
            word[..1].make_ascii_uppercase();
            let explains = match answer.explained(trace.laps_alone()) {
                Some(share) => format!("this explains {:.1} % of the excess", 100.0 * share),
                None => format!(
                    "this gains {:.1} units of log-likelihood, of an excess that as a whole chance often makes",
                    answer.gain
                ),
            };
            format!("{word}: {}; {explains}.{rest}", what.join(" and "))
        }
    };
    // Two sizes of one effect are no two answers.
    let answers = distinct(rivals(diagnosis).iter().map(Explanation::label));
    let others = answers.get(1..).unwrap_or_default();
    let alternatives = if others.is_empty() {
        String::new()
    } else {
        format!(
            " These {} do not tell it apart from: {}.",
            trace.source(),
            others.join("; ")
        )
    };
    let further = further_in_words(trace);
    let next = next_in_words(trace).map_or(String::new(), |next| format!("\n{next}"));
    format!("{said}{alternatives}{further}{next}\n{}", error_in_words(trace))
}

/// How far the simulation is from the robot.
fn error_in_words(trace: &Trace) -> String {
    let before_mm = MM * trace.mean_m(|e| &e.before_m);
    let after = match trace.answer.claimed() {
        Some(_) => format!(" before, {:.2} mm after", MM * trace.mean_m(|e| &e.after_m)),
        None => String::new(),
    };
    let by_run = sizes_by_run_in_words(&trace.answer).map_or(String::new(), |words| format!(" {words}"));
    format!(
        "Error of the mean lap on {}: {before_mm:.2} mm{after}; {:.2} mm would be chance.{by_run}",
        trace.judged_runs(),
        MM * trace.mean_m(|e| &e.floor_m)
    )
}

/// What may be there beside what is claimed.
fn further_in_words(trace: &Trace) -> String {
    let Some(claimed) = trace.answer.claimed() else {
        return String::new();
    };
    let further = trace.answer.further().into_iter().map(|further| {
        let more = further.gain - claimed.gain;
        format!(
            "{} (gains {more:.1} units of log-likelihood more)",
            further.label()
        )
    });
    let further: Vec<String> = further.collect();
    if further.is_empty() {
        return String::new();
    }
    format!(
        " Another effect may be there, for which these {} speak, but not enough to claim it: {}.",
        trace.source(),
        further.join("; ")
    )
}

/// Why nothing is claimed.
fn unexplained(trace: &Trace) -> String {
    if let Some(found) = trace.from_logs.as_ref().filter(|found| !found.confirmed) {
        let said: Vec<String> = (found.logs.answer.explanations.first().iter())
            .map(|answer| answer.label())
            .collect();
        return format!(
            "Unexplained: the log says {}, and the laps do not agree. Neither is claimed.",
            if said.is_empty() {
                "that nothing is missing".to_owned()
            } else {
                said.join(", ")
            }
        );
    }
    if let Some(found) = &trace.from_logs
        && matches!(found.logs.decide, Decided::NoController { .. })
    {
        return format!(
            "Unexplained: {}",
            decide_in_words(&found.logs.decide, &trace.recordings)
        );
    }
    let stage = trace.answer.cause.as_ref().map(|cause| {
        format!(
            " It sits in the {} stage: {}.",
            cause.stage.name(),
            cause_in_words(cause)
        )
    });
    format!(
        "Unexplained: the data depart from the declared model, and no name would be honest.{}{}",
        stage.unwrap_or_default(),
        best_listed(trace).unwrap_or_default()
    )
}

/// How much the best explanation by listed effects explains, and why it is not claimed; `None` where none was fitted.
fn best_listed(trace: &Trace) -> Option<String> {
    let answer = &trace.answer;
    let is_listed = |e: &&Explanation| {
        e.effects
            .iter()
            .all(|effect| Cause::of(&effect.setting).is_none())
    };
    let best = answer.explanations.iter().find(is_listed)?;
    let stalls = (answer.explanations[..answer.indistinguishable].iter())
        .find(|e| is_listed(e) && e.effects.len() == 2 && e.names().contains(&"wheel-scale"))
        .filter(|e| e.names().contains(&"slip-level"));
    let why = match (&answer.cause, best.remainder_p.filter(|_| !best.fits())) {
        (Some(cause), _) if cause.depends_on == "chance" && stalls.is_some() => {
            "but a slower wheel and more slip are what a wheel does that stands still now and then: one cause without a name rather \
             than two with theirs"
                .to_owned()
        }
        (Some(_), _) => "but what it leaves shows a cause without a name".to_owned(),
        _ if best.noises() > 1 => {
            "but with several effects on noise, which are more likely one cause without a name".to_owned()
        }
        (None, Some(p)) => format!(
            "but leaves a remainder that is significant and too large for it to be claimed (p {})",
            probability(p)
        ),
        (None, None) if best.fits() => "but of so weak a signal chance explains as much".to_owned(),
        (None, None) => "too little to be claimed".to_owned(),
    };
    let explains = match best.explained(trace.laps_alone()) {
        Some(share) => format!("explains {:.1} % of the excess", 100.0 * share),
        None => format!("gains {:.1} units of log-likelihood", best.gain),
    };
    let fitted = answer.explanations.iter().filter(is_listed).count();
    Some(format!(
        " The best of {fitted} explanations by listed effects that were fitted, {}, {explains}, {why}.",
        best.label()
    ))
}

/// What a cause without a name acts on and depends on, for a sentence.
pub(crate) fn cause_in_words(cause: &Cause) -> String {
    match cause.depends_on.as_str() {
        "chance" => format!("noise of the {}", cause.acts_on),
        on => format!("{} by {on}", cause.acts_on),
    }
}

/// Effects with their sizes, one by one, for a sentence.
pub(crate) fn described(trace: &Trace, effects: &[Candidate]) -> Vec<String> {
    effects.iter().map(|effect| describe(trace, effect)).collect()
}

/// An effect with its size, for a sentence.
fn describe(trace: &Trace, effect: &Candidate) -> String {
    let name = effect.setting.spec.name;
    match (&effect.setting.pattern, Cause::of(&effect.setting)) {
        (_, Some(cause)) => in_words(trace, effect, &cause),
        (Pattern::Constant(_), _) => format!("{name} ({})", size(effect)),
        (Pattern::ByTime { .. }, _) => format!("{name} changing in time ({})", size(effect)),
        (Pattern::ByRun(_), _) => format!("{name} by run ({})", size(effect)),
    }
}

/// The size of an effect, with its standard error where it was fitted, or with its interval where that says more.
pub(super) fn size(effect: &Candidate) -> String {
    let params = effect.setting.spec.params;
    let numbers = effect.setting.pattern.numbers();
    let number = |place: usize, param: &sim::Param| {
        let (value, error) = (numbers[place], effect.standard_errors[place]);
        match effect.intervals.get(&place) {
            // An end of the parameter's range is none of the interval's.
            Some(&[low, high]) => with_interval(
                value,
                [
                    (low > param.low).then_some(low),
                    (high < param.high).then_some(high),
                ],
            ),
            None if effect.interval(place) == [param.low, param.high] => with_interval(value, [None; 2]),
            None if error > 0.0 => with_error(value, error),
            None => four_digits(value),
        }
    };
    let list = |first: usize| {
        let one = |(i, p): (usize, &sim::Param)| match p.choices.get(numbers[first + i] as usize) {
            Some(choice) => format!("{} {choice}", p.name),
            None => format!("{} {}", p.name, number(first + i, p)),
        };
        params.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
    };
    match &effect.setting.pattern {
        Pattern::Constant(_) => list(0),
        Pattern::ByTime { per_s, .. } => {
            let changing = (params.iter().enumerate()).filter(|(i, _)| per_s[*i] != 0.0);
            let changes = changing
                .map(|(i, p)| format!("; {} changes by {} per s", p.name, number(params.len() + i, p)));
            format!("{} at the start{}", list(0), changes.collect::<String>())
        }
        Pattern::ByRun(runs) => {
            let each: Vec<String> = (0..runs.len()).map(|run| list(run * params.len())).collect();
            each.join("; ")
        }
    }
}
