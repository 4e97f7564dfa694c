//! `lapwing drive`: simulated laps as a data set.

use std::ops::ControlFlow;

use anyhow::{Result, ensure};
use rayon::prelude::*;
use serde_json::{Value, json};
use sim::{CasterKind, Drive, Model, Pattern, Step, Streams};
use toml::Table as Toml;

use crate::args;
use crate::config::Config;
use crate::dataset::{DataSetToWrite, Log, Rows, run_name, write_dataset};
use crate::figures::{self, DrawnRun};
use crate::interrupt::{self, Interrupted};
use crate::laps::{self, SampledRun, mean_and_deviation};
use crate::output::{OutDir, Work, sha256};
use crate::session::Session;
use crate::setup::{self, Setup, locate};
use crate::table::{Table, counted};

pub(crate) fn run(session: &Session, args: &args::Drive) -> Result<()> {
    if let Some(name) = &args.name {
        check_name(name)?;
    }
    let file = setup::model_file(&args.model)?;
    let world = args.model.settings.world.as_deref();
    let kind = args.caster.as_deref().and_then(caster);
    let setup = Setup::load(&file, world, kind)?;
    let runs = args
        .runs
        .map_or_else(|| default_runs(&setup.model), |runs| runs as usize);
    let configuration = json!({
        "model": file.config, "seed": session.seed(), "runs": runs, "laps": args.laps, "log": args.log,
        "caster": setup.scene.caster().kind().name(),
    });
    let source = file.world(world)?;
    let inputs = vec![file.input.clone(), source.input.clone()];
    let out = OutDir::create(&args.out, &Work::new("drive", &configuration), &inputs, false)?;
    let laps = args.laps as usize;
    let progress = session.progress("driving", runs as u64);
    let driven: Vec<(Drive, Rows)> = (0..runs)
        .into_par_iter()
        .map(|run| {
            let driven = record(&setup, session.seed(), run, laps, args.log);
            match driven.map_err(|error| locate(&file, &source, error))? {
                ControlFlow::Break(interrupted) => Err(anyhow::Error::from(interrupted)),
                ControlFlow::Continue(driven) => {
                    progress.tick(1);
                    Ok(driven)
                }
            }
        })
        .collect::<Result<_>>()?;
    drop(progress);

    let name = args
        .name
        .clone()
        .unwrap_or_else(|| name(&file.config, &configuration));
    let sampled: Vec<SampledRun> = driven
        .iter()
        .enumerate()
        .map(|(i, (drive, _))| laps::simulated(&name, i, drive, laps))
        .collect();
    let shipped = source.path.is_none();
    let rows: Vec<(String, &Rows)> = driven
        .iter()
        .enumerate()
        .map(|(i, (_, rows))| (run_name(i), rows))
        .collect();
    if !shipped {
        out.write("world.toml", &source.text)?;
    }
    write_dataset(
        out.path(),
        &DataSetToWrite {
            name: &name,
            world: if shipped { &file.config.world } else { "world.toml" },
            controller: file.config.controller.kind,
            laps,
            note: "simulated by lapwing; model.toml beside this file is the model",
            declared: &declared(&file.config),
            runs: &rows,
        },
    )?;
    let mut config = file.config.clone();
    if !shipped {
        config.world = "world.toml".into();
    }
    out.write("model.toml", config.to_toml())?;
    let drawn: Vec<DrawnRun<'_>> = sampled
        .iter()
        .zip(&driven)
        .map(|(run, (_, rows))| DrawnRun {
            label: format!("run {}", run.run),
            laps: &run.laps,
            rest: rest(run, rows),
        })
        .collect();
    out.write(
        "laps.svg",
        figures::laps_map(setup.scene.circuit(), &drawn).to_svg()?,
    )?;
    let document = summary(&name, &sampled, &driven);
    out.write("summary.json", format!("{document:#}\n"))?;
    interrupt::check()?;
    out.finish(&session.manifest(configuration, inputs))?;

    for remark in sampled.iter().flat_map(SampledRun::remarks) {
        session.remark(&remark);
    }
    if args.json {
        session.print_json(&document)
    } else {
        session.print(&text(args, &document))
    }
}

/// Whether tables and files can call a data set so.
fn check_name(name: &str) -> Result<()> {
    ensure!(
        !name.trim().is_empty() && !name.contains(char::is_control),
        "--name {name:?}: a name on one line is needed, of more than spaces and without control characters"
    );
    Ok(())
}

/// Runs where nobody says how many: those that the model's effects have values for.
fn default_runs(model: &Model) -> usize {
    const USUAL: usize = 4;
    let by_run = model.effects.iter().filter_map(|effect| match &effect.pattern {
        Pattern::ByRun(runs) => Some(runs.len()),
        Pattern::Constant(_) | Pattern::ByTime { .. } => None,
    });
    by_run.min().unwrap_or(USUAL)
}

/// The name of a data set that was given none: its controller and what tells it from others, wherever it is written to.
fn name(config: &Config, configuration: &Value) -> String {
    let hash = sha256(configuration.to_string().as_bytes());
    format!("{}-{}", config.controller.kind.name(), &hash[..8])
}

/// The caster of that name.
fn caster(name: &str) -> Option<CasterKind> {
    CasterKind::NAMED
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, kind)| *kind)
}

/// Drives one run and keeps its rows, unless it is interrupted.
fn record(
    setup: &Setup,
    seed: u64,
    run: usize,
    laps: usize,
    log: bool,
) -> Result<ControlFlow<Interrupted, (Drive, Rows)>, sim::Error> {
    let mut rows = Rows {
        log: log.then(Log::default),
        ..Rows::default()
    };
    let streams = Streams {
        seed,
        run: run as u64,
    };
    let world = setup.scene.world(&setup.model, run)?;
    let drive = sim::drive_until(&world, streams, None, laps, |step: &Step| {
        rows.t_s.push(step.time_s);
        rows.position_m.push(Some([step.observed.x, step.observed.y]));
        if let Some(log) = &mut rows.log {
            log.readings.push(step.readings);
            log.left_m_s.push(step.command.left_m_s);
            log.right_m_s.push(step.command.right_m_s);
        }
        interrupt::check().map_or_else(ControlFlow::Break, ControlFlow::Continue)
    })?;
    Ok(drive.map_continue(|drive| (drive, rows)))
}

/// What a run drove after its last lap kept, m, where it timed out or has none.
fn rest(run: &SampledRun, rows: &Rows) -> Vec<[f64; 2]> {
    if !run.timed_out && !run.laps.is_empty() {
        return Vec::new();
    }
    let from_s = run.laps.last().map_or(0.0, |lap| lap.end_s);
    let seen = rows.since_start_s().zip(&rows.position_m);
    seen.filter(|(t_s, _)| *t_s >= from_s)
        .filter_map(|(_, position_m)| *position_m)
        .collect()
}

/// What an experimenter sets and a reader of the laps must know: the controller's settings and the driving direction.
fn declared(config: &Config) -> Toml {
    let shipped = Config::shipped();
    let mut declared = Toml::new();
    let mut put = |table: &str, key: &str, value: toml::Value, usual: toml::Value| {
        if value != usual {
            let entry = declared
                .entry(table)
                .or_insert_with(|| toml::Value::Table(Toml::new()));
            if let Some(entry) = entry.as_table_mut() {
                entry.insert(key.to_owned(), value);
            }
        }
    };
    let (now, usual) = (&config.controller, &shipped.controller);
    put(
        "controller",
        "speed_m_s",
        now.speed_m_s.into(),
        usual.speed_m_s.into(),
    );
    put(
        "controller",
        "gain_per_count",
        now.gain_per_count.into(),
        usual.gain_per_count.into(),
    );
    put(
        "controller",
        "threshold_counts",
        now.threshold_counts.into(),
        usual.threshold_counts.into(),
    );
    put("controller", "step_s", now.step_s.into(), usual.step_s.into());
    let (now, usual) = (&config.run, &shipped.run);
    put(
        "run",
        "direction",
        now.direction.name().into(),
        usual.direction.name().into(),
    );
    put(
        "run",
        "gates",
        (now.gates as i64).into(),
        (usual.gates as i64).into(),
    );
    declared
}

fn summary(name: &str, runs: &[SampledRun], driven: &[(Drive, Rows)]) -> Value {
    let run = |(run, (drive, _)): (&SampledRun, &(Drive, Rows))| {
        let (mean, deviation) = mean_and_deviation(&run.lap_times_s());
        json!({
            "run": run.run, "laps": run.laps.len(), "wanted": run.wanted,
            "lap_time_s": finite(mean), "lap_time_deviation_s": finite(deviation),
            "contact_steps": drive.contacts, "timed_out": drive.timed_out, "steps": drive.steps,
            "set_aside": run.set_aside.iter().map(|(lap, gate)| json!({ "lap": lap, "gate": gate })).collect::<Vec<_>>(),
        })
    };
    json!({ "data_set": name, "runs": runs.iter().zip(driven).map(run).collect::<Vec<_>>() })
}

/// JSON has no NaN: what is not there is null.
fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

fn text(args: &args::Drive, document: &Value) -> String {
    let mut table = Table::new(
        "",
        &[
            "run",
            "laps closed",
            "lap time, s",
            "s.d., s",
            "contacts",
            "ended",
        ],
    );
    for run in document["runs"].as_array().into_iter().flatten() {
        let seconds = |value: &Value| value.as_f64().map_or("-".into(), |s| format!("{s:.2}"));
        table.push([
            run["run"].as_str().unwrap_or("").to_owned(),
            format!("{} of {}", run["laps"], run["wanted"]),
            seconds(&run["lap_time_s"]),
            seconds(&run["lap_time_deviation_s"]),
            run["contact_steps"].to_string(),
            ending(run),
        ]);
    }
    format!(
        "{}\nwritten to {}, as {}\n",
        table.to_text(),
        args.out.display(),
        document["data_set"].as_str().unwrap_or("")
    )
}

/// How a run ended, and what became of laps that are not there.
fn ending(run: &Value) -> String {
    let missed = run["set_aside"].as_array().map_or(0, Vec::len);
    match (run["timed_out"] == true, missed) {
        (true, 0) => "timed out".into(),
        (false, 0) => "closed".into(),
        (true, _) => format!("timed out, {} missed a gate", counted(missed, "lap")),
        (false, _) => format!("{} missed a gate", counted(missed, "lap")),
    }
}
