use crate::crossing::{Segment, crossing};
use crate::numeric::{cubic_roots, integral, sign_change};
use crate::spline::{Cubic, Spline};
use crate::{Error, Vec2};

/// Neighbouring splines may miss each other, in position and in derivative, by no more than this.
const JOINT_TOLERANCE_M: f64 = 1e-4;
/// Pieces of one span in the table of arc lengths and in the search for the nearest point.
const PIECES: usize = 8;
/// Chords of one span when looking for a wall that crosses itself.
const CHORDS: usize = 32;

/// A closed wall: a chain of b-splines that share their joints and the first derivative there.
///
/// ```
/// use track::{Course, Vec2};
///
/// let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// let nearest = course.outer.nearest(Vec2::new(0.5477, 0.9282));
/// assert!((nearest.distance_m - 0.0965).abs() < 1e-4);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Wall {
    name: String,
    splines: Vec<Spline>,
    spans: Vec<Cubic>,
    pieces: Vec<Piece>,
    /// Middles of the pieces, apart because the search looks at all of them.
    middles: Vec<Vec2>,
    length_m: f64,
}

/// The point of a wall that is nearest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Distance to it, not negative.
    pub distance_m: f64,
    /// Its arc length from the wall's first joint over the length of the wall, in [0, 1).
    pub fraction: f64,
    /// Where it is.
    pub point: Vec2,
}

/// A stretch of one span, `from` to `to` in its parameter.
#[derive(Debug, Clone, Copy)]
struct Piece {
    span: usize,
    from: f64,
    to: f64,
    /// Arc length from the wall's first joint to `from`.
    start_m: f64,
    length_m: f64,
    /// No point of the piece is farther from its middle.
    radius_m: f64,
    chord: Segment,
    /// No point of the piece is farther from its chord.
    sagitta_m: f64,
}

/// A point of a wall by its span and the parameter in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Foot {
    pub(crate) distance_sq: f64,
    pub(crate) point: Vec2,
    span: usize,
    u: f64,
}

impl Wall {
    /// A wall of splines in driving direction, the last one ending where the first one starts. What neighbours
    /// may still miss each other by (0.1 mm) is taken from the later spline's first point.
    ///
    /// # Errors
    /// Where splines do not meet, or not smoothly, where the wall turns back on the spot, and where it crosses itself.
    pub fn new(name: &str, splines: Vec<Spline>) -> Result<Self, Error> {
        if splines.is_empty() {
            return Err(Error::NoSplines { wall: name.into() });
        }
        let splines = joined(name, splines)?;
        let spans: Vec<Cubic> = splines.iter().flat_map(Spline::spans).collect();
        let mut wall = Self {
            name: name.into(),
            splines,
            spans,
            pieces: Vec::new(),
            middles: Vec::new(),
            length_m: 0.0,
        };
        for span in 0..wall.spans.len() {
            for piece in 0..PIECES {
                wall.add_piece(span, piece)?;
            }
        }
        wall.check_self_crossing()?;
        Ok(wall)
    }

    fn add_piece(&mut self, span: usize, index: usize) -> Result<(), Error> {
        let cubic = self.spans[span];
        let [from, middle, to] = [0.0, 0.5, 1.0].map(|part| (index as f64 + part) / PIECES as f64);
        let [before, after] = [from, to].map(|u| cubic.velocity(u));
        if !(before.dot(after) > 0.0 && before.length_squared().min(after.length_squared()) > 1e-14) {
            let (wall, spline) = (self.name.clone(), self.spline_of(span));
            return Err(Error::Cusp {
                wall,
                spline,
                at_m: cubic.point(middle),
            });
        }
        let speed = |u: f64| cubic.velocity(u).length();
        let (first_m, second_m) = (integral(from, middle, speed), integral(middle, to, speed));
        // linear interpolation misses a curve by at most h^2/8 of its largest second derivative, which in a cubic is at an end
        let bend = [from, to].map(|u| cubic.acceleration(u).length());
        self.pieces.push(Piece {
            span,
            from,
            to,
            start_m: self.length_m,
            length_m: first_m + second_m,
            radius_m: first_m.max(second_m),
            chord: (cubic.point(from), cubic.point(to)),
            sagitta_m: bend[0].max(bend[1]) * (to - from).powi(2) / 8.0,
        });
        self.middles.push(cubic.point(middle));
        self.length_m += first_m + second_m;
        Ok(())
    }

    fn check_self_crossing(&self) -> Result<(), Error> {
        let chords = self.chords();
        let last = chords.len() - 1;
        let apart = |i: usize, j: usize| j > i + 1 && !(i == 0 && j == last);
        match crossing(&chords, apart) {
            None => Ok(()),
            Some((i, j, at_m)) => Err(Error::SelfCrossing {
                wall: self.name.clone(),
                spline: self.spline_of(i / CHORDS),
                other: self.spline_of(j / CHORDS),
                at_m,
            }),
        }
    }

    /// Number of the spline, from 1, that a span belongs to.
    fn spline_of(&self, span: usize) -> usize {
        let mut end = 0;
        let owner = self.splines.iter().position(|spline| {
            end += spline.control_points_m().len() - 1;
            span < end
        });
        owner.map_or(self.splines.len(), |index| index + 1)
    }

    /// Closely spaced chords all the way round, for checks of order and crossing.
    pub(crate) fn chords(&self) -> Vec<Segment> {
        let at = |index: usize| {
            let span = self.spans[index / CHORDS % self.spans.len()];
            span.point((index % CHORDS) as f64 / CHORDS as f64)
        };
        (0..self.spans.len() * CHORDS)
            .map(|i| (at(i), at(i + 1)))
            .collect()
    }

    /// Its name, by which errors call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its length once round, within 1e-10 m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Its splines in driving direction.
    pub fn splines(&self) -> &[Spline] {
        &self.splines
    }

    /// The points where its splines meet, in driving direction from the first spline's start.
    pub fn joints(&self) -> impl ExactSizeIterator<Item = Vec2> + '_ {
        self.splines.iter().map(Spline::first)
    }

    /// The point at a fraction of the arc length from the first joint in driving direction; whole turns are dropped.
    pub fn point(&self, fraction: f64) -> Vec2 {
        let (span, u) = self.place(fraction);
        self.spans[span].point(u)
    }

    /// The unit vector to the left of the driving direction at a fraction of the arc length, as [`Wall::point`] has it.
    pub fn left_normal(&self, fraction: f64) -> Vec2 {
        let (span, u) = self.place(fraction);
        self.spans[span].velocity(u).normalize().perp()
    }

    /// The point of the wall nearest to `p`, within 1e-10 m.
    pub fn nearest(&self, p: Vec2) -> Nearest {
        let foot = self.foot(p);
        Nearest {
            distance_m: foot.distance_sq.sqrt(),
            fraction: self.fraction(foot.span as f64 + foot.u),
            point: foot.point,
        }
    }

    /// Span and parameter at a fraction of the arc length.
    fn place(&self, fraction: f64) -> (usize, f64) {
        let along_m = (fraction - fraction.floor()) * self.length_m;
        let later = self.pieces.partition_point(|piece| piece.start_m <= along_m);
        let piece = self.pieces[later.saturating_sub(1)];
        let cubic = self.spans[piece.span];
        let rest_m = (along_m - piece.start_m).min(piece.length_m);
        let speed = |u: f64| cubic.velocity(u).length();
        let u = sign_change(piece.from, piece.to, |u| {
            (integral(piece.from, u, speed) - rest_m, speed(u))
        });
        (piece.span, u)
    }

    /// Fraction of the arc length, in [0, 1), at a parameter that counts spans from the first joint.
    pub(crate) fn fraction(&self, w: f64) -> f64 {
        let span = (w as usize).min(self.spans.len() - 1);
        let u = w - span as f64;
        let index = span * PIECES + ((u * PIECES as f64) as usize).min(PIECES - 1);
        let (piece, cubic) = (&self.pieces[index], &self.spans[span]);
        let along_m = piece.start_m + integral(piece.from, u, |u| cubic.velocity(u).length());
        let fraction = along_m / self.length_m;
        if fraction < 1.0 { fraction.max(0.0) } else { 0.0 }
    }

    /// The parameter that counts spans from the first joint, at a fraction of the arc length.
    pub(crate) fn parameter(&self, fraction: f64) -> f64 {
        let (span, u) = self.place(fraction);
        span as f64 + u
    }

    pub(crate) fn spans(&self) -> &[Cubic] {
        &self.spans
    }

    /// The nearest point: pieces too far by their middle or their chord are left out, the others searched.
    pub(crate) fn foot(&self, p: Vec2) -> Foot {
        let nearest_sq = self
            .middles
            .iter()
            .map(|m| m.distance_squared(p))
            .fold(f64::INFINITY, f64::min);
        let mut best = Foot {
            distance_sq: f64::INFINITY,
            point: p,
            span: 0,
            u: 0.0,
        };
        let mut reach_m = nearest_sq.sqrt();
        for (piece, middle) in self.pieces.iter().zip(&self.middles) {
            let far_m = reach_m + piece.radius_m;
            if middle.distance_squared(p) > far_m * far_m {
                continue;
            }
            let far_m = reach_m + piece.sagitta_m;
            if segment_distance_sq(p, piece.chord) > far_m * far_m {
                continue;
            }
            self.search(piece, p, &mut best);
            reach_m = reach_m.min(best.distance_sq.sqrt());
        }
        best
    }

    /// Betters `best` by the points of one piece. Near the centre of a bend the distance can have two minima in a
    /// piece, so each quarter is looked at by itself.
    fn search(&self, piece: &Piece, p: Vec2, best: &mut Foot) {
        const QUARTERS: usize = 4;
        let cubic = &self.spans[piece.span];
        let mut consider = |u: f64, point: Vec2| {
            let distance_sq = point.distance_squared(p);
            if distance_sq < best.distance_sq {
                *best = Foot {
                    distance_sq,
                    point,
                    span: piece.span,
                    u,
                };
            }
        };
        let (mut low, mut low_slope) = (piece.from, f64::INFINITY);
        for quarter in 0..=QUARTERS {
            let u = piece.from + (piece.to - piece.from) * quarter as f64 / QUARTERS as f64;
            let point = cubic.point(u);
            let slope = (point - p).dot(cubic.velocity(u));
            consider(u, point);
            if low_slope < 0.0 && slope > 0.0 {
                let root = sign_change(low, u, |u| {
                    let (away, velocity) = (cubic.point(u) - p, cubic.velocity(u));
                    (
                        away.dot(velocity),
                        velocity.length_squared() + away.dot(cubic.acceleration(u)),
                    )
                });
                consider(root, cubic.point(root));
            }
            (low, low_slope) = (u, slope);
        }
    }

    /// Distance from `origin` along the unit vector `axis` to the first point of the wall, if there is one.
    pub(crate) fn along(&self, origin: Vec2, axis: Vec2) -> Option<f64> {
        let mut first = f64::INFINITY;
        for cubic in &self.spans {
            cubic_roots(cubic.coordinate(origin, axis.perp()), |u| {
                let distance_m = (cubic.point(u) - origin).dot(axis);
                if distance_m > 0.0 {
                    first = first.min(distance_m);
                }
            });
        }
        first.is_finite().then_some(first)
    }
}

/// The splines with shared joints, if they meet closely enough.
fn joined(name: &str, splines: Vec<Spline>) -> Result<Vec<Spline>, Error> {
    let count = splines.len();
    for index in 0..count {
        let (spline, next) = (index + 1, (index + 1) % count + 1);
        let (here, there) = (&splines[index], &splines[next - 1]);
        let wall = || name.to_owned();
        let mismatch_m = here.last().distance(there.first());
        if mismatch_m > JOINT_TOLERANCE_M {
            return Err(Error::Gap {
                wall: wall(),
                spline,
                next,
                mismatch_m,
                mend_m: here.last(),
            });
        }
        let mismatch_m = here.arrival().distance(there.departure());
        if mismatch_m > JOINT_TOLERANCE_M {
            let mend_m = there.first() + here.arrival();
            return Err(Error::Corner {
                wall: wall(),
                spline,
                next,
                mismatch_m,
                mend_m,
            });
        }
    }
    let ends: Vec<Vec2> = splines.iter().map(Spline::last).collect();
    let firsts = (0..count).map(|index| ends[(index + count - 1) % count]);
    Ok(splines
        .into_iter()
        .zip(firsts)
        .map(|(spline, first)| spline.starting_at(first))
        .collect())
}

/// Square of the distance from a point to a segment.
pub(crate) fn segment_distance_sq(p: Vec2, (a, b): Segment) -> f64 {
    let (along, to) = (b - a, p - a);
    let length_sq = along.length_squared();
    let part = if length_sq > 0.0 {
        (to.dot(along) / length_sq).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (to - part * along).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{circuit, on_ellipse, ring, ring_through};
    use proptest::prelude::*;

    /// Two straights of 1 m, joined by two bends.
    fn stadium() -> Wall {
        let v = |points: &[(f64, f64)]| {
            Spline::new(points.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap()
        };
        let splines = vec![
            v(&[(0.0, 1.0), (0.5, 1.0), (1.0, 1.0)]),
            v(&[(1.0, 1.0), (1.5, 1.0), (1.5, 0.0), (1.0, 0.0)]),
            v(&[(1.0, 0.0), (0.5, 0.0), (0.0, 0.0)]),
            v(&[(0.0, 0.0), (-0.5, 0.0), (-0.5, 1.0), (0.0, 1.0)]),
        ];
        Wall::new("stadium", splines).unwrap()
    }

    #[test]
    fn straights_are_measured_exactly() {
        let wall = stadium();
        let along = |distance_m: f64| wall.point(distance_m / wall.length_m());
        for distance_m in [0.0, 0.125, 0.3, 0.99] {
            assert!(along(distance_m).distance(Vec2::new(distance_m, 1.0)) < 1e-14);
            assert!(wall.left_normal(distance_m / wall.length_m()).distance(Vec2::Y) < 1e-15);
        }
        let opposite = 0.5 + 0.25 / wall.length_m();
        assert!(wall.point(opposite).distance(Vec2::new(0.75, 0.0)) < 1e-12);
        assert_eq!(wall.joints().len(), 4);
    }

    #[test]
    fn nearest_point_of_a_straight_is_the_foot() {
        let wall = stadium();
        let nearest = wall.nearest(Vec2::new(0.3, 1.25));
        assert!((nearest.distance_m - 0.25).abs() < 1e-15, "{nearest:?}");
        assert!(
            (nearest.fraction * wall.length_m() - 0.3).abs() < 1e-12,
            "{nearest:?}"
        );
        assert!(nearest.point.distance(Vec2::new(0.3, 1.0)) < 1e-12, "{nearest:?}");
    }

    #[test]
    fn length_is_that_of_ever_finer_chords() {
        let wall = circuit().outer;
        let chords_m = |count: u32| {
            let at = |i: u32| wall.point(f64::from(i) / f64::from(count));
            (0..count).map(|i| at(i).distance(at(i + 1))).sum::<f64>()
        };
        let (coarse_m, fine_m) = (chords_m(5000), chords_m(10_000));
        let extrapolated_m = fine_m + (fine_m - coarse_m) / 3.0;
        let length_m = wall.length_m();
        assert!(
            (length_m - extrapolated_m).abs() < 1e-10,
            "{length_m} and {extrapolated_m}"
        );
    }

    #[test]
    fn first_hit_of_a_ray_is_on_the_wall() {
        let wall = stadium();
        let middle = Vec2::new(0.5, 0.5);
        assert!((wall.along(middle, Vec2::Y).unwrap() - 0.5).abs() < 1e-15);
        let right_m = wall.along(middle, Vec2::X).unwrap();
        assert!(wall.nearest(middle + right_m * Vec2::X).distance_m < 1e-14);
        assert_eq!(wall.along(Vec2::new(0.5, 3.0), Vec2::Y), None);
    }

    #[test]
    fn names_the_spline_that_does_not_fit() {
        let mut splines = stadium().splines().to_vec();
        splines[2] = Spline::new(vec![Vec2::new(1.0, -0.01), Vec2::new(0.5, 0.0), Vec2::ZERO]).unwrap();
        let gap = Wall::new("outer", splines.clone()).unwrap_err().to_string();
        let expected = "outer wall: spline 2 ends 0.010000 m away from where spline 3 starts; \
                        let spline 3 start at [1.00000, 0.00000]";
        assert_eq!(gap, expected);
        splines[2] = Spline::new(vec![Vec2::X, Vec2::new(0.51, 0.0), Vec2::ZERO]).unwrap();
        let corner = Wall::new("outer", splines.clone()).unwrap_err().to_string();
        let expected = "outer wall: the first derivative jumps by 0.010000 m from spline 2 to spline 3; \
                        move the second control point of spline 3 to [0.50000, 0.00000]";
        assert_eq!(corner, expected);
        splines.truncate(2);
        let open = Wall::new("outer", splines).unwrap_err();
        assert!(
            matches!(
                open,
                Error::Gap {
                    spline: 2,
                    next: 1,
                    ..
                }
            ),
            "{open}"
        );
        assert!(matches!(Wall::new("outer", vec![]), Err(Error::NoSplines { .. })));
    }

    #[test]
    fn small_gaps_are_closed() {
        let mut splines = stadium().splines().to_vec();
        splines[2] = splines[2].clone().starting_at(Vec2::new(1.0, 5e-5));
        let wall = Wall::new("outer", splines).unwrap();
        assert_eq!(wall.splines()[2].control_points_m()[0], Vec2::X);
    }

    #[test]
    fn refuses_walls_that_cross_themselves_or_turn_on_the_spot() {
        let v = |points: &[(f64, f64)]| {
            Spline::new(points.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap()
        };
        let eight = vec![
            v(&[
                (0.0, 0.0),
                (0.3, 0.3),
                (0.9, 0.3),
                (0.9, -0.3),
                (0.3, -0.3),
                (0.0, 0.0),
            ]),
            v(&[
                (0.0, 0.0),
                (-0.3, 0.3),
                (-0.9, 0.3),
                (-0.9, -0.3),
                (-0.3, -0.3),
                (0.0, 0.0),
            ]),
        ];
        match Wall::new("inner", eight) {
            Err(Error::SelfCrossing { at_m, .. }) => assert!(at_m.length() < 1e-9, "{at_m}"),
            other => panic!("{other:?}"),
        }
        let there_and_back = v(&[
            (0.0, 0.0),
            (0.3, 0.0),
            (0.6, 0.0),
            (0.3, 0.0),
            (-0.3, 0.0),
            (0.0, 0.0),
        ]);
        let error = Wall::new("inner", vec![there_and_back]).unwrap_err();
        assert!(matches!(error, Error::Cusp { spline: 1, .. }), "{error}");
    }

    #[test]
    fn nearest_is_exact_where_it_is_about_to_jump() {
        // near the centre of a ring the nearest point could be anywhere
        let wall = ring_through("round", 4, |index| on_ellipse([0.1, 0.1], index as f64 / 20.0));
        for (x, y) in [(1.0, 1.0), (1.001, 1.0), (0.999, 1.002), (1.01, 1.01)] {
            assert_nearest(&wall, Vec2::new(x, y));
        }
    }

    fn assert_nearest(wall: &Wall, p: Vec2) {
        let nearest = wall.nearest(p);
        let brute_m = (0..4000)
            .map(|i| wall.point(f64::from(i) / 4000.0).distance(p))
            .fold(f64::INFINITY, f64::min);
        let (found_m, step_m) = (nearest.distance_m, wall.length_m() / 4000.0);
        assert!(
            found_m <= brute_m + 1e-12 && found_m >= brute_m - step_m,
            "{found_m} and {brute_m}"
        );
        assert!(wall.point(nearest.fraction).distance(nearest.point) < 1e-10);
        assert!((nearest.point.distance(p) - found_m).abs() < 1e-15);
        let along_m = (p - nearest.point).dot(wall.left_normal(nearest.fraction).perp());
        assert!(along_m.abs() < 1e-10, "the foot is {along_m} m off");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn nearest_beats_every_other_point(wall in ring(), x in 0.0..2.0_f64, y in 0.0..2.0_f64) {
            assert_nearest(&wall, Vec2::new(x, y));
        }

        #[test]
        fn fractions_go_along_the_wall_at_constant_speed(wall in ring(), fraction in -1.0..2.0_f64) {
            let step = 1e-4;
            let moved = wall.point(fraction + step) - wall.point(fraction - step);
            let speed = moved.length() / (2.0 * step * wall.length_m());
            prop_assert!((speed - 1.0).abs() < 1e-4, "{speed}");
            let normal = wall.left_normal(fraction);
            prop_assert!(normal.dot(moved.normalize()).abs() < 1e-3);
            prop_assert!((normal.length() - 1.0).abs() < 1e-14);
            prop_assert!(wall.point(fraction).distance(wall.point(fraction + 1.0)) < 1e-10);
            let back = wall.fraction(wall.parameter(fraction));
            let off = (back - fraction).rem_euclid(1.0);
            prop_assert!(off.min(1.0 - off) < 1e-12, "{fraction} came back as {back}");
        }
    }
}
