//! Where in its laps a camera did not see a robot.

use track::{Gates, Lap, Vec2, Way, laps};

/// The parts of a run's laps in which the robot was not seen.
///
/// A lap that is seen in part has other samples than one that is seen throughout: across a hole they lie on its chord, and
/// where fewer positions are left they are noisier. So simulated laps are seen through the same holes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unseen {
    /// Of each lap, rising: from where to where, in gates since the lap began.
    laps: Vec<Vec<[f64; 2]>>,
}

impl Unseen {
    /// What was not seen of closed laps by a camera that saw the robot at these times, rising, and would have every `step_s`.
    /// A few short holes change no sample, and are none.
    pub fn of(laps: &[Lap], seen_s: &[f64], step_s: f64) -> Self {
        /// Gates up to which a hole is short, and share of the way up to which holes are few.
        const SHORT: f64 = 0.5;
        const FEW: f64 = 2e-3;
        let holes: Vec<[f64; 2]> = (seen_s.windows(2))
            .filter(|pair| pair[1] - pair[0] > 1.5 * step_s)
            .map(|pair| [pair[0] + 0.5 * step_s, pair[1] - 0.5 * step_s])
            .collect();
        let of_lap = |lap: &Lap| {
            let crossings_s = crossings_s(lap);
            let inside = |hole: &&[f64; 2]| hole[0] < lap.end_s && lap.start_s < hole[1];
            let place = |hole: &[f64; 2]| hole.map(|time_s| place_at(&crossings_s, time_s));
            holes.iter().filter(inside).map(place).collect()
        };
        let all = Self {
            laps: laps.iter().map(of_lap).collect(),
        };
        let is_short = |[from, to]: &[f64; 2]| to - from < SHORT;
        let gates = laps.first().map_or(1, |lap| lap.times_s.len());
        if all.laps.iter().flatten().all(is_short) && all.share(gates) < FEW {
            return Self::default();
        }
        all
    }

    /// Whether the robot was seen throughout.
    pub fn is_nothing(&self) -> bool {
        self.laps.iter().all(Vec::is_empty)
    }

    /// Share of the way in which the robot was not seen, in laps of so many gates.
    pub fn share(&self, gates: usize) -> f64 {
        let holes = self.laps.iter().flatten();
        holes.map(|[from, to]| to - from).sum::<f64>() / (self.laps.len() * gates) as f64
    }

    /// Laps on a path of times in s and positions in m, as they are seen if the path has the same holes; they are made in it,
    /// and go round where there are more laps. A lap that can then no longer be sampled stays as it is.
    pub fn through(
        &self,
        closed: Vec<Lap>,
        path: &mut Vec<(f64, Vec2)>,
        gates: &Gates,
        way: Way,
    ) -> Vec<Lap> {
        if self.is_nothing() {
            return closed;
        }
        self.make_holes(&closed, path);
        let found: Vec<Lap> = laps(gates, way, path)
            .into_iter()
            .filter(|lap| lap.missed.is_empty())
            .collect();
        let through = |lap: Lap| {
            let apart_s = |other: &&Lap| (other.start_s - lap.start_s).abs();
            let same = found.iter().min_by(|a, b| apart_s(a).total_cmp(&apart_s(b)));
            let same = same.filter(|other| apart_s(other) < 0.25 * lap.duration_s());
            same.cloned().unwrap_or(lap)
        };
        closed.into_iter().map(through).collect()
    }

    /// Takes the rows out of a path in which closed laps of it would not be seen.
    fn make_holes(&self, closed: &[Lap], path: &mut Vec<(f64, Vec2)>) {
        let of_lap = |(lap, holes): (&Lap, &Vec<[f64; 2]>)| -> Vec<[f64; 2]> {
            let crossings_s = crossings_s(lap);
            let times_s = |hole: &[f64; 2]| hole.map(|place| time_at(&crossings_s, place));
            holes.iter().map(times_s).collect()
        };
        let holes: Vec<[f64; 2]> = closed
            .iter()
            .zip(self.laps.iter().cycle())
            .flat_map(of_lap)
            .collect();
        let mut next = 0;
        path.retain(|&(time_s, _)| {
            while holes.get(next).is_some_and(|hole| hole[1] <= time_s) {
                next += 1;
            }
            holes.get(next).is_none_or(|hole| time_s < hole[0])
        });
    }
}

/// When a closed lap of N gates crosses them, in the order of driving, and at last the first one again: N + 1 times.
fn crossings_s(lap: &Lap) -> Vec<f64> {
    let mut times_s = lap.times_s.clone();
    times_s.sort_unstable_by(f64::total_cmp);
    times_s.push(lap.end_s);
    times_s
}

/// Gates since a lap began, in the lap.
fn place_at(crossings_s: &[f64], time_s: f64) -> f64 {
    let last = crossings_s.len() - 2;
    let gate = crossings_s.partition_point(|&crossing_s| crossing_s <= time_s);
    let gate = gate.saturating_sub(1).min(last);
    let share = (time_s - crossings_s[gate]) / (crossings_s[gate + 1] - crossings_s[gate]);
    gate as f64 + share.clamp(0.0, 1.0)
}

/// When a lap was so many gates from where it began.
fn time_at(crossings_s: &[f64], place: f64) -> f64 {
    let gate = (place as usize).min(crossings_s.len() - 2);
    crossings_s[gate] + (place - gate as f64) * (crossings_s[gate + 1] - crossings_s[gate])
}

#[cfg(test)]
mod tests {
    use track::Course;

    use super::*;

    const STEP_S: f64 = 0.064;

    fn gates() -> Gates {
        let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
        course.gates(100).unwrap()
    }

    /// Rounds along the middles of the gates, from half a gate before gate 0, one gate every so many steps.
    fn path(gates: &Gates, way: Way, rounds: usize, steps: usize) -> Vec<(f64, Vec2)> {
        let count = gates.len();
        let number = |gate: usize| match way {
            Way::Forward => (count - 1 + gate) % count,
            Way::Backward => (1 + rounds * count - gate) % count,
        };
        let position = |step: usize| {
            let (gate, share) = (step / steps, (step % steps) as f64 / steps as f64);
            gates[number(gate)]
                .center
                .lerp(gates[number(gate + 1)].center, share)
        };
        (steps / 2..rounds * count * steps)
            .map(|step| (STEP_S * step as f64, position(step)))
            .collect()
    }

    #[test]
    fn a_slower_robot_has_the_same_holes_at_the_same_places() {
        let gates = gates();
        for way in [Way::Forward, Way::Backward] {
            // 40 steps in a bend of the second lap, and 7 in its end and the next lap's beginning.
            let mut fast = path(&gates, way, 4, 10);
            let hidden = [1450..1490, 2004..2011];
            let first = fast[0].0;
            let step_of = |time_s: f64| ((time_s - first) / STEP_S).round() as usize;
            fast.retain(|(time_s, _)| !hidden.iter().any(|hole| hole.contains(&step_of(*time_s))));
            let measured = laps(&gates, way, &fast);
            let seen_s: Vec<f64> = fast.iter().map(|row| row.0).collect();
            let unseen = Unseen::of(&measured, &seen_s, STEP_S);
            assert!(!unseen.is_nothing());
            let share = unseen.share(100);
            assert!(
                (share - 4.7 / 100.0 / measured.len() as f64).abs() < 2e-4,
                "{share}"
            );

            let mut slow = path(&gates, way, 4, 30);
            let rows = slow.clone();
            let whole = laps(&gates, way, &slow);
            let through = unseen.through(whole.clone(), &mut slow, &gates, way);
            assert!((rows.len() - slow.len()).abs_diff(3 * 47) <= 2);
            assert_eq!(through.len(), whole.len());
            let most_m = |laps: &[Lap]| {
                let offsets = |laps: &[Lap]| {
                    laps.iter()
                        .flat_map(|lap| lap.offsets_m.clone())
                        .collect::<Vec<f64>>()
                };
                let pairs = offsets(laps).into_iter().zip(offsets(&measured));
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            // A chord's ends are known to a row.
            assert!(most_m(&whole) > 0.003, "{}", most_m(&whole));
            assert!(most_m(&through) < 0.0006, "{}", most_m(&through));
        }
    }

    #[test]
    fn what_is_seen_throughout_stays_as_it_is() {
        let gates = gates();
        let mut rows = path(&gates, Way::Forward, 3, 10);
        let seen_s: Vec<f64> = rows.iter().map(|row| row.0).collect();
        let (whole, before) = (laps(&gates, Way::Forward, &rows), rows.clone());
        let unseen = Unseen::of(&whole, &seen_s, STEP_S);
        assert!(unseen.is_nothing());
        assert_eq!(
            unseen.through(whole.clone(), &mut rows, &gates, Way::Forward),
            whole
        );
        assert_eq!(rows, before);
    }
}
