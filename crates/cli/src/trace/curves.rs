//! The curves of a trace as CSV.

use diagnose::mean_lap;

use super::Trace;
use super::errors::Errors;
use crate::laps::SampledRun;
use crate::table::Table;

/// The mean laps gate by gate as CSV, recording by recording.
pub(crate) fn gates_csv(trace: &Trace) -> String {
    let mut table = Table::new("", &["data_set", "gate", "measured_m", "before_m", "after_m"]);
    for errors in &trace.errors {
        let laps: Vec<Vec<f64>> = errors.held_out.iter().flat_map(SampledRun::offsets_m).collect();
        let name = data_set(errors);
        for (gate, measured) in mean_lap(&laps).unwrap_or_default().iter().enumerate() {
            let (before, after) = (errors.before.mean_m()[gate], errors.after.mean_m()[gate]);
            let curves = [measured, &before, &after].map(|offset_m| format!("{offset_m:.6}"));
            table.push([name.to_owned(), gate.to_string()].into_iter().chain(curves));
        }
    }
    table.to_csv()
}

/// How runs start as CSV, recording by recording where that is known.
pub(crate) fn starts_csv(trace: &Trace) -> String {
    let mut table = Table::new("", &["data_set", "t_s", "measured_mm", "before_mm", "after_mm"]);
    for errors in &trace.errors {
        let name = data_set(errors);
        let Some(starts) = &errors.starts else {
            continue;
        };
        let simulated = starts.before.ahead_mm().zip(starts.after.ahead_mm());
        for ((time_s, measured), ((_, before), (_, after))) in starts.measured.ahead_mm().zip(simulated) {
            let curves = [time_s, measured, before, after].map(|number| format!("{number:.3}"));
            table.push(std::iter::once(name.to_owned()).chain(curves));
        }
    }
    table.to_csv()
}

/// The name of the data set whose runs these errors are of.
fn data_set(errors: &Errors) -> &str {
    errors.held_out.first().map_or("", |run| &run.set)
}
