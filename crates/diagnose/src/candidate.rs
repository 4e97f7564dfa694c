//! What might explain a residual.

use std::collections::BTreeMap;
use std::ops::Range;

use sim::{Area, Param, Pattern, Setting, Spec, Stage, UNLISTED, unlisted_area};

use crate::Cause;

/// Half width of a 95 % interval in standard errors.
pub(crate) const HALF_WIDTH_95: f64 = 1.96;

/// An effect that might explain what the model lacks, with its fitted size.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The effect with its fitted values and their pattern.
    pub setting: Setting,
    /// Standard error of each fitted value, in the order of the pattern's values (for a pattern by run, run after run;
    /// by time, start values and then slopes); 0 for a value that was chosen and not fitted, such as a wall.
    pub standard_errors: Vec<f64>,
    /// 95 % intervals of values of which the standard error tells little, because the likelihood falls far more slowly to one side,
    /// by their place in the same order.
    pub intervals: BTreeMap<usize, [f64; 2]>,
    /// Log-likelihood gained over the declared model.
    pub gain: f64,
    /// Number of fitted values.
    pub fitted: usize,
    /// How much it does alone, in units that the effects of an explanation share: squared distance from the declared model.
    pub weight: f64,
}

impl Candidate {
    /// The 95 % interval of a fitted value by its place in the order of the pattern's values, inside its parameter's range; the value
    /// itself, twice, if it was chosen.
    pub fn interval(&self, place: usize) -> [f64; 2] {
        if let Some(interval) = self.intervals.get(&place) {
            return *interval;
        }
        let (value, reach) = (
            self.setting.pattern.numbers()[place],
            HALF_WIDTH_95 * self.standard_errors[place],
        );
        let range = self.setting.param(place).filter(|param| round(param).is_none());
        let [low, high] = range.map_or([f64::NEG_INFINITY, f64::INFINITY], |param| {
            [param.low, param.high]
        });
        [(value - reach).max(low), (value + reach).min(high)]
    }

    /// The effect with one fitted number moved by its standard error, number by number: up, or down where it would leave its range.
    pub(crate) fn moved(&self) -> impl Iterator<Item = Setting> {
        let values = self.setting.pattern.numbers();
        let fitted = self
            .standard_errors
            .iter()
            .enumerate()
            .filter(|(_, error)| **error > 0.0);
        fitted.map(move |(place, &error)| {
            let leaves = |param: &Param| values[place] + error > param.high;
            let down = self.setting.param(place).is_some_and(leaves);
            Setting {
                spec: self.setting.spec,
                pattern: self
                    .setting
                    .pattern
                    .moved(place, if down { -error } else { error }),
            }
        })
    }

    /// The stage of the loop in which it acts.
    pub fn stage(&self) -> Stage {
        stage_of(&self.setting)
    }

    /// The effect with what tells it from others of its name (a sensor, a place), and its pattern.
    pub fn label(&self) -> String {
        label(&self.setting)
    }
}

/// An effect with what tells it from others of its name, and its pattern.
pub(crate) fn label(setting: &Setting) -> String {
    let (values, pattern) = match &setting.pattern {
        Pattern::Constant(values) => (values, ""),
        Pattern::ByRun(runs) => (&runs[0], ", by run"),
        Pattern::ByTime { start, .. } => (start, ", by time"),
    };
    let spec = setting.spec;
    let fixed: Vec<String> = (spec.params.iter().zip(values))
        .filter(|(param, _)| param.neutral.is_none() && (spec.params.len() > 1 || *spec == UNLISTED))
        .map(|(param, value)| match param.choices.get(*value as usize) {
            Some(choice) if *spec == UNLISTED => format!("{} {choice}", param.name.replace('_', " ")),
            Some(choice) => (*choice).to_owned(),
            None if param.whole => format!("{} {value}", param.name),
            None => format!("{} {value:.2}", param.name),
        })
        .collect();
    let fixed = if fixed.is_empty() {
        String::new()
    } else {
        format!(" ({})", fixed.join(", "))
    };
    format!("{}{fixed}{pattern}", spec.name)
}

/// Values of [`UNLISTED`] before its coefficients: what it acts on, what it depends on, and the basis.
pub(crate) const WORDS: usize = UNLISTED.params.len();

/// The values of an effect without a name that does nothing yet, with so many coefficients; `None` if it knows no such word.
pub(crate) fn unlisted_values(words: [&str; WORDS], coefficients: usize) -> Option<Vec<f64>> {
    let number = |(param, word): (&Param, &str)| {
        let place = param.choices.iter().position(|choice| *choice == word);
        place.map(|place| place as f64)
    };
    let mut values: Vec<f64> = (UNLISTED.params.iter().zip(words))
        .map(number)
        .collect::<Option<_>>()?;
    values.resize(WORDS + coefficients, 0.0);
    Some(values)
}

/// The softness of an area that ends as a normal law's bell does.
pub(crate) const OF_A_BELL: f64 = 1.0;

/// The values of an area in the arena's middle that does nothing yet; `None` if nothing is known of such a target.
pub(crate) fn area_values(target: &str) -> Option<Vec<f64>> {
    const RADIUS_M: f64 = 0.15;
    let mut values = unlisted_values([target, "place", Area::BASIS], 0)?;
    values.extend([0.0, 0.0, 0.0, RADIUS_M, OF_A_BELL]);
    Some(values)
}

/// Where a parameter goes round: the range that holds each of its values once. Angles and places on a closed wall do.
pub(crate) fn round(param: &Param) -> Option<Range<f64>> {
    const PI: f64 = std::f64::consts::PI;
    match param.name {
        "position" => Some(0.0..1.0),
        "azimuth_rad" => Some(-PI..PI),
        _ => None,
    }
}

/// A value brought into its parameter's range: what goes round goes on, others stop at the end.
pub(crate) fn within(value: f64, param: &Param) -> f64 {
    match round(param) {
        Some(turn) => (value - turn.start).rem_euclid(turn.end - turn.start) + turn.start,
        None => value.clamp(param.low, param.high),
    }
}

/// A value of an effect brought into its range, as [`within`] does; the radius and the softness of an area, for which any number
/// stands, to where they make a difference.
pub(crate) fn bounded(spec: &Spec, values: &[f64], place: usize, value: f64) -> f64 {
    const RADIUS_M: [f64; 2] = [0.01, 1.0];
    const SOFTNESS: [f64; 2] = [Area::SHARPEST, 2.0];
    let is_area = *spec == UNLISTED && unlisted_area(values).is_some();
    match place.checked_sub(WORDS) {
        Some(3) if is_area => value.clamp(RADIUS_M[0], RADIUS_M[1]),
        Some(4) if is_area => value.clamp(SOFTNESS[0], SOFTNESS[1]),
        _ => spec.param(place).map_or(value, |param| within(value, param)),
    }
}

/// How far a value is from another, the shorter way round if it is one of a parameter that goes round.
pub(crate) fn apart(value: f64, other: f64, param: Option<&Param>) -> f64 {
    match param.and_then(round) {
        Some(turn) => {
            let period = turn.end - turn.start;
            (value - other + 0.5 * period).rem_euclid(period) - 0.5 * period
        }
        None => value - other,
    }
}

/// The stage in which a setting shows: that of its effect, or of what an effect without a name acts on.
pub(crate) fn stage_of(setting: &Setting) -> Stage {
    Cause::of(setting).map_or(setting.spec.stage, |cause| cause.stage)
}

/// Gives one run of several the mean of the other runs' values.
pub(crate) fn take_mean_of_others(values: &mut [Vec<f64>], run: usize) {
    let others = values.len() as f64 - 1.0;
    if others < 1.0 || run >= values.len() {
        return;
    }
    for i in 0..values[run].len() {
        let sum: f64 = values.iter().map(|values| values[i]).sum();
        values[run][i] = (sum - values[run][i]) / others;
    }
}

/// What one run tells of some values, with their standard errors.
#[derive(Debug, Clone)]
pub(crate) struct OfRun {
    pub(crate) values: Vec<f64>,
    pub(crate) errors: Vec<f64>,
}

/// The values of all runs, run by run, and their errors in a row, as a [`Candidate`] has them. Runs that tell nothing have the mean of
/// the others, with an error that holds how far these are apart; `None` if none tells anything.
pub(crate) fn filled(runs: &[Option<OfRun>]) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let told: Vec<&OfRun> = runs.iter().flatten().collect();
    let count = told.len() as f64;
    let mean = |i: usize| told.iter().map(|run| run.values[i]).sum::<f64>() / count;
    let error = |i: usize| {
        let square = |run: &&OfRun| (run.values[i] - mean(i)).powi(2) + run.errors[i] * run.errors[i];
        (told.iter().map(square).sum::<f64>() / count).sqrt()
    };
    let numbers = 0..told.first()?.values.len();
    let unseen = OfRun {
        values: numbers.clone().map(mean).collect(),
        errors: numbers.map(error).collect(),
    };
    let all = || runs.iter().map(|run| run.as_ref().unwrap_or(&unseen));
    Some((
        all().map(|run| run.values.clone()).collect(),
        all().flat_map(|run| run.errors.iter().copied()).collect(),
    ))
}

#[cfg(test)]
mod tests {
    use sim::find;

    use super::*;

    #[test]
    fn a_run_takes_the_mean_of_the_others() {
        let mut values = vec![vec![1.0, 5.0], vec![9.0, 9.0], vec![3.0, 6.0]];
        take_mean_of_others(&mut values, 1);
        assert_eq!(values, [[1.0, 5.0], [2.0, 5.5], [3.0, 6.0]]);
        let mut alone = vec![vec![1.0]];
        take_mean_of_others(&mut alone, 0);
        assert_eq!(alone, [[1.0]]);
    }

    #[test]
    fn a_run_that_tells_nothing_has_the_mean_and_an_error_that_holds_the_others() {
        let of = |value: f64| {
            Some(OfRun {
                values: vec![value],
                errors: vec![4.0],
            })
        };
        let (values, errors) = filled(&[of(7.0), None, of(13.0)]).unwrap();
        assert_eq!(values, [[7.0], [10.0], [13.0]]);
        // 3 off the mean and known to 4.
        assert_eq!(errors, [4.0, 5.0, 4.0]);
        assert!(filled(&[None, None]).is_none());
    }

    #[test]
    fn intervals_stay_in_their_parameters_range_and_may_be_open() {
        let mut noise = Candidate {
            setting: Setting::constant(find("reading-noise").unwrap(), [0.06]),
            standard_errors: vec![0.1],
            intervals: BTreeMap::new(),
            gain: 1.0,
            fitted: 1,
            weight: 1.0,
        };
        let near =
            |[low, high]: [f64; 2], [a, b]: [f64; 2]| (low - a).abs() < 1e-12 && (high - b).abs() < 1e-12;
        assert!(near(noise.interval(0), [0.0, 0.256]));
        noise.intervals.insert(0, [0.05, 3.0]);
        assert_eq!(noise.interval(0), [0.05, 3.0]);
        // A change per second has no range, and an angle goes round.
        let tilt = Candidate {
            setting: Setting {
                spec: find("floor-tilt").unwrap(),
                pattern: Pattern::ByTime {
                    start: vec![1e-3, 3.1],
                    per_s: vec![-1e-6, 0.0],
                },
            },
            standard_errors: vec![1e-4, 0.1, 1e-7, 0.0],
            ..noise
        };
        assert!(near(tilt.interval(1), [2.904, 3.296]));
        assert!(near(tilt.interval(2), [-1e-6 - 1.96e-7, -1e-6 + 1.96e-7]));
    }

    #[test]
    fn places_go_round_a_wall_and_sizes_stop_at_the_end_of_their_range() {
        let bump = find("wall-bump").unwrap();
        let param = |name: &str| bump.params.iter().find(|param| param.name == name).unwrap();
        assert!((within(-0.005, param("position")) - 0.995).abs() < 1e-12);
        assert!((within(1.005, param("position")) - 0.005).abs() < 1e-12);
        assert!((apart(0.01, 0.99, Some(param("position"))) - 0.02).abs() < 1e-12);
        assert!((apart(0.99, 0.01, Some(param("position"))) + 0.02).abs() < 1e-12);
        let azimuth = &find("floor-tilt").unwrap().params[1];
        assert!((apart(-3.1, 3.1, Some(azimuth)) - (std::f64::consts::TAU - 6.2)).abs() < 1e-12);
        assert!((apart(0.3, 0.1, Some(azimuth)) - 0.2).abs() < 1e-12);
        let height = param("height_m");
        assert!((apart(0.9, 0.1, Some(height)) - 0.8).abs() < 1e-12);
        assert_eq!(within(height.high + 1.0, height), height.high);
    }
}
