//! From measured laps to what the model lacks.

mod answer;
mod atlas;
mod beginnings;
mod cache;
mod checks;
mod curves;
mod document;
mod errors;
mod limits;
mod logs;
mod next;
mod pages;
mod pictures;
mod recording;
mod remarks;
mod tapes;
mod unnamed;

use std::path::Path;

use anyhow::Result;
use diagnose::{Answer, Baselines, Decided, Departures, Detectable, Verdict};

use answer::{FromLogs, TracedLaps};
use atlas::Purpose;
use beginnings::only_beginnings_depart;
pub(crate) use cache::Cache;
pub(crate) use curves::{gates_csv, starts_csv};
pub(crate) use document::{document, parameters};
pub(crate) use errors::Errors;
use errors::errors;
use limits::decide_in_words;
use logs::{Logs, unused_in_words};
use next::{Experiment, experiments};
pub(crate) use pages::{digest, sections, summary};
use recording::{HeldOut, Recording, runs};
use remarks::{remarks, sizes_by_run_in_words};

use crate::config::{Config, ModelFile};
use crate::dataset::DataSet;
use crate::interrupt;
use crate::laps::SampledRun;
use crate::session::Session;
use crate::setup;

/// A diagnosis with what a reader wants to know of it.
#[derive(Debug)]
pub(crate) struct Trace {
    /// The measured data sets, each on the model that it declares.
    pub(crate) recordings: Vec<Recording>,
    /// How the laps depart from the declared model.
    pub(crate) residual: Departures,
    /// Probability of what was seen if the declared model were the robot.
    pub(crate) p: f64,
    /// What is claimed.
    pub(crate) answer: Answer,
    /// What the robot's logs say, where there are logs.
    pub(crate) from_logs: Option<FromLogs>,
    /// What simpler ways of naming say of the laps, where there are no logs.
    pub(crate) baselines: Option<Baselines>,
    /// The error, recording by recording.
    pub(crate) errors: Vec<Errors>,
    /// What a reader must know of the data.
    pub(crate) remarks: Vec<String>,
    /// Whether the only run there is was fitted and judges too.
    pub(crate) judged_by_the_fitted: bool,
    /// Experiments that would tell the answer from what these data do not tell it from.
    pub(crate) experiments: Vec<Experiment>,
    /// The smallest sizes of effects that these data show; of laps without logs.
    pub(crate) detectable: Vec<Detectable>,
    pub(crate) laps_simulated: u64,
}

impl Trace {
    /// How the laps depart from the declared model, where they are all that was judged.
    pub(crate) fn laps_alone(&self) -> Option<&Departures> {
        self.from_logs.is_none().then_some(&self.residual)
    }

    /// What was judged, in a word.
    fn source(&self) -> &'static str {
        self.from_logs.as_ref().map_or("laps", |_| "logs")
    }

    /// Traces what a model lacks in measured data sets.
    ///
    /// # Errors
    /// Data of another world or controller, too few laps, a model that cannot drive.
    pub(crate) fn new(
        session: &Session,
        file: &ModelFile,
        world: Option<&Path>,
        sets: Vec<DataSet>,
        held_out: Option<DataSet>,
        cache: &Cache,
    ) -> Result<Self> {
        let recordings = Recording::all(session, file, world, sets)?;
        let held_out = held_out
            .map(|set| HeldOut::new(&recordings, file, set))
            .transpose()?;
        let seed = session.seed();
        let logged = Logs::of(&recordings);
        let judged_by_the_fitted = held_out.is_none() && runs(&recordings).count() == 1;
        let mut remarks = remarks(&recordings, logged.as_ref(), judged_by_the_fitted);
        let held_out_runs = held_out.iter().flat_map(|held_out| &held_out.runs);
        remarks.extend(held_out_runs.flat_map(SampledRun::remarks));
        // Logs name the effect, and the laps judge it.
        let purpose = if logged.is_some() {
            Purpose::Judge
        } else {
            Purpose::Name
        };
        let traced = TracedLaps::new(session, recordings.iter().collect(), purpose, cache)?;
        let progress = session.open_progress("naming the effect");
        let watch = |what: &str| progress.message(&format!("naming the effect: {what}"));
        let named = match &logged {
            Some(logs) => {
                let logged = || {
                    let logged = logs.recordings.iter().map(|&number| &recordings[number]);
                    (logs.recordings.len() < recordings.len())
                        .then(|| TracedLaps::new(session, logged.collect(), purpose, cache))
                        .transpose()
                };
                traced.named_by_logs(logs, logged, &watch)
            }
            None => traced.named(&watch),
        };
        interrupt::check()?;
        let mut named = named?;
        traced.keep_what_was_added(cache);
        named.answer = named.answer.unless_stalls(recordings[0].config.slip.level);
        progress.message("simulating the error before and after");
        let errors = errors(&recordings, &named.answer, held_out, seed)?;
        interrupt::check()?;
        remarks.extend(sizes_by_run_in_words(&named.answer));
        if named.answer.verdict != Verdict::Faithful {
            remarks.extend(only_beginnings_depart(&named.residual));
        }
        if let (Some(found), Some(logs)) = (&named.from_logs, &logged) {
            remarks.extend(unused_in_words(&recordings, logs, &found.logs));
            if matches!(found.logs.decide, Decided::NoController { .. }) {
                remarks.push(decide_in_words(&found.logs.decide, &recordings));
            }
        }
        let mut trace = Self {
            remarks,
            judged_by_the_fitted,
            laps_simulated: traced.atlas.spent(),
            experiments: Vec::new(),
            recordings,
            errors,
            residual: named.residual,
            p: named.p,
            answer: named.answer,
            from_logs: named.from_logs,
            baselines: named.baselines,
            detectable: named.detectable,
        };
        trace.experiments = experiments(&trace, seed)?;
        Ok(trace)
    }

    /// The declared model with the effects of the answer.
    pub(crate) fn after_config(&self) -> Config {
        let mut config = self.recordings[0].config.clone();
        config
            .effect
            .extend(self.answer.settings().iter().map(setup::effect_table));
        config
    }

    /// The runs that judge, in words.
    pub(crate) fn judged_runs(&self) -> &'static str {
        if self.judged_by_the_fitted {
            "the run that was fitted"
        } else {
            "held-out runs"
        }
    }

    /// Mean over all held-out runs of one of the errors, m.
    pub(crate) fn mean_m(&self, which: impl Fn(&Errors) -> &[f64]) -> f64 {
        let all: Vec<f64> = (self.errors.iter())
            .flat_map(|errors| which(errors).iter().copied())
            .collect();
        all.iter().sum::<f64>() / all.len() as f64
    }

    /// The recording whose laps are drawn, and its errors: the first with held-out runs.
    pub(crate) fn shown(&self) -> (&Recording, &Errors) {
        let errors = &self.errors[0];
        (&self.recordings[errors.recording], errors)
    }

    /// All held-out runs.
    pub(crate) fn held_out(&self) -> impl Iterator<Item = &SampledRun> {
        self.errors.iter().flat_map(|errors| &errors.held_out)
    }
}
