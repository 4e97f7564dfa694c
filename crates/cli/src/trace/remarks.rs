//! What a reader must know of the data.

use diagnose::{Answer, LogRow};

use super::logs::Logs;
use super::recording::{Recording, runs};
use crate::laps::SampledRun;

/// What the error after means where sizes go by run.
pub(super) fn sizes_by_run_in_words(answer: &Answer) -> Option<String> {
    let claimed = answer.claimed()?;
    let by_run = claimed
        .effects
        .iter()
        .filter(|effect| effect.setting.goes_by_run());
    let names: Vec<&str> = by_run.map(|effect| effect.setting.spec.name).collect();
    (!names.is_empty()).then(|| {
        format!(
            "The size of {} differs from run to run: that of a run which is held out is not known, and the mean of the others stands \
             for it. The error after is that of such a run and may be larger than before; model.after.toml has each run's own size.",
            names.join(" and ")
        )
    })
}

/// What these data do not allow; `logged` are the logs that are used, and the only run may judge what was fitted to it.
pub(super) fn remarks(
    recordings: &[Recording],
    logged: Option<&Logs>,
    judged_by_the_fitted: bool,
) -> Vec<String> {
    let mut remarks = Vec::new();
    if runs(recordings).count() == 1 {
        let (error, held_out) = if judged_by_the_fitted {
            (
                ", and the error after is that of the very run that was fitted",
                ", or give one with --held-out",
            )
        } else {
            ("", "")
        };
        remarks.push(format!(
            "One run only: whether the robot differs from run to run cannot be told{error}; measure a second run{held_out}."
        ));
    }
    for recording in recordings {
        if let Some(unit_m) = recording.written_m {
            remarks.push(format!(
                "{}: positions are written to {} mm: the simulated camera is as much noisier.",
                recording.measured.set.name,
                1000.0 * unit_m
            ));
        }
        remarks.extend(recording.clocks_in_words());
        remarks.extend(recording.missing_rows_in_words());
        remarks.extend(recording.beginnings.in_words());
        let gates = recording.measured.circuit.gates.len();
        for (run, unseen) in recording.measured.runs.iter().zip(&recording.unseen) {
            remarks.extend(run.strays.iter().cloned().chain(run.laps_set_aside()));
            if !unseen.is_nothing() {
                remarks.push(format!(
                    "Run {}: the camera did not see the robot on {:.1} % of its way; simulated laps are seen through the same \
                     holes.",
                    run.name,
                    100.0 * unseen.share(gates)
                ));
            }
        }
    }
    for run in runs(recordings).filter(|run| run.laps.len() < run.wanted) {
        remarks.push(format!(
            "Run {} has {} of {} laps.",
            run.name,
            run.laps.len(),
            run.wanted
        ));
    }
    if let Some(logs) = logged {
        remarks.extend(logs.implausible.iter().cloned());
        let told: Vec<&SampledRun> = (runs(recordings).zip(&logs.runs))
            .filter(|(_, rows)| rows.iter().any(LogRow::tells))
            .map(|(run, _)| run)
            .collect();
        if let ([run], true) = (told.as_slice(), logs.runs.len() > 1) {
            remarks.push(format!(
                "One log only: the error after on run {} is that of the very run that was fitted.",
                run.name
            ));
        }
        for (run, rows) in runs(recordings).zip(&logs.runs) {
            if !rows.is_empty() && !rows.iter().any(LogRow::tells) {
                remarks.push(format!(
                    "The log of run {} has no readings beside commands: a size that goes by run is the mean of the other \
                     runs' there.",
                    run.name
                ));
            }
        }
    }
    let used = logged.map_or(&[][..], |logs| &logs.recordings);
    for (place, recording) in recordings.iter().enumerate() {
        let set = &recording.measured.set;
        let count = set.runs.iter().filter(|run| run.rows.log.is_some()).count();
        if !used.contains(&place) && count > 0 {
            let why = match used {
                [first, ..] if !recording.shares_walls_with(&recordings[*first]) => {
                    "they are declared with other walls, another body or other places of sensors than those that are: trace this data \
                     set alone to use them"
                }
                _ if count < set.runs.len() => {
                    "a log in every run is needed: leave out the runs without one to use them"
                }
                _ => {
                    "a stretch of 200 rows is needed in which a row and its command are there for nearly every control step, and \
                     the camera saw the robot"
                }
            };
            let logs = if count == 1 { "log" } else { "logs" };
            remarks.push(format!("{}: {count} {logs} not used; {why}.", set.name));
        }
        if let ([_, ..], 0) = (used, count) {
            remarks.push(format!(
                "{} has no logs: its laps judge what the other data sets' logs say, unless sizes go by run.",
                set.name
            ));
        }
    }
    remarks
}
