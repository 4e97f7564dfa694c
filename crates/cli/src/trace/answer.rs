//! What laps and the robot's logs say together.

use std::ops::Range;

use anyhow::Result;
use diagnose::{
    Answer, Atlas, Explanation, FourNumbers, LogDiagnosis, LogRow, ObservedLap, Simulate, Verdict, Watch,
    diagnose_logs,
};
use sim::{Vec2, WheelSpeeds};

use crate::dataset::{DataSet, RunFile};
use crate::setup::Setup;

/// Probability below which laps contradict what the logs say, if the answer does not explain most of it.
const CONTRADICTS_P: f64 = 1e-5;
/// Share of the laps' departure that an answer from logs must explain to stand.
const CONFIRMED_SHARE: f64 = 0.8;

/// An answer from logs beside what the laps make of it.
#[derive(Debug)]
pub(crate) struct FromLogs {
    pub(crate) logs: LogDiagnosis,
    /// How the laps depart from the declared model, and from the model with the answer's effects.
    pub(crate) before: FourNumbers,
    pub(crate) after: Option<FourNumbers>,
    /// Whether the laps agree with the answer.
    pub(crate) confirmed: bool,
}

/// The rows of every run, where all runs have a log.
pub(crate) fn log_rows(set: &DataSet) -> Option<Vec<Vec<LogRow>>> {
    set.runs.iter().map(rows_of).collect()
}

fn rows_of(run: &RunFile) -> Option<Vec<LogRow>> {
    let log = run.rows.log.as_ref()?;
    let row = |i: usize| LogRow {
        time_s: run.rows.t_s[i],
        observed: run.rows.position_m[i].map(|[x, y]| Vec2::new(x, y)),
        readings: log.readings[i],
        command: WheelSpeeds {
            left_m_s: log.left_m_s[i],
            right_m_s: log.right_m_s[i],
        },
    };
    Some((0..run.rows.t_s.len()).map(row).collect())
}

/// The stage-wise diagnosis of the logs, then what the laps say of it; the logs are those of the runs `logged` among all, and
/// `watch` is told what is being tried.
pub(crate) fn from_logs(
    setup: &Setup,
    rows: &[Vec<LogRow>],
    logged: Range<usize>,
    atlas: &Atlas,
    simulate: &Simulate<'_>,
    laps: &[Vec<ObservedLap>],
    watch: &Watch<'_>,
) -> Result<FromLogs> {
    let runs: Vec<&[LogRow]> = rows.iter().map(Vec::as_slice).collect();
    let mut logs = diagnose_logs(&setup.model, &setup.scene, &runs, watch)?;
    watch("whether the laps agree");
    logs.answer.spread_over(&logged, laps.len());
    let (before, after) = atlas.confirm(simulate, laps, &logs.answer.settings())?;
    // Where the logs claim nothing there is nothing to agree with.
    let confirmed = logs.answer.verdict == Verdict::Unexplained
        || after.is_some_and(|after| {
            after.omnibus_p() >= CONTRADICTS_P || after.excess() < (1.0 - CONFIRMED_SHARE) * before.excess()
        });
    Ok(FromLogs {
        logs,
        before,
        after,
        confirmed,
    })
}

impl FromLogs {
    /// What is claimed: the logs' answer if the laps agree with it, and nothing if they do not.
    pub(crate) fn answer(&self) -> Answer {
        let mut answer = self.logs.answer.clone();
        if let (Some(best), true) = (answer.explanations.first_mut(), answer.cause.is_none()) {
            best.remainder = self.after;
        }
        if !self.confirmed {
            answer.verdict = Verdict::Unexplained;
        }
        if answer.verdict == Verdict::Unexplained {
            answer.left_out.iter_mut().for_each(Vec::clear);
        }
        answer
    }
}

/// The sets of names among the explanations that the data do not tell apart, the answer's first.
pub(crate) fn rivals(answer: &Answer) -> &[Explanation] {
    &answer.explanations[..answer.indistinguishable]
}
