use crate::{Error, Vec2};

/// A uniform cubic b-spline that starts on its first control point, ends on its last one, and is straight
/// (has no second derivative) at both.
///
/// ```
/// use track::{Spline, Vec2};
///
/// let spline = Spline::new(vec![Vec2::new(0.0, 0.0), Vec2::new(0.1, 0.0), Vec2::new(0.2, 0.1)])?;
/// assert_eq!(spline.control_points_m().len(), 3);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    control_points_m: Vec<Vec2>,
}

impl Spline {
    /// A spline of at least two control points, in m.
    ///
    /// # Errors
    /// With fewer than two points, or where a coordinate is not finite.
    pub fn new(control_points_m: Vec<Vec2>) -> Result<Self, Error> {
        let count = control_points_m.len();
        if count < 2 {
            return Err(Error::FewPoints { count });
        }
        for (index, point) in control_points_m.iter().enumerate() {
            for (axis, value) in [('x', point.x), ('y', point.y)] {
                if !value.is_finite() {
                    let what = format!("{axis} of control point {}", index + 1);
                    return Err(Error::NotFinite { what, value });
                }
            }
        }
        Ok(Self { control_points_m })
    }

    /// Its control points in driving direction, without the phantom points at the ends.
    pub fn control_points_m(&self) -> &[Vec2] {
        &self.control_points_m
    }

    pub(crate) fn first(&self) -> Vec2 {
        self.control_points_m[0]
    }

    pub(crate) fn last(&self) -> Vec2 {
        self.control_points_m[self.control_points_m.len() - 1]
    }

    /// First derivative at the start, by the spline's parameter.
    pub(crate) fn departure(&self) -> Vec2 {
        self.control_points_m[1] - self.first()
    }

    /// First derivative at the end, by the spline's parameter.
    pub(crate) fn arrival(&self) -> Vec2 {
        self.last() - self.control_points_m[self.control_points_m.len() - 2]
    }

    /// The same spline from another first point.
    pub(crate) fn starting_at(mut self, first: Vec2) -> Self {
        self.control_points_m[0] = first;
        self
    }

    /// Its polynomial pieces in order, one fewer than control points. The phantom points 2 P0 - P1 and
    /// 2 Pn - P(n-1) make the ends natural.
    pub(crate) fn spans(&self) -> Vec<Cubic> {
        let mut points = Vec::with_capacity(self.control_points_m.len() + 2);
        points.push(self.first() - self.departure());
        points.extend_from_slice(&self.control_points_m);
        points.push(self.last() + self.arrival());
        points.windows(4).map(Cubic::span).collect()
    }
}

/// One polynomial piece of a spline, for u in [0, 1].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cubic {
    c: [Vec2; 4],
}

impl Cubic {
    /// The uniform cubic b-spline over four control points, in powers of u.
    fn span(p: &[Vec2]) -> Self {
        Self {
            c: [
                (p[0] + 4.0 * p[1] + p[2]) / 6.0,
                (p[2] - p[0]) / 2.0,
                (p[0] - 2.0 * p[1] + p[2]) / 2.0,
                (p[3] - p[0] + 3.0 * (p[1] - p[2])) / 6.0,
            ],
        }
    }

    #[inline]
    pub(crate) fn point(&self, u: f64) -> Vec2 {
        self.c[0] + u * (self.c[1] + u * (self.c[2] + u * self.c[3]))
    }

    #[inline]
    pub(crate) fn velocity(&self, u: f64) -> Vec2 {
        self.c[1] + u * (2.0 * self.c[2] + u * 3.0 * self.c[3])
    }

    #[inline]
    pub(crate) fn acceleration(&self, u: f64) -> Vec2 {
        2.0 * self.c[2] + 6.0 * u * self.c[3]
    }

    /// Curvature without its sign, 1/m.
    pub(crate) fn curvature(&self, u: f64) -> f64 {
        let velocity = self.velocity(u);
        velocity.perp_dot(self.acceleration(u)).abs() / velocity.length().powi(3)
    }

    /// Coefficients of the coordinate along `axis`, measured from `origin`, as a cubic in u.
    pub(crate) fn coordinate(&self, origin: Vec2, axis: Vec2) -> [f64; 4] {
        [
            (self.c[0] - origin).dot(axis),
            self.c[1].dot(axis),
            self.c[2].dot(axis),
            self.c[3].dot(axis),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent() -> Spline {
        let points = [(0.0, 0.0), (0.1, 0.02), (0.2, 0.2), (0.1, 0.3)];
        Spline::new(points.map(|(x, y)| Vec2::new(x, y)).to_vec()).unwrap()
    }

    #[test]
    fn ends_are_natural_and_on_the_outer_points() {
        let spline = bent();
        let spans = spline.spans();
        let (first, last) = (spans[0], spans[spans.len() - 1]);
        assert_eq!(spans.len(), 3);
        assert!(first.point(0.0).distance(spline.first()) < 1e-16);
        assert!(last.point(1.0).distance(spline.last()) < 1e-16);
        assert!(first.velocity(0.0).distance(spline.departure()) < 1e-15);
        assert!(last.velocity(1.0).distance(spline.arrival()) < 1e-15);
        assert!(first.acceleration(0.0).length() < 1e-15);
        assert!(last.acceleration(1.0).length() < 1e-15);
    }

    #[test]
    fn spans_meet_with_two_derivatives() {
        for pair in bent().spans().windows(2) {
            assert!(pair[0].point(1.0).distance(pair[1].point(0.0)) < 1e-15);
            assert!(pair[0].velocity(1.0).distance(pair[1].velocity(0.0)) < 1e-15);
            assert!(pair[0].acceleration(1.0).distance(pair[1].acceleration(0.0)) < 1e-15);
        }
    }

    #[test]
    fn points_on_a_line_stay_on_it() {
        let spline = Spline::new(vec![Vec2::ZERO, Vec2::new(1.0, 2.0)]).unwrap();
        let middle = spline.spans()[0].point(0.5);
        assert!(middle.distance(Vec2::new(0.5, 1.0)) < 1e-15, "{middle}");
    }

    #[test]
    fn refuses_what_is_no_curve() {
        let few = Spline::new(vec![Vec2::ZERO]).unwrap_err();
        assert_eq!(
            few.to_string(),
            "a spline needs at least 2 control points, here are 1"
        );
        let nan = Spline::new(vec![Vec2::ZERO, Vec2::new(0.0, f64::NAN)]).unwrap_err();
        assert_eq!(
            nan.to_string(),
            "y of control point 2 is NaN, not a finite number"
        );
        assert!(Spline::new(vec![Vec2::ZERO, Vec2::new(f64::INFINITY, 0.0)]).is_err());
    }
}
