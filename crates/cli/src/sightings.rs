//! Where a camera saw the robot: sightings where it cannot be, and times in which it was not seen.

use diagnose::{far, median};
use track::Lap;

use crate::dataset::{Rows, RunFile};

/// Takes sightings away that a camera repeats, or in which the robot is where it cannot be between those beside them, and says
/// which.
pub(crate) fn without_strays(run: &mut RunFile) -> Vec<String> {
    let repeated = |_: [String; 2]| {
        "the camera sees the robot where it saw it in the row before, to the last digit".to_owned()
    };
    let stray = |[x, y]: [String; 2]| {
        format!("the robot is seen at ({x}, {y}), where it cannot get from where it is seen before and after")
    };
    let mut words = taken_away(run, |rows| repeats(&rows.position_m), repeated);
    words.extend(taken_away(run, |rows| strays(&rows.t_s, &rows.position_m), stray));
    words.extend(taken_away(run, |rows| outliers(&rows.position_m), stray));
    words
}

/// Takes away the sightings of some rows, and says why.
fn taken_away(
    run: &mut RunFile,
    which: impl Fn(&Rows) -> Vec<usize>,
    why: impl Fn([String; 2]) -> String,
) -> Vec<String> {
    let rows = which(&run.rows);
    let what = |row: usize| why(run.rows.position_m[row].unwrap_or([f64::NAN; 2]).map(short));
    let words = run.tell(&rows, what, "taken as not seen");
    for row in rows {
        run.rows.position_m[row] = None;
    }
    words
}

/// The rows in which a camera that has stopped gives its last sighting again and again.
fn repeats(position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// Sightings that are the same by chance, or as they are rounded, at most.
    const LEAST: usize = 8;
    let seen: Vec<usize> = (0..position_m.len())
        .filter(|&row| position_m[row].is_some())
        .collect();
    let same = seen.chunk_by(|&a, &b| position_m[a] == position_m[b]);
    same.filter(|rows| rows.len() >= LEAST)
        .flat_map(|rows| rows[1..].to_vec())
        .collect()
}

/// The rows in which a robot is seen far from the median of where it is seen about then; none if they are many.
fn outliers(position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
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

/// A number as a reader knows it again, whatever its size.
pub(crate) fn short(number: f64) -> String {
    if number != 0.0 && !(1e-4..1e6).contains(&number.abs()) {
        format!("{number:e}")
    } else {
        number.to_string()
    }
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
fn strays(t_s: &[f64], position_m: &[Option<[f64; 2]>]) -> Vec<usize> {
    /// A robot's speed at most, and how far sightings of it may be off.
    const FAST_M_S: f64 = 0.2;
    const OFF_M: f64 = 0.05;
    /// Time within which it has come back, s, if not with the very next sighting.
    const SOON_S: f64 = 0.6;
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
    let mut last = 0;
    if seen.len() > 2 && !gets(0, 1) && gets(1, 2) {
        strays.push(seen[0].row);
        last = 1;
    }
    let mut next = last + 1;
    while next < seen.len() {
        if !gets(last, next) {
            let soon = |&later: &usize| later == next + 1 || seen[later].time_s - seen[last].time_s <= SOON_S;
            let mut later = (next + 1..seen.len()).take_while(soon);
            if let Some(back) = later.find(|&later| gets(last, later)) {
                strays.extend(seen[next..back].iter().map(|sighting| sighting.row));
                next = back;
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
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hole {
    from_s: f64,
    to_s: f64,
    /// The last row in which it was seen.
    row: usize,
}

/// The holes in a run that are too long for a straight line across them to stand for the way driven.
pub(crate) fn long_holes(run: &RunFile, whole: &[Lap]) -> Vec<Hole> {
    /// Of a lap's time.
    const LONGEST: f64 = 0.05;
    let known_s = || whole.iter().map(Lap::duration_s).filter(|s| s.is_finite());
    if known_s().next().is_none() {
        return Vec::new();
    }
    let longest_s = LONGEST * median(known_s());
    let times_s: Vec<f64> = run.rows.since_start_s().collect();
    let seen: Vec<usize> = (0..times_s.len())
        .filter(|&row| run.rows.position_m[row].is_some())
        .collect();
    let hole = |pair: &[usize]| Hole {
        from_s: times_s[pair[0]],
        to_s: times_s[pair[1]],
        row: pair[0],
    };
    let holes = seen.windows(2).map(hole);
    holes.filter(|hole| hole.to_s - hole.from_s > longest_s).collect()
}

/// Where one of a run's laps has a hole, if it has one, in words.
pub(crate) fn lost_in_words(run: &RunFile, holes: &[Hole], whole: &[Lap], number: usize) -> Option<String> {
    let [start_s, end_s] = bounds_s(whole, number);
    let inside = |hole: &&Hole| hole.from_s < end_s && start_s < hole.to_s;
    let hole = holes.iter().find(inside)?;
    let (place, for_s) = (run.place(hole.row), hole.to_s - hole.from_s);
    Some(format!(
        "{place}: from here on the robot is not seen for {for_s:.1} s"
    ))
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
        assert_eq!(outliers(&seen), [0; 0]);
        // Holes move no median.
        seen[1000..1040].fill(None);
        assert_eq!(outliers(&seen), [0; 0]);
        for row in [500, 501, 1999] {
            seen[row] = seen[row].map(|[x, y]| [x + 0.02, y]);
        }
        assert_eq!(outliers(&seen), [500, 501, 1999]);
        for row in (100..200).step_by(10) {
            seen[row] = seen[row].map(|[x, y]| [x, y - 0.02]);
        }
        assert_eq!(outliers(&seen), [0; 0]);
    }

    #[test]
    fn a_camera_that_stopped_repeats_itself() {
        let mut seen = round_trip();
        assert_eq!(repeats(&seen), [0; 0]);
        let last = seen[700];
        seen[701..708].fill(last);
        seen[704] = None;
        // Seven that are the same, with one that is not seen between them.
        assert_eq!(repeats(&seen), [0; 0]);
        seen[708] = last;
        assert_eq!(repeats(&seen), [701, 702, 703, 705, 706, 707, 708]);
    }

    #[test]
    fn sightings_where_no_robot_gets_are_strays_if_it_comes_back() {
        let t_s: Vec<f64> = (0..1000).map(|i| 0.064 * f64::from(i)).collect();
        let way: Vec<Option<[f64; 2]>> = (0..1000).map(|i| Some([0.003 * f64::from(i), 0.5])).collect();
        assert_eq!(strays(&t_s, &way), [0; 0]);
        let mut seen = way.clone();
        for row in [0, 400, 401, 700] {
            seen[row] = Some([57.0, 0.5]);
        }
        seen[402] = None;
        assert_eq!(strays(&t_s, &seen), [0, 400, 401, 700]);
        // Carried elsewhere it does not come back.
        let mut carried = way.clone();
        carried[500..].iter_mut().flatten().for_each(|at| at[1] = 0.9);
        assert_eq!(strays(&t_s, &carried), [0; 0]);
        // Another unit is no fault of single sightings.
        let millimetres: Vec<_> = way.iter().map(|at| at.map(|at| at.map(|m| 1000.0 * m))).collect();
        assert_eq!(strays(&t_s, &millimetres), [0; 0]);
    }
}
