//! Where the walls are cut: two programs that look at different points of a wall put its corners at different places,
//! and where a wall is nearly straight a micrometre of tolerance moves a corner by centimetres. The logs say which
//! points were looked at.

use sim::{Model, Scene, Setting, Vec2};
use track::{Chain, Side, Vertex, Wall};

use super::evidence::Evidence;

/// Points looked at in each span of a spline, and whether the chord ends at the last of them that is good or at the
/// first that is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corners {
    /// Points in a span; 0 for the declared cut, which is exact.
    pub per_span: usize,
    /// Whether a chord ends before the point that is too far, not on it.
    pub before: bool,
}

/// The declared cut.
pub(crate) const EXACT: Corners = Corners {
    per_span: 0,
    before: true,
};

/// What programs commonly look at.
const PER_SPAN: [usize; 7] = [50, 64, 100, 128, 200, 256, 500];

/// The scene whose corners the logs like best beside these effects, if they like it clearly better than the declared one.
pub(crate) fn recut(
    scene: &Scene,
    model: &Model,
    wide: &Model,
    evidence: &Evidence<'_>,
    settings: &[Setting],
) -> Option<(Corners, Scene)> {
    /// Log-likelihood by which another cut must win.
    const CLEARLY: f64 = 12.0;
    let first = evidence.of_run(*evidence.runs().first()?);
    let [outer, inner] = scene.chains().map(|chain| chain.vertices.len());
    let mut tried: Vec<(f64, Corners, Scene)> = Vec::new();
    for per_span in PER_SPAN {
        for before in [true, false] {
            let chain = |side| {
                cut(
                    scene.circuit().course.wall(side),
                    model.wall.max_error_m,
                    per_span,
                    before,
                )
            };
            let chains = [chain(Side::Outer), chain(Side::Inner)];
            // A cut with another number of pieces is another declaration.
            if chains[0].vertices.len() == outer && chains[1].vertices.len() == inner {
                let [outer, inner] = chains;
                let scene = scene.recut(wide, outer, inner);
                let likelihood = first.elsewhere(&scene).likelihood(settings)?;
                tried.push((likelihood, Corners { per_span, before }, scene));
            }
        }
    }
    let (_, corners, scene) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let gained = evidence.elsewhere(&scene).likelihood(settings)? - evidence.likelihood(settings)?;
    (gained > CLEARLY).then_some((corners, scene))
}

/// A wall cut at sampled points.
fn cut(wall: &Wall, max_error_m: f64, per_span: usize, before: bool) -> Chain {
    let points = samples(wall, per_span);
    let last = points.len() - 1;
    let mut corners = vec![0];
    let mut from = 0;
    while let Some(bad) = (from + 2..=last).find(|&to| exceeds(&points[from..=to], max_error_m)) {
        from = if before { bad - 1 } else { bad };
        corners.push(from);
    }
    let vertex = |&i: &usize| {
        let nearest = wall.nearest(points[i]);
        let fraction = if i == 0 { 0.0 } else { nearest.fraction };
        Vertex {
            position: points[i],
            left_normal: wall.left_normal(fraction),
            fraction,
        }
    };
    Chain {
        vertices: corners.iter().map(vertex).collect(),
    }
}

/// Whether a point in between is farther than that from the chord.
fn exceeds(points: &[Vec2], max_error_m: f64) -> bool {
    let (a, b) = (points[0], points[points.len() - 1]);
    let Some(along) = (b - a).try_normalize() else {
        return false;
    };
    points.iter().any(|p| along.perp_dot(*p - a).abs() > max_error_m)
}

/// Points of a wall at equal steps of each span's parameter, the first repeated at the end.
fn samples(wall: &Wall, per_span: usize) -> Vec<Vec2> {
    let mut points = Vec::new();
    for spline in wall.splines() {
        let own = spline.control_points_m();
        let count = own.len();
        let mut control = vec![own[0] * 2.0 - own[1]];
        control.extend_from_slice(own);
        control.push(own[count - 1] * 2.0 - own[count - 2]);
        for p in control.windows(4) {
            points.extend((0..per_span).map(|i| basis(p, i as f64 / per_span as f64)));
        }
    }
    points.push(points[0]);
    points
}

/// A point of a span of a uniform cubic b-spline.
fn basis(p: &[Vec2], u: f64) -> Vec2 {
    let v = 1.0 - u;
    let weights = [
        v * v * v,
        3.0 * u * u * u - 6.0 * u * u + 4.0,
        3.0 * v * v * v - 6.0 * v * v + 4.0,
        u * u * u,
    ];
    p.iter().zip(weights).map(|(p, w)| *p * (w / 6.0)).sum()
}
