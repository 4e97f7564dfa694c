//! Where the walls are cut: two programs that look at different points of a wall put its corners at different places,
//! and where a wall is nearly straight a micrometre of tolerance moves a corner by centimetres. The logs say which
//! points were looked at.

use sim::{Model, Scene, Vec2};
use track::{Chain, Side, Vertex, Wall};

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

/// The declared walls cut by programs that look at so many points of each span, where that gives as many pieces as the
/// exact cut; another number of pieces would be another declaration. `model` is what the scenes are for.
pub(crate) fn cuts(scene: &Scene, model: &Model, per_span: &[usize]) -> Vec<(Corners, Scene)> {
    let counts = scene.chains().map(|chain| chain.vertices.len());
    let ways = per_span
        .iter()
        .flat_map(|&per_span| [true, false].map(|before| Corners { per_span, before }));
    ways.filter_map(|corners| {
        let course = &scene.circuit().course;
        let [outer, inner] =
            [Side::Outer, Side::Inner].map(|side| cut(course.wall(side), model.wall.max_error_m, corners));
        let same = [outer.vertices.len(), inner.vertices.len()] == counts;
        same.then(|| (corners, scene.recut(model, outer, inner)))
    })
    .collect()
}

/// The declared scene with its walls cut at sampled points, a few ways: what another program may make of the same
/// declaration.
pub fn other_cuts(scene: &Scene, model: &Model) -> Vec<Scene> {
    const FEW: [usize; 3] = [64, 100, 200];
    cuts(scene, model, &FEW)
        .into_iter()
        .map(|(_, scene)| scene)
        .collect()
}

/// A wall cut at sampled points.
fn cut(wall: &Wall, max_error_m: f64, corners: Corners) -> Chain {
    let Corners { per_span, before } = corners;
    let points = samples(wall, per_span);
    let last = points.len() - 1;
    let mut ends = vec![0];
    let mut from = 0;
    while let Some(bad) = (from + 2..=last).find(|&to| exceeds(&points[from..=to], max_error_m)) {
        from = if before { bad - 1 } else { bad };
        ends.push(from);
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
        vertices: ends.iter().map(vertex).collect(),
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
