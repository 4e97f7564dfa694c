//! Causes without a name: what each acts on, with what it depends on, as a group of basis functions.

use sim::{Setting, Stage, UNLISTED};

use super::catalogue::Variant;
use crate::candidate::{WORDS, area_values, stage_of, unlisted_values};

/// Times, s, between those of a lap and of a run, about which what settles is sought.
const SETTLE_WITHIN_S: [f64; 7] = [15.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0];

/// Every target with every dependence that linear algebra tells.
pub(crate) fn unlisted_variants() -> Vec<Variant> {
    let dependences = [
        ("constant", "polynomial", 1, 1.0),
        ("heading", "harmonics", 4, 1.0),
        ("place", "polynomial", 15, 4.0),
        ("speed", "polynomial", 3, 20.0),
        ("turn", "polynomial", 4, 20.0),
        ("time", "polynomial", 3, 1.0 / 200.0),
    ];
    let of = |target: &&'static str| {
        dependences.map(|(name, basis, count, scale)| {
            let degree = |i: usize| match name {
                "place" => (1..).take_while(|d| d * (d + 1) / 2 <= i).count(),
                "heading" => 0,
                _ => i,
            };
            let scales: Vec<f64> = (0..count).map(|i| f64::powi(scale, degree(i) as i32)).collect();
            group(target, [name, basis], &scales)
        })
    };
    UNLISTED.params[0].choices.iter().flat_map(of).flatten().collect()
}

/// Every target on a part of the floor, which is to be looked for from where it may be.
pub(crate) fn area_variants() -> Vec<Variant> {
    const STEP_M: f64 = 0.01;
    const STEP_OF_SOFTNESS: f64 = 0.05;
    let of = |target: &&'static str| {
        let values = area_values(target)?;
        let steps = [step_of(target), STEP_M, STEP_M, STEP_M, STEP_OF_SOFTNESS];
        let steps: Vec<(usize, f64)> = (WORDS..).zip(steps).collect();
        Some(Variant::linear(&UNLISTED, &values, &steps))
    };
    UNLISTED.params[0].choices.iter().filter_map(of).collect()
}

/// Each wheel's speed by its own angle.
pub(crate) fn wheel_variants() -> Vec<Variant> {
    let of = |wheel| group(wheel, ["wheel angle", "harmonics"], &[1.0; 2]);
    ["left wheel", "right wheel"].into_iter().filter_map(of).collect()
}

/// What comes to rest in the course of a run, within one of several times, in one stage.
pub(crate) fn settling_variants(stage: Stage) -> Vec<Variant> {
    let within = |target: &&'static str, time_s: f64| {
        let mut variant = group(target, ["time", "settling"], &[1.0; 2])?;
        variant.free.push(variant.values.len());
        variant.values.push(time_s);
        Some(variant)
    };
    (UNLISTED.params[0].choices.iter())
        .flat_map(|target| SETTLE_WITHIN_S.map(|time_s| within(target, time_s)))
        .flatten()
        .filter(|variant| stage_of(&Setting::constant(variant.spec, variant.values.clone())) == stage)
        .collect()
}

/// A target with a dependence on a basis, and the sizes of its terms relative to the target's step.
fn group(target: &str, [dependence, basis]: [&str; 2], scales: &[f64]) -> Option<Variant> {
    let values = unlisted_values([target, dependence, basis], scales.len())?;
    let steps = scales.iter().map(|scale| step_of(target) * scale);
    let steps: Vec<(usize, f64)> = (WORDS..).zip(steps).collect();
    Some(Variant::linear(&UNLISTED, &values, &steps))
}

/// About a percent, a millimetre, a count or a hundredth of a radian per second.
fn step_of(target: &str) -> f64 {
    match target {
        "side slip" | "camera x" | "camera y" => 5e-4,
        "left-right difference" => 1.0,
        _ => 0.01,
    }
}
