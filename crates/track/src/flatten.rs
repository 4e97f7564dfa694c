use crate::crossing::Segment;
use crate::numeric::cubic_extrema;
use crate::spline::Cubic;
use crate::wall::segment_distance_sq;
use crate::{Error, Vec2, Wall};

/// Fewest steps of a scan round the wall; small bumps of the deviation would need more.
const SCAN_STEPS: f64 = 2000.0;
/// Steps of a scan in the shortest chord that the wall's sharpest bend allows.
const STEPS_PER_CHORD: f64 = 6.0;
/// Points looked at in a span that runs past an end of its chord, where no closed form holds.
const SAMPLES: usize = 64;

/// A corner of a wall's straight segments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Where it is; as cut, on the exact wall.
    pub position: Vec2,
    /// Unit vector across the exact wall to the left of the driving direction.
    pub left_normal: Vec2,
    /// Its arc length from the wall's first joint over the length of the wall, in [0, 1).
    pub fraction: f64,
}

/// A wall as straight segments: a closed line whose last vertex joins the first.
///
/// ```
/// use track::Course;
///
/// let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// let chain = course.inner.flatten(0.01)?;
/// assert_eq!(chain.segments().count(), 13);
/// assert!(chain.measured_error_m(&course.inner) <= 0.01 + 1e-9);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Its corners in driving direction, the first on the wall's first joint.
    pub vertices: Vec<Vertex>,
}

impl Chain {
    /// Its segments in driving direction, as many as vertices, each by its two ends.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = (&Vertex, &Vertex)> {
        let count = self.vertices.len();
        (0..count).map(move |i| (&self.vertices[i], &self.vertices[(i + 1) % count]))
    }

    /// The largest distance, in m, of a point of the exact wall from the segment that stands for it.
    pub fn measured_error_m(&self, wall: &Wall) -> f64 {
        let round = wall.spans().len() as f64;
        self.segments()
            .map(|(here, there)| {
                let from = wall.parameter(here.fraction);
                let to = wall.parameter(there.fraction);
                let to = if to > from { to } else { to + round };
                deviation_m(wall, (from, to), (here.position, there.position))
            })
            .fold(0.0, f64::max)
    }
}

impl Wall {
    /// The straight segments that stand for the wall within a maximal error in m: from each vertex on, the chord's
    /// end moves along the wall until a point in between is first farther from the chord than that, and the chord
    /// ends there (Roduit et al., III-A). The last one closes the wall.
    ///
    /// # Errors
    /// For a maximal error outside [1e-9, 10] m, or one that leaves fewer than three segments.
    pub fn flatten(&self, max_error_m: f64) -> Result<Chain, Error> {
        if !(1e-9..=10.0).contains(&max_error_m) {
            return Err(Error::MaxError { max_error_m });
        }
        let step_m = self.scan_step_m(max_error_m);
        let mut vertices = vec![self.vertex(0.0)];
        let mut from = 0.0;
        while let Some(to) = self.chord_end(from, max_error_m, step_m) {
            vertices.push(self.vertex(to));
            from = to;
        }
        if vertices.len() < 3 {
            let (wall, segments) = (self.name().to_owned(), vertices.len());
            return Err(Error::TooCoarse {
                wall,
                max_error_m,
                segments,
            });
        }
        Ok(Chain { vertices })
    }

    /// Arc length between two looks at the deviation, short beside any chord.
    fn scan_step_m(&self, max_error_m: f64) -> f64 {
        let sharpest = self
            .spans()
            .iter()
            .flat_map(|span| (0..16).map(|i| span.curvature(f64::from(i) / 16.0)))
            .fold(0.0, f64::max);
        let chord_m = (8.0 * max_error_m / sharpest).sqrt(); // a circle's sagitta is its curvature times the chord squared over 8
        (chord_m / STEPS_PER_CHORD).min(self.length_m() / SCAN_STEPS)
    }

    /// Where the deviation of the chord from `from` first exceeds the maximal error, by a scan and then by halving;
    /// `None` where it stays within it to the end of the wall.
    fn chord_end(&self, from: f64, max_error_m: f64, step_m: f64) -> Option<f64> {
        let round = self.spans().len() as f64;
        let start = self.at(from).0;
        let exceeds = |to: f64| deviation_m(self, (from, to), (start, self.at(to).0)) > max_error_m;
        let mut low = from;
        let mut high = from;
        while !exceeds(high) {
            if high >= round {
                return None;
            }
            low = high;
            high = (high + step_m / self.at(high).1.length()).min(round);
        }
        while high - low > 1e-13 * round {
            let middle = 0.5 * (low + high);
            if exceeds(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(low)
    }

    fn vertex(&self, w: f64) -> Vertex {
        let (position, velocity) = self.at(w);
        Vertex {
            position,
            left_normal: velocity.normalize().perp(),
            fraction: self.fraction(w),
        }
    }

    /// Point and first derivative at a parameter that counts spans from the first joint.
    fn at(&self, w: f64) -> (Vec2, Vec2) {
        let span = (w as usize).min(self.spans().len() - 1);
        let (cubic, u) = (&self.spans()[span], w - span as f64);
        (cubic.point(u), cubic.velocity(u))
    }
}

/// The largest distance from a chord to the wall between two parameters; the second may count past the wall's end.
fn deviation_m(wall: &Wall, (from, to): (f64, f64), chord: Segment) -> f64 {
    let count = wall.spans().len();
    let mut largest_sq = 0.0_f64;
    let mut span = from as usize;
    while (span as f64) < to {
        let (low, high) = ((from - span as f64).max(0.0), (to - span as f64).min(1.0));
        largest_sq = largest_sq.max(span_deviation_sq(&wall.spans()[span % count], (low, high), chord));
        span += 1;
    }
    largest_sq.sqrt()
}

/// The same for a stretch of one span, squared. Beside the chord the distance is a cubic, whose extrema are known;
/// past its ends the stretch is sampled.
fn span_deviation_sq(cubic: &Cubic, (low, high): (f64, f64), chord: Segment) -> f64 {
    let along = chord.1 - chord.0;
    let distance_sq = |u: f64| segment_distance_sq(cubic.point(u), chord);
    let beside = |u: f64| (0.0..=along.length_squared()).contains(&(cubic.point(u) - chord.0).dot(along));
    let mut largest_sq = distance_sq(low).max(distance_sq(high));
    cubic_extrema(cubic.coordinate(chord.0, along.perp()), |u| {
        if u > low && u < high {
            largest_sq = largest_sq.max(distance_sq(u));
        }
    });
    let inner = |u: f64| low + (high - low) * u;
    let mut all_beside = beside(inner(1e-3)) && beside(inner(1.0 - 1e-3)); // the chord's own ends may round to outside
    cubic_extrema(cubic.coordinate(chord.0, along), |u| {
        all_beside &= u <= low || u >= high || beside(u);
    });
    if !all_beside {
        let samples = (1..SAMPLES).map(|i| distance_sq(inner(i as f64 / SAMPLES as f64)));
        largest_sq = samples.fold(largest_sq, f64::max);
    }
    largest_sq
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{circuit, ring};
    use proptest::prelude::*;

    #[test]
    fn circuit_has_the_papers_counts() {
        let course = circuit();
        for (error_m, outer, inner) in [(0.001, 61, 44), (0.005, 27, 20), (0.01, 20, 13), (0.05, 9, 6)] {
            for (wall, count) in [(&course.outer, outer), (&course.inner, inner)] {
                let chain = wall.flatten(error_m).unwrap();
                assert_eq!(chain.vertices.len(), count, "{} wall, {error_m} m", wall.name());
                let measured_m = chain.measured_error_m(wall);
                assert!(
                    (measured_m / error_m - 1.0).abs() < 1e-9,
                    "{measured_m} of {error_m}"
                );
            }
        }
    }

    #[test]
    fn vertices_lie_on_the_wall_in_order() {
        let wall = circuit().outer;
        let chain = wall.flatten(0.005).unwrap();
        assert_eq!(chain.vertices[0].fraction, 0.0);
        assert!(chain.vertices.is_sorted_by(|a, b| a.fraction < b.fraction));
        for vertex in &chain.vertices {
            assert!(wall.point(vertex.fraction).distance(vertex.position) < 1e-12);
            assert!(wall.left_normal(vertex.fraction).distance(vertex.left_normal) < 1e-9);
        }
    }

    /// The same looked at point by point.
    fn sampled_error_m(chain: &Chain, wall: &Wall) -> f64 {
        let segments: Vec<_> = chain.segments().collect();
        let distance_m = |fraction: f64| {
            let index = segments.partition_point(|(from, _)| from.fraction <= fraction) - 1;
            let chord = (segments[index].0.position, segments[index].1.position);
            segment_distance_sq(wall.point(fraction), chord).sqrt()
        };
        (0..20_000)
            .map(|i| distance_m(f64::from(i) / 20_000.0))
            .fold(0.0, f64::max)
    }

    #[test]
    fn measured_error_agrees_with_points_looked_at_one_by_one() {
        let wall = circuit().inner;
        let mut chain = wall.flatten(0.01).unwrap();
        let (measured_m, sampled_m) = (chain.measured_error_m(&wall), sampled_error_m(&chain, &wall));
        assert!(
            (measured_m - sampled_m).abs() < 1e-7,
            "{measured_m} and {sampled_m}"
        );
        chain.vertices[4].position += Vec2::new(0.004, 0.02); // a moved vertex is measured where it is
        let (measured_m, sampled_m) = (chain.measured_error_m(&wall), sampled_error_m(&chain, &wall));
        let step_m = wall.length_m() / 20_000.0; // the largest distance is that of the vertex itself
        assert!(
            (measured_m - sampled_m).abs() < step_m,
            "{measured_m} and {sampled_m}"
        );
        assert!((measured_m - 0.004_f64.hypot(0.02)).abs() < 1e-9, "{measured_m}");
    }

    #[test]
    fn refuses_errors_that_leave_nothing() {
        let wall = circuit().inner;
        for bad in [0.0, -0.01, f64::NAN, f64::INFINITY] {
            assert!(matches!(wall.flatten(bad), Err(Error::MaxError { .. })), "{bad}");
        }
        let message = wall.flatten(2.0).unwrap_err().to_string();
        assert_eq!(
            message,
            "maximal error 2 m leaves only 1 segments of the inner wall; take a smaller one"
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn measured_error_never_exceeds_the_bound(wall in ring(), log_error in -4.0..-1.31_f64) {
            let error_m = 10_f64.powf(log_error); // 0.1 to 50 mm
            match wall.flatten(error_m) {
                Ok(chain) => {
                    let measured_m = chain.measured_error_m(&wall);
                    prop_assert!(measured_m <= error_m * (1.0 + 1e-6), "{measured_m} of {error_m}");
                }
                Err(error) => prop_assert!(matches!(error, Error::TooCoarse { .. }), "{error}"),
            }
        }

        #[test]
        fn segments_grow_with_the_root_of_the_error(wall in ring(), error_m in 1e-5..1e-4_f64) {
            let count = |error_m| wall.flatten(error_m).unwrap().vertices.len() as f64;
            let ratio = count(error_m / 4.0) / count(error_m);
            prop_assert!((ratio - 2.0).abs() < 0.1, "{ratio} times the segments for a quarter of the error");
        }
    }
}
