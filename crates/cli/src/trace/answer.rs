//! What laps and the robot's logs say together.

use anyhow::{Context, Result};
use diagnose::{
    Answer, Atlas, Baselines, Detectable, Explanation, FourNumbers, LogDiagnosis, LoggedRun, ObservedLap,
    Simulate, Verdict, Watch, diagnose_logs,
};

use super::logs::Logs;
use super::recording::Recording;

/// An answer from logs beside what the laps make of it.
#[derive(Debug)]
pub(crate) struct FromLogs {
    pub(crate) logs: LogDiagnosis,
    /// How the laps depart from the model with the answer's effects; `None` where the robot crashes.
    pub(crate) after: Option<FourNumbers>,
    /// Whether the laps agree with the answer.
    pub(crate) confirmed: bool,
}

/// The laps of a trace, and what simulates such.
pub(super) struct TracedLaps<'a> {
    pub(super) atlas: &'a Atlas,
    pub(super) simulate: &'a Simulate<'a>,
    pub(super) laps: &'a [Vec<ObservedLap>],
}

/// What is claimed, and why.
pub(super) struct Named {
    pub(super) residual: FourNumbers,
    pub(super) answer: Answer,
    pub(super) from_logs: Option<FromLogs>,
    pub(super) baselines: Option<Baselines>,
    pub(super) detectable: Vec<Detectable>,
}

impl TracedLaps<'_> {
    /// What the laps say; `watch` is told what is being tried.
    pub(super) fn named(&self, watch: &Watch<'_>) -> Result<Named> {
        let found = self.atlas.diagnose(self.simulate, self.laps, watch)?;
        Ok(Named {
            residual: found.residual,
            answer: found.answer,
            from_logs: None,
            baselines: Some(self.atlas.baselines(self.laps)?),
            detectable: self.atlas.detectable(),
        })
    }

    /// What the robot's logs say, stage by stage, and what the laps make of it.
    pub(super) fn named_by_logs(
        &self,
        recordings: &[Recording],
        logs: &Logs,
        watch: &Watch<'_>,
    ) -> Result<Named> {
        let models = (recordings.iter())
            .flat_map(|recording| recording.measured.runs.iter().map(|_| &recording.setup.model));
        let runs: Vec<LoggedRun<'_>> = (models.zip(&logs.runs))
            .map(|(model, rows)| LoggedRun { model, rows })
            .collect();
        let first = &recordings[logs.recordings[0]];
        let logs = diagnose_logs(&first.setup.scene, &runs, watch)
            .with_context(|| first.measured.set.name.clone())?;
        watch("whether the laps agree");
        let (before, after) = (self.atlas).confirm(self.simulate, self.laps, &logs.answer.settings())?;
        let found = FromLogs {
            confirmed: logs.answer.agrees_with(&before, after.as_ref()),
            logs,
            after,
        };
        Ok(Named {
            residual: before,
            answer: found.answer(),
            baselines: None,
            detectable: found.logs.detectable.clone(),
            from_logs: Some(found),
        })
    }
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

/// The explanations that the data do not tell apart, the answer's first; none where nothing is claimed.
pub(crate) fn rivals(answer: &Answer) -> &[Explanation] {
    match answer.claimed() {
        Some(_) => &answer.explanations[..answer.indistinguishable],
        None => &[],
    }
}
