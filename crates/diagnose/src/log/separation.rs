//! How far a robot's log would tell two explanations apart.

use sim::{Model, Scene, Setting};

use super::evidence::{Evidence, widened};
use super::groups::{area_variants, unlisted_variants};
use super::refine::{knobs_of, refine};
use super::rows::LogRow;
use super::steps::written_step;

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
        ..masks
    };
    let variants = [evidence.variants(), unlisted_variants(), area_variants()].concat();
    let knobs = knobs_of(rival, &variants);
    let best = refine(&evidence, rival.to_vec(), knobs, STEPS)?.log_likelihood;
    Some((2.0 * (evidence.likelihood(answer)? - best).max(0.0)).sqrt())
}
