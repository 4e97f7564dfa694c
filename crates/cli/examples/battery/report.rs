//! The figures of a battery, as text and as a table of sets.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;

use crate::figures::{figures, median};
use crate::labels::{Kind, Level};
use crate::program::builds;
use crate::score::Outcome;

/// Data sets of one origin with their answers.
#[derive(Debug)]
pub(crate) struct Battery {
    pub(crate) name: &'static str,
    pub(crate) outcomes: Vec<Outcome>,
}

/// Everything there is to say.
pub(crate) fn markdown(batteries: &[Battery], build: &str) -> String {
    let mut text = String::from("# Battery\n\n");
    table(&mut text, batteries);
    for battery in batteries {
        let Battery { name, outcomes } = battery;
        line(&mut text, &format!("\n## {name}: {} sets\n", outcomes.len()));
        times(&mut text, outcomes);
        for (other, count) in builds(outcomes.iter().map(|outcome| &outcome.timing)) {
            if other != build {
                let remark =
                    format!("{count} answers are of another build ({other}) than the present one ({build}).");
                line(&mut text, &remark);
            }
        }
        confusion(&mut text, outcomes);
        listed(&mut text, "Failures", outcomes, |outcome| !outcome.right());
        listed(
            &mut text,
            "Below detection: the omnibus misses them too, and they are left out of the shares",
            outcomes,
            Outcome::below_detection,
        );
        listed(
            &mut text,
            "Named right, at another sensor or wall",
            outcomes,
            Outcome::other_place,
        );
        listed(
            &mut text,
            "One effect, answered with several",
            outcomes,
            |outcome| outcome.label.kind == Kind::Single && outcome.names().len() > 1,
        );
    }
    text
}

fn line(text: &mut String, words: &str) {
    writeln!(text, "{words}").expect("a string takes any text");
}

/// The figures of all batteries side by side.
fn table(text: &mut String, batteries: &[Battery]) {
    let columns: Vec<_> = (batteries.iter())
        .map(|battery| figures(&battery.outcomes))
        .collect();
    let names: String = batteries
        .iter()
        .map(|battery| format!(" {} |", battery.name))
        .collect();
    line(text, &format!("| figure | asked |{names}"));
    line(text, &format!("|---|---|{}", "---|".repeat(batteries.len())));
    let rows = columns.first().map_or(0, Vec::len);
    for row in 0..rows {
        let values: String = columns
            .iter()
            .map(|column| format!(" {} |", column[row].value))
            .collect();
        let figure = &columns[0][row];
        line(text, &format!("| {} | {} |{values}", figure.name, figure.asked));
    }
}

fn times(text: &mut String, outcomes: &[Outcome]) {
    for level in [Level::L1, Level::L2] {
        let seconds: Vec<f64> = (outcomes.iter())
            .filter(|outcome| outcome.label.level == level)
            .map(|outcome| outcome.timing.seconds)
            .collect();
        if let Some(middle) = median(&seconds) {
            let most = seconds.iter().fold(0.0_f64, |most, &s| most.max(s));
            let level = level.name();
            line(
                text,
                &format!("{level}: median {middle:.1} s a set, at most {most:.0} s.\n"),
            );
        }
    }
}

/// What singles are called that are not called by their name.
fn confusion(text: &mut String, outcomes: &[Outcome]) {
    let mut rows: BTreeMap<(String, &str), BTreeMap<&str, usize>> = BTreeMap::new();
    let singles = outcomes
        .iter()
        .filter(|outcome| outcome.label.kind == Kind::Single && !outcome.below_detection());
    for outcome in singles {
        let said = outcome.first().unwrap_or(&outcome.trace.verdict);
        let truth = (outcome.label.effects.join("+"), outcome.label.controller.name());
        *rows.entry(truth).or_default().entry(said).or_default() += 1;
    }
    rows.retain(|(truth, _), said| said.keys().any(|name| name != truth));
    if rows.is_empty() {
        return;
    }
    line(
        text,
        "\n### Confusion: truth and first name\n\n| truth | controller | named first |\n|---|---|---|",
    );
    for ((truth, controller), said) in rows {
        let said: Vec<String> = said
            .iter()
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        line(text, &format!("| {truth} | {controller} | {} |", said.join(", ")));
    }
}

fn listed(text: &mut String, title: &str, outcomes: &[Outcome], which: impl Fn(&Outcome) -> bool) {
    let found: Vec<&Outcome> = outcomes.iter().filter(|outcome| which(outcome)).collect();
    if found.is_empty() {
        return;
    }
    line(text, &format!("\n### {title} ({})\n", found.len()));
    for outcome in found {
        let p = outcome
            .trace
            .residual
            .p
            .map_or_else(String::new, |p| format!(", p {p:.1e}"));
        line(text, &format!("- {}{p}", outcome.line()));
    }
}

/// One row per set.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write_csv(path: &Path, batteries: &[Battery]) -> Result<()> {
    const COLUMNS: [&str; 27] = [
        "battery",
        "set",
        "level",
        "kind",
        "controller",
        "truth",
        "parameters",
        "verdict",
        "named",
        "by",
        "reported",
        "share",
        "p",
        "right",
        "below_detection",
        "exact",
        "in_class",
        "in_reported",
        "stage_right",
        "before_m",
        "after_m",
        "floor_m",
        "truth_m",
        "seconds",
        "mean_lap_rms",
        "two_modes",
        "errors",
    ];
    let mut writer = csv::Writer::from_path(path)?;
    writer.write_record(COLUMNS)?;
    for battery in batteries {
        for outcome in &battery.outcomes {
            writer.write_record(row(battery.name, outcome))?;
        }
    }
    Ok(writer.flush()?)
}

fn row(battery: &str, outcome: &Outcome) -> [String; 27] {
    let Outcome {
        label,
        trace,
        timing,
        truth_m,
    } = outcome;
    let first = trace.effects.first();
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6}"));
    let first_of = |names: fn(&crate::score::Baselines) -> &Vec<String>| {
        let baselines = trace.baselines.as_ref();
        baselines.map_or_else(String::new, |baselines| names(baselines).join("|"))
    };
    let errors: Vec<String> = outcome
        .parameter_errors()
        .iter()
        .map(|error| {
            format!(
                "{} {:.4}{}",
                error.name,
                error.error,
                if error.covered { "" } else { " outside" }
            )
        })
        .collect();
    [
        battery.to_owned(),
        label.name.clone(),
        label.level.name().to_owned(),
        label.kind.name().to_owned(),
        label.controller.name().to_owned(),
        label.title(),
        label.sizes(),
        trace.verdict.clone(),
        outcome.names().join("+"),
        first.and_then(|first| first.by.clone()).unwrap_or_default(),
        outcome.reported().into_iter().collect::<Vec<_>>().join("|"),
        number(first.and_then(|first| first.share)),
        (trace.residual.p).map_or_else(String::new, |p| format!("{p:.3e}")),
        outcome.right().to_string(),
        outcome.below_detection().to_string(),
        outcome.exact().to_string(),
        outcome.in_class().to_string(),
        outcome.in_reported().to_string(),
        outcome.stage_right().to_string(),
        number(trace.error.before),
        number(trace.error.after),
        number(trace.error.floor),
        number(*truth_m),
        format!("{:.2}", timing.seconds),
        first_of(|baselines| &baselines.mean_lap_rms),
        first_of(|baselines| &baselines.two_modes),
        errors.join("|"),
    ]
}
