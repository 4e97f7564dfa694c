//! The robot's logs, of a recording in which every run has one.

use diagnose::{Implausible, LogDiagnosis, LogRow, Why, take_out_implausible};
use sim::{Model, Vec2, WheelSpeeds};

use super::recording::Recording;
use crate::dataset::{LOG_COLUMNS, RunFile};
use crate::sightings::short;

/// The logs that are used.
#[derive(Debug)]
pub(super) struct Logs {
    /// The number of their recording.
    pub(super) recording: usize,
    /// The rows of every run.
    pub(super) runs: Vec<Vec<LogRow>>,
    /// Values that are not used, in words.
    pub(super) implausible: Vec<String>,
}

impl Logs {
    /// The logs of the first recording in which every run has one.
    pub(super) fn of(recordings: &[Recording]) -> Option<Self> {
        (recordings.iter().enumerate()).find_map(|(place, recording)| {
            let files = &recording.measured.set.runs;
            let model = &recording.setup.model;
            let runs: Vec<_> = files.iter().map(|run| read(run, model)).collect::<Option<_>>()?;
            let (runs, implausible): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
            Some(Self {
                recording: place,
                runs,
                implausible: implausible.concat(),
            })
        })
    }
}

/// The rows of a run's log, and in words what of them is not used.
fn read(run: &RunFile, model: &Model) -> Option<(Vec<LogRow>, Vec<String>)> {
    let log = run.rows.log.as_ref()?;
    let row = |(i, time_s): (usize, f64)| LogRow {
        time_s,
        observed: run.rows.position_m[i].map(|[x, y]| Vec2::new(x, y)),
        readings: log.readings[i],
        command: WheelSpeeds {
            left_m_s: log.left_m_s[i],
            right_m_s: log.right_m_s[i],
        },
    };
    let mut rows: Vec<LogRow> = run.rows.since_start_s().enumerate().map(row).collect();
    let say = |found: Implausible| {
        let why = match found.why {
            Why::OutOfRange => "which this robot cannot write",
            Why::Spike => "far from what it is in the rows before and after",
        };
        let (place, column, value) = (
            run.place(found.row),
            LOG_COLUMNS[found.column],
            short(found.value),
        );
        format!("{place}: {column} is {value}, {why}; taken as missing")
    };
    let implausible = take_out_implausible(&mut rows, model);
    Some((rows, implausible.into_iter().map(say).collect()))
}

/// The rows that a diagnosis of a recording's logs did not use, in words.
pub(super) fn spoilt_in_words(recording: &Recording, found: &LogDiagnosis) -> Vec<String> {
    let of_run = |(run, rows): (&RunFile, &Vec<usize>)| -> Vec<String> {
        let say = |&row: &usize| {
            format!(
                "{}: the command does not follow from the readings as those of the other rows do; taken as missing",
                run.place(row)
            )
        };
        rows.iter().map(say).collect()
    };
    let runs = recording.measured.set.runs.iter().zip(&found.spoilt);
    runs.flat_map(of_run).collect()
}
