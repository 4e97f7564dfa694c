//! The experiment that would tell apart what these data do not.

use anyhow::Result;
use diagnose::{Explanation, Extent, LogRow, ObservedRun, Rival, log_separation, separations};
use sim::{Controller, Setting, Stage, Step, Streams};

use super::Trace;
use super::answer::rivals;
use super::recording::{Recording, RunPlace, Seeds};
use super::tapes::Tapes;
use crate::config::Config;
use crate::interrupt;
use crate::setup::Setup;

/// Shape of the data set that an experiment is judged by.
const RUNS: usize = 4;
const LAPS: usize = 8;
/// Laps of each run with the robot's log: logs say more.
const LOGGED_LAPS: usize = 3;
/// Standard deviations at which two explanations are told apart.
const ENOUGH: f64 = 5.0;
/// Standard deviations that stand for certainty.
const CERTAIN: f64 = 1e3;
/// Laps that are more than anyone records.
pub(super) const MOST_LAPS: usize = 1000;
/// Rivals that are looked at.
const RIVALS: usize = 3;

/// An experiment that has not been made.
#[derive(Debug, Clone)]
pub(crate) struct Experiment {
    /// What to do, in words.
    pub(crate) name: String,
    /// Keys of the model to set for it, as `[declared]` names them.
    pub(crate) declared: Vec<(&'static str, String)>,
    /// Rival by rival: name, and standard deviations between its laps and the answer's.
    pub(crate) separations: Vec<(String, f64)>,
    /// Laps that a data set of these standard deviations has.
    pub(crate) laps: usize,
}

impl Experiment {
    /// Standard deviations between the answer and the rival that is nearest to it.
    pub(crate) fn least(&self) -> f64 {
        self.separations
            .iter()
            .map(|(_, s)| *s)
            .fold(f64::INFINITY, f64::min)
    }

    /// What it is expected to tell, in words.
    pub(crate) fn expectation(&self) -> String {
        if self.least() >= CERTAIN {
            format!("certain with {} laps", self.laps)
        } else {
            format!(
                "{:.1} standard deviations expected of {} laps",
                self.least(),
                self.laps
            )
        }
    }

    /// Laps that tell the answer from every rival; `None` if that would take too many.
    pub(crate) fn laps_needed(&self) -> Option<usize> {
        let needed = (self.laps as f64 * (ENOUGH / self.least()).powi(2)).ceil();
        (needed <= MOST_LAPS as f64).then_some((needed as usize).max(RUNS))
    }
}

/// What to set for a lap experiment: words, and keys of the model with their values.
fn ideas(config: &Config, setup: &Setup) -> Vec<(String, Vec<(&'static str, String)>)> {
    let mut ideas = vec![("more laps as they are".to_owned(), Vec::new())];
    let backward = match config.run.direction {
        crate::config::Direction::Clockwise => "counter-clockwise",
        crate::config::Direction::CounterClockwise => "clockwise",
    };
    ideas.push((
        format!("{backward} laps"),
        vec![("run.direction", backward.to_owned())],
    ));
    let (gain_key, gain) = match setup.model.machine.controller {
        Controller::Braitenberg { gain_per_count, .. } => ("controller.gain_per_count", 2.0 * gain_per_count),
        Controller::RuleBased { threshold_counts, .. } => {
            ("controller.threshold_counts", 0.6 * threshold_counts)
        }
    };
    ideas.push((
        format!("laps with {gain_key} = {gain}"),
        vec![(gain_key, gain.to_string())],
    ));
    let speed = 0.6 * setup.model.machine.controller.speed_m_s();
    ideas.push((
        format!("laps with controller.speed_m_s = {speed}"),
        vec![("controller.speed_m_s", speed.to_string())],
    ));
    ideas
}

/// Experiments that would tell the answer from its rivals, and from what may be there besides, the best first; none where nothing
/// has to be told apart.
///
/// # Errors
/// Interrupted.
pub(crate) fn experiments(trace: &Trace, seed: u64) -> Result<Vec<Experiment>> {
    let Some(answer) = trace.answer.claimed() else {
        return Ok(Vec::new());
    };
    let mut others: Vec<&Explanation> = Vec::new();
    for rival in (rivals(&trace.answer).iter().skip(1)).chain(trace.answer.further()) {
        let known = others
            .iter()
            .chain([&answer])
            .any(|other| other.names() == rival.names());
        if !known && others.len() < RIVALS {
            others.push(rival);
        }
    }
    if others.is_empty() {
        return Ok(Vec::new());
    }
    let recording = &trace.recordings[0];
    let mut found = Vec::new();
    for (name, declared) in ideas(&recording.config, &recording.setup) {
        interrupt::check()?;
        let Some(setup) = changed(recording, &declared) else {
            continue;
        };
        if trace.from_logs.is_none() {
            let separations = by_laps(&setup, answer, &others, seed);
            found.extend(separations.map(|separations| Experiment {
                name: name.clone(),
                declared: declared.clone(),
                separations,
                laps: RUNS * LAPS,
            }));
        }
        // The robot's log is worth having with the laps as they are, and where there is one it says more than laps.
        if declared.is_empty() || trace.from_logs.is_some() {
            let separations = by_logs(&setup, answer, &others, seed);
            found.extend(separations.map(|separations| Experiment {
                name: format!("{name}, with the robot's log of readings and commands"),
                declared,
                separations,
                laps: RUNS * LOGGED_LAPS,
            }));
        }
    }
    // Interrupted, the last one came to nothing.
    interrupt::check()?;
    found.retain(|experiment| experiment.least() > 0.3);
    found.sort_by(|a, b| {
        (b.least() / (b.laps as f64).sqrt()).total_cmp(&(a.least() / (a.laps as f64).sqrt()))
    });
    Ok(found)
}

/// The declared model with some keys set otherwise; `None` if it cannot drive so.
fn changed(recording: &Recording, declared: &[(&'static str, String)]) -> Option<Setup> {
    let mut config = recording.config.clone();
    for (key, value) in declared {
        config = config.with(key, value).ok()?;
    }
    let mut setup = Setup::new(&config, recording.measured.circuit.clone(), None).ok()?;
    setup.see_in_steps(recording.written_m);
    Some(setup)
}

fn by_laps(
    setup: &Setup,
    answer: &Explanation,
    others: &[&Explanation],
    seed: u64,
) -> Option<Vec<(String, f64)>> {
    let simulate = |effects: &[Setting], set: u64, _: Extent| -> Option<Vec<ObservedRun>> {
        let anywhere = |number| RunPlace {
            number,
            start: None,
            unseen: None,
            begins: true,
        };
        let runs = (0..RUNS).map(|run| (LAPS, anywhere(run)));
        Recording::drive(setup, effects, Seeds { session: seed, set }, &Tapes::NONE, runs)
    };
    let rivals: Vec<Rival> = (others.iter())
        .map(|other| Rival {
            settings: first_runs(&other.settings()),
            relative_error: other.effects[0].relative_error(),
        })
        .collect();
    let found = separations(&simulate, &first_runs(&answer.settings()), &rivals)?;
    // A rival with which the robot crashes is told apart by the first lap.
    let found = found.into_iter().map(|sigmas| sigmas.unwrap_or(CERTAIN));
    Some(named(others, found.collect()))
}

/// `None` if logs cannot be simulated, or followed: what they would tell is not known.
fn by_logs(
    setup: &Setup,
    answer: &Explanation,
    others: &[&Explanation],
    seed: u64,
) -> Option<Vec<(String, f64)>> {
    let rows = logs(setup, &first_runs(&answer.settings()), seed)?;
    let runs: Vec<&[LogRow]> = rows.iter().map(Vec::as_slice).collect();
    // Commands follow from readings exactly: a log tells at once whether it is the controller.
    let decides = |e: &Explanation| e.effects.iter().any(|c| c.stage() == Stage::Decide);
    let separation = |other: &&Explanation| {
        if decides(answer) != decides(other) {
            return Some(CERTAIN);
        }
        let [answer, other] = [answer, *other].map(|e| first_runs(&e.settings()));
        log_separation(&setup.model, &setup.scene, &runs, &answer, &other)
    };
    let found = others.iter().map(separation).collect::<Option<_>>()?;
    Some(named(others, found))
}

fn named(others: &[&Explanation], found: Vec<f64>) -> Vec<(String, f64)> {
    let name = |other: &&Explanation| other.names().join(" + ");
    others.iter().map(name).zip(found).collect()
}

/// Simulated logs of a robot with effects.
fn logs(setup: &Setup, effects: &[Setting], seed: u64) -> Option<Vec<Vec<LogRow>>> {
    let mut model = setup.model.clone();
    model.effects.extend_from_slice(effects);
    let run = |run: usize| {
        let world = setup.scene.world(&model, run).ok()?;
        let streams = Streams {
            seed: (seed << 20) + (1 << 51),
            run: run as u64,
        };
        let mut rows = Vec::new();
        let record = |step: &Step| rows.push(LogRow::from(*step));
        let drive = sim::drive(&world, streams, LOGGED_LAPS, record).ok()?;
        (drive.laps.len() == LOGGED_LAPS).then_some(rows)
    };
    (0..RUNS).map(run).collect()
}

/// Effects for the four runs of an experiment: sizes by run go round.
fn first_runs(settings: &[Setting]) -> Vec<Setting> {
    let fitted = |setting: &Setting| match &setting.pattern {
        sim::Pattern::ByRun(values) => Setting {
            spec: setting.spec,
            pattern: sim::Pattern::ByRun((0..RUNS).map(|run| values[run % values.len()].clone()).collect()),
        },
        _ => setting.clone(),
    };
    settings.iter().map(fitted).collect()
}
