//! The experiment that would tell apart what these data do not.

use anyhow::Result;
use diagnose::{
    Answer, Explanation, Extent, LogRow, ObservedRun, Rival, TELLS_NOTHING, log_separation, separations,
};
use sim::{Controller, Setting, Stage, Step, Streams};

use super::Trace;
use super::answer::rivals;
use super::recording::{Recording, RunPlace, Seeds};
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
    /// The rivals that it tells from the answer, with standard deviations, if it is made with enough laps.
    pub(crate) fn told(&self) -> impl Iterator<Item = &(String, f64)> {
        let is_told = |(_, sigmas): &&(String, f64)| self.laps_for(*sigmas).is_some();
        self.separations.iter().filter(is_told)
    }

    /// Standard deviations between the answer and the nearest of the rivals that it tells; of all if it tells none.
    pub(crate) fn least(&self) -> f64 {
        let told = self.told().map(|(_, sigmas)| *sigmas).reduce(f64::min);
        let most = || {
            self.separations
                .iter()
                .map(|(_, sigmas)| *sigmas)
                .fold(0.0, f64::max)
        };
        told.unwrap_or_else(most)
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

    /// Laps that tell the answer from the rivals that it tells; `None` if it tells none, with as many as anyone records.
    pub(crate) fn laps_needed(&self) -> Option<usize> {
        self.laps_for(self.least())
    }

    /// Laps that tell what lies so many standard deviations apart in it.
    pub(crate) fn laps_for(&self, sigmas: f64) -> Option<usize> {
        let needed = (self.laps as f64 * (ENOUGH / sigmas).powi(2)).ceil();
        (needed <= MOST_LAPS as f64).then_some((needed as usize).max(RUNS))
    }
}

/// What to set for a lap experiment: words, and keys of the model with their values.
fn ideas(config: &Config, setup: &Setup) -> Vec<(String, Vec<(&'static str, String)>)> {
    let mut ideas = vec![("more laps as they are".to_owned(), Vec::new())];
    let driven = config.run.direction.on(&setup.scene.circuit().course);
    let backward = driven.reversed().name();
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

/// What has to be told from the explanation that is claimed: its rivals by other names and what may be there besides, the best of each
/// set of names.
pub(super) fn to_tell_from<'a>(answer: &'a Answer, claimed: &Explanation) -> Vec<&'a Explanation> {
    let mut others: Vec<&Explanation> = Vec::new();
    for rival in rivals(answer).iter().skip(1).chain(answer.further()) {
        let mut known = others.iter().copied().chain([claimed]);
        if !known.any(|other| other.names() == rival.names()) {
            others.push(rival);
        }
    }
    others
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
    let mut others = to_tell_from(&trace.answer, answer);
    others.truncate(RIVALS);
    if others.is_empty() {
        return Ok(Vec::new());
    }
    let look = |with: With| looked_at(&trace.recordings[0], with, answer, &others, seed);
    if trace.from_logs.is_none() {
        return look(With::Laps);
    }
    // Where there is a log it says more than laps, but for what it takes for the same.
    let found = look(With::Logs)?;
    if found.is_empty() {
        return look(With::LapsAlone);
    }
    Ok(found)
}

/// What is recorded in experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum With {
    /// Laps, and the robot's log too as things are.
    Laps,
    /// Laps alone.
    LapsAlone,
    /// The robot's log.
    Logs,
}

/// Experiments that would tell an answer from some of its rivals, the best first.
fn looked_at(
    recording: &Recording,
    with: With,
    answer: &Explanation,
    others: &[&Explanation],
    seed: u64,
) -> Result<Vec<Experiment>> {
    let mut found = Vec::new();
    for (name, declared) in ideas(&recording.config, &recording.setup) {
        interrupt::check()?;
        let Some(setup) = changed(recording, &declared) else {
            continue;
        };
        if with != With::Logs {
            let separations = by_laps(recording, &setup, answer, others, seed);
            found.extend(separations.map(|separations| Experiment {
                name: name.clone(),
                declared: declared.clone(),
                separations,
                laps: RUNS * LAPS,
            }));
        }
        if with == With::Logs || with == With::Laps && declared.is_empty() {
            let separations = by_logs(&setup, answer, others, seed);
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
    Ok(best_first(found))
}

/// Experiments that tell something, the best first: those that tell the answer from most rivals, and of these those that take fewest laps.
fn best_first(mut found: Vec<Experiment>) -> Vec<Experiment> {
    found.retain(|experiment| experiment.least() > TELLS_NOTHING);
    let of_a_lap = |experiment: &Experiment| experiment.least() / (experiment.laps as f64).sqrt();
    found.sort_by(|a, b| {
        let told = b.told().count().cmp(&a.told().count());
        told.then(of_a_lap(b).total_cmp(&of_a_lap(a)))
    });
    found
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
    recording: &Recording,
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
        recording.drive(setup, effects, Seeds { session: seed, set }, runs)
    };
    let rivals: Vec<Rival> = (others.iter())
        .map(|other| Rival {
            settings: first_runs(&other.settings()),
            moved: other
                .moved()
                .iter()
                .map(|settings| first_runs(settings))
                .collect(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rival_that_nothing_tells_does_not_hide_what_tells_the_others() {
        let experiment = |name: &str, laps: usize, separations: &[(&str, f64)]| Experiment {
            name: name.into(),
            declared: Vec::new(),
            separations: separations
                .iter()
                .map(|(rival, s)| ((*rival).into(), *s))
                .collect(),
            laps,
        };
        let found = best_first(vec![
            experiment("useless", 32, &[("a", 0.1), ("b", 0.0), ("c", 0.2)]),
            experiment("of two", 32, &[("a", 8.0), ("b", 0.0), ("c", 6.0)]),
            experiment("of one", 12, &[("a", 9.0), ("b", 0.1), ("c", 0.0)]),
        ]);
        let least: Vec<(&str, f64)> = found.iter().map(|e| (e.name.as_str(), e.least())).collect();
        assert_eq!(least, [("of two", 6.0), ("of one", 9.0)]);
        // 6 standard deviations of 32 laps, and 5 of (5 / 6)^2 as many.
        assert_eq!(found[0].laps_needed(), Some(23));
        assert_eq!(found[0].told().count(), 2);
    }
}
