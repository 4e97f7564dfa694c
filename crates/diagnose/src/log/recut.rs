//! Where the walls seem to be cut, by what the logs say.

use sim::{Model, Scene, Setting};

use super::evidence::Evidence;
use crate::corners::{Corners, cuts};

/// Points of a span that programs commonly look at.
const PER_SPAN: [usize; 7] = [50, 64, 100, 128, 200, 256, 500];

/// The walls that the logs like best beside some effects.
#[derive(Debug)]
pub(crate) struct Recut {
    /// Corners and their scene, if the logs like them clearly better than the declared ones.
    pub(crate) cut: Option<(Corners, Scene)>,
    /// Log-likelihood with them.
    pub(crate) log_likelihood: f64,
}

/// Where the walls seem to be cut beside these effects. `evidence` is that of the declared walls, `scene`.
pub(crate) fn recut(
    scene: &Scene,
    wide: &Model,
    evidence: &Evidence<'_>,
    settings: &[Setting],
) -> Option<Recut> {
    /// Log-likelihood by which another cut must win.
    const CLEARLY: f64 = 12.0;
    let declared = evidence.likelihood(settings)?;
    let as_declared = Recut {
        cut: None,
        log_likelihood: declared,
    };
    let first = evidence.of_run(*evidence.runs().first()?);
    let mut tried: Vec<(f64, Corners, Scene)> = Vec::new();
    for (corners, scene) in cuts(scene, wide, &PER_SPAN) {
        if let Some(likelihood) = first.elsewhere(&scene).likelihood(settings) {
            tried.push((likelihood, corners, scene));
        }
    }
    let Some((_, corners, scene)) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Some(as_declared);
    };
    let log_likelihood = evidence.elsewhere(&scene).likelihood(settings)?;
    if log_likelihood - declared <= CLEARLY {
        return Some(as_declared);
    }
    Some(Recut {
        cut: Some((corners, scene)),
        log_likelihood,
    })
}
