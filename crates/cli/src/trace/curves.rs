//! The curves of a trace as CSV.

use diagnose::mean_lap;

use super::Trace;
use crate::laps::SampledRun;

/// The mean laps gate by gate as CSV, recording by recording.
pub(crate) fn gates_csv(trace: &Trace) -> String {
    let mut csv = String::from("data_set,gate,measured_m,before_m,after_m\n");
    for errors in &trace.errors {
        let laps: Vec<Vec<f64>> = errors.held_out.iter().flat_map(SampledRun::offsets_m).collect();
        let name = errors.held_out.first().map_or("", |run| &run.set);
        for (gate, measured) in mean_lap(&laps).unwrap_or_default().iter().enumerate() {
            let (before, after) = (errors.before.mean_m()[gate], errors.after.mean_m()[gate]);
            csv += &format!("{name},{gate},{measured:.6},{before:.6},{after:.6}\n");
        }
    }
    csv
}

/// How runs start as CSV, recording by recording where that is known.
pub(crate) fn starts_csv(trace: &Trace) -> String {
    let mut csv = String::from("data_set,t_s,measured_mm,before_mm,after_mm\n");
    for errors in &trace.errors {
        let name = errors.held_out.first().map_or("", |run| &run.set);
        let Some(starts) = &errors.starts else {
            continue;
        };
        let simulated = starts.before.ahead_mm().zip(starts.after.ahead_mm());
        for ((time_s, measured), ((_, before), (_, after))) in starts.measured.ahead_mm().zip(simulated) {
            csv += &format!("{name},{time_s:.3},{measured:.3},{before:.3},{after:.3}\n");
        }
    }
    csv
}
