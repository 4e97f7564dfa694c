//! From measured laps to what the model lacks.

mod answer;
mod cache;
mod document;
mod error;
mod pages;

use std::path::Path;

use anyhow::{Context, Result, ensure};
use diagnose::{Answer, Atlas, FourNumbers};
use sim::{Setting, Streams};

use answer::{FromLogs, from_logs, log_rows};
pub(crate) use cache::Cache;
pub(crate) use document::document;
pub(crate) use error::{MeanLaps, mean};
pub(crate) use pages::{sections, summary};

use crate::config::{Config, ModelFile};
use crate::dataset::DataSet;
use crate::interrupt;
use crate::laps::{Measured, SampledRun};
use crate::session::Session;
use crate::setup::{self, Setup};

/// A diagnosis with what a reader wants to know of it.
#[derive(Debug)]
pub(crate) struct Trace {
    pub(crate) config: Config,
    pub(crate) setup: Setup,
    pub(crate) measured: Measured,
    /// How the laps depart from the declared model.
    pub(crate) residual: FourNumbers,
    /// What is claimed.
    pub(crate) answer: Answer,
    /// What the robot's logs say, where there are logs.
    pub(crate) from_logs: Option<FromLogs>,
    /// The runs that errors are measured on.
    pub(crate) held_out: Vec<SampledRun>,
    pub(crate) before: MeanLaps,
    pub(crate) after: MeanLaps,
    /// Root mean square distances, m: mean over the held-out runs.
    pub(crate) before_m: f64,
    pub(crate) after_m: f64,
    pub(crate) floor_m: f64,
    pub(crate) laps_simulated: u64,
}

impl Trace {
    /// Traces what a model lacks in a measured data set.
    ///
    /// # Errors
    /// Data of another world or controller, too few laps, a model that cannot drive.
    pub(crate) fn new(
        session: &Session,
        file: &ModelFile,
        world: Option<&Path>,
        set: DataSet,
        held_out: Option<DataSet>,
        cache: &Cache,
    ) -> Result<Self> {
        let config = set.declared_config(&file.config)?;
        let source = file.world(world)?;
        let circuit = setup::circuit(&source, config.run.gates)?;
        let check = |set: &DataSet| belongs(set, &config, &source.text);
        check(&set)?;
        let measured = Measured::on(set, circuit.clone())?;
        let held_out = held_out
            .map(|set| {
                check(&set)?;
                anyhow::Ok(Measured::on(set, circuit.clone())?.runs)
            })
            .transpose()?;
        measured
            .runs
            .iter()
            .flat_map(SampledRun::remarks)
            .for_each(|remark| session.remark(&remark));
        let setup = Setup::new(&config, circuit, None)?;
        let shape: Vec<usize> = measured.runs.iter().map(|run| run.laps.len()).collect();
        let simulate = |effects: &[Setting], set: u64| data_set(&setup, effects, session.seed(), set, &shape);
        let laps: Vec<Vec<track::Lap>> = measured.runs.iter().map(|run| run.laps.clone()).collect();
        let (residual, answer, from_logs) = match log_rows(&measured.set) {
            Some(rows) => {
                let progress = session.progress("judging the laps and following the logs", Atlas::null_sets());
                let atlas = Atlas::without_effects(&simulate, &|| progress.tick(1))?;
                let found = from_logs(&setup, &rows, &atlas, &simulate, &laps)?;
                (found.before, found.answer(), Some(found))
            }
            None => {
                let atlas = atlas(session, &config, &source.text, &shape, cache, &simulate)?;
                interrupt::check()?;
                let progress = session.progress("naming the effect", 1);
                let found = atlas.diagnose(&simulate, &laps)?;
                progress.tick(1);
                (found.residual, found.answer, None)
            }
        };
        interrupt::check()?;

        let wanted = shape.iter().copied().max().unwrap_or(20).max(20);
        let before = MeanLaps::new(&setup, &[], session.seed(), wanted)?;
        let settings = answer.settings();
        let after = MeanLaps::new(&setup, &settings, session.seed(), wanted)?;
        let mean_over = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let (held_out, after_m) = match held_out {
            Some(runs) => {
                let distances = runs.iter().map(|run| after.distance_m(run)).collect();
                (runs, mean_over(distances))
            }
            None => {
                let without = measured
                    .runs
                    .iter()
                    .zip(&answer.left_out)
                    .map(|(run, effects)| {
                        Ok(MeanLaps::new(&setup, effects, session.seed(), wanted)?.distance_m(run))
                    });
                let distances = without.collect::<Result<_>>()?;
                (measured.runs.clone(), mean_over(distances))
            }
        };
        let before_m = mean_over(held_out.iter().map(|run| before.distance_m(run)).collect());
        let floor_m = after.floor_m();
        let laps_simulated = Atlas::sets() * shape.iter().sum::<usize>() as u64;
        Ok(Self {
            config,
            setup,
            measured,
            residual,
            answer,
            from_logs,
            held_out,
            before,
            after,
            before_m,
            after_m,
            floor_m,
            laps_simulated,
        })
    }

    /// The declared model with the effects of the answer.
    pub(crate) fn after_config(&self) -> Config {
        let mut config = self.config.clone();
        config
            .effect
            .extend(self.answer.settings().iter().map(setup::effect_table));
        config
    }
}

/// Refuses data that are not the model's.
fn belongs(set: &DataSet, config: &Config, world: &str) -> Result<()> {
    let shown = set.folder.display();
    if let Some(controller) = set.controller {
        ensure!(
            controller == config.controller.kind,
            "{shown}: driven by the {} controller, and the model's is {}; add --set controller.kind={}",
            controller.name(),
            config.controller.kind.name(),
            controller.name()
        );
    }
    let source = set
        .world_source(None)
        .with_context(|| format!("{shown}: whose world must be the model's"))?;
    ensure!(
        source.text == world,
        "{shown}: driven in another world ({}) than the model's",
        source.label
    );
    Ok(())
}

/// One simulated data set of the measured one's shape; `None` where a run does not complete its laps.
fn data_set(
    setup: &Setup,
    effects: &[Setting],
    seed: u64,
    set: u64,
    shape: &[usize],
) -> Option<Vec<Vec<track::Lap>>> {
    let mut model = setup.model.clone();
    model.effects.extend_from_slice(effects);
    let run = |(run, &laps): (usize, &usize)| {
        let world = setup.scene.world(&model, run).ok()?;
        // Data sets have seeds of their own, far from those that a user's `drive` has.
        let streams = Streams {
            seed: (seed << 20) + (1 << 50) + set,
            run: run as u64,
        };
        let drive = sim::drive(&world, streams, laps, |_| {}).ok()?;
        let closed: Vec<track::Lap> = drive
            .laps
            .into_iter()
            .filter(|lap| lap.missed.is_empty())
            .collect();
        (closed.len() == laps).then_some(closed)
    };
    shape.iter().enumerate().map(run).collect()
}

/// The model's atlas, from the cache or made now.
fn atlas(
    session: &Session,
    config: &Config,
    world: &str,
    shape: &[usize],
    cache: &Cache,
    simulate: &diagnose::Simulate<'_>,
) -> Result<Atlas> {
    let key = format!("{}\n{world}\n{shape:?}\n{}", config.to_toml(), session.seed());
    if let Some(atlas) = cache.get(&key) {
        return Ok(atlas);
    }
    let progress = session.progress("simulating what each effect would do", Atlas::sets());
    let atlas = Atlas::new(simulate, &|| progress.tick(1))?;
    drop(progress);
    cache.put(&key, &atlas);
    Ok(atlas)
}
