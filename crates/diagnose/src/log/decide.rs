//! The decide stage: the commands are recomputed from the logged readings, and what is left is exact.

use std::collections::BTreeMap;

use sim::{Controller, Pattern, Setting, find};

use super::controller::{AT_LIMIT_M_S, Constants, FORGIVEN, Line, constants_by_run};
use super::rows::LoggedRun;
use crate::Candidate;
use crate::candidate::{OfRun, filled};

/// What the logged commands say of the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Decided {
    /// The declared controller gives the logged commands from the logged readings.
    AsDeclared,
    /// The declared controller gives them with other constants.
    Changed(Vec<Candidate>),
    /// No controller of this kind gives them: a wrong unit, another controller, or an effect that has no name.
    NoController {
        /// Share of the control steps that the best constants do not explain, of the run in which that is most.
        share: f64,
        /// The runs in which it is too much.
        runs: Vec<usize>,
    },
    /// No control step has both readings and commands.
    Unknown,
}

/// Relative change of a constant below which it is the declared one.
const SAME: f64 = 2e-4;

/// The verdict with what goes with it.
#[derive(Debug)]
pub(crate) struct Decision {
    pub(crate) decided: Decided,
    /// What the constants are without what each run tells.
    pub(crate) without: Vec<Vec<Setting>>,
    /// The rows of each run that it does not hold for: single ones that were spoilt after the robot had driven by them.
    pub(crate) spoilt: Vec<Vec<usize>>,
}

/// The verdict over all runs.
pub(crate) fn decision(runs: &[LoggedRun<'_>]) -> Decision {
    let found = constants_by_run(runs);
    let declared: Vec<Controller> = runs.iter().map(|run| run.model.machine.controller).collect();
    let beyond: Vec<f64> = runs.iter().map(beyond_limit).collect();
    let decided = no_controller(&beyond).unwrap_or_else(|| decided(&declared, &found));
    let holds = matches!(decided, Decided::AsDeclared | Decided::Changed(_));
    let without = |run: usize| -> Vec<Setting> {
        let mut others = found.clone();
        others[run] = None;
        let changed = changed(&declared, &others);
        changed.into_iter().map(|effect| effect.setting).collect()
    };
    let spoilt = |run: Option<Constants>| run.filter(|_| holds).map_or_else(Vec::new, |run| run.spoilt);
    Decision {
        without: (0..runs.len()).map(without).collect(),
        decided,
        spoilt: found.into_iter().map(spoilt).collect(),
    }
}

/// That no controller gives the commands of runs of which it misses these shares; `None` if it misses hardly any.
fn no_controller(missed: &[f64]) -> Option<Decided> {
    let share = missed.iter().copied().fold(0.0, f64::max);
    let runs = (0..missed.len()).filter(|&run| missed[run] > FORGIVEN).collect();
    (share > FORGIVEN).then_some(Decided::NoController { share, runs })
}

/// The verdict on runs whose declared controllers are these.
fn decided(declared: &[Controller], found: &[Option<Constants>]) -> Decided {
    if found.iter().all(Option::is_none) {
        return Decided::Unknown;
    }
    let missed = |run: &Option<Constants>| run.as_ref().map_or(0.0, |run| run.missed);
    let missed: Vec<f64> = found.iter().map(missed).collect();
    if let Some(none) = no_controller(&missed) {
        return none;
    }
    let changed = changed(declared, found);
    // A gain or a speed a thousand times as large is another unit, and one below 0 another order of columns.
    let in_range = |run: &usize| {
        let of_run = |candidate: &Candidate| {
            let spec = candidate.setting.spec;
            let value = candidate
                .setting
                .values(0, *run)
                .map(|(values, _)| Setting::constant(spec, values));
            value.is_ok_and(|value| value.check(0).is_ok())
        };
        changed.iter().all(of_run)
    };
    let told = (0..found.len()).filter(|&run| found[run].is_some());
    let wrong: Vec<usize> = told.filter(|run| !in_range(run)).collect();
    match (wrong.is_empty(), changed.is_empty()) {
        (false, _) => Decided::NoController {
            share: 1.0,
            runs: wrong,
        },
        (true, true) => Decided::AsDeclared,
        (true, false) => Decided::Changed(changed),
    }
}

/// The constants that are not the declared ones.
fn changed(declared: &[Controller], found: &[Option<Constants>]) -> Vec<Candidate> {
    let relative = |factor: fn(&Controller, &Constants) -> Relative| -> Vec<Option<Relative>> {
        let of_run =
            |(declared, run): (&Controller, &Option<Constants>)| Some(factor(declared, run.as_ref()?));
        declared.iter().zip(found).map(of_run).collect()
    };
    let gains = relative(|declared, run| {
        let parameter = match *declared {
            Controller::Braitenberg { gain_per_count, .. } => gain_per_count,
            Controller::RuleBased { threshold_counts, .. } => threshold_counts,
        };
        Relative {
            line: run.parameter.map(|p| p / parameter),
            error: run.parameter_error / parameter,
        }
    });
    let speeds = relative(|declared, run| {
        let speed = declared.speed_m_s();
        Relative {
            line: run.speed_m_s.map(|v| v / speed),
            error: run.speed_error_m_s / speed,
        }
    });
    let candidates = [
        candidate("controller-gain", &gains),
        candidate("controller-speed", &speeds),
    ];
    candidates.into_iter().flatten().collect()
}

/// Share of a run's commands beyond the wheels' limit, to which every controller's commands are cut.
fn beyond_limit(LoggedRun { model, rows }: &LoggedRun<'_>) -> f64 {
    let limit_m_s = model.machine.robot.wheel_speed_limit_m_s + AT_LIMIT_M_S;
    let (mut all, mut beyond) = (0.0_f64, 0.0);
    for row in rows.iter().filter(|row| row.commands()) {
        all += 1.0;
        if row.command.left_m_s.abs().max(row.command.right_m_s.abs()) > limit_m_s {
            beyond += 1.0;
        }
    }
    beyond / all.max(1.0)
}

/// A run's constant relative to the declared one.
#[derive(Debug, Clone, Copy)]
struct Relative {
    line: Line,
    /// Standard error at the run's start.
    error: f64,
}

/// The effect with its factor as it goes over the runs; `None` where it is 1 in all of them. A run of which the log tells nothing
/// has the mean of the others'.
fn candidate(name: &str, factors: &[Option<Relative>]) -> Option<Candidate> {
    /// A run's usual length, s, and the change over it that is seen.
    const RUN_S: f64 = 300.0;
    const DRIFTS: f64 = 5e-3;
    let told: Vec<Relative> = factors.iter().flatten().copied().collect();
    let best = *told.iter().min_by(|a, b| a.error.total_cmp(&b.error))?;
    let beyond = |value: f64, error: f64| value.abs() > SAME.max(4.0 * error);
    let slopes = told.iter().any(|run| run.line[1].abs() * RUN_S > DRIFTS);
    if !slopes && !told.iter().any(|run| beyond(run.line[0] - 1.0, run.error)) {
        return None;
    }
    let weight = |run: &Relative| run.error.max(f64::MIN_POSITIVE.sqrt()).powi(-2);
    let weights: f64 = told.iter().map(weight).sum();
    let mean = |i: usize| told.iter().map(|run| weight(run) * run.line[i]).sum::<f64>() / weights;
    let start = mean(0);
    let differ =
        (told.iter()).any(|run| beyond(run.line[0] - best.line[0], 2.0 * run.error.hypot(best.error)));
    // What is rounded alike is off alike in all runs.
    let error = best.error;
    let spec = find(name).ok()?;
    let (pattern, standard_errors) = if slopes {
        (
            Pattern::ByTime {
                start: vec![start],
                per_s: vec![mean(1)],
            },
            vec![error, error / RUN_S],
        )
    } else if differ {
        let of_run = |run: &Relative| OfRun {
            values: vec![run.line[0]],
            errors: vec![run.error],
        };
        let runs: Vec<Option<OfRun>> = factors.iter().map(|run| run.as_ref().map(of_run)).collect();
        let (values, errors) = filled(&runs)?;
        (Pattern::ByRun(values), errors)
    } else {
        (Pattern::Constant(vec![start]), vec![error])
    };
    let fitted = standard_errors.len();
    Some(Candidate {
        setting: Setting { spec, pattern },
        standard_errors,
        intervals: BTreeMap::new(),
        gain: f64::INFINITY,
        fitted,
        weight: 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_without_readings_tells_nothing_of_a_factor() {
        let of = |gain: f64| {
            Some(Relative {
                line: [gain, 0.0],
                error: 1e-6,
            })
        };
        let factors =
            |runs: &[Option<Relative>]| candidate("controller-gain", runs).map(|found| found.setting.pattern);
        assert_eq!(
            factors(&[of(1.2), None, of(1.2)]),
            Some(Pattern::Constant(vec![1.2]))
        );
        let by_run = Pattern::ByRun(vec![vec![1.25], vec![1.0], vec![1.5]]);
        assert_eq!(factors(&[None, of(1.0), of(1.5)]), Some(by_run));
        assert_eq!(factors(&[None, of(1.0)]), None);
        assert_eq!(factors(&[None]), None);
    }
}
