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
    pub(crate) fn new(
        midline: &Midline,
        walls: Walls<'_>,
        joint: Vec2,
        count: usize,
    ) -> Result<Self, Error> {
        if count < 3 {
            return Err(Error::FewGates { count });
        }
        let start_m = midline.nearest_m(walls, joint)?;
        let gate = |index: usize| {
            let along_m = start_m + midline.length_m() * index as f64 / count as f64;
            midline
                .at(walls, along_m)
                .map(|station| walls.gate(&station))
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
        Some((first, second, _)) => Err(Error::GatesCross {
            first,
            second,
            of: count,
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::circuit;

    #[test]
    fn circuit_has_the_listed_gates() {
        let text = include_str!("../../../worlds/roduit2007/gates.csv");
        let t=std::time::Instant::now();
        let course=circuit();
        println!("load {:?}", t.elapsed());
        let t=std::time::Instant::now();
        let gates = course.gates(100).unwrap();
        println!("gates {:?}", t.elapsed());
        let t=std::time::Instant::now();
        println!("{:?} {:?}", course.corridor_m(), t.elapsed());
        println!("len {}", gates.midline_length_m());
        let mut worst=[0.0f64;4];
        for (line, gate) in text.lines().skip(1).zip(&gates) {
            let v: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            worst[0]=worst[0].max(gate.center.distance(crate::Vec2::new(v[1],v[2])));
            worst[1]=worst[1].max(gate.left.distance(crate::Vec2::new(v[3],v[4])));
            worst[2]=worst[2].max((gate.left_m-v[5]).abs());
            worst[3]=worst[3].max((gate.right_m-v[6]).abs());
        }
        println!("{worst:?}");
    }
}
