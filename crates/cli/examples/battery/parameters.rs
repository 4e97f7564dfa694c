//! How far the sizes in an answer are from the truth.

use serde_json::Value;

use crate::labels::Truth;
use crate::score::Interval;

/// Effects that `effects.md` defines in words: another program's parameters need not mean the same.
const IN_WORDS: [&str; 3] = ["cone-of-view", "turn-scrub", "incidence-falloff"];

/// Parameters that say where something is and not how much of it.
const PLACES: [&str; 3] = ["azimuth_rad", "position", "length_m"];

/// Labels are rounded to six digits.
const ROUNDING: f64 = 1e-5;

/// One parameter of an effect that was named right.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ParameterError {
    pub(crate) name: String,
    /// Whether `error` is relative to the size; otherwise it is the plain difference of a place.
    pub(crate) relative: bool,
    pub(crate) error: f64,
    /// Whether the interval holds the truth.
    pub(crate) covered: bool,
}

/// Whether sizes of an effect can be compared.
pub(crate) fn comparable(effect: &str) -> bool {
    !IN_WORDS.contains(&effect)
}

/// The errors of an effect's parameters; those that say which (a sensor, a wall) have none.
pub(crate) fn errors(
    effect: &str,
    truths: &[(String, Truth)],
    estimates: &[Interval],
) -> Vec<ParameterError> {
    let Ok(spec) = sim::find(effect) else {
        return Vec::new();
    };
    let one = |(name, truth): &(String, Truth)| {
        let param = spec.params.iter().find(|param| param.name == name)?;
        let estimate = estimates.iter().find(|interval| interval.name == *name)?;
        if param.whole {
            return None;
        }
        // A limit has no value at which it does nothing: its error is relative to the limit itself.
        error(name, truth, estimate, param.neutral.unwrap_or(0.0))
    };
    truths.iter().filter_map(one).collect()
}

/// Whether what says which (a sensor, a wall) is right.
pub(crate) fn which_is_right(effect: &str, truths: &[(String, Truth)], estimates: &[Interval]) -> bool {
    let Ok(spec) = sim::find(effect) else { return true };
    let right = |(name, truth): &(String, Truth)| {
        let whole = spec.params.iter().any(|param| param.name == name && param.whole);
        let estimate = estimates.iter().find(|interval| interval.name == *name);
        !whole
            || estimate.is_some_and(|estimate| match truth {
                Truth::Word(word) => estimate.value.as_str() == Some(word),
                Truth::Number(number) => numbers(&estimate.value).iter().all(|value| value == number),
                Truth::ByRun(_) => true,
            })
    };
    truths.iter().all(right)
}

fn error(name: &str, truth: &Truth, estimate: &Interval, neutral: f64) -> Option<ParameterError> {
    let (values, low, high) = (
        numbers(&estimate.value),
        numbers(&estimate.low),
        numbers(&estimate.high),
    );
    let truths = match truth {
        Truth::Number(value) => vec![*value],
        Truth::ByRun(values) => values.clone(),
        Truth::Word(_) => return None,
    };
    // One value stands for all runs.
    let runs = truths.len().max(values.len());
    let [truths, values, low, high] = [truths, values, low, high].map(|list| match list.as_slice() {
        [value] => vec![*value; runs],
        _ => list,
    });
    if values.len() != runs || truths.len() != runs || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let place = PLACES.contains(&name);
    let difference = |(truth, value): (&f64, &f64)| wrapped(name, value - truth);
    let differences: Vec<f64> = truths.iter().zip(&values).map(difference).collect();
    let sizes: Vec<f64> = truths.iter().map(|truth| truth - neutral).collect();
    let scale = if place { 1.0 } else { rms(&sizes) };
    let covered = (0..values.len()).all(|i| {
        let slack = ROUNDING * truths[i].abs();
        let off = differences[i];
        (low.get(i).zip(high.get(i)))
            .is_some_and(|(low, high)| low - values[i] - slack <= -off && -off <= high - values[i] + slack)
    });
    Some(ParameterError {
        name: name.to_owned(),
        relative: !place,
        error: rms(&differences) / scale,
        covered,
    })
}

/// A difference the shorter way round, where there is one.
fn wrapped(name: &str, difference: f64) -> f64 {
    let period = match name {
        "azimuth_rad" => std::f64::consts::TAU,
        "position" => 1.0,
        _ => return difference,
    };
    difference - period * (difference / period).round()
}

/// The numbers of a value that may be a list.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().filter_map(Value::as_f64).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn interval(name: &str, value: Value, low: Value, high: Value) -> Interval {
        Interval {
            name: name.into(),
            value,
            low,
            high,
        }
    }

    fn truth(name: &str, value: f64) -> Vec<(String, Truth)> {
        vec![(name.to_owned(), Truth::Number(value))]
    }

    #[test]
    fn errors_are_relative_to_the_distance_from_neutral() {
        let estimate = [interval("gain", json!(1.21), json!(1.15), json!(1.25))];
        let found = errors("reading-gain", &truth("gain", 1.2), &estimate);
        assert!((found[0].error - 0.05).abs() < 1e-9 && found[0].covered && found[0].relative);
        let found = errors("reading-gain", &truth("gain", 1.1), &estimate);
        assert!((found[0].error - 1.1).abs() < 1e-9 && !found[0].covered);
    }

    #[test]
    fn azimuths_go_round_and_are_no_sizes() {
        let estimate = [interval("azimuth_rad", json!(3.1), json!(3.0), json!(3.2))];
        let found = errors("directional-light", &truth("azimuth_rad", -3.1), &estimate);
        let expected = std::f64::consts::TAU - 6.2;
        assert!((found[0].error - expected).abs() < 1e-9, "{found:?}");
        assert!(!found[0].relative && found[0].covered, "-3.1 is 3.183: {found:?}");
    }

    #[test]
    fn sizes_by_run_are_compared_run_by_run() {
        let truths = vec![("gain".to_owned(), Truth::ByRun(vec![1.1, 0.9]))];
        let estimate = [interval(
            "gain",
            json!([1.11, 0.91]),
            json!([1.0, 0.8]),
            json!([1.2, 0.95]),
        )];
        let found = errors("reading-gain", &truths, &estimate);
        assert!((found[0].error - 0.1).abs() < 1e-9 && found[0].covered);
        let constant = [interval("gain", json!(1.0), json!(0.9), json!(1.1))];
        let found = errors("reading-gain", &truths, &constant);
        assert!(
            (found[0].error - 1.0).abs() < 1e-9 && found[0].covered,
            "{found:?}"
        );
    }

    #[test]
    fn a_wrong_sensor_is_no_size() {
        let truths = vec![
            ("sensor".to_owned(), Truth::Number(5.0)),
            ("gain".to_owned(), Truth::Number(0.72)),
        ];
        let estimate = |sensor: f64| {
            [
                interval("sensor", json!(sensor), json!(sensor), json!(sensor)),
                interval("gain", json!(0.72), json!(0.7), json!(0.74)),
            ]
        };
        assert_eq!(errors("one-sensor-gain", &truths, &estimate(5.0)).len(), 1);
        assert!(which_is_right("one-sensor-gain", &truths, &estimate(5.0)));
        assert!(!which_is_right("one-sensor-gain", &truths, &estimate(6.0)));
    }

    #[test]
    fn a_limit_is_compared_with_itself() {
        let estimate = [interval("m_s2", json!(0.11), json!(0.1), json!(0.12))];
        let found = errors("acceleration-limit", &truth("m_s2", 0.1), &estimate);
        assert!((found[0].error - 0.1).abs() < 1e-9);
    }
}
