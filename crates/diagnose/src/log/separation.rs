//! How far a robot's log would tell two explanations apart.

use sim::{Model, Pattern, Scene, Setting, find};

use super::evidence::{Asked, Evidence, widened};
use super::groups::{area_variants, unlisted_variants};
use super::refine::{knobs_of, refine};
use super::rows::LogRow;
use super::steps::written_step;
use crate::slip::level_of;

/// The distance in standard deviations, for these logs of a robot with the answer's effects, between the answer and a rival that
/// is fitted to them. `None` for logs that cannot be followed.
pub fn log_separation(
    model: &Model,
    scene: &Scene,
    runs: &[&[LogRow]],
    answer: &[Setting],
    rival: &[Setting],
) -> Option<f64> {
    const STEPS: usize = 4;
    let (_, scene) = widened(std::iter::once(model), scene).ok()?;
    let mut true_model = model.clone();
    true_model.effects.extend_from_slice(answer);
    let [true_models, models] = [&true_model, model].map(|model| vec![model; runs.len()]);
    let masks = Evidence::new(&scene, &true_models, runs, written_step(runs)).ok()?;
    let evidence = Evidence {
        models: &models,
        asked: Asked::nothing(),
        ..masks
    };
    let [answer, rival] = [answer, rival].map(with_levels);
    let variants = [evidence.variants(), unlisted_variants(), area_variants()].concat();
    let knobs = knobs_of(&rival, &variants);
    let best = refine(&evidence, rival, knobs, STEPS)?.log_likelihood;
    Some((2.0 * (evidence.likelihood(&answer)? - best).max(0.0)).sqrt())
}

/// Effects with slip that has a memory as the level that a filter takes it for.
fn with_levels(settings: &[Setting]) -> Vec<Setting> {
    let as_level = |setting: &Setting| match (setting.spec.name, &setting.pattern, find("slip-level")) {
        ("slip-memory", Pattern::Constant(values), Ok(level)) => {
            Setting::constant(level, [level_of(values[0])])
        }
        _ => setting.clone(),
    };
    settings.iter().map(as_level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_memory_is_a_level_to_a_filter() {
        let [gain, memory] = ["reading-gain", "slip-memory"].map(|name| find(name).unwrap());
        let settings = [Setting::constant(gain, [1.1]), Setting::constant(memory, [0.6])];
        let seen = with_levels(&settings);
        assert_eq!(seen[0], settings[0]);
        assert_eq!(seen[1].spec.name, "slip-level");
        // (1 + .6) / (1 - .6) = 2 squared.
        assert!((seen[1].pattern.numbers()[0] - 2.0).abs() < 1e-9);
    }
}
