//! What holds for every effect; the families' own truths stand in files of their names.

mod act;
mod observe;
mod rays;
mod sense;
mod unlisted;
mod world;

use super::testing::{active, declared, steps, with};
use super::*;

/// Control steps of more than a lap.
const LAP: usize = 1200;

/// Values for a test: neutral ones by `neutral`, places and choices by `place`.
fn values(spec: &Spec, neutral: fn(&Param, f64) -> f64, place: fn(&Param) -> f64) -> Vec<f64> {
    spec.params
        .iter()
        .map(|p| p.neutral.map_or_else(|| place(p), |value| neutral(p, value)))
        .collect()
}

fn middle(param: &Param) -> f64 {
    if param.whole {
        param.low
    } else {
        0.5 * (param.low + param.high)
    }
}

fn neutral(spec: &Spec) -> Vec<f64> {
    values(spec, |_, value| value, middle)
}

fn has_neutral(spec: &Spec) -> bool {
    spec.params.iter().any(|param| param.neutral.is_some())
}

#[test]
fn the_registry_has_the_names_that_others_ask_for() {
    let asked = "cone-of-view half_angle_rad; reading-gain gain; distance-scale scale; response-exponent scale; \
        ambient-offset counts; sensor-rotation angle_rad; sensor-reach fraction; one-sensor-gain sensor gain; \
        one-sensor-offset sensor counts; directional-light counts azimuth_rad; crosstalk fraction; sensor-lag time_s; \
        reading-noise factor; reading-step counts; reading-drift per_s; incidence-falloff exponent; \
        controller-gain factor; controller-speed factor; wheel-asymmetry ratio; wheel-scale factor; axle-length factor; \
        motor-lag time_s; command-delay time_s; dead-band speed_m_s; speed-step speed_m_s; acceleration-limit m_s2; \
        turn-scrub fraction; battery-sag per_s; floor-tilt speed_m_s azimuth_rad; slip-level factor; \
        slip-memory correlation; outer-wall-offset distance_m; inner-wall-offset distance_m; \
        wall-bump wall position height_m length_m; outer-wall-reflectance factor; inner-wall-reflectance factor; \
        reflectance-patch wall position length_m factor; camera-scale factor; camera-offset dx_m dy_m; \
        camera-rotation angle_rad; camera-distortion k1; marker-offset forward_m left_m angle_rad; camera-noise factor";
    let mut expected: Vec<Vec<&str>> = asked
        .split(';')
        .map(|line| line.split_whitespace().collect())
        .collect();
    let words = |spec: &'static Spec| {
        [spec.name]
            .into_iter()
            .chain(spec.params.iter().map(|p| p.name))
            .collect()
    };
    let mut known: Vec<Vec<&str>> = EFFECTS.iter().map(words).collect();
    expected.sort();
    known.sort();
    assert_eq!(known, expected);
}

#[test]
fn names_are_unique_and_ranges_sane() {
    for (i, spec) in EFFECTS.iter().enumerate() {
        assert!(
            EFFECTS[..i].iter().all(|other| other != spec),
            "{} twice",
            spec.name
        );
        assert_eq!(find(spec.name).unwrap(), spec);
        for p in spec.params {
            let label = format!("{}.{}", spec.name, p.name);
            assert!(
                p.low < p.high && p.low.is_finite() && p.high.is_finite(),
                "{label}"
            );
            assert!(
                p.neutral.is_none_or(|value| (p.low..=p.high).contains(&value)),
                "{label}"
            );
            assert!(
                p.choices.is_empty() || p.choices.len() as f64 == p.high + 1.0,
                "{label}"
            );
            let ends = ["_m", "_m_s", "_rad", "_s", "_s2"]
                .iter()
                .any(|end| p.name.ends_with(end));
            let plain = p.unit.is_empty() || p.unit == "counts" || p.unit.starts_with("fraction");
            assert!(ends || plain || p.name == "m_s2", "{label} must end in its unit");
        }
        let (low, high) = (
            values(spec, |p, _| p.low, |p| p.low),
            values(spec, |p, _| p.high, |p| p.high),
        );
        assert!(
            Setting::constant(spec, low).check(0).is_ok() && Setting::constant(spec, high).check(0).is_ok()
        );
    }
}

#[test]
fn effects_stand_in_the_order_of_their_stages() {
    assert!(EFFECTS.windows(2).all(|pair| pair[0].stage <= pair[1].stage));
}

/// Constant, by run and by time, whatever the pattern: neutral values change no bit.
#[test]
fn neutral_values_leave_a_lap_bit_identical() {
    let plain = steps(&declared(), 0, 1, LAP);
    for spec in EFFECTS.iter().filter(|spec| has_neutral(spec)) {
        let still = vec![0.0; spec.params.len()];
        for pattern in [
            Pattern::Constant(neutral(spec)),
            Pattern::ByTime {
                start: neutral(spec),
                per_s: still,
            },
        ] {
            let mut model = declared();
            model.effects.push(Setting { spec, pattern });
            assert!(
                steps(&model, 0, 1, LAP) == plain,
                "{}: {:?}",
                spec.name,
                model.effects
            );
        }
    }
}

/// A lap's fifth is enough to see every effect at an end of its range.
#[test]
fn far_ends_change_something_whatever_the_pattern() {
    let count = LAP / 5;
    let plain = steps(&declared(), 0, 1, count);
    for spec in EFFECTS {
        let far = [
            values(spec, |p, _| p.high, middle),
            values(spec, |p, _| p.low, |p| p.low),
        ];
        let run = |run: usize, pattern: Pattern| {
            let mut model = declared();
            model.effects.push(Setting { spec, pattern });
            model.check().unwrap();
            steps(&model, run, 1, count)
        };
        let constant: Vec<_> = far.iter().map(|v| run(0, Pattern::Constant(v.clone()))).collect();
        let chosen = constant.iter().position(|laps| *laps != plain).expect(spec.name);
        let far = far[chosen].clone();
        assert!(
            constant[chosen].iter().all(|(_, step)| step.observed.is_finite()),
            "{}",
            spec.name
        );
        assert!(
            run(1, Pattern::ByRun(vec![neutral(spec), far.clone()])) == constant[chosen],
            "{}",
            spec.name
        );
        // Towards the far end within 10 s; whole numbers stay.
        let start = neutral(spec);
        let slope = |i: usize| {
            if spec.params[i].whole {
                0.0
            } else {
                (far[i] - start[i]) / 10.0
            }
        };
        let per_s = (0..far.len()).map(slope).collect();
        let drifting = run(0, Pattern::ByTime { start, per_s });
        let differs = drifting != plain || !has_neutral(spec);
        assert!(
            differs && drifting.iter().all(|(_, step)| step.observed.is_finite()),
            "{}",
            spec.name
        );
    }
}

#[test]
fn values_change_linearly_in_time_and_stop_at_the_range() {
    let spec = find("reading-gain").unwrap();
    let setting = Setting {
        spec,
        pattern: Pattern::ByTime {
            start: vec![1.0],
            per_s: vec![0.25],
        },
    };
    let mut gain = Active::all(&[setting], 3).unwrap().remove(0);
    for (time_s, value) in [(0.0, 1.0), (2.0, 1.5), (76.0, 20.0), (1000.0, 20.0), (4.0, 2.0)] {
        gain.advance(time_s);
        assert_eq!(gain.values, [value]);
    }
}

#[test]
fn order_is_the_signals_way_whatever_the_files_order() {
    let gain_first = with(
        &with(&declared(), "reading-gain", &[1.2]),
        "ambient-offset",
        &[50.0],
    );
    let offset_first = with(
        &with(&declared(), "ambient-offset", &[50.0]),
        "reading-gain",
        &[1.2],
    );
    assert_eq!(steps(&gain_first, 0, 1, 100), steps(&offset_first, 0, 1, 100));
}

#[test]
fn settings_that_mean_nothing_are_refused() {
    let refusal = |name: &str, values: &[f64]| {
        Setting::constant(find(name).unwrap(), values)
            .check(2)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        refusal("slip-level", &[-1.0]),
        "effect.2.factor = -1 is outside [0, 20]"
    );
    assert_eq!(
        refusal("one-sensor-gain", &[2.5, 1.0]),
        "effect.2.sensor: 2.5 given, a whole number expected"
    );
    assert_eq!(
        refusal("one-sensor-gain", &[8.0, 1.0]),
        "effect.2.sensor = 8 is outside [0, 7]"
    );
    assert_eq!(
        refusal("camera-offset", &[0.1]),
        "effect.2: camera-offset needs 2 values, not 1"
    );
    assert!(refusal("crosstalk", &[f64::NAN]).contains("outside"));
    let runs = Pattern::ByRun(vec![vec![1.0]]);
    let setting = Setting {
        spec: find("wheel-scale").unwrap(),
        pattern: runs,
    };
    assert!(setting.values(0, 0).is_ok());
    let beyond = setting.values(2, 1).unwrap_err();
    assert_eq!(beyond.key(), Some("effect.2.by"));
    let unknown = find("whel-scale").unwrap_err().to_string();
    assert_eq!(unknown, "unknown effect `whel-scale`; nearest known: wheel-scale");
    assert_eq!(active("wheel-scale", &[1.0]).values, [1.0]);
}
