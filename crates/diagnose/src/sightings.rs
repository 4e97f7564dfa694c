//! Where a camera saw a robot: sightings that cannot be, holes, and how positions are written.

use track::Lap;

use crate::{far, median};

/// The rows in which a camera that has stopped gives its last sighting again and again.
pub fn repeated_sightings(position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// Sightings that are the same by chance at most; where positions are coarse, of a robot that turns on the spot.
    const LEAST: usize = 8;
    const LEAST_COARSE: usize = 64;
    /// As coarse as the camera's noise, m.
    const COARSE_M: f64 = 0.001;
    let unit_m = coarse_unit_m(position_m.iter().flatten().flatten().copied());
    let least = if unit_m.is_some_and(|unit_m| unit_m > COARSE_M) {
        LEAST_COARSE
    } else {
        LEAST
    };
    let seen: Vec<usize> = (0..position_m.len())
        .filter(|&row| position_m[row].is_some())
        .collect();
    let same = seen.chunk_by(|&a, &b| position_m[a] == position_m[b]);
    same.filter(|rows| rows.len() >= least)
        .flat_map(|rows| rows[1..].to_vec())
        .collect()
}

/// The rows in which a robot is seen far from the median of where it is seen about then; none if they are many.
pub fn outlying_sightings(position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// Sightings to either side of which the median is taken.
    const REACH: usize = 4;
    /// What is not far in any case, m.
    const LEAST_M: f64 = 0.008;
    /// Share of the sightings that are many: a camera that often errs is one of its own kind.
    const MANY: f64 = 2e-3;
    let seen: Vec<(usize, [f64; 2])> = (position_m.iter().enumerate())
        .filter_map(|(row, position)| position.map(|position| (row, position)))
        .collect();
    let off_m = |at: usize| {
        // As many on one side as on the other: the robot moves.
        let reach = REACH.min(at).min(seen.len() - 1 - at);
        let about = &seen[at - reach..=at + reach];
        let middle = |axis: usize| median(about.iter().map(|(_, p)| p[axis]));
        (seen[at].1[0] - middle(0)).hypot(seen[at].1[1] - middle(1))
    };
    let all_m: Vec<f64> = (0..seen.len()).map(off_m).collect();
    let far_m = far(&all_m, LEAST_M);
    let far = seen.iter().zip(&all_m).filter(|(_, off_m)| **off_m > far_m);
    let rows: Vec<usize> = far.map(|((row, _), _)| *row).collect();
    if rows.len() as f64 > MANY * seen.len() as f64 {
        return Vec::new();
    }
    rows
}

/// A row in which the robot is seen.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    row: usize,
    time_s: f64,
    x_m: f64,
    y_m: f64,
}

/// The rows in which a robot is seen where it cannot get, and out of which it comes back; none if they are many, which is no
/// fault of single sightings.
pub fn stray_sightings(t_s: &[f64], position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// A robot's speed at most, and how far sightings of it may be off.
    const FAST_M_S: f64 = 0.2;
    const OFF_M: f64 = 0.05;
    /// Time within which it has come back, s, if not with the very next sighting.
    const SOON_S: f64 = 0.6;
    /// Sightings at either end that are taken for strays.
    const FEW: usize = 3;
    /// Share of the sightings that are many.
    const MANY: f64 = 0.01;
    let sighting = |(row, (&time_s, position)): (usize, (&f64, &Option<[f64; 2]>))| {
        position.map(|[x_m, y_m]| Sighting {
            row,
            time_s,
            x_m,
            y_m,
        })
    };
    let seen: Vec<Sighting> = (t_s.iter().zip(position_m).enumerate())
        .filter_map(sighting)
        .collect();
    let gets = |from: usize, to: usize| {
        let (from, to) = (&seen[from], &seen[to]);
        let way_m = (to.x_m - from.x_m).hypot(to.y_m - from.y_m);
        way_m <= OFF_M + FAST_M_S * (to.time_s - from.time_s)
    };
    let mut strays = Vec::new();
    // Where it was before, or is after, tells nothing at either end.
    let first =
        (1..=FEW).find(|&first| first + 1 < seen.len() && !gets(first - 1, first) && gets(first, first + 1));
    let mut last = first.unwrap_or(0);
    strays.extend(seen[..last].iter().map(|sighting| sighting.row));
    let mut next = last + 1;
    while next < seen.len() {
        if !gets(last, next) {
            let soon = |&later: &usize| later == next + 1 || seen[later].time_s - seen[last].time_s <= SOON_S;
            let mut later = (next + 1..seen.len()).take_while(soon);
            if let Some(back) = later.find(|&later| gets(last, later)) {
                strays.extend(seen[next..back].iter().map(|sighting| sighting.row));
                next = back;
            } else if seen.len() - next <= FEW && last > 0 && gets(last - 1, last) {
                strays.extend(seen[next..].iter().map(|sighting| sighting.row));
                break;
            }
        }
        last = next;
        next += 1;
    }
    if strays.len() as f64 > MANY * seen.len() as f64 {
        return Vec::new();
    }
    strays
}

/// A time in which the robot was not seen, since the run began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// When it was seen last, s.
    pub from_s: f64,
    /// When it was seen again, s.
    pub to_s: f64,
    /// The last row in which it was seen.
    pub row: usize,
}

/// The holes in a run that are too long for a straight line across them to stand for the way driven; `times_s` and `seen`
/// tell of each row when it was, since the run began, and whether the robot was seen.
pub fn long_holes(times_s: &[f64], seen: &[bool], whole: &[Lap]) -> Vec<Hole> {
    /// Of a lap's time.
    const LONGEST: f64 = 0.05;
    let known_s = || whole.iter().map(Lap::duration_s).filter(|s| s.is_finite());
    if known_s().next().is_none() {
        return Vec::new();
    }
    let longest_s = LONGEST * median(known_s());
    let rows: Vec<usize> = (0..times_s.len()).filter(|&row| seen[row]).collect();
    let hole = |pair: &[usize]| Hole {
        from_s: times_s[pair[0]],
        to_s: times_s[pair[1]],
        row: pair[0],
    };
    let holes = rows.windows(2).map(hole);
    holes.filter(|hole| hole.to_s - hole.from_s > longest_s).collect()
}

/// The first hole in one of the whole laps of a run, if it has one.
pub fn hole_in<'h>(holes: &'h [Hole], whole: &[Lap], number: usize) -> Option<&'h Hole> {
    let [start_s, end_s] = bounds_s(whole, number);
    holes
        .iter()
        .find(|hole| hole.from_s < end_s && start_s < hole.to_s)
}

/// From when to when a lap of a run went; where gate 0 was missed, at most.
fn bounds_s(whole: &[Lap], number: usize) -> [f64; 2] {
    let known = |lap: &Lap| {
        lap.times_s
            .clone()
            .into_iter()
            .filter(|time_s| time_s.is_finite())
    };
    let before = number
        .checked_sub(1)
        .and_then(|before| known(&whole[before]).reduce(f64::max));
    let after = whole.get(number + 1).and_then(|lap| known(lap).reduce(f64::min));
    let lap = &whole[number];
    [
        (lap.start_s, before.unwrap_or(f64::NEG_INFINITY)),
        (lap.end_s, after.unwrap_or(f64::INFINITY)),
    ]
    .map(|(own_s, else_s)| if own_s.is_nan() { else_s } else { own_s })
}

/// What the coordinates of all positions are multiples of, m, if that is coarse.
pub fn coarse_unit_m(coordinates_m: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    const COARSE_M: [f64; 3] = [0.01, 0.005, 0.001];
    let is_multiple = |x: f64| (x - x.round()).abs() < 1e-6;
    COARSE_M
        .into_iter()
        .find(|unit| coordinates_m.clone().all(|x| is_multiple(x / unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a robot that goes round in a circle of half a metre at 3 mm a row, seen to a millimetre.
    fn round_trip() -> Vec<Option<[f64; 2]>> {
        let off_m = |i: u32| 1e-3 * f64::from(i * 7919 % 200) / 100.0 - 1e-3;
        let position = |i: u32| {
            let angle = 0.012 * f64::from(i);
            Some([0.25 * angle.cos() + off_m(i), 0.25 * angle.sin() + off_m(i + 77)])
        };
        (0..3000).map(position).collect()
    }

    #[test]
    fn sightings_far_from_the_median_about_them_are_outliers_if_they_are_few() {
        let mut seen = round_trip();
        assert_eq!(outlying_sightings(&seen), [0; 0]);
        // Holes move no median.
        seen[1000..1040].fill(None);
        assert_eq!(outlying_sightings(&seen), [0; 0]);
        for row in [500, 501, 1999] {
            seen[row] = seen[row].map(|[x, y]| [x + 0.02, y]);
        }
        assert_eq!(outlying_sightings(&seen), [500, 501, 1999]);
        for row in (100..200).step_by(10) {
            seen[row] = seen[row].map(|[x, y]| [x, y - 0.02]);
        }
        assert_eq!(outlying_sightings(&seen), [0; 0]);
    }

    #[test]
    fn a_camera_that_stopped_repeats_itself() {
        let mut seen = round_trip();
        assert_eq!(repeated_sightings(&seen), [0; 0]);
        let last = seen[700];
        seen[701..708].fill(last);
        seen[704] = None;
        // Seven that are the same, with one that is not seen between them.
        assert_eq!(repeated_sightings(&seen), [0; 0]);
        seen[708] = last;
        assert_eq!(repeated_sightings(&seen), [701, 702, 703, 705, 706, 707, 708]);
        // In whole centimetres a robot that turns on the spot stays where it is.
        let coarse = |at: &Option<[f64; 2]>| at.map(|at| at.map(|m| (100.0 * m).round() / 100.0));
        let seen: Vec<_> = seen.iter().map(coarse).collect();
        assert_eq!(repeated_sightings(&seen), [0; 0]);
    }

    #[test]
    fn sightings_where_no_robot_gets_are_strays_if_it_comes_back() {
        let t_s: Vec<f64> = (0..1000).map(|i| 0.064 * f64::from(i)).collect();
        let way: Vec<Option<[f64; 2]>> = (0..1000).map(|i| Some([0.003 * f64::from(i), 0.5])).collect();
        assert_eq!(stray_sightings(&t_s, &way), [0; 0]);
        let mut seen = way.clone();
        for row in [0, 400, 401, 700] {
            seen[row] = Some([57.0, 0.5]);
        }
        seen[402] = None;
        assert_eq!(stray_sightings(&t_s, &seen), [0, 400, 401, 700]);
        for row in [1, 998, 999] {
            seen[row] = Some([57.0, 0.5]);
        }
        assert_eq!(stray_sightings(&t_s, &seen), [0, 1, 400, 401, 700, 998, 999]);
        // Carried elsewhere it does not come back.
        let mut carried = way.clone();
        carried[500..].iter_mut().flatten().for_each(|at| at[1] = 0.9);
        assert_eq!(stray_sightings(&t_s, &carried), [0; 0]);
        // Another unit is no fault of single sightings.
        let millimetres: Vec<_> = way.iter().map(|at| at.map(|at| at.map(|m| 1000.0 * m))).collect();
        assert_eq!(stray_sightings(&t_s, &millimetres), [0; 0]);
    }

    /// A lap of 40 s through four gates.
    fn lap(start_s: f64) -> Lap {
        Lap {
            offsets_m: vec![0.0; 4],
            times_s: (0..4).map(|gate| start_s + 10.0 * f64::from(gate)).collect(),
            start_s,
            end_s: start_s + 40.0,
            missed: Vec::new(),
        }
    }

    #[test]
    fn a_hole_of_more_than_a_twentieth_of_a_lap_is_long_and_in_the_laps_that_it_touches() {
        let times_s: Vec<f64> = (0..1800).map(|row| 0.1 * f64::from(row)).collect();
        let mut seen = vec![true; 1800];
        let whole: Vec<Lap> = [5.0, 45.0, 85.0, 125.0].map(lap).to_vec();
        // 1.9 s are not long; 2.1 s are, here from the first lap's end to the second one's beginning.
        seen[200..218].fill(false);
        assert_eq!(long_holes(&times_s, &seen, &whole), []);
        seen[440..460].fill(false);
        let holes = long_holes(&times_s, &seen, &whole);
        assert_eq!(holes.iter().map(|hole| hole.row).collect::<Vec<_>>(), [439]);
        assert!((holes[0].from_s - 43.9).abs() < 1e-9 && (holes[0].to_s - 46.0).abs() < 1e-9);
        let hit: Vec<bool> = (0..4)
            .map(|number| hole_in(&holes, &whole, number).is_some())
            .collect();
        assert_eq!(hit, [true, true, false, false]);
        assert_eq!(long_holes(&times_s, &seen, &[]), []);
    }

    #[test]
    fn a_lap_that_missed_gate_0_may_go_from_the_one_before_to_the_one_after() {
        let mut whole: Vec<Lap> = [5.0, 45.0, 85.0].map(lap).to_vec();
        (whole[1].start_s, whole[1].end_s) = (f64::NAN, f64::NAN);
        assert_eq!(bounds_s(&whole, 1), [35.0, 85.0]);
        assert_eq!(bounds_s(&whole, 0), [5.0, 45.0]);
    }

    #[test]
    fn the_unit_of_positions_is_coarse_from_a_millimetre_on() {
        let in_units_of = |unit: f64| (0..99).map(move |i| unit * f64::from(i * 7 % 50));
        for unit_m in [0.001, 0.005, 0.01] {
            assert_eq!(coarse_unit_m(in_units_of(unit_m)), Some(unit_m));
        }
        assert_eq!(coarse_unit_m(in_units_of(1e-4)), None);
    }
}
