//! Whether data are the model's, and in its units.

use anyhow::{Context, Result, ensure};
use diagnose::median;

use crate::config::Config;
use crate::dataset::{DataSet, RunFile};
use crate::laps::Measured;
use crate::setup::Setup;

/// Whether laps take about as long as the declared robot's: if not, by no effect that is worth a search, times are in another unit.
fn in_seconds(measured: &Measured, setup: &Setup) -> Result<()> {
    /// A robot that turns on the spot needs longer than the midline's length at its speed says.
    const TIMES: f64 = 5.0;
    let declared_s = setup.scene.world(&setup.model, 0)?.nominal_lap_s();
    for (run, file) in measured.runs.iter().zip(&measured.set.runs) {
        let times_s = run.lap_times_s();
        let lap_s = times_s.iter().sum::<f64>() / times_s.len() as f64;
        ensure!(
            (declared_s / TIMES..=declared_s * TIMES).contains(&lap_s),
            "{}: a lap takes {lap_s:.3} s, and the declared robot needs about {declared_s:.0} s at its speed: is t_s in seconds, \
             and controller.speed_m_s ([declared] in dataset.toml) that of this robot?",
            file.path.display()
        );
    }
    Ok(())
}

/// Whether a run has a row for each control step of the declared robot: of laps some may be missing, but none be between.
fn in_control_steps(run: &RunFile, step_s: f64) -> Result<()> {
    /// Share by which a step may be off.
    const OFF: f64 = 0.25;
    if run.rows.t_s.len() < 2 {
        return Ok(());
    }
    let usual_s = median(run.rows.t_s.windows(2).map(|pair| pair[1] - pair[0]));
    let longest_s = match run.rows.log {
        Some(_) => step_s * (1.0 + OFF),
        None => f64::INFINITY,
    };
    ensure!(
        (step_s * (1.0 - OFF)..=longest_s).contains(&usual_s),
        "{}: a row every {usual_s:.3} s, and the declared robot's control step is {step_s} s: give a row for each control step, or \
         say how long it is (controller.step_s, in [declared] of dataset.toml)",
        run.path.display()
    );
    Ok(())
}

/// Whether the runs of a data set have the times of a robot whose model it declares.
pub(super) fn is_timed(measured: &Measured, setup: &Setup) -> Result<()> {
    in_seconds(measured, setup)?;
    let step_s = setup.model.run.control_step_s;
    measured
        .set
        .runs
        .iter()
        .try_for_each(|run| in_control_steps(run, step_s))
}

/// Refuses data that are not the model's.
pub(super) fn belongs(set: &DataSet, config: &Config, world: &str) -> Result<()> {
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
