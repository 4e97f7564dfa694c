//! The straight pieces that rays hit and the body touches.

use track::{Chain, Side, Vec2};

/// Where on a wall a point lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPlace {
    /// Which wall.
    pub side: Side,
    /// Fraction of the exact wall's length from its first joint in driving direction, in [0, 1).
    pub fraction: f64,
}

/// What is remembered of a straight piece: the wall and the stretch of it that the piece stands for, by fractions in [0, 2).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    side: Side,
    fractions: [f64; 2],
}

/// All walls as straight pieces: closed outlines of vertices, each joined to the next.
///
/// Vertex `i` and vertex `i + 1` of one outline are segment `i`; the first vertex of an outline is repeated as its
/// last, so a run of neighbouring segments is a run of neighbouring vertices. The numbers of the last vertices are
/// skipped: no segment has them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Walls {
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    /// Of each segment, to the left of its direction.
    normals: Vec<Vec2>,
    pieces: Vec<Option<Piece>>,
}

impl Walls {
    /// The walls of two closed chains, as lines or, for a thickness above zero, as boxes of that thickness about
    /// every piece of a chain (as in Webots: the boxes overlap at the joints, and their corners are not mitred).
    pub fn new(outer: &Chain, inner: &Chain, thickness_m: f64) -> Self {
        let mut walls = Self::default();
        for (side, chain) in [(Side::Outer, outer), (Side::Inner, inner)] {
            if thickness_m > 0.0 {
                walls.push_boxes(side, chain, 0.5 * thickness_m);
            } else {
                walls.push_outline(
                    side,
                    chain
                        .segments()
                        .map(|(a, b)| (a.position, stretch(a.fraction, b.fraction))),
                );
            }
        }
        walls
    }

    /// Walls from bare outlines, each closed by itself; all belong to the outer wall.
    pub fn from_outlines(outlines: &[Vec<Vec2>]) -> Self {
        let mut walls = Self::default();
        for outline in outlines {
            let count = outline.len() as f64;
            walls.push_outline(
                Side::Outer,
                outline
                    .iter()
                    .enumerate()
                    .map(|(i, &p)| (p, [i as f64 / count, (i + 1) as f64 / count])),
            );
        }
        walls
    }

    fn push_outline(&mut self, side: Side, vertices: impl Iterator<Item = (Vec2, [f64; 2])>) {
        let first = self.x_m.len();
        for (position, fractions) in vertices {
            self.x_m.push(position.x);
            self.y_m.push(position.y);
            self.pieces.push(Some(Piece { side, fractions }));
        }
        if self.x_m.len() > first {
            self.x_m.push(self.x_m[first]);
            self.y_m.push(self.y_m[first]);
            self.pieces.push(None);
            for i in first..self.x_m.len() - 1 {
                let along = self.vertex(i + 1) - self.vertex(i);
                self.normals.push(along.normalize_or_zero().perp());
            }
            self.normals.push(Vec2::ZERO);
        }
    }

    fn push_boxes(&mut self, side: Side, chain: &Chain, half_m: f64) {
        for (a, b) in chain.segments() {
            let Some(along) = (b.position - a.position).try_normalize() else {
                continue;
            };
            let left = along.perp() * half_m;
            let [from, to] = stretch(a.fraction, b.fraction);
            let corners = [
                (a.position + left, [from, to]),
                (b.position + left, [to, to]),
                (b.position - left, [to, from]),
                (a.position - left, [from, from]),
            ];
            self.push_outline(side, corners.into_iter());
        }
    }

    /// How far a vertex lies at most from where the same vertex is in other walls, m; infinite where these have others.
    pub(crate) fn farthest_moved_m(&self, other: &Self) -> f64 {
        if self.pieces != other.pieces {
            return f64::INFINITY;
        }
        (0..self.x_m.len())
            .map(|i| self.vertex(i).distance(other.vertex(i)))
            .fold(0.0, f64::max)
    }

    /// Number of straight pieces.
    pub fn len(&self) -> usize {
        self.pieces.iter().flatten().count()
    }

    /// Whether there is no wall at all.
    pub fn is_empty(&self) -> bool {
        self.x_m.is_empty()
    }

    /// The numbers of all segments with their ends, m.
    pub fn segments(&self) -> impl Iterator<Item = (usize, Vec2, Vec2)> + '_ {
        (0..self.pieces.len())
            .filter(|&i| self.pieces[i].is_some())
            .map(|i| (i, self.vertex(i), self.vertex(i + 1)))
    }

    /// The numbers of the vertices of each outline, the repeated one included.
    pub(crate) fn outlines(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        let ends = (0..self.pieces.len())
            .filter(|&i| self.pieces[i].is_none())
            .map(|i| i + 1);
        let mut start = 0;
        ends.map(move |end| std::mem::replace(&mut start, end)..end)
    }

    /// Vertex `i`, m.
    #[inline]
    pub fn vertex(&self, i: usize) -> Vec2 {
        Vec2::new(self.x_m[i], self.y_m[i])
    }

    /// The coordinates of the vertices, m, one list each.
    #[inline]
    pub(crate) fn coordinates_m(&self) -> (&[f64], &[f64]) {
        (&self.x_m, &self.y_m)
    }

    /// Unit vector across a segment, to the left of its direction.
    #[inline]
    pub fn normal(&self, segment: usize) -> Vec2 {
        self.normals[segment]
    }

    /// The coordinates of [`Walls::normal`] of several segments, one list each.
    #[inline]
    pub(crate) fn normals<const N: usize>(&self, segments: [u32; N]) -> ([f64; N], [f64; N]) {
        let normals = segments.map(|segment| self.normal(segment as usize));
        (normals.map(|n| n.x), normals.map(|n| n.y))
    }

    /// Which wall a segment is a piece of.
    #[inline]
    pub(crate) fn side(&self, segment: usize) -> Side {
        self.piece(segment).side
    }

    #[inline]
    fn piece(&self, segment: usize) -> Piece {
        self.pieces[segment].expect("a caster returns numbers of segments")
    }

    /// The place on the exact wall that a point of a segment stands for.
    pub fn place(&self, segment: usize, point: Vec2) -> WallPlace {
        let piece = self.piece(segment);
        let (a, b) = (self.vertex(segment), self.vertex(segment + 1));
        let along =
            ((point - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let [from, to] = piece.fractions;
        let fraction = from + along * (to - from);
        WallPlace {
            side: piece.side,
            fraction: if fraction < 1.0 { fraction } else { fraction - 1.0 },
        }
    }

    /// Lower left and upper right corner of everything, m.
    pub(crate) fn bounds_m(&self) -> (Vec2, Vec2) {
        let start = (Vec2::splat(f64::INFINITY), Vec2::splat(f64::NEG_INFINITY));
        (0..self.x_m.len())
            .map(|i| self.vertex(i))
            .fold(start, |(low, high), p| (low.min(p), high.max(p)))
    }
}

/// The fractions of a wall's length from one point of it on to another, the second in [0, 2): the last piece goes on to the first point.
fn stretch(from: f64, to: f64) -> [f64; 2] {
    [from, if to < from { to + 1.0 } else { to }]
}

/// The point of the segment from `a` to `b` that is nearest to `p`.
#[inline]
pub(crate) fn nearest_on_segment(a: Vec2, b: Vec2, p: Vec2) -> Vec2 {
    let along = b - a;
    let length2 = along.length_squared();
    if length2 == 0.0 {
        return a;
    }
    a + along * ((p - a).dot(along) / length2).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use crate::effects::testing::{declared, scene};

    #[test]
    fn both_faces_of_a_thick_wall_are_where_its_middle_is() {
        const THICKNESS_M: f64 = 0.01;
        let mut model = declared();
        model.wall.thickness_m = THICKNESS_M;
        let scene = Scene::new(scene().circuit().clone().into(), &model, None).unwrap();
        let course = &scene.circuit().course;
        for (segment, a, b) in scene.walls().segments() {
            for point in [0.01, 0.3, 0.5, 0.99].map(|share| a + (b - a) * share) {
                let place = scene.walls().place(segment, point);
                let wall = match place.side {
                    Side::Outer => &course.outer,
                    Side::Inner => &course.inner,
                };
                assert!((0.0..1.0).contains(&place.fraction), "{place:?}");
                // Half of the thickness, what cutting the wall is off, and what the way along a bend is longer than its chord.
                let off_m = wall.point(place.fraction).distance(point);
                assert!(
                    off_m < THICKNESS_M + model.wall.max_error_m,
                    "{place:?}: {off_m} m"
                );
            }
        }
    }
}
