use crate::crossing::{Segment, crossing};
use crate::midline::{Midline, Station, Walls};
use crate::{Error, Vec2};
use std::ops::Index;
use std::sync::Arc;

/// A line across the corridor, from wall to wall, at which a lap's position is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Its point on the midline, equidistant from both walls.
    pub center: Vec2,
    /// Unit vector along it to the left of the driving direction.
    pub left: Vec2,
    /// Distance from the centre to the wall on the left.
    pub left_m: f64,
    /// Distance from the centre to the wall on the right.
    pub right_m: f64,
}

impl Gate {
    /// Unit vector across it in driving direction.
    pub fn forward(&self) -> Vec2 {
        -self.left.perp()
    }

    /// Signed distance of a point from the centre along the gate, positive to the left, in m.
    pub fn offset_m(&self, p: Vec2) -> f64 {
        (p - self.center).dot(self.left)
    }

    /// Whether an offset lies between the walls.
    pub fn admits(&self, offset_m: f64) -> bool {
        (-self.right_m..=self.left_m).contains(&offset_m)
    }

    fn segment(&self) -> Segment {
        (
            self.center - self.right_m * self.left,
            self.center + self.left_m * self.left,
        )
    }
}

/// The way through the gates. The gates keep their numbers and the offsets their signs either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// In the driving direction of the course: gates 0, 1, 2, ...
    Forward,
    /// Against it: gates 0, N-1, N-2, ...
    Backward,
}

/// The gates of a course, numbered in driving direction; cheap to clone.
///
/// ```
/// use track::Course;
///
/// let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// let gates = course.gates(100)?;
/// assert!((gates[0].left_m - 0.096536).abs() < 1e-4);
/// assert!((gates.spacing_m() - 0.03248).abs() < 1e-5);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Gates {
    gates: Arc<[Gate]>,
    midline_length_m: f64,
}

impl Gates {
    pub(crate) fn new(midline: &Midline, walls: Walls<'_>, joint: Vec2, count: usize) -> Result<Self, Error> {
        if count < 3 {
            return Err(Error::FewGates { count });
        }
        let start_m = midline.nearest_m(walls, joint)?;
        let gate = |index: usize| {
            let along_m = start_m + midline.length_m() * index as f64 / count as f64;
            midline.at(walls, along_m).map(|station| walls.gate(&station))
        };
        let gates = (0..count).map(gate).collect::<Result<Arc<[_]>, _>>()?;
        check(&gates)?;
        Ok(Self {
            gates,
            midline_length_m: midline.length_m(),
        })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.gates.len()
    }

    /// Never: there are at least three.
    pub fn is_empty(&self) -> bool {
        self.gates.is_empty()
    }

    /// The gates in the order of their numbers.
    pub fn iter(&self) -> std::slice::Iter<'_, Gate> {
        self.gates.iter()
    }

    /// The gate of a number, if there is one.
    pub fn get(&self, number: usize) -> Option<&Gate> {
        self.gates.get(number)
    }

    /// Length of the midline once round.
    pub fn midline_length_m(&self) -> f64 {
        self.midline_length_m
    }

    /// Distance from gate to gate along the midline.
    pub fn spacing_m(&self) -> f64 {
        self.midline_length_m / self.len() as f64
    }

    pub(crate) fn shared(&self) -> Arc<[Gate]> {
        Arc::clone(&self.gates)
    }
}

impl Index<usize> for Gates {
    type Output = Gate;

    fn index(&self, number: usize) -> &Gate {
        &self.gates[number]
    }
}

impl<'g> IntoIterator for &'g Gates {
    type Item = &'g Gate;
    type IntoIter = std::slice::Iter<'g, Gate>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl Walls<'_> {
    /// Distances from a station to the walls on its left and right, straight across the midline.
    pub(crate) fn reach_m(&self, station: &Station) -> (f64, f64) {
        let reach_m = |axis: Vec2| {
            let hits = [self.left, self.right].map(|wall| wall.along(station.point, axis));
            hits.into_iter().flatten().fold(f64::INFINITY, f64::min)
        };
        (reach_m(station.left), reach_m(-station.left))
    }

    fn gate(&self, station: &Station) -> Gate {
        let (left_m, right_m) = self.reach_m(station);
        Gate {
            center: station.point,
            left: station.left,
            left_m,
            right_m,
        }
    }
}

fn check(gates: &[Gate]) -> Result<(), Error> {
    let count = gates.len();
    let turns = |i: usize| gates[i].left.dot(gates[(i + 1) % count].left) < 0.5; // 60 degrees: cells between gates stay wedges
    if (0..count).any(turns) {
        return Err(Error::FewGates { count });
    }
    let segments: Vec<Segment> = gates.iter().map(Gate::segment).collect();
    match crossing(&segments, |_, _| true) {
        Some((first, second, at_m)) => Err(Error::GatesCross {
            first,
            second,
            of: count,
            at_m,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Course;
    use crate::testing::{circuit, corridor};
    use proptest::prelude::*;

    #[test]
    fn circuit_has_the_listed_gates() {
        let text = include_str!("../../../worlds/roduit2007/gates.csv");
        let gates = circuit().gates(100).unwrap();
        assert!((gates.midline_length_m() - 3.2480).abs() < 5e-5);
        assert_eq!(text.lines().count(), 101);
        for (line, gate) in text.lines().skip(1).zip(&gates) {
            let row: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
            let center_m = gate.center.distance(Vec2::new(row[1], row[2]));
            let left = gate.left.distance(Vec2::new(row[3], row[4]));
            assert!(center_m < 1e-4 && left < 1e-3, "{line}: {center_m} m, {left} off");
            assert!(
                (gate.left_m - row[5]).abs() < 1e-4,
                "{line}: left {}",
                gate.left_m
            );
            assert!(
                (gate.right_m - row[6]).abs() < 1e-4,
                "{line}: right {}",
                gate.right_m
            );
        }
    }

    /// Every property that defines the gates, but for the numbers of the circuit.
    fn assert_gates(course: &Course, gates: &Gates) {
        for gate in gates {
            let (outer, inner) = (
                course.outer.nearest(gate.center),
                course.inner.nearest(gate.center),
            );
            assert!((outer.distance_m - inner.distance_m).abs() < 1e-11);
            let to_outer = (outer.point - gate.center).normalize();
            let from_inner = (gate.center - inner.point).normalize();
            let across = (to_outer + from_inner).normalize();
            assert!(
                (across.dot(gate.left).abs() - 1.0).abs() < 1e-12,
                "{across} and {}",
                gate.left
            );
            for end in [gate.segment().0, gate.segment().1] {
                let gap_m = course
                    .outer
                    .nearest(end)
                    .distance_m
                    .min(course.inner.nearest(end).distance_m);
                assert!(gap_m < 1e-10, "a gate ends {gap_m} m from the walls");
            }
        }
        let joint = course.outer.point(0.0);
        let along_m = (joint - gates[0].center).dot(gates[0].forward());
        assert!(along_m.abs() < 1e-8, "gate 0 is {along_m} m off the joint");
    }

    #[test]
    fn gates_stand_across_the_middle() {
        let course = circuit();
        assert_gates(&course, &course.gates(100).unwrap());
    }

    #[test]
    fn more_gates_contain_the_fewer() {
        let course = circuit();
        let (few, many) = (course.gates(25).unwrap(), course.gates(100).unwrap());
        assert_eq!((few.len(), many.len(), few.is_empty()), (25, 100, false));
        for (index, gate) in few.iter().enumerate() {
            assert!(many[4 * index].center.distance(gate.center) < 1e-9);
        }
        assert_eq!(few.get(25), None);
    }

    #[test]
    fn refuses_too_few() {
        for count in [0, 1, 2, 5] {
            let error = circuit().gates(count).unwrap_err();
            assert_eq!(error, Error::FewGates { count });
        }
    }

    #[test]
    fn refuses_gates_that_cross() {
        // the sharpest bends of the midline have their centre inside the corridor
        let message = circuit().gates(200).unwrap_err().to_string();
        assert!(
            message.starts_with("gates 181 and 182 of 200 cross near ["),
            "{message}"
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn gates_of_any_corridor_keep_the_definition(course in corridor()) {
            assert_gates(&course, &course.gates(60).unwrap());
        }
    }
}
