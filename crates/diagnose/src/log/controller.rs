//! The constants of a controller, from the commands that it gave for readings.

use std::collections::{BTreeMap, BTreeSet};

use sim::{Controller, Model};

use super::rows::{LogRow, LoggedRun};
use super::steps::written_counts;
use crate::outlying::median;

/// Largest error of a speed that is written with 5 decimals; its standard deviation is about half of that.
const SPEED_ROUNDING_M_S: f64 = 6e-6;
/// How near the wheels' limit a written command is at it, m/s.
pub(crate) const AT_LIMIT_M_S: f64 = 2e-5;
/// Share of the control steps that may miss by more, where a command was cut or a file was mended.
pub(crate) const FORGIVEN: f64 = 2e-3;

/// A control step as the controller saw it.
#[derive(Debug, Clone, Copy)]
struct Choice {
    row: usize,
    time_s: f64,
    right_counts: f64,
    left_counts: f64,
    left_m_s: f64,
    right_m_s: f64,
}

/// What one run's log says of the controller.
#[derive(Debug)]
struct Run {
    declared: Controller,
    choices: Vec<Choice>,
    /// What its readings are multiples of: 0.1 where they have one decimal.
    written_counts: f64,
    /// What its commands are multiples of, if they are coarser than with 5 decimals.
    written_m_s: f64,
}

impl Run {
    fn new(LoggedRun { model, rows }: &LoggedRun<'_>) -> Self {
        let choices = choices(model, rows);
        Self {
            declared: model.machine.controller,
            written_m_s: written_m_s(&choices),
            written_counts: written_counts(rows),
            choices,
        }
    }

    /// Largest error of a written command.
    fn speed_rounding_m_s(&self) -> f64 {
        SPEED_ROUNDING_M_S.max(0.6 * self.written_m_s)
    }

    /// Standard error of V: roundings of commands that repeat are no independent errors.
    fn speed_error_m_s(&self) -> f64 {
        const OF_ONE: f64 = 0.05;
        OF_ONE * self.speed_rounding_m_s()
    }

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
pub(crate) type Line = [f64; 2];

/// One run's constants: speed V and the controller's own parameter, with their standard errors.
#[derive(Debug, Clone)]
pub(crate) struct Constants {
    pub(crate) speed_m_s: Line,
    pub(crate) speed_error_m_s: f64,
    pub(crate) parameter: Line,
    pub(crate) parameter_error: f64,
    /// Share of the choices that they do not explain.
    pub(crate) missed: f64,
    /// Rows, few, that are far off and were left out.
    pub(crate) spoilt: Vec<usize>,
}

/// The constants by each run's log, changing in time only if they explain the logs in no other way; `None` where a log tells
/// nothing.
pub(crate) fn constants_by_run(runs: &[LoggedRun<'_>]) -> Vec<Option<Constants>> {
    let runs: Vec<Run> = runs.iter().map(Run::new).collect();
    let fit = |sloped: bool| -> Vec<Option<Constants>> {
        (runs.iter())
            .map(|run| (!run.choices.is_empty()).then(|| constants(run, sloped)))
            .collect()
    };
    let still = fit(false);
    if most_missed(&still) <= FORGIVEN {
        still
    } else {
        fit(true)
    }
}

/// The largest share of a run's choices that its constants do not explain.
fn most_missed(runs: &[Option<Constants>]) -> f64 {
    runs.iter().flatten().map(|run| run.missed).fold(0.0, f64::max)
}

/// The power of ten, from 5 to 2 decimals, that all commands are multiples of; 5 where they have too few values to tell.
fn written_m_s(choices: &[Choice]) -> f64 {
    const FINEST: i32 = 5;
    const COARSEST: i32 = 2;
    const VALUES: usize = 12;
    let unit = |decimals: i32| 10.0_f64.powi(-decimals);
    let in_units = |decimals: i32| {
        let of_choice = move |c: &Choice| [c.left_m_s, c.right_m_s].map(|speed| speed / unit(decimals));
        choices.iter().flat_map(of_choice)
    };
    let values: BTreeSet<i64> = in_units(FINEST).map(|speed| speed.round() as i64).collect();
    let is_multiple = |speed: f64| (speed - speed.round()).abs() < 1e-4;
    let holds = |&decimals: &i32| in_units(decimals).all(is_multiple);
    let decimals = (COARSEST..FINEST).find(holds).filter(|_| values.len() > VALUES);
    unit(decimals.unwrap_or(FINEST))
}

fn choices(model: &Model, rows: &[LogRow]) -> Vec<Choice> {
    let limit_m_s = model.machine.robot.wheel_speed_limit_m_s - AT_LIMIT_M_S;
    let decides = |logged: &LogRow| {
        // The controllers do not look behind.
        let (right, left) = (&logged.readings[..3], &logged.readings[5..]);
        logged.commands() && right.iter().chain(left).all(|reading| reading.is_finite())
    };
    (rows.iter().enumerate().filter(|(_, logged)| decides(logged)))
        .map(|(row, logged)| Choice {
            row,
            time_s: logged.time_s,
            right_counts: logged.readings[..3].iter().sum(),
            left_counts: logged.readings[5..].iter().sum(),
            left_m_s: logged.command.left_m_s,
            right_m_s: logged.command.right_m_s,
        })
        .filter(|choice| choice.left_m_s.abs() < limit_m_s && choice.right_m_s.abs() < limit_m_s)
        .collect()
}

fn constants(run: &Run, sloped: bool) -> Constants {
    match run.declared {
        Controller::Braitenberg { .. } => braitenberg(run, sloped),
        Controller::RuleBased { threshold_counts, .. } => rules(run, threshold_counts, sloped),
    }
}

/// The choices but for those that are far off what is fitted to the others, to begin with by medians: one of them would decide
/// least squares.
fn near<F>(
    choices: &[Choice],
    begin: F,
    fit: impl Fn(&[Choice]) -> F,
    off: impl Fn(&F, &Choice) -> f64,
) -> Vec<Choice> {
    /// Times what half of the choices are off, or a rounding.
    const FAR: f64 = 20.0;
    const ROUNDS: usize = 5;
    let mut fitted = begin;
    let mut kept: Vec<Choice> = Vec::new();
    for _ in 0..ROUNDS {
        let offs: Vec<f64> = choices.iter().map(|choice| off(&fitted, choice)).collect();
        let most = FAR * median(offs.iter().copied()).max(SPEED_ROUNDING_M_S);
        let pairs = choices.iter().zip(&offs).filter(|(_, off)| **off <= most);
        let next: Vec<Choice> = pairs.map(|(choice, _)| *choice).collect();
        let same = next.len() == kept.len();
        kept = next;
        if same {
            break;
        }
        fitted = fit(&kept);
    }
    kept
}

/// The share of a run's choices that constants miss, without those that are not near where these are few, and then their rows.
fn missed(run: &Run, near: &[Choice], is_missed: impl Fn(&Choice) -> bool) -> (f64, Vec<usize>) {
    /// Share of the choices that may be spoilt.
    const FEW: f64 = 5e-3;
    let share = |choices: &[Choice]| {
        choices.iter().filter(|choice| is_missed(choice)).count() as f64 / choices.len() as f64
    };
    if ((run.choices.len() - near.len()) as f64) > FEW * run.choices.len() as f64 {
        return (share(&run.choices), Vec::new());
    }
    let kept: BTreeSet<usize> = near.iter().map(|choice| choice.row).collect();
    let rows = run.choices.iter().map(|choice| choice.row);
    (share(near), rows.filter(|row| !kept.contains(row)).collect())
}

/// V and K by least squares: the mean of the speeds is V, half their difference V K (Sl - Sr).
fn braitenberg(run: &Run, sloped: bool) -> Constants {
    let difference = |c: &Choice| c.left_counts - c.right_counts;
    let fit = |choices: &[Choice]| -> [Line; 2] {
        let mean = |c: &Choice| (c.time_s, 1.0, 0.5 * (c.left_m_s + c.right_m_s));
        let turn = |c: &Choice| (c.time_s, difference(c), 0.5 * (c.left_m_s - c.right_m_s));
        [
            line(choices.iter().map(mean), sloped),
            line(choices.iter().map(turn), sloped),
        ]
    };
    let off = |[mean, product]: &[Line; 2], c: &Choice| {
        let speed = mean[0] + mean[1] * c.time_s;
        let turn = (product[0] + product[1] * c.time_s) * difference(c);
        (c.left_m_s - speed - turn)
            .abs()
            .max((c.right_m_s - speed + turn).abs())
    };
    let choices = &near(&run.choices, by_medians(&run.choices), fit, off);
    let [mean, product] = fit(choices);
    let (missed, spoilt) = missed(run, choices, |c| {
        let speed = mean[0] + mean[1] * c.time_s;
        let slope = product[0] + product[1] * c.time_s;
        let allowed = run.speed_rounding_m_s()
            + 2.0 * run.sum_rounding_counts() * slope.abs()
            + 2e-4 * speed.abs() * f64::from(u8::from(sloped));
        off(&[mean, product], c) > allowed
    });
    let gain = product[0] / mean[0];
    let deviation_m_s = (0.5 * run.speed_rounding_m_s())
        .hypot(product[0] * std::f64::consts::SQRT_2 * run.sum_deviation_counts());
    let slope_error = deviation_m_s * error_of_slope(choices.iter().map(difference), run.written_counts);
    Constants {
        speed_m_s: mean,
        speed_error_m_s: run.speed_error_m_s(),
        // (a + b t) / (c + d t) to first order in time.
        parameter: [gain, (product[1] - gain * mean[1]) / mean[0]],
        parameter_error: slope_error / mean[0].abs() + 1e-9 * gain.abs(),
        missed,
        spoilt,
    }
}

/// V and K by the medians of what single choices say: not exact where they go over time, but never far off.
fn by_medians(choices: &[Choice]) -> [Line; 2] {
    let difference = |c: &Choice| c.left_counts - c.right_counts;
    let usual = median(choices.iter().map(|c| difference(c).abs()));
    let telling = choices.iter().filter(|c| difference(c).abs() >= usual.max(1e-9));
    let turn = |c: &Choice| 0.5 * (c.left_m_s - c.right_m_s) / difference(c);
    [
        [
            median(choices.iter().map(|c| 0.5 * (c.left_m_s + c.right_m_s))),
            0.0,
        ],
        [median(telling.map(turn)), 0.0],
    ]
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
    let rounding_counts = 2.0 * run.sum_rounding_counts();
    let fit = |choices: &[Choice]| -> Line {
        let size = |c: &Choice| (c.time_s, 1.0, 0.5 * (c.left_m_s.abs() + c.right_m_s.abs()));
        line(choices.iter().map(size), sloped)
    };
    let off = |speed: &Line, c: &Choice| {
        let size = speed[0] + speed[1] * c.time_s;
        (c.left_m_s.abs() - size)
            .abs()
            .max((c.right_m_s.abs() - size).abs())
    };
    let usual = median((run.choices.iter()).map(|c| 0.5 * (c.left_m_s.abs() + c.right_m_s.abs())));
    let choices = near(&run.choices, [usual, 0.0], fit, off);
    let speed = fit(&choices);
    let choices = &without_wrong_turns(&choices, rounding_counts);
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
    let (missed, spoilt) = missed(run, choices, |c| {
        let limit = threshold + slope * c.time_s;
        let near =
            |sum: f64| (sum - limit).abs() <= rounding_counts + 0.01 * limit * f64::from(u8::from(sloped));
        let turns_left = c.right_counts > limit;
        let turns_right = !turns_left && c.left_counts > limit;
        let size = speed[0] + speed[1] * c.time_s;
        let wrong_way = turns_left != (c.left_m_s < 0.0) || turns_right != (c.right_m_s < 0.0);
        let allowed = run.speed_rounding_m_s() + 2e-4 * size * f64::from(u8::from(sloped));
        let wrong_size = off(&speed, c) > allowed;
        wrong_size || wrong_way && !near(c.right_counts) && !near(c.left_counts)
    });
    Constants {
        speed_m_s: speed,
        speed_error_m_s: run.speed_error_m_s(),
        parameter: [threshold, slope],
        parameter_error: ((high - low) / 12.0_f64.sqrt())
            .hypot(run.sum_deviation_counts())
            .min(0.1 * declared_counts),
        missed,
        spoilt,
    }
}

/// The choices without those in which the robot turned, or did not, against what most say of the threshold.
fn without_wrong_turns(choices: &[Choice], rounding_counts: f64) -> Vec<Choice> {
    // Each sum that the rules look at, and whether it was found to be above the threshold.
    let sums = |c: &Choice| {
        let (turns_left, turns_right) = (c.left_m_s < 0.0, c.right_m_s < 0.0);
        let right = (c.right_counts, turns_left);
        [Some(right), (!turns_left).then_some((c.left_counts, turns_right))]
    };
    let mut all: Vec<(f64, bool)> = choices.iter().flat_map(sums).flatten().collect();
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    // With the threshold above so many of them: those below that were found above, and those above that were found below.
    let mut wrong = all.iter().filter(|(_, above)| !above).count();
    let (mut least, mut limit) = (wrong, f64::NEG_INFINITY);
    for &(sum, above) in &all {
        if above {
            wrong += 1;
        } else {
            wrong -= 1;
        }
        if wrong < least {
            (least, limit) = (wrong, sum);
        }
    }
    let contradicts =
        |(sum, above): (f64, bool)| (sum > limit) != above && (sum - limit).abs() > rounding_counts;
    let holds = |c: &&Choice| !sums(c).into_iter().flatten().any(contradicts);
    choices.iter().filter(holds).copied().collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    const BRAITENBERG: Controller = Controller::Braitenberg {
        speed_m_s: 0.06,
        gain_per_count: 0.003,
    };
    const RULES: Controller = Controller::RuleBased {
        speed_m_s: 0.05,
        threshold_counts: 300.0,
    };

    /// A step of a rule-based controller with threshold T on sums that are written to 0.1 counts.
    fn chosen(time_s: f64, right_counts: f64, threshold_counts: f64) -> Choice {
        const SPEED_M_S: f64 = 0.05;
        let turns = right_counts > threshold_counts;
        Choice {
            row: 0,
            time_s,
            right_counts: (right_counts * 10.0).round() / 10.0,
            left_counts: 0.0,
            left_m_s: if turns { -SPEED_M_S } else { SPEED_M_S },
            right_m_s: SPEED_M_S,
        }
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
                row: i,
                time_s: 0.064 * i as f64,
                right_counts: rounded(right, 0.1),
                left_counts: rounded(left, 0.1),
                left_m_s: rounded(SPEED_M_S + turn, 1e-5),
                right_m_s: rounded(SPEED_M_S - turn, 1e-5),
            }
        };
        let run = Run {
            declared: BRAITENBERG,
            choices: (0..6000).map(step).collect(),
            written_counts: 0.1,
            written_m_s: 1e-5,
        };
        let found = braitenberg(&run, false);
        let off = (found.parameter[0] - GAIN).abs();
        assert!(off > 1e-5 * GAIN, "rounding is to be seen: {found:?}");
        assert!(off < 3.0 * found.parameter_error, "{found:?}");
        assert!(found.parameter_error < 1e-3 * GAIN, "{found:?}");
    }

    /// Steps of a reactive controller, whose readings and commands are written exactly.
    fn reactive(gain: f64, steps: usize) -> Run {
        let step = |i: usize| {
            let time_s = 0.064 * i as f64;
            let (right, left) = (150.0 + 140.0 * time_s.sin(), 150.0 + 140.0 * (1.3 * time_s).cos());
            let turn = 0.05 * gain * (left - right);
            Choice {
                row: i,
                time_s,
                right_counts: right,
                left_counts: left,
                left_m_s: 0.05 + turn,
                right_m_s: 0.05 - turn,
            }
        };
        Run {
            declared: BRAITENBERG,
            choices: (0..steps).map(step).collect(),
            written_counts: 0.1,
            written_m_s: 1e-5,
        }
    }

    #[test]
    fn single_rows_that_were_spoilt_do_not_decide_the_constants() {
        const GAIN: f64 = 0.003;
        for sloped in [false, true] {
            let mut run = reactive(GAIN, 4000);
            run.choices[700].right_counts = 3000.0;
            run.choices[1800].left_m_s = 0.1;
            let found = braitenberg(&run, sloped);
            assert_eq!(found.spoilt, [700, 1800]);
            assert!((found.parameter[0] / GAIN - 1.0).abs() < 1e-6, "{found:?}");
            assert!(found.missed <= FORGIVEN);
        }
        // A tenth of them is another controller.
        let mut run = reactive(GAIN, 4000);
        (0..400).for_each(|i| run.choices[10 * i].left_m_s += 0.01);
        let found = braitenberg(&run, false);
        assert!(found.spoilt.is_empty() && found.missed > 0.05, "{found:?}");
    }

    #[test]
    fn single_turns_against_the_rules_do_not_decide_the_threshold() {
        const THRESHOLD: f64 = 300.0;
        let sum = |i: usize| 200.0 + 25.0 * (i % 9) as f64 + 0.5;
        let mut choices: Vec<Choice> = (0..4000)
            .map(|i| Choice {
                row: i,
                ..chosen(0.064 * i as f64, sum(i), THRESHOLD)
            })
            .collect();
        // One that did not turn where it had to, one that turned where it must not, one at another speed.
        choices[8].right_counts = 3000.0;
        choices[8].left_m_s = 0.05;
        choices[900].right_counts = 20.0;
        choices[900].left_m_s = -0.05;
        choices[1700].right_m_s = 0.09;
        let run = Run {
            declared: RULES,
            choices,
            written_counts: 0.1,
            written_m_s: 1e-5,
        };
        let found = rules(&run, THRESHOLD, false);
        assert_eq!(found.spoilt, [8, 900, 1700]);
        assert!(found.missed <= FORGIVEN, "{found:?}");
        assert_eq!(found.parameter, [THRESHOLD, 0.0]);
    }

    #[test]
    fn a_threshold_is_no_better_known_than_the_readings_are_written() {
        const THRESHOLD: f64 = 410.02;
        let sums = [409.97, 410.03, 400.0, 420.0];
        let run = Run {
            declared: RULES,
            choices: (sums.iter().enumerate())
                .map(|(i, sum)| chosen(0.064 * i as f64, *sum, THRESHOLD))
                .collect(),
            written_counts: 0.1,
            written_m_s: 1e-5,
        };
        let found = rules(&run, 300.0, false);
        // Both sums next to the threshold are written as 410.0.
        assert!((found.parameter[0] - 410.0).abs() < 1e-9, "{found:?}");
        assert!(found.parameter_error >= run.sum_deviation_counts(), "{found:?}");
        assert_eq!((found.missed, found.spoilt), (0.0, Vec::new()));
    }
}
