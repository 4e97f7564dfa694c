//! The robot's logs, of the recordings in which every run has one.

use std::collections::BTreeMap;

use diagnose::{Implausible, LogDiagnosis, LogRow, can_be_followed, take_out_implausible};
use sim::{Model, Vec2, WheelSpeeds};

use super::recording::{Recording, files};
use crate::dataset::{LOG_COLUMNS, RunFile};
use crate::sightings::short;

/// The logs that are used.
#[derive(Debug)]
pub(super) struct Logs {
    /// The numbers of their recordings.
    pub(super) recordings: Vec<usize>,
    /// The rows of every run of all recordings, none where no log is used.
    pub(super) runs: Vec<Vec<LogRow>>,
    /// Values that are not used, in words.
    pub(super) implausible: Vec<String>,
}

impl Logs {
    /// The logs of the recordings in which every run has one, and one at least can be followed, between walls that are the same to the robot.
    pub(super) fn of(recordings: &[Recording]) -> Option<Self> {
        let mut logs = Self {
            recordings: Vec::new(),
            runs: Vec::new(),
            implausible: Vec::new(),
        };
        for (number, recording) in recordings.iter().enumerate() {
            let first = logs
                .recordings
                .first()
                .map_or(recording, |&first| &recordings[first]);
            let runs = read_all(recording).filter(|_| recording.shares_walls_with(first));
            match runs {
                Some((runs, implausible)) => {
                    logs.recordings.push(number);
                    logs.runs.extend(runs);
                    logs.implausible.extend(implausible);
                }
                None => logs.runs.extend(recording.shape().iter().map(|_| Vec::new())),
            }
        }
        (!logs.recordings.is_empty()).then_some(logs)
    }
}

/// The rows of every run of a recording, and in words what of them is not used; `None` where a run has no log, or none can be
/// followed.
fn read_all(recording: &Recording) -> Option<(Vec<Vec<LogRow>>, Vec<String>)> {
    let model = &recording.setup.model;
    let runs = recording.measured.set.runs.iter().enumerate();
    let read = |(i, run): (usize, &RunFile)| {
        let (mut rows, implausible) = read(run, model)?;
        rows.first_mut()?.starts = recording.beginnings.is_known(i);
        Some((rows, implausible))
    };
    let runs: Vec<_> = runs.map(read).collect::<Option<_>>()?;
    let (runs, implausible): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
    let followed = runs.iter().any(|rows| can_be_followed(rows, model));
    followed.then(|| (runs, implausible.concat()))
}

/// The rows of a run's log, and in words what of them is not used.
fn read(run: &RunFile, model: &Model) -> Option<(Vec<LogRow>, Vec<String>)> {
    let log = run.rows.log.as_ref()?;
    let row = |(i, time_s): (usize, f64)| LogRow {
        time_s,
        starts: false,
        observed: run.rows.position_m[i].map(|[x, y]| Vec2::new(x, y)),
        readings: log.readings[i],
        command: WheelSpeeds {
            left_m_s: log.left_m_s[i],
            right_m_s: log.right_m_s[i],
        },
        doubt_m: 0.0,
    };
    let mut rows: Vec<LogRow> = run.rows.since_start_s().enumerate().map(row).collect();
    let implausible = take_out_implausible(&mut rows, model);
    let why = "which this robot cannot write";
    Some((rows, in_words(run, &implausible, why)))
}

/// Values of a run's log that are not used, and why, in words: those of a column together.
fn in_words(run: &RunFile, found: &[Implausible], why: &str) -> Vec<String> {
    let of_column = |(column, name): (usize, &str)| {
        let own = found.iter().filter(|one| one.column == column);
        let values: BTreeMap<usize, f64> = own.map(|one| (one.row, one.value)).collect();
        let rows: Vec<usize> = values.keys().copied().collect();
        let what = |row: usize| format!("{name} is {}, {why}", short(values[&row]));
        run.tell(&rows, what, "taken as missing")
    };
    LOG_COLUMNS.into_iter().enumerate().flat_map(of_column).collect()
}

/// What a reader must know of the logs that a diagnosis did not use, in words.
pub(super) fn unused_in_words(recordings: &[Recording], logs: &Logs, found: &LogDiagnosis) -> Vec<String> {
    /// Share of the rows of which it is said if no more are used.
    const MOST: f64 = 0.9;
    let mut words = spoilt_in_words(recordings, found);
    let rows: usize = logs.runs.iter().map(Vec::len).sum();
    if (found.steps as f64) < MOST * rows as f64 {
        words.push(format!(
            "Of {rows} rows of logs {} are used: those in stretches of 200 and more in which a row and its command are there for \
             nearly every control step.",
            found.steps
        ));
    }
    words
}

/// What of the logs was spoilt, in words.
fn spoilt_in_words(recordings: &[Recording], found: &LogDiagnosis) -> Vec<String> {
    let runs = || files(recordings);
    let leaping = |(run, readings): (&RunFile, &Vec<Implausible>)| {
        in_words(run, readings, "far from what it is in the rows before and after")
    };
    let contradicting = |(run, rows): (&RunFile, &Vec<usize>)| {
        let what =
            |_| "the command does not follow from the readings as those of the other rows do".to_owned();
        run.tell(rows, what, "taken as missing")
    };
    let readings = runs().zip(&found.spoilt.readings).flat_map(leaping);
    let rows = runs().zip(&found.spoilt.rows).flat_map(contradicting);
    readings.chain(rows).collect()
}
