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
    run_up: Lap,
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
            run_up: Lap::new(gates.len()),
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

    /// What was crossed before the first lap began: the gates from where the robot was first seen, its end once gate 0 was crossed, and
    /// NaN at all others; none of them count as missed.
    pub fn run_up(&self) -> &Lap {
        &self.run_up
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

    /// The first cell.
    fn enter(&mut self, position: Vec2) {
        if let Some(cell) = (0..self.count()).find(|&cell| self.contains(cell, position)) {
            self.due = cell + 1;
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
    fn cross_between(&mut self, cell: i64, next: i64, from: (f64, Vec2), to: (f64, Vec2)) -> Option<Lap> {
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
        let lap = self.lap.as_mut().unwrap_or(&mut self.run_up);
        lap.offsets_m[gate] = offset_m;
        lap.times_s[gate] = time_s;
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
        let Some(closed) = self.lap.replace(next) else {
            self.run_up.end_s = time_s;
            return None;
        };
        Some(Lap {
            end_s: time_s,
            ..closed
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::circuit;
    use proptest::prelude::*;
    use std::sync::LazyLock;

    const N: usize = 100;

    fn gates() -> Gates {
        static GATES: LazyLock<Gates> = LazyLock::new(|| circuit().gates(N).unwrap());
        GATES.clone()
    }

    /// A point beside a gate: `offset_m` to the left of its middle, `ahead_m` beyond it in the way of driving.
    fn beside(gate: &Gate, way: Way, offset_m: f64, ahead_m: f64) -> Vec2 {
        let sign = if way == Way::Forward { 1.0 } else { -1.0 };
        gate.center + offset_m * gate.left + sign * ahead_m * gate.forward()
    }

    /// Gates passed by the straight line between a point 4 mm before and one 4 mm beyond each; one second a gate,
    /// starting half a second before the first.
    fn path(gates: &Gates, way: Way, passes: impl Iterator<Item = (usize, f64)>) -> Vec<(f64, Vec2)> {
        let pass = |(step, (gate, offset_m)): (usize, (usize, f64))| {
            let time_s = step as f64;
            [(time_s - 0.2, -0.004), (time_s + 0.2, 0.004)]
                .map(|(t, ahead_m)| (t, beside(&gates[gate % N], way, offset_m, ahead_m)))
        };
        passes.enumerate().flat_map(pass).collect()
    }

    /// Samples from gate 0 on: each where a line between positions first crosses the gate after the one before it.
    fn by_definition(gates: &Gates, rows: &[(f64, Vec2)]) -> Vec<f64> {
        let mut samples = Vec::new();
        for pair in rows.windows(2) {
            let (mut from, to) = (pair[0].1, pair[1].1);
            loop {
                let gate = gates[samples.len() % N];
                let [before_m, after_m] = [from, to].map(|p| (p - gate.center).dot(gate.forward()));
                let crossing = from.lerp(to, before_m / (before_m - after_m));
                if !(before_m < 0.0 && after_m >= 0.0 && gate.admits(gate.offset_m(crossing))) {
                    break;
                }
                samples.push(gate.offset_m(crossing));
                from = crossing;
            }
        }
        samples
    }

    fn assert_close(found: &[f64], truth: &[f64]) {
        assert_eq!(found.len(), truth.len());
        for (index, (found, truth)) in found.iter().zip(truth).enumerate() {
            assert!(
                (found - truth).abs() < 1e-12,
                "gate {index}: {found} instead of {truth}"
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn offsets_come_back_exactly_both_ways(
            offsets in prop::collection::vec(-0.05..0.05_f64, N),
            start in 0..N,
            backward: bool,
        ) {
            let gates = gates();
            let way = if backward { Way::Backward } else { Way::Forward };
            let number = |step: usize| if backward { (start + 4 * N - step) % N } else { (start + step) % N };
            let passes = (0..=3 * N).map(|step| (number(step), offsets[number(step)]));
            let laps = laps(&gates, way, &path(&gates, way, passes));
            prop_assert_eq!(laps.len(), if number(0) == 0 { 3 } else { 2 });
            for lap in &laps {
                assert_close(lap.closed().unwrap(), &offsets);
                prop_assert!((lap.duration_s() - N as f64).abs() < 1e-9);
                let next = if backward { N - 1 } else { 1 };
                prop_assert!((lap.times_s[next] - lap.start_s - 1.0).abs() < 1e-9);
                prop_assert_eq!(lap.times_s[0], lap.start_s);
            }
        }

        #[test]
        fn what_comes_before_gate_0_is_the_run_up(start in 2..N - 1, backward: bool) {
            let gates = gates();
            let way = if backward { Way::Backward } else { Way::Forward };
            let number = |step: usize| if backward { (start + 2 * N - step) % N } else { (start + step) % N };
            let mut tracker = LapTracker::new(&gates, way);
            for (time_s, position) in path(&gates, way, (0..N).map(|step| (number(step), 0.01))) {
                tracker.push(time_s, position);
            }
            let run_up = tracker.run_up();
            let until = if backward { start } else { N - start };
            prop_assert!((run_up.end_s - until as f64).abs() < 1e-9 && run_up.start_s.is_nan());
            // The tracker first sees the robot where it is just before the gate that it starts at.
            for step in 0..N {
                let gate = number(step);
                if step < until {
                    prop_assert!((run_up.times_s[gate] - step as f64).abs() < 1e-9);
                    prop_assert!((run_up.offsets_m[gate] - 0.01).abs() < 1e-9);
                } else {
                    prop_assert!(run_up.times_s[gate].is_nan() && run_up.offsets_m[gate].is_nan());
                }
            }
            prop_assert!(run_up.missed.is_empty());
        }

        #[test]
        fn gates_passed_round_their_end_are_missed(missed in prop::collection::btree_set(1..N - 1, 1..20)) {
            let gates = gates();
            let around = |gate: usize| if missed.contains(&gate) { gates[gate].left_m + 0.01 } else { 0.01 };
            let passes = (0..=N).map(|gate| (gate, around(gate % N)));
            let laps = laps(&gates, Way::Forward, &path(&gates, Way::Forward, passes));
            prop_assert_eq!(laps.len(), 1);
            prop_assert_eq!(&laps[0].missed, &missed.iter().copied().collect::<Vec<_>>());
            let error = laps[0].closed().unwrap_err();
            prop_assert_eq!(error, Error::MissedGate { gate: laps[0].missed[0], of: N });
            prop_assert!(missed.iter().all(|&gate| laps[0].offsets_m[gate].is_nan()));
        }

        #[test]
        fn back_and_forth_over_the_gates_changes_nothing(
            jitter in prop::collection::vec((-0.003..0.003_f64, -0.003..0.003_f64), 40),
        ) {
            let gates = gates();
            let clean = path(&gates, Way::Forward, (0..=2 * N).map(|gate| (gate, 0.02)));
            let shaken = clean.chunks(2).enumerate().flat_map(|(step, pair)| {
                let gate = gates[step % N];
                let shakes = jitter.iter().enumerate().map(move |(i, &(aside_m, ahead_m))| {
                    (pair[1].0 + 0.01 * i as f64, beside(&gate, Way::Forward, aside_m, ahead_m))
                });
                pair.iter().copied().chain(shakes)
            });
            let laps = laps(&gates, Way::Forward, &shaken.collect::<Vec<_>>());
            prop_assert_eq!(laps.len(), 2);
            for lap in &laps {
                assert_close(lap.closed().unwrap(), &[0.02; N]);
            }
        }

        #[test]
        fn noisy_laps_are_those_of_the_definition(
            noise in prop::collection::vec((-0.004..0.004_f64, -0.004..0.004_f64), 97),
            waves in 1.0..9.0_f64,
        ) {
            let gates = gates();
            let at = |step: usize| {
                let (gate, part) = (&gates[step / 10 % N], (step % 10) as f64 / 10.0);
                let offset_m = 0.055 * (waves * step as f64 / 1000.0).sin();
                let (x, y) = noise[step % noise.len()];
                (step as f64, beside(gate, Way::Forward, offset_m + x, part * gates.spacing_m() + y))
            };
            let rows: Vec<_> = (0..3500).map(at).collect();
            let found: Vec<f64> = laps(&gates, Way::Forward, &rows)
                .iter()
                .flat_map(|lap| lap.closed().unwrap().to_vec())
                .collect();
            let truth = by_definition(&gates, &rows);
            prop_assert!(found.len() >= 2 * N);
            assert_close(&found, &truth[..found.len()]);
        }

        #[test]
        fn the_wrong_way_closes_no_lap(
            jitter in prop::collection::vec((-0.02..0.02_f64, -0.02..0.02_f64), 37),
            start in 0..N,
        ) {
            let gates = gates();
            let mut tracker = LapTracker::new(&gates, Way::Forward);
            for step in 0..10 * 4 * N {
                let (gate, (aside_m, ahead_m)) = (&gates[(start + 10 * N - step / 4) % N], jitter[step % jitter.len()]);
                prop_assert_eq!(tracker.push(step as f64, beside(gate, Way::Forward, aside_m, ahead_m)), None);
            }
        }
    }

    #[test]
    fn one_long_line_crosses_several_gates() {
        let gates = gates();
        // gates 25 to 35 stand on the circuit's longest straight
        let mut rows = path(&gates, Way::Forward, (0..=N).map(|gate| (gate, 0.0)));
        rows.drain(2 * 26..2 * 35);
        let laps = laps(&gates, Way::Forward, &rows);
        assert_eq!(laps.len(), 1);
        let offsets_m = laps[0].closed().unwrap();
        assert!(
            offsets_m.iter().all(|offset_m| offset_m.abs() < 0.01),
            "{offsets_m:?}"
        );
        assert!(laps[0].times_s.is_sorted());
    }

    #[test]
    fn gap_across_the_inner_wall_leaves_a_lap_that_says_so() {
        let gates = gates();
        let mut rows = path(&gates, Way::Forward, (0..=2 * N).map(|gate| (gate, 0.0)));
        rows.drain(2 * 10..2 * 55);
        let laps = laps(&gates, Way::Forward, &rows);
        assert_eq!(laps.len(), 2);
        assert!(laps[0].missed.contains(&40), "{:?}", laps[0].missed);
        assert!(
            laps[0].missed.iter().all(|gate| (10..55).contains(gate)),
            "{:?}",
            laps[0].missed
        );
        assert!((laps[0].duration_s() - 100.0).abs() < 1e-9);
        assert!(laps[1].closed().is_ok());
    }

    #[test]
    fn missed_gate_0_spoils_both_laps() {
        let gates = gates();
        let offset_m = |step: usize| {
            if step == N { gates[0].left_m + 0.01 } else { 0.0 }
        };
        let passes = (0..=3 * N).map(|step| (step, offset_m(step)));
        let laps = laps(&gates, Way::Forward, &path(&gates, Way::Forward, passes));
        assert_eq!(laps.len(), 3);
        assert_eq!((&laps[0].missed, &laps[1].missed), (&vec![0], &vec![0]));
        assert!(laps[0].end_s.is_nan() && laps[1].start_s.is_nan() && laps[1].offsets_m[0].is_nan());
        assert!(laps[2].closed().is_ok());
    }

    #[test]
    fn turning_round_and_back_samples_each_gate_once() {
        let gates = gates();
        let mut tracker = LapTracker::new(&gates, Way::Forward);
        let middle =
            |gate: usize| gates[gate % N].center + 0.5 * gates.spacing_m() * gates[gate % N].forward();
        let there = 95..160;
        let back = (120..160).rev();
        let on = 120..=200;
        let steps = there.chain(back).chain(on);
        let laps: Vec<Lap> = steps
            .enumerate()
            .filter_map(|(t, gate)| tracker.push(t as f64, middle(gate)))
            .collect();
        assert_eq!(laps.len(), 1);
        assert!(laps[0].closed().is_ok());
        assert_eq!((tracker.expected_gate(), tracker.gates_passed()), (1, 105));
        assert!(
            (laps[0].duration_s() - 180.0).abs() < 1.0,
            "{}",
            laps[0].duration_s()
        );
    }

    #[test]
    fn a_lap_backwards_is_no_debt() {
        let gates = gates();
        let mut tracker = LapTracker::new(&gates, Way::Forward);
        let middle =
            |gate: usize| gates[gate % N].center + 0.5 * gates.spacing_m() * gates[gate % N].forward();
        let steps = (350..=499).rev().chain(350..=501);
        let laps = steps
            .enumerate()
            .filter_map(|(t, gate)| tracker.push(t as f64, middle(gate)))
            .count();
        assert_eq!(laps, 1, "gate 0 is crossed as 400 and as 500");
    }

    #[test]
    fn what_is_not_finite_is_not_seen() {
        let gates = gates();
        let mut rows = path(&gates, Way::Forward, (0..=N).map(|gate| (gate, 0.0)));
        rows.insert(51, (25.0, Vec2::NAN));
        rows.insert(0, (-1.0, Vec2::new(f64::INFINITY, 0.0)));
        assert_eq!(laps(&gates, Way::Forward, &rows).len(), 1);
        assert!(laps(&gates, Way::Forward, &[]).is_empty());
    }
}
