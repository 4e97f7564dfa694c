use crate::{Error, Vec2, Wall};

/// Longest step along the midline.
const STEP_M: f64 = 2e-3;
/// Shortest step; a bend that is still sharp then is a corner of the midline.
const SHORTEST_STEP_M: f64 = 1e-6;
/// Largest turn in one step.
const TURN_RAD: f64 = 0.02;
/// How far a point of the midline may be nearer to one wall than to the other, beside its distance from the origin.
const BALANCE: f64 = 1e-13;

/// The closed line of points equidistant from both walls, in driving direction.
#[derive(Debug, Clone)]
pub(crate) struct Midline {
    stations: Vec<Station>,
    length_m: f64,
}

/// A point of the midline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    /// Arc length from the first station.
    along_m: f64,
    pub(crate) point: Vec2,
    /// Unit vector across the midline, to the left of the driving direction.
    pub(crate) left: Vec2,
}

impl Station {
    pub(crate) fn forward(&self) -> Vec2 {
        -self.left.perp()
    }

    /// Length of the arc to another station and its turn: that of the circle through both, exact to the fourth
    /// power of the step.
    fn step_to(&self, next: &Station) -> (f64, f64) {
        let turn_rad = self
            .left
            .perp_dot(next.left)
            .atan2(self.left.dot(next.left))
            .abs();
        let half = 0.5 * turn_rad;
        let bulge = if half > 1e-6 { half / half.sin() } else { 1.0 };
        (self.point.distance(next.point) * bulge, turn_rad)
    }
}

/// The two walls by their side of the driving direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Walls<'w> {
    pub(crate) left: &'w Wall,
    pub(crate) right: &'w Wall,
}

impl Walls<'_> {
    /// The midline's point near `p`, by Newton's method across the corridor. The direction across halves the angle
    /// between the direction to the nearest point of one wall and the reverse of that to the other.
    fn balance(&self, mut p: Vec2) -> Result<Station, Error> {
        let lost = Error::Midline { at_m: p };
        for attempt in 0..60 {
            let (to_left, to_right) = (self.left.foot(p).point - p, self.right.foot(p).point - p);
            let (left_m, right_m) = (to_left.length(), to_right.length());
            let direction = to_left / left_m;
            let across = direction - to_right / right_m;
            let left = across.normalize();
            let excess_m = left_m - right_m;
            if excess_m.abs() < BALANCE * (1.0 + p.length()) {
                return Ok(Station {
                    along_m: 0.0,
                    point: p,
                    left,
                });
            }
            let damping = if attempt < 20 { 1.0 } else { 0.5 }; // where the nearest point jumps, whole steps can alternate
            p += left * (damping * excess_m / across.dot(left));
            if !p.is_finite() {
                return Err(lost);
            }
        }
        Err(lost)
    }

    /// One point of the midline: on the line from the left wall's first joint to the nearest point of the other.
    fn first(&self) -> Result<Station, Error> {
        let joint = self.left.point(0.0);
        let across = self.right.foot(joint).point - joint;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            let p = joint + middle * across;
            if self.left.foot(p).distance_sq < self.right.foot(p).distance_sq {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.balance(joint + low * across)
    }
}

impl Midline {
    /// The midline once round, marched in steps that shorten with its bends; its length is within 1e-7 m.
    pub(crate) fn new(walls: Walls<'_>) -> Result<Self, Error> {
        let start = walls.first()?;
        let limit_m = 2.0 * (walls.left.length_m() + walls.right.length_m());
        let (mut stations, mut here, mut step_m) = (vec![start], start, STEP_M);
        loop {
            let home = start.point - here.point;
            let closes = stations.len() > 2 && home.dot(here.forward()) > 0.0 && home.length() < 1.5 * step_m;
            let mut next = if closes {
                start
            } else {
                walls.balance(here.point + step_m * here.forward())?
            };
            let (length_m, turn_rad) = here.step_to(&next);
            let strayed = length_m > 2.0 * step_m || turn_rad > TURN_RAD;
            if strayed && step_m > SHORTEST_STEP_M {
                step_m *= 0.5;
                continue;
            }
            next.along_m = here.along_m + length_m;
            if closes {
                return Ok(Self {
                    stations,
                    length_m: next.along_m,
                });
            }
            if next.along_m > limit_m {
                return Err(Error::Midline { at_m: here.point });
            }
            stations.push(next);
            (here, step_m) = (next, (2.0 * step_m).min(STEP_M));
        }
    }

    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// The stations of the march, at most 2 mm apart.
    pub(crate) fn stations(&self) -> &[Station] {
        &self.stations
    }

    /// The point at an arc length from the first station; whole turns are dropped.
    pub(crate) fn at(&self, walls: Walls<'_>, along_m: f64) -> Result<Station, Error> {
        let along_m = along_m.rem_euclid(self.length_m);
        let index = self
            .stations
            .partition_point(|station| station.along_m <= along_m)
            - 1;
        let here = self.stations[index];
        let there = self.stations[(index + 1) % self.stations.len()];
        let end_m = if index + 1 < self.stations.len() {
            there.along_m
        } else {
            self.length_m
        };
        let step_m = end_m - here.along_m;
        let t = (along_m - here.along_m) / step_m;
        let (t2, t3) = (t * t, t * t * t); // Hermite's cubic from the points and directions at both ends
        let between = here.point * (1.0 - 3.0 * t2 + 2.0 * t3)
            + there.point * (3.0 * t2 - 2.0 * t3)
            + step_m * ((t - 2.0 * t2 + t3) * here.forward() + (t3 - t2) * there.forward());
        walls.balance(between)
    }

    /// Arc length from the first station to the midline's point nearest to `p`.
    pub(crate) fn nearest_m(&self, walls: Walls<'_>, p: Vec2) -> Result<f64, Error> {
        let distance_sq = |station: &Station| station.point.distance_squared(p);
        let nearest = self
            .stations
            .iter()
            .min_by(|a, b| distance_sq(a).total_cmp(&distance_sq(b)))
            .expect("the march starts with a station");
        let (mut low, mut high) = (nearest.along_m - 1.5 * STEP_M, nearest.along_m + 1.5 * STEP_M);
        while high - low > 1e-11 {
            let middle = 0.5 * (low + high);
            let station = self.at(walls, middle)?;
            if (station.point - p).dot(station.forward()) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(0.5 * (low + high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::circuit;

    #[test]
    fn length_is_that_of_ever_finer_chords() {
        let course = circuit();
        let walls = Walls {
            left: &course.outer,
            right: &course.inner,
        };
        let midline = Midline::new(walls).unwrap();
        let chords_m = |count: u32| {
            let at = |i: u32| {
                midline
                    .at(walls, midline.length_m() * f64::from(i) / f64::from(count))
                    .unwrap()
                    .point
            };
            (0..count).map(|i| at(i).distance(at(i + 1))).sum::<f64>()
        };
        let (coarse_m, fine_m) = (chords_m(4000), chords_m(8000));
        let extrapolated_m = fine_m + (fine_m - coarse_m) / 3.0; // chords miss the arc by the square of the step
        let length_m = midline.length_m();
        assert!(
            (length_m - extrapolated_m).abs() < 1e-7,
            "{length_m} and {extrapolated_m}"
        );
    }

    #[test]
    fn points_keep_their_distances() {
        let course = circuit();
        let walls = Walls {
            left: &course.outer,
            right: &course.inner,
        };
        let midline = Midline::new(walls).unwrap();
        let step_m = midline.length_m() / 3000.0;
        for i in 0..3000 {
            let [here, there] = [i, i + 1].map(|i| midline.at(walls, f64::from(i) * step_m).unwrap());
            let (arc_m, turn_rad) = here.step_to(&there);
            assert!(
                (arc_m - step_m).abs() < 1e-8,
                "{arc_m} m instead of {step_m} m, {turn_rad} rad, at {}",
                here.point
            );
        }
    }
}
