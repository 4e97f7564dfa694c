//! The decide stage: the commands are recomputed from the logged readings, and what is left is exact.

use std::collections::BTreeMap;

use sim::{Controller, Model, Pattern, Setting, find};

use super::rows::LogRow;
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
        /// Share of the control steps that the best constants do not explain.
        share: f64,
    },
    /// No control step has both readings and commands.
    Unknown,
}

/// Largest error of a written speed, which has 5 decimals, and its standard deviation.
const SPEED_ROUNDING_M_S: f64 = 6e-6;
const SPEED_DEVIATION_M_S: f64 = 3e-6;
/// Share of the control steps that may miss by more, where a command was cut or a file was mended.
const FORGIVEN: f64 = 2e-3;
/// Relative change of a constant below which it is the declared one.
const SAME: f64 = 2e-4;

/// A control step as the controller saw it.
#[derive(Debug, Clone, Copy)]
struct Choice {
    time_s: f64,
    right_counts: f64,
    left_counts: f64,
    left_m_s: f64,
    right_m_s: f64,
}

/// What one run's log says of the controller.
#[derive(Debug)]
struct Run {
    choices: Vec<Choice>,
    /// What its readings are multiples of: 0.1 where they have one decimal.
    written_counts: f64,
}

impl Run {
    /// Largest error of a sum of three readings.
    fn sum_rounding_counts(&self) -> f64 {
        1.6 * self.written_counts
    }

    /// Standard deviation of the error of a sum of three readings.
    fn sum_deviation_counts(&self) -> f64 {
        0.5 * self.written_counts
    }
}

/// A line over time: value at the run's start and change per second.
type Line = [f64; 2];

/// One run's constants: speed V and the controller's own parameter, with the parameter's standard error.
#[derive(Debug, Clone, Copy)]
struct Constants {
    speed_m_s: Line,
    parameter: Line,
    parameter_error: f64,
    missed: f64,
}

/// The verdict over all runs.
pub(crate) fn decided(model: &Model, runs: &[&[LogRow]]) -> Decided {
    let share = beyond_limit(model, runs);
    if share > FORGIVEN {
        return Decided::NoController { share };
    }
    let runs: Vec<Run> = (runs.iter())
        .map(|rows| Run {
            choices: choices(model, rows),
            written_counts: written_counts(rows),
        })
        .collect();
    if runs.iter().all(|run| run.choices.is_empty()) {
        return Decided::Unknown;
    }
    let fit = |sloped: bool| -> Vec<Option<Constants>> {
        (runs.iter())
            .map(|run| (!run.choices.is_empty()).then(|| constants(model, run, sloped)))
            .collect()
    };
    let fits = |found: &[Option<Constants>]| found.iter().flatten().all(|run| run.missed <= FORGIVEN);
    let still = fit(false);
    let found = if fits(&still) { still } else { fit(true) };
    if !fits(&found) {
        let share = found.iter().flatten().map(|run| run.missed).fold(0.0, f64::max);
        return Decided::NoController { share };
    }
    let controller = &model.machine.controller;
    let parameter = match *controller {
        Controller::Braitenberg { gain_per_count, .. } => gain_per_count,
        Controller::RuleBased { threshold_counts, .. } => threshold_counts,
    };
    let speed = controller.speed_m_s();
    let changed: Vec<Candidate> = [
        candidate("controller-gain", &found, |run| Relative {
            line: run.parameter.map(|p| p / parameter),
            error: run.parameter_error / parameter,
        }),
        candidate("controller-speed", &found, |run| Relative {
            line: run.speed_m_s.map(|v| v / speed),
            error: SPEED_ROUNDING_M_S / speed * 0.05,
        }),
    ]
    .into_iter()
    .flatten()
    .collect();
    let in_range = |candidate: &Candidate| candidate.setting.check(0).is_ok();
    match changed.is_empty() {
        true => Decided::AsDeclared,
        // A gain or a speed a thousand times as large is another unit.
        false if !changed.iter().all(in_range) => Decided::NoController { share: 1.0 },
        false => Decided::Changed(changed),
    }
}

/// Share of the commands beyond the wheels' limit, to which every controller's commands are cut.
fn beyond_limit(model: &Model, runs: &[&[LogRow]]) -> f64 {
    let limit_m_s = model.machine.robot.wheel_speed_limit_m_s + 2e-5;
    let commanded = runs
        .iter()
        .flat_map(|rows| rows.iter())
        .filter(|row| row.commands());
    let (mut all, mut beyond) = (0.0_f64, 0.0);
    for row in commanded {
        all += 1.0;
        if row.command.left_m_s.abs().max(row.command.right_m_s.abs()) > limit_m_s {
            beyond += 1.0;
        }
    }
    beyond / all.max(1.0)
}

/// The power of ten, at most 1, that all readings of a log are multiples of.
pub(crate) fn written_counts(rows: &[LogRow]) -> f64 {
    const DECIMALS: std::ops::RangeInclusive<i32> = 0..=6;
    let all_are_multiples = |decimals: &i32| {
        let scale = 10.0_f64.powi(*decimals);
        let is_multiple = |reading: &f64| (scale * reading - (scale * reading).round()).abs() < 1e-4;
        let mut readings = rows.iter().filter_map(LogRow::read);
        readings.all(|readings| readings.iter().all(is_multiple))
    };
    let decimals = DECIMALS.clone().find(all_are_multiples);
    10.0_f64.powi(-decimals.unwrap_or(*DECIMALS.end()))
}

fn choices(model: &Model, rows: &[LogRow]) -> Vec<Choice> {
    let limit_m_s = model.machine.robot.wheel_speed_limit_m_s - 2e-5;
    (rows.iter().filter(|row| row.commands()))
        .filter_map(|row| row.read().map(|readings| (row, readings)))
        .map(|(row, s)| Choice {
            time_s: row.time_s,
            right_counts: s[0] + s[1] + s[2],
            left_counts: s[5] + s[6] + s[7],
            left_m_s: row.command.left_m_s,
            right_m_s: row.command.right_m_s,
        })
        .filter(|choice| choice.left_m_s.abs() < limit_m_s && choice.right_m_s.abs() < limit_m_s)
        .collect()
}

fn constants(model: &Model, run: &Run, sloped: bool) -> Constants {
    match model.machine.controller {
        Controller::Braitenberg { .. } => braitenberg(run, sloped),
        Controller::RuleBased { threshold_counts, .. } => rules(run, threshold_counts, sloped),
    }
}

/// V and K by least squares: the mean of the speeds is V, half their difference V K (Sl - Sr).
fn braitenberg(run: &Run, sloped: bool) -> Constants {
    let choices = &run.choices;
    let mean = line(
        choices
            .iter()
            .map(|c| (c.time_s, 1.0, 0.5 * (c.left_m_s + c.right_m_s))),
        sloped,
    );
    let difference = |c: &Choice| c.left_counts - c.right_counts;
    let product = line(
        choices
            .iter()
            .map(|c| (c.time_s, difference(c), 0.5 * (c.left_m_s - c.right_m_s))),
        sloped,
    );
    let missed = |c: &&Choice| {
        let speed = mean[0] + mean[1] * c.time_s;
        let slope = product[0] + product[1] * c.time_s;
        let turn = slope * difference(c);
        let allowed = SPEED_ROUNDING_M_S
            + 2.0 * run.sum_rounding_counts() * slope.abs()
            + 2e-4 * speed.abs() * f64::from(u8::from(sloped));
        (c.left_m_s - speed - turn)
            .abs()
            .max((c.right_m_s - speed + turn).abs())
            > allowed
    };
    let gain = product[0] / mean[0];
    let deviation_m_s =
        SPEED_DEVIATION_M_S.hypot(product[0] * std::f64::consts::SQRT_2 * run.sum_deviation_counts());
    let slope_error = deviation_m_s * error_of_slope(choices.iter().map(difference), run.written_counts);
    Constants {
        speed_m_s: mean,
        // (a + b t) / (c + d t) to first order in time.
        parameter: [gain, (product[1] - gain * mean[1]) / mean[0]],
        parameter_error: slope_error / mean[0].abs() + 1e-9 * gain.abs(),
        missed: choices.iter().filter(missed).count() as f64 / choices.len() as f64,
    }
}

/// Error of the slope of a line through the origin, where points with the same x share an error of unit
/// variance: what is rounded alike is off alike.
fn error_of_slope(x: impl Iterator<Item = f64>, written: f64) -> f64 {
    let (mut of_value, mut squares) = (BTreeMap::<i64, f64>::new(), 0.0_f64);
    for x in x {
        *of_value.entry((x / written).round() as i64).or_default() += x;
        squares += x * x;
    }
    let shared: f64 = of_value.values().map(|sum| sum * sum).sum();
    shared.sqrt() / squares.max(1e-12)
}

/// V from the speeds' size, T from between the sums that turned the robot and those that did not.
fn rules(run: &Run, declared_counts: f64, sloped: bool) -> Constants {
    let choices = &run.choices;
    let rounding_counts = 2.0 * run.sum_rounding_counts();
    let speed = line(
        choices
            .iter()
            .map(|c| (c.time_s, 1.0, 0.5 * (c.left_m_s.abs() + c.right_m_s.abs()))),
        sloped,
    );
    let bracket = |slope: f64| {
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        for c in choices {
            let (turns_left, turns_right) = (c.left_m_s < 0.0, c.right_m_s < 0.0);
            let [right, left] = [c.right_counts, c.left_counts].map(|sum| sum - slope * c.time_s);
            if turns_left {
                high = high.min(right)
            } else {
                low = low.max(right)
            }
            if !turns_left {
                if turns_right {
                    high = high.min(left)
                } else {
                    low = low.max(left)
                }
            }
        }
        (low, high)
    };
    let end_s = choices.last().map_or(1.0, |c| c.time_s.max(1.0));
    let slopes = if sloped { 400 } else { 0 };
    let slope = (-slopes..=slopes)
        .map(|i| f64::from(i) / 400.0 * declared_counts / end_s)
        .max_by(|a, b| (bracket(*a).1 - bracket(*a).0).total_cmp(&(bracket(*b).1 - bracket(*b).0)))
        .unwrap_or(0.0);
    let (low, high) = bracket(slope);
    let inside = (low - rounding_counts..=high + rounding_counts).contains(&declared_counts);
    let threshold = if inside && slope == 0.0 {
        declared_counts
    } else {
        0.5 * (low + high.min(low + 1e3))
    };
    let missed = |c: &&Choice| {
        let limit = threshold + slope * c.time_s;
        let near =
            |sum: f64| (sum - limit).abs() <= rounding_counts + 0.01 * limit * f64::from(u8::from(sloped));
        let turns_left = c.right_counts > limit;
        let turns_right = !turns_left && c.left_counts > limit;
        let size = speed[0] + speed[1] * c.time_s;
        let wrong_way = turns_left != (c.left_m_s < 0.0) || turns_right != (c.right_m_s < 0.0);
        let allowed = SPEED_ROUNDING_M_S + 2e-4 * size * f64::from(u8::from(sloped));
        let wrong_size = (c.left_m_s.abs() - size)
            .abs()
            .max((c.right_m_s.abs() - size).abs())
            > allowed;
        wrong_size || wrong_way && !near(c.right_counts) && !near(c.left_counts)
    };
    Constants {
        speed_m_s: speed,
        parameter: [threshold, slope],
        parameter_error: ((high - low) / 12.0_f64.sqrt())
            .hypot(run.sum_deviation_counts())
            .min(0.1 * declared_counts),
        missed: choices.iter().filter(missed).count() as f64 / choices.len() as f64,
    }
}

/// Least squares of y = (a + b t) x; b only if `sloped`.
fn line(points: impl Iterator<Item = (f64, f64, f64)>, sloped: bool) -> Line {
    let mut s = [0.0; 5];
    for (t, x, y) in points {
        let terms = [x * x, t * x * x, t * t * x * x, x * y, t * x * y];
        s.iter_mut().zip(terms).for_each(|(s, term)| *s += term);
    }
    let determinant = s[0] * s[2] - s[1] * s[1];
    if !sloped || determinant <= 1e-9 * s[0] * s[2] {
        return [if s[0] > 0.0 { s[3] / s[0] } else { 0.0 }, 0.0];
    }
    [
        (s[2] * s[3] - s[1] * s[4]) / determinant,
        (s[0] * s[4] - s[1] * s[3]) / determinant,
    ]
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
fn candidate(
    name: &str,
    runs: &[Option<Constants>],
    factor: impl Fn(&Constants) -> Relative,
) -> Option<Candidate> {
    /// A run's usual length, s, and the change over it that is seen.
    const RUN_S: f64 = 300.0;
    const DRIFTS: f64 = 5e-3;
    let factors: Vec<Option<Relative>> = runs.iter().map(|run| run.as_ref().map(&factor)).collect();
    let told: Vec<Relative> = factors.iter().flatten().copied().collect();
    let first = told.first()?;
    let beyond = |value: f64, error: f64| value.abs() > SAME.max(4.0 * error);
    let slopes = told.iter().any(|run| run.line[1].abs() * RUN_S > DRIFTS);
    if !slopes && !told.iter().any(|run| beyond(run.line[0] - 1.0, run.error)) {
        return None;
    }
    let mean = |i: usize| told.iter().map(|run| run.line[i]).sum::<f64>() / told.len() as f64;
    let start = mean(0);
    let differ = (told.iter()).any(|run| beyond(run.line[0] - first.line[0], 2.0 * run.error));
    let error = told.iter().map(|run| run.error).fold(0.0, f64::max);
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
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step of a rule-based controller with threshold T on sums that are written to 0.1 counts.
    fn chosen(time_s: f64, right_counts: f64, threshold_counts: f64) -> Choice {
        const SPEED_M_S: f64 = 0.05;
        let turns = right_counts > threshold_counts;
        Choice {
            time_s,
            right_counts: (right_counts * 10.0).round() / 10.0,
            left_counts: 0.0,
            left_m_s: if turns { -SPEED_M_S } else { SPEED_M_S },
            right_m_s: SPEED_M_S,
        }
    }

    #[test]
    fn a_run_without_readings_tells_nothing_of_a_factor() {
        let of = |gain: f64| {
            Some(Constants {
                speed_m_s: [0.05, 0.0],
                parameter: [gain, 0.0],
                parameter_error: 1e-6,
                missed: 0.0,
            })
        };
        let factors = |runs: &[Option<Constants>]| {
            let factor = |run: &Constants| Relative {
                line: run.parameter,
                error: run.parameter_error,
            };
            candidate("controller-gain", runs, factor).map(|found| found.setting.pattern)
        };
        assert_eq!(
            factors(&[of(1.2), None, of(1.2)]),
            Some(Pattern::Constant(vec![1.2]))
        );
        let by_run = Pattern::ByRun(vec![vec![1.25], vec![1.0], vec![1.5]]);
        assert_eq!(factors(&[None, of(1.0), of(1.5)]), Some(by_run));
        assert_eq!(factors(&[None, of(1.0)]), None);
        assert_eq!(factors(&[None]), None);
    }

    #[test]
    fn readings_that_repeat_do_not_average_their_rounding() {
        const SPEED_M_S: f64 = 0.06;
        const GAIN: f64 = 0.003;
        let rounded = |x: f64, to: f64| (x / to).round() * to;
        // Readings in steps of 141.283 counts are written as 141.3 and 282.6, and give few speeds.
        let step = |i: usize| {
            let (right, left) = ([0.0, 141.283][i % 2], [141.283, 282.566, 0.0][i % 3]);
            let turn = SPEED_M_S * GAIN * (left - right);
            Choice {
                time_s: 0.064 * i as f64,
                right_counts: rounded(right, 0.1),
                left_counts: rounded(left, 0.1),
                left_m_s: rounded(SPEED_M_S + turn, 1e-5),
                right_m_s: rounded(SPEED_M_S - turn, 1e-5),
            }
        };
        let run = Run {
            choices: (0..6000).map(step).collect(),
            written_counts: 0.1,
        };
        let found = braitenberg(&run, false);
        let off = (found.parameter[0] - GAIN).abs();
        assert!(off > 1e-5 * GAIN, "rounding is to be seen: {found:?}");
        assert!(off < 3.0 * found.parameter_error, "{found:?}");
        assert!(found.parameter_error < 1e-3 * GAIN, "{found:?}");
    }

    #[test]
    fn a_threshold_is_no_better_known_than_the_readings_are_written() {
        const THRESHOLD: f64 = 410.02;
        let sums = [409.97, 410.03, 400.0, 420.0];
        let run = Run {
            choices: (sums.iter().enumerate())
                .map(|(i, sum)| chosen(0.064 * i as f64, *sum, THRESHOLD))
                .collect(),
            written_counts: 0.1,
        };
        let found = rules(&run, 300.0, false);
        // Both sums next to the threshold are written as 410.0.
        assert!((found.parameter[0] - 410.0).abs() < 1e-9, "{found:?}");
        assert!(found.parameter_error >= run.sum_deviation_counts(), "{found:?}");
        assert_eq!(found.missed, 0.0);
    }
}
