use crate::{Error, Gate, Gates, Vec2, Way};
use std::sync::Arc;

/// One lap as the gates saw it, from one crossing of gate 0 to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Lap {
    /// Position at each gate, by the gate's number: distance from its centre, positive to the left of the course's
    /// driving direction; NaN where missed.
    pub offsets_m: Vec<f64>,
    /// Time of the crossing of each gate, by the gate's number; NaN where missed.
    pub times_s: Vec<f64>,
    /// When the lap began; NaN where gate 0 was missed then.
    pub start_s: f64,
    /// When it ended; NaN where gate 0 was missed then.
    pub end_s: f64,
    /// Numbers of the missed gates in the order of driving; gate 0 also where only the lap's end missed it.
    pub missed: Vec<usize>,
}

impl Lap {
    fn new(gates: usize) -> Self {
        let unknown = || vec![f64::NAN; gates];
        Self {
            offsets_m: unknown(),
            times_s: unknown(),
            start_s: f64::NAN,
            end_s: f64::NAN,
            missed: Vec::new(),
        }
    }

    /// The positions at all N gates, by number, in m.
    ///
    /// # Errors
    /// If the lap misses a gate.
    pub fn closed(&self) -> Result<&[f64], Error> {
        match self.missed.first() {
            None => Ok(&self.offsets_m),
            Some(&gate) => Err(Error::MissedGate {
                gate,
                of: self.offsets_m.len(),
            }),
        }
    }

    /// How long it took, NaN where gate 0 was missed at either end.
    pub fn duration_s(&self) -> f64 {
        self.end_s - self.start_s
    }
}

/// Every whole lap in a path of times in s and positions in m, rows in time order; the first one, which depends on
/// where the robot was put, included.
pub fn laps(gates: &Gates, way: Way, path: &[(f64, Vec2)]) -> Vec<Lap> {
    let mut tracker = LapTracker::new(gates, way);
    path.iter()
        .filter_map(|&(time_s, position)| tracker.push(time_s, position))
        .collect()
}

/// Laps from a stream of positions: watches the robot go from gate to gate, and gives each lap as it closes.
///
/// A gate's sample is taken where the straight line between two consecutive positions first crosses it in driving
/// direction after the gate before it; crossing back and forth over a gate changes nothing. The tracker knows
/// between which two gates the robot is, backing included, so that driving the wrong way round closes no lap, and
/// a gate counts as missed only once a later one, at most half a lap ahead, has been crossed.
///
/// ```
/// use track::{Course, LapTracker, Way};
///
/// let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// let gates = course.gates(100)?;
/// let mut tracker = LapTracker::new(&gates, Way::Forward);
/// let mut laps = Vec::new();
/// for step in 0..=211 { // along the middles of the gates, from half a gate before gate 90
///     let gate = &gates[(step + 90) % 100];
///     let position = gate.center - 0.5 * gates.spacing_m() * gate.forward();
///     laps.extend(tracker.push(step as f64, position));
/// }
/// assert_eq!(laps.len(), 2);
/// assert!((laps[0].duration_s() - 100.0).abs() < 1e-9);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LapTracker {
    /// The two lines that bound the cell the robot is in, ready for the next position.
    behind: Line,
    ahead: Line,
    /// No point of the corridor is farther from the middle of the gate behind it, along that gate.
    reach_m: f64,
    /// Where and when the robot was last seen; none before the first position.
    last: Option<(f64, Vec2)>,
    /// The robot is between the gates `cell` and `cell + 1`, counted on from lap to lap; none until it is first
    /// seen in the corridor.
    cell: Option<i64>,
    /// Gate that is due, counted in the same way.
    due: i64,
    passed: u64,
    lap: Option<Lap>,
    gates: Arc<[Gate]>,
    way: Way,
}

/// The line of a gate, by its middle and the unit vector across it in the direction of driving.
#[derive(Debug, Clone, Copy)]
struct Line {
    center: Vec2,
    forward: Vec2,
}

impl Line {
    /// How far a point is beyond the line.
    #[inline]
    fn beyond_m(&self, p: Vec2) -> f64 {
        (p - self.center).dot(self.forward)
    }

    /// How far from the middle, along the line.
    #[inline]
    fn aside_m(&self, p: Vec2) -> f64 {
        (p - self.center).perp_dot(self.forward).abs()
    }
}

impl LapTracker {
    /// A tracker that has seen nothing yet.
    pub fn new(gates: &Gates, way: Way) -> Self {
        let widest_m = gates
            .iter()
            .map(|gate| gate.left_m.max(gate.right_m))
            .fold(0.0, f64::max);
        let nowhere = Line {
            center: Vec2::ZERO,
            forward: Vec2::ZERO,
        };
        Self {
            behind: nowhere,
            ahead: nowhere,
            reach_m: widest_m + gates.spacing_m(), // a cell is bent: its points lie to the side of its first gate too
            last: None,
            cell: None,
            due: 0,
            passed: 0,
            lap: None,
            gates: gates.shared(),
            way,
        }
    }

    /// The lap that a new position closes, if it does. Times rise from call to call; a position that was not seen
    /// is left out by the caller, one that is not finite is ignored. Before the first crossing of gate 0 no lap runs.
    #[inline]
    pub fn push(&mut self, time_s: f64, position: Vec2) -> Option<Lap> {
        let inside = self.behind.beyond_m(position) >= 0.0
            && self.ahead.beyond_m(position) < 0.0
            && self.behind.aside_m(position) <= self.reach_m;
        if inside {
            self.last = Some((time_s, position));
            return None;
        }
        self.leave_cell(time_s, position)
    }

    /// Number of the gate whose crossing is due next.
    pub fn expected_gate(&self) -> usize {
        self.number(self.due)
    }

    /// How many gates the robot has passed for the first time, in order, missed ones included; never falls.
    pub fn gates_passed(&self) -> u64 {
        self.passed
    }

    /// Everything but staying between the same two gates.
    #[inline(never)]
    fn leave_cell(&mut self, time_s: f64, position: Vec2) -> Option<Lap> {
        if !(position.is_finite() && time_s.is_finite()) {
            return None;
        }
        let now = (time_s, position);
        let from = self.last.replace(now);
        let Some(cell) = self.cell else {
            self.enter(position);
            return None;
        };
        let next = self.find(cell, position)?;
        let closed = from.and_then(|from| self.cross_between(cell, next, from, now));
        self.stand_in(next);
        closed
    }

    /// The first cell. The gate behind the robot is due too: it may have been put right on it.
    fn enter(&mut self, position: Vec2) {
        if let Some(cell) = (0..self.count()).find(|&cell| self.contains(cell, position)) {
            self.due = cell;
            self.stand_in(cell);
        }
    }

    fn stand_in(&mut self, cell: i64) {
        // a whole lap backwards the gate that is due lies ahead again
        let cell = if cell + 1 + self.count() <= self.due {
            cell + self.count()
        } else {
            cell
        };
        self.cell = Some(cell);
        (self.behind, self.ahead) = (self.line(cell), self.line(cell + 1));
    }

    /// The cell that holds a position, at most half a lap from `cell`, the nearest first.
    fn find(&self, cell: i64, position: Vec2) -> Option<i64> {
        (0..=self.count() / 2)
            .flat_map(|away| [cell + away, cell - away])
            .find(|&cell| self.contains(cell, position))
    }

    fn contains(&self, cell: i64, position: Vec2) -> bool {
        let behind = self.line(cell);
        behind.beyond_m(position) >= 0.0
            && behind.aside_m(position) <= self.reach_m
            && self.line(cell + 1).beyond_m(position) < 0.0
    }

    /// Takes the samples of the gates after `cell` up to `next` that the straight line crosses.
    fn cross_between(
        &mut self,
        cell: i64,
        next: i64,
        from: (f64, Vec2),
        to: (f64, Vec2),
    ) -> Option<Lap> {
        let mut closed = None;
        let mut reached = 0.0;
        for index in cell + 1..=next {
            let line = self.line(index);
            let (before_m, after_m) = (line.beyond_m(from.1), line.beyond_m(to.1));
            let part = before_m / (before_m - after_m);
            let gate = self.gates[self.number(index)];
            let offset_m = gate.offset_m(from.1.lerp(to.1, part));
            if before_m < 0.0 && after_m >= 0.0 && part >= reached && gate.admits(offset_m) {
                reached = part;
                let time_s = from.0 + part * (to.0 - from.0);
                closed = self.cross(index, time_s, offset_m).or(closed);
            }
        }
        closed
    }

    /// One gate crossed in driving direction.
    fn cross(&mut self, index: i64, time_s: f64, offset_m: f64) -> Option<Lap> {
        let gate = self.number(index);
        let starts = self.lap.is_none() && gate == 0;
        if index < self.due && !starts {
            return None;
        }
        let mut closed = None;
        for missed in self.due..index {
            closed = self.miss(self.number(missed)).or(closed);
        }
        if gate == 0 {
            closed = self.next_lap(time_s).or(closed);
        }
        if let Some(lap) = &mut self.lap {
            lap.offsets_m[gate] = offset_m;
            lap.times_s[gate] = time_s;
        }
        self.passed += 1;
        self.due = index + 1;
        closed
    }

    /// One gate missed: if it is gate 0, the lap ends without an end and the next begins without a beginning.
    fn miss(&mut self, gate: usize) -> Option<Lap> {
        self.passed += 1;
        let lap = self.lap.as_mut()?;
        lap.missed.push(gate);
        if gate != 0 {
            return None;
        }
        let closed = self.next_lap(f64::NAN);
        self.lap.as_mut()?.missed.push(gate);
        closed
    }

    /// The running lap, ended, while a new one begins.
    fn next_lap(&mut self, time_s: f64) -> Option<Lap> {
        let next = Lap {
            start_s: time_s,
            ..Lap::new(self.gates.len())
        };
        let closed = self.lap.replace(next);
        closed.map(|lap| Lap {
            end_s: time_s,
            ..lap
        })
    }

    fn count(&self) -> i64 {
        self.gates.len() as i64
    }

    /// Number of the gate that comes `index`-th in the direction of driving, from gate 0.
    fn number(&self, index: i64) -> usize {
        let in_order = match self.way {
            Way::Forward => index,
            Way::Backward => -index,
        };
        in_order.rem_euclid(self.count()) as usize
    }

    fn line(&self, index: i64) -> Line {
        let gate = &self.gates[self.number(index)];
        let forward = match self.way {
            Way::Forward => gate.forward(),
            Way::Backward => -gate.forward(),
        };
        Line {
            center: gate.center,
            forward,
        }
    }
}
