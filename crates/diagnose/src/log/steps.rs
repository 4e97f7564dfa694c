//! The multiples to which readings were rounded, by looking at the values that occur.

use super::rows::LogRow;

/// Step up to which whole counts tell nothing but how they were written.
pub(crate) const WHOLE: f64 = 1.5;
/// Readings looked at.
const LOOKED_AT: usize = 4000;

/// The step of which all readings are multiples, counts; `None` if they are not multiples of anything coarser than
/// what the file can tell, which may have whole counts.
pub(crate) fn reading_step(runs: &[&[LogRow]]) -> Option<f64> {
    let readings: Vec<f64> = (runs.iter().flat_map(|rows| finite(rows)))
        .filter(|&reading| reading > 0.0 && reading < 4000.0)
        .collect();
    let every = (readings.len() / LOOKED_AT).max(1);
    let some: Vec<f64> = readings.iter().copied().step_by(every).collect();
    if some.len() < 100 {
        return None;
    }
    let smallest = readings.iter().copied().fold(f64::INFINITY, f64::min);
    // The smallest reading is the step itself or a small multiple of it, so the step is a fraction of it.
    let guess = (1..=12)
        .map(|k| smallest / f64::from(k))
        .find(|&step| step > 0.45 && fits(&some, step))?;
    let whole = some.iter().all(|reading| reading.fract() == 0.0);
    let step = sharpened(&readings, guess);
    (!whole || step > WHOLE).then_some(step)
}

/// The step to which the file writes readings that are not rounded otherwise, counts.
pub(crate) fn written_step(runs: &[&[LogRow]]) -> f64 {
    const TENTHS: f64 = 0.1;
    let finest = runs.iter().map(|rows| written_counts(rows)).fold(1.0, f64::min);
    finest.max(TENTHS)
}

/// The power of ten, at most 1, that all readings of a log are multiples of.
pub(crate) fn written_counts(rows: &[LogRow]) -> f64 {
    const DECIMALS: std::ops::RangeInclusive<i32> = 0..=6;
    let all_are_multiples = |decimals: &i32| {
        let scale = 10.0_f64.powi(*decimals);
        let is_multiple = |reading: f64| (scale * reading - (scale * reading).round()).abs() < 1e-4;
        finite(rows).all(is_multiple)
    };
    let decimals = DECIMALS.clone().find(all_are_multiples);
    10.0_f64.powi(-decimals.unwrap_or(*DECIMALS.end()))
}

/// The readings that are there.
fn finite(rows: &[LogRow]) -> impl Iterator<Item = f64> {
    let all = rows.iter().flat_map(|row| row.readings);
    all.filter(|reading| reading.is_finite())
}

/// Whether all readings lie within the file's rounding of multiples of something near the guess, which is known no better where
/// few multiples occur.
fn fits(readings: &[f64], guess: f64) -> bool {
    const ROUNDING: f64 = 0.05;
    const OFF: f64 = 2.2 * ROUNDING;
    let step = sharpened(readings, guess);
    let off = |reading: f64| (reading - (reading / step).round() * step).abs();
    let near = readings.iter().filter(|&&reading| off(reading) < OFF).count();
    near as f64 > 0.98 * readings.len() as f64 && step > 0.45
}

/// The step by least squares, with ever larger multiples as it gets sharper.
fn sharpened(readings: &[f64], guess: f64) -> f64 {
    let mut step = guess;
    let mut reach = 5.0;
    for _ in 0..10 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for &reading in readings.iter().filter(|&&reading| reading < reach * step) {
            let k = (reading / step).round();
            top += k * reading;
            bottom += k * k;
        }
        if bottom > 0.0 {
            step = top / bottom;
        }
        reach *= 3.0;
    }
    step
}

#[cfg(test)]
mod tests {
    use sim::WheelSpeeds;

    use super::*;

    fn rows(step: f64) -> Vec<LogRow> {
        (0..4000)
            .map(|i| {
                let raw = |lane: usize| f64::from(i * 7 % 977) * 0.731 + lane as f64 * 13.3;
                let rounded = |x: f64| if step > 0.0 { (x / step).round() * step } else { x };
                let readings = std::array::from_fn(|lane| (10.0 * rounded(raw(lane))).round() / 10.0);
                LogRow {
                    time_s: 0.064 * f64::from(i),
                    starts: false,
                    observed: None,
                    readings,
                    command: WheelSpeeds::default(),
                    doubt_m: 0.0,
                }
            })
            .collect()
    }

    #[test]
    fn finds_a_step_and_nothing_where_there_is_none() {
        for step in [2.5, 7.3, 41.77, 139.49] {
            let rows = rows(step);
            let found = reading_step(&[&rows]).unwrap();
            assert!((found / step - 1.0).abs() < 1e-3, "{found} for {step}");
        }
        assert_eq!(reading_step(&[&rows(0.0)]), None);
        // Written without decimals.
        assert_eq!(reading_step(&[&rows(1.0)]), None);
        assert_eq!(
            [0.0, 1.0, 7.3].map(|step| written_step(&[&rows(step)])),
            [0.1, 1.0, 0.1]
        );
        let found = reading_step(&[&rows(2.0)]).unwrap();
        assert!((found - 2.0).abs() < 1e-6, "{found}");
    }

    #[test]
    fn a_sensor_that_is_not_there_hides_no_step() {
        let mut rows = rows(7.3);
        rows.iter_mut().for_each(|row| row.readings[3] = f64::NAN);
        let found = reading_step(&[&rows]).unwrap();
        assert!((found / 7.3 - 1.0).abs() < 1e-3, "{found}");
        assert_eq!(written_counts(&rows), 0.1);
    }

    #[test]
    fn finds_a_step_of_which_two_multiples_occur() {
        let of = |readings| LogRow {
            time_s: 0.0,
            starts: false,
            observed: None,
            readings,
            command: WheelSpeeds::default(),
            doubt_m: 0.0,
        };
        // Multiples of 146.27 as a file has them.
        let mut rows = vec![of([0.0, 146.3, 0.0, 146.3, 146.3, 146.3, 146.3, 146.3]); 200];
        rows.extend(vec![of([292.5, 146.3, 0.0, 0.0, 0.0, 146.3, 0.0, 0.0]); 40]);
        let found = reading_step(&[&rows]).unwrap();
        assert!((found / 146.27 - 1.0).abs() < 2e-4, "{found}");
    }
}
