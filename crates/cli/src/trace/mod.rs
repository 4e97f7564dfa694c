//! From measured laps to what the model lacks.

mod answer;
mod cache;
mod document;
mod error;
mod limits;
mod next;
mod pages;
mod pictures;
mod recording;
mod unnamed;

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use diagnose::{Answer, Atlas, Baselines, Decided, Detectable, FourNumbers, LogRow, ObservedLap, Simulate};
use sim::Setting;

use answer::{FromLogs, from_logs, log_rows};
pub(crate) use cache::Cache;
pub(crate) use document::{document, parameters};
pub(crate) use error::{MeanLaps, mean};
use limits::decide_in_words;
use next::{Experiment, experiments};
pub(crate) use pages::{digest, gates_csv, sections, summary};
use recording::{Recording, Seeds, held_out, simulate_all};

use crate::config::{Config, ModelFile};
use crate::dataset::DataSet;
use crate::interrupt;
use crate::laps::SampledRun;
use crate::session::Session;
use crate::setup;

/// Laps behind every mean lap are at least so many a run.
const LAPS: usize = 20;

/// A diagnosis with what a reader wants to know of it.
#[derive(Debug)]
pub(crate) struct Trace {
    /// The measured data sets, each on the model that it declares.
    pub(crate) recordings: Vec<Recording>,
    /// How the laps depart from the declared model.
    pub(crate) residual: FourNumbers,
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
    /// Experiments that would tell the answer from what these data do not tell it from.
    pub(crate) experiments: Vec<Experiment>,
    /// The smallest sizes of effects that these data show; of laps without logs.
    pub(crate) detectable: Vec<Detectable>,
    pub(crate) laps_simulated: u64,
}

/// How far one recording's held-out runs are from the simulation.
#[derive(Debug)]
pub(crate) struct Errors {
    /// Which of the recordings.
    pub(crate) recording: usize,
    pub(crate) held_out: Vec<SampledRun>,
    pub(crate) before: MeanLaps,
    pub(crate) after: MeanLaps,
    /// For each held-out run: root mean square distances, m.
    pub(crate) before_m: Vec<f64>,
    pub(crate) after_m: Vec<f64>,
    /// What it is for runs of the model with the effects, m.
    pub(crate) floor_m: Vec<f64>,
}

impl Trace {
    /// Traces what a model lacks in measured data sets.
    ///
    /// # Errors
    /// Data of another world or controller, too few laps, a model that cannot drive.
    pub(crate) fn new(
        session: &Session,
        file: &ModelFile,
        world: Option<&Path>,
        sets: Vec<DataSet>,
        unseen: Option<DataSet>,
        cache: &Cache,
    ) -> Result<Self> {
        let mut recordings: Vec<Recording> = Vec::with_capacity(sets.len());
        for set in sets {
            let first_run = runs(&recordings).count();
            recordings.push(Recording::new(session, file, world, set, first_run)?);
        }
        let unseen = unseen.map(|set| held_out(&recordings, file, set)).transpose()?;
        let seed = session.seed();
        let simulate =
            |effects: &[Setting], set: u64| simulate_all(&recordings, effects, Seeds { session: seed, set });
        let laps: Vec<Vec<ObservedLap>> = recordings.iter().flat_map(Recording::laps).collect();
        let few = laps.iter().position(|run| run.len() < 3);
        ensure!(
            few.is_none(),
            "run {} has {} whole laps after its first: at least 3 in every run are needed to trace anything; leave the run \
             out of `runs` in dataset.toml, or measure it again",
            runs(&recordings)
                .nth(few.unwrap_or(0))
                .map_or("", |run| run.name.as_str()),
            laps[few.unwrap_or(0)].len()
        );
        let logged = with_logs(&recordings);
        let mut remarks = remarks(&recordings, logged.as_ref());
        // Logs name the effect, and the laps judge it.
        let purpose = if logged.is_some() {
            Purpose::Judge
        } else {
            Purpose::Name
        };
        let parts = (recordings.iter())
            .map(|recording| atlas(session, recording, purpose, cache))
            .collect::<Result<Vec<_>>>()?;
        let atlas = Atlas::join(parts).expect("at least one data set is measured");
        let baselines = logged.is_none().then(|| atlas.baselines(&laps)).transpose()?;
        let slip_level = recordings[0].config.slip.level;
        let doubted = |answer: Answer| answer.unless_stalls(slip_level);
        let progress = session.open_progress("naming the effect");
        let watch = |what: &str| progress.message(&format!("naming the effect: {what}"));
        let (residual, answer, from_logs) = match logged {
            Some((place, rows)) => {
                let first = recordings[place].first_run;
                let own = first..first + rows.len();
                let found = from_logs(
                    &recordings[place].setup,
                    &rows,
                    own,
                    &atlas,
                    &simulate,
                    &laps,
                    &watch,
                );
                interrupt::check()?;
                let found = found.with_context(|| recordings[place].measured.set.name.clone())?;
                (found.before, doubted(found.answer()), Some(found))
            }
            None => {
                let found = atlas.diagnose(&simulate, &laps, &watch);
                interrupt::check()?;
                let found = found?;
                (found.residual, doubted(found.answer), None)
            }
        };
        progress.message("simulating the error before and after");
        let errors = errors(&recordings, &answer, unseen, seed)?;
        interrupt::check()?;
        if let Some(found) = &from_logs
            && matches!(found.logs.decide, Decided::NoController { .. })
        {
            remarks.push(decide_in_words(&found.logs.decide));
        }
        let mut trace = Self {
            remarks,
            laps_simulated: laps_simulated(&recordings, &atlas, purpose),
            detectable: match &from_logs {
                Some(found) => found.logs.detectable.clone(),
                None => atlas.detectable(),
            },
            experiments: Vec::new(),
            recordings,
            residual,
            answer,
            from_logs,
            baselines,
            errors,
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

fn runs(recordings: &[Recording]) -> impl Iterator<Item = &SampledRun> {
    recordings.iter().flat_map(|recording| &recording.measured.runs)
}

/// What these data do not allow; `logged` are the logs that are used, with their recording.
fn remarks(recordings: &[Recording], logged: Option<&(usize, Vec<Vec<LogRow>>)>) -> Vec<String> {
    let mut remarks = Vec::new();
    if runs(recordings).count() == 1 {
        remarks.push(
            "One run only: whether the robot differs from run to run cannot be told, and the error after is that of \
             the very run that was fitted; measure a second run, or give one with --held-out."
                .to_owned(),
        );
    }
    remarks.extend(runs(recordings).flat_map(|run| run.strays.clone()));
    for run in runs(recordings).filter(|run| run.laps.len() < run.wanted) {
        remarks.push(format!(
            "Run {} has {} of {} laps.",
            run.name,
            run.laps.len(),
            run.wanted
        ));
    }
    if let Some((place, logs)) = logged {
        for (run, rows) in recordings[*place].measured.runs.iter().zip(logs) {
            if !rows.iter().any(LogRow::tells) {
                remarks.push(format!(
                    "The log of run {} has no readings beside commands: a size that goes by run is the mean of the other \
                     runs' there.",
                    run.name
                ));
            }
        }
    }
    let used = logged.map(|(place, _)| *place);
    for (place, recording) in recordings.iter().enumerate() {
        let set = &recording.measured.set;
        let count = set.runs.iter().filter(|run| run.rows.log.is_some()).count();
        if used != Some(place) && count > 0 {
            let why = match used {
                Some(_) => "those of another data set are used: trace this one alone to use them",
                None => "a log in every run is needed: leave out the runs without one to use them",
            };
            remarks.push(format!(
                "The logs of {} ({count} runs) are not used; {why}.",
                set.name
            ));
        }
    }
    remarks
}

/// The first recording of which all runs have a log, and its logs.
fn with_logs(recordings: &[Recording]) -> Option<(usize, Vec<Vec<LogRow>>)> {
    (recordings.iter().enumerate())
        .find_map(|(place, recording)| log_rows(&recording.measured.set).map(|rows| (place, rows)))
}

/// The errors of every recording; without unseen data each run is left out of the fit in turn.
fn errors(
    recordings: &[Recording],
    answer: &Answer,
    unseen: Option<(usize, Vec<SampledRun>)>,
    seed: u64,
) -> Result<Vec<Errors>> {
    let mut all = Vec::new();
    for (place, recording) in recordings.iter().enumerate() {
        let wanted = recording.shape().into_iter().fold(LAPS, usize::max);
        let laps_of = |effects: &[Setting], runs: Range<usize>| {
            let places = &recording.places(effects)[runs];
            MeanLaps::new(&recording.setup, effects, seed, wanted, places)
        };
        let all_runs = 0..recording.measured.runs.len();
        let before = laps_of(&[], all_runs.clone())?;
        let settings = answer.settings();
        let after = if settings.is_empty() {
            before.clone()
        } else {
            laps_of(&settings, all_runs)?
        };
        let (held_out, before_m, after_m) = match &unseen {
            Some((at, _)) if *at != place => continue,
            Some((_, runs)) => (
                runs.clone(),
                runs.iter().map(|run| before.distance_m(run)).collect(),
                runs.iter().map(|run| after.distance_m(run)).collect(),
            ),
            None => {
                let runs = recording.measured.runs.clone();
                let (mut before_m, mut after_m) = (Vec::new(), Vec::new());
                for (at, run) in runs.iter().enumerate() {
                    let without = &answer.left_out[recording.first_run + at];
                    let distance_m = |effects| anyhow::Ok(laps_of(effects, at..at + 1)?.distance_m(run));
                    let own_m = if recording.runs_are_alike() {
                        before.distance_m(run)
                    } else {
                        distance_m(&[])?
                    };
                    before_m.push(own_m);
                    after_m.push(if without.is_empty() {
                        own_m
                    } else {
                        distance_m(without)?
                    });
                }
                (runs, before_m, after_m)
            }
        };
        all.push(Errors {
            recording: place,
            before_m,
            floor_m: held_out.iter().map(|run| after.floor_m(run.laps.len())).collect(),
            held_out,
            before,
            after,
            after_m,
        });
    }
    Ok(all)
}

/// What the declared model and its other cuts simulate for one recording.
fn with_simulations<R>(
    recording: &Recording,
    seed: u64,
    use_them: impl FnOnce(&Simulate<'_>, &[&Simulate<'_>]) -> R,
) -> R {
    let of = |setup| {
        move |effects: &[Setting], set: u64| {
            recording.simulate_anywhere(setup, effects, Seeds { session: seed, set })
        }
    };
    let declared = of(&recording.setup);
    let cuts: Vec<_> = recording.cuts.iter().map(of).collect();
    let cuts: Vec<&Simulate<'_>> = cuts.iter().map(|cut| cut as &Simulate<'_>).collect();
    use_them(&declared, &cuts)
}

/// Laps simulated for a diagnosis; those of a cached atlas count as if they were simulated now.
fn laps_simulated(recordings: &[Recording], atlas: &Atlas, purpose: Purpose) -> u64 {
    let of = |recording: &Recording| {
        let sets = purpose.sets(recording.cuts.len());
        (sets + atlas.spent()) * recording.shape().iter().sum::<usize>() as u64
    };
    recordings.iter().map(of).sum()
}

/// What an atlas is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To name what laps lack.
    Name,
    /// To judge laps by: it knows no effect.
    Judge,
}

impl Purpose {
    /// Data sets simulated for it with so many other cuts of the walls.
    fn sets(self, cuts: usize) -> u64 {
        match self {
            Self::Name => Atlas::sets(cuts),
            Self::Judge => Atlas::null_sets(cuts),
        }
    }
}

/// A recording's atlas, from the cache or made now.
fn atlas(session: &Session, recording: &Recording, purpose: Purpose, cache: &Cache) -> Result<Atlas> {
    let Recording { config, world, .. } = recording;
    let shape = recording.shape();
    let alike = recording.runs_are_alike();
    let mut key = format!(
        "{}\n{purpose:?}\n{}\n{world}\n{shape:?}\n{}",
        Atlas::RECIPE,
        config.to_toml(),
        session.seed()
    );
    if !alike {
        key += &format!("\n{:?}", recording.places(&[]));
    }
    if let Some(atlas) = cache.get(&key) {
        return Ok(atlas);
    }
    let doing = match purpose {
        Purpose::Name => "simulating what each effect would do",
        Purpose::Judge => "simulating the declared model",
    };
    let progress = session.progress(doing, purpose.sets(recording.cuts.len()));
    let tick = || progress.tick(1);
    let atlas = with_simulations(recording, session.seed(), |declared, cuts| match purpose {
        Purpose::Name => Atlas::new(declared, cuts, alike, &tick),
        Purpose::Judge => Atlas::without_effects(declared, cuts, alike, &tick),
    });
    drop(progress);
    interrupt::check()?;
    let atlas = atlas?;
    if let Some(folder) = cache.put(&key, &atlas).err() {
        session.remark(&format!(
            "{}: signatures cannot be kept here and are simulated anew next time; choose another folder with --cache",
            folder.display()
        ));
    }
    Ok(atlas)
}
