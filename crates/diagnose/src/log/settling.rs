//! Sizes that come to rest in the course of a run, where the list has none but those that change at a constant rate.

use sim::Pattern;

use super::evidence::Evidence;
use super::groups::settling_variants;
use super::leads::{Lead, constant, start};
use super::refined::{Refined, together};
use super::screen::normals;
use crate::candidate::stage_of;

/// Steps of a refinement at most.
const STEPS: usize = 12;

/// What settles in the stage of an effect that changes with time, if it explains more than that effect does, or about as much as
/// a rate that changes. `base` is the
/// declared model's log-likelihood.
pub(crate) fn settling(evidence: &Evidence<'_>, changing: &Refined, base: f64) -> Option<Refined> {
    /// Log-likelihood by which it must be ahead, and a share of what is explained: no model is exact.
    const AHEAD: (f64, f64) = (20.0, 5e-4);
    let [effect] = changing.settings.as_slice() else {
        return None;
    };
    if !effect.depends_on_time() {
        return None;
    }
    let variants = settling_variants(stage_of(effect));
    let normals = normals(&evidence.traces(&[])?, &variants).ok()?;
    let leads = (variants.iter().zip(&normals).enumerate())
        .map(|(i, (variant, normals))| (variant, constant(i, normals)));
    let (variant, lead): (_, Lead) = leads.max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain))?;
    let at = start(variant, lead.multiples[0].as_slice());
    let found = together(evidence, &[(variant.clone(), at)], base, STEPS)?;
    let ahead = found.gain - changing.gain;
    let Pattern::Constant(values) = &found.settings[0].pattern else {
        return None;
    };
    let ends_s = (evidence.stretches.iter()).filter_map(|stretch| Some(stretch.rows.last()?.time_s));
    let longest_s = ends_s.fold(0.0, f64::max);
    let comes_to_rest = (values.last()).is_some_and(|time_s| (0.0..longest_s).contains(time_s));
    // A rate that itself changes is no better known than what comes to rest.
    let bends = effect.spec.drifts() && matches!(effect.pattern, Pattern::ByTime { .. });
    let wins = if bends {
        found.score() > changing.score()
    } else {
        ahead > AHEAD.0.max(AHEAD.1 * changing.gain)
    };
    (comes_to_rest && wins).then_some(found)
}
