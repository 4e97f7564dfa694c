//! Where the walls seem to be cut, by what the logs say.

use sim::{Model, Scene, Setting};

use super::evidence::Evidence;
use crate::corners::{Corners, cuts};

/// Points of a span that programs commonly look at.
const PER_SPAN: [usize; 7] = [50, 64, 100, 128, 200, 256, 500];

/// The scene whose corners the logs like best beside these effects, if they like it clearly better than the declared one.
pub(crate) fn recut(
    scene: &Scene,
    wide: &Model,
    evidence: &Evidence<'_>,
    settings: &[Setting],
) -> Option<(Corners, Scene)> {
    /// Log-likelihood by which another cut must win.
    const CLEARLY: f64 = 12.0;
    let first = evidence.of_run(*evidence.runs().first()?);
    let mut tried: Vec<(f64, Corners, Scene)> = Vec::new();
    for (corners, scene) in cuts(scene, wide, &PER_SPAN) {
        let likelihood = first.elsewhere(&scene).likelihood(settings)?;
        tried.push((likelihood, corners, scene));
    }
    let (_, corners, scene) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let gained = evidence.elsewhere(&scene).likelihood(settings)? - evidence.likelihood(settings)?;
    (gained > CLEARLY).then_some((corners, scene))
}
