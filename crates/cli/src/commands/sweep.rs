//! `lapwing sweep`: a grid of model settings, each compared with every measured run.
//!
//! A unit of work is one grid point simulated with one seed. Units are stored in `DIR.partial` as they are done, and
//! the analysis reads them from there, so a sweep that was stopped and resumed ends in the same bytes.

mod analysis;
mod grid;
mod pictures;
mod report;
mod unit;

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use serde_json::{Value, json};
use sim::{Circuit, Streams};
use track::Course;

use crate::args;
use crate::config::{Config, WorldSource};
use crate::dataset::DataSet;
use crate::interrupt;
use crate::laps::{self, Measured, SampledRun};
use crate::output::{Input, OutDir, Work};
use crate::session::Session;
use crate::setup;

use analysis::SeedResult;
use grid::{Base, Grid};
use unit::Unit;

/// Subfolder of the units, there only while the sweep is under way.
const UNITS: &str = "units";

pub(crate) fn run(session: &Session, args: &args::Sweep) -> Result<()> {
    let sweep = Sweep::new(session, args)?;
    let mut out = OutDir::create(
        &args.out,
        &Work::new("sweep", &sweep.identity),
        &sweep.inputs,
        args.resume,
    )?;
    out.keep_partial();
    sweep.simulate(session, &out)?;
    let results = sweep.analyse(&out)?;
    let document = report::document(&sweep, &results);
    out.write("sweep.csv", report::csv(&sweep, &results)?)?;
    out.write("sweep.json", format!("{document:#}\n"))?;
    out.write("distance.svg", pictures::distances(&sweep, &results).to_svg()?)?;
    out.write("modes.svg", pictures::modes(&sweep, &out)?.to_svg()?)?;
    out.remove(UNITS)?;
    out.finish(&session.manifest(sweep.configuration.clone(), sweep.inputs.clone()))?;
    for remark in results.iter().flat_map(|result| &result.remarks) {
        session.remark(remark);
    }
    if args.json {
        session.print_json(&document)
    } else {
        session.print(&report::text(&sweep, &results))
    }
}

/// What is simulated and what it is compared with, all of it checked.
struct Sweep {
    grid: Grid,
    measured: Measured,
    runs: usize,
    laps: usize,
    seeds: Vec<u64>,
    configuration: Value,
    /// The configuration and the hashes of the inputs: what `--resume` must find unchanged.
    identity: Value,
    inputs: Vec<Input>,
}

impl Sweep {
    fn new(session: &Session, args: &args::Sweep) -> Result<Self> {
        let file = setup::model_file(&args.model)?;
        let world = file.world(args.model.settings.world.as_deref())?;
        let circuit = setup::model_circuit(&file, &world)?;
        let set = measured_set(args, &world)?;
        remark_on_declared(session, &set, &file.config, &circuit.course)?;
        let base = Base {
            file: &file,
            world: &world,
            circuit: &circuit,
            runs: args.runs as usize,
        };
        let grid = Grid::new(&base, &args.vary)?;
        let measured = Measured::on(set, circuit, &file.config)?;
        measured
            .runs
            .iter()
            .flat_map(SampledRun::remarks)
            .for_each(|remark| session.remark(&remark));

        let seeds = (0..u64::from(args.seeds))
            .map(|index| session.seed().wrapping_add(index))
            .collect();
        let configuration = json!({
            "model": file.config, "vary": grid.axes_json(), "measured": args.measured, "seeds": seeds,
            "runs": args.runs, "laps": args.laps,
        });
        let mut inputs = vec![file.input.clone(), world.input];
        inputs.extend(measured.set.inputs.iter().cloned());
        let identity = json!({ "configuration": configuration, "inputs": inputs });
        let (runs, laps) = (args.runs as usize, args.laps as usize);
        Ok(Self {
            grid,
            measured,
            runs,
            laps,
            seeds,
            configuration,
            identity,
            inputs,
        })
    }

    fn circuit(&self) -> &Arc<Circuit> {
        &self.measured.circuit
    }

    /// The file of a unit.
    fn unit_name(&self, seed: usize, point: usize) -> String {
        format!("{UNITS}/{seed}_{point}")
    }

    /// Simulates the units that are not there yet.
    fn simulate(&self, session: &Session, out: &OutDir) -> Result<()> {
        let points = self.grid.points.len();
        let units: Vec<(usize, usize)> = (0..self.seeds.len())
            .flat_map(|seed| (0..points).map(move |point| (seed, point)))
            .collect();
        let progress = session.progress("sweeping", (units.len() * self.runs) as u64);
        units.into_par_iter().try_for_each(|(seed, point)| {
            let name = self.unit_name(seed, point);
            let there = out.resumed() && self.unit(out, seed, point)?.is_some();
            if there {
                progress.tick(self.runs as u64);
                return Ok(());
            }
            let setup = &self.grid.points[point].setup;
            let runs = (0..self.runs).into_par_iter().map(|run| {
                interrupt::check_resumable()?;
                let drive = setup.drive(
                    Streams {
                        seed: self.seeds[seed],
                        run: run as u64,
                    },
                    self.laps,
                    |_| {},
                )?;
                progress.tick(1);
                anyhow::Ok(laps::simulated(
                    &self.grid.points[point].name,
                    run,
                    &drive,
                    self.laps,
                ))
            });
            let unit = Unit::new(runs.collect::<Result<Vec<_>>>()?);
            out.write(&name, unit.to_bytes())
        })
    }

    /// A unit as it was stored; none where it is not there or not whole.
    fn unit(&self, out: &OutDir, seed: usize, point: usize) -> Result<Option<Unit>> {
        let bytes = out.read(&self.unit_name(seed, point))?;
        Ok(bytes.and_then(|bytes| Unit::from_bytes(&bytes, self.runs, self.circuit().gates.len())))
    }

    /// The units of one seed, in the order of the grid.
    fn units(&self, out: &OutDir, seed: usize) -> Result<Vec<Unit>> {
        let unit = |point: usize| {
            let missing = || format!("{} was removed while the sweep ran", self.unit_name(seed, point));
            self.unit(out, seed, point)?.with_context(missing)
        };
        (0..self.grid.points.len()).map(unit).collect()
    }

    /// One PDM per seed, of all grid points and measured runs together.
    fn analyse(&self, out: &OutDir) -> Result<Vec<SeedResult>> {
        let result = |seed: usize| {
            interrupt::check_resumable()?;
            analysis::compare(self, seed, &self.units(out, seed)?)
        };
        (0..self.seeds.len()).into_par_iter().map(result).collect()
    }
}

/// The measured laps, which must have been driven in the model's world.
fn measured_set(args: &args::Sweep, world: &WorldSource) -> Result<DataSet> {
    let set = DataSet::load(&args.measured)?;
    let driven_in = set.world_source(args.model.settings.world.as_deref())?;
    if driven_in.text != world.text {
        bail!(
            "{}: driven in {}, but the model's world is {}: laps are compared gate by gate, so let `world` of the model name \
             the same, or pass --world FILE for both",
            args.measured.display(),
            driven_in.label,
            world.label,
        );
    }
    Ok(set)
}

/// Says where the model departs from what the measured robot was set to: the sweep may well mean it.
fn remark_on_declared(session: &Session, set: &DataSet, config: &Config, course: &Course) -> Result<()> {
    let name = &set.name;
    if let Some(kind) = set.controller.filter(|&kind| kind != config.controller.kind) {
        let (measured, model) = (kind.name(), config.controller.kind.name());
        session.remark(&format!(
            "{name} was driven by the {measured} controller, the model has {model}"
        ));
    }
    let declares_other =
        set.declared_config(config)?.going_round(course) != config.clone().going_round(course);
    if declares_other {
        let declared = set.declared.to_string();
        let declared = declared.trim().replace('\n', "; ");
        session.remark(&format!(
            "{name} declares other settings than the model has, which is simulated as it is: {declared}"
        ));
    }
    Ok(())
}
