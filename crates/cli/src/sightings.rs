//! What of a camera's sightings is not used, in words.

use diagnose::{Hole, hole_in, long_holes, outlying_sightings, repeated_sightings, stray_sightings};
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
    let mut words = taken_away(run, |rows| repeated_sightings(&rows.position_m), repeated);
    words.extend(taken_away(
        run,
        |rows| stray_sightings(&rows.t_s, &rows.position_m),
        stray,
    ));
    words.extend(taken_away(
        run,
        |rows| outlying_sightings(&rows.position_m),
        stray,
    ));
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

/// A number as a reader knows it again, whatever its size.
pub(crate) fn short(number: f64) -> String {
    if number != 0.0 && !(1e-4..1e6).contains(&number.abs()) {
        format!("{number:e}")
    } else {
        number.to_string()
    }
}

/// Says of each of a run's whole laps, by its number, where the robot was not seen for too long, if it was not.
pub(crate) fn lost<'r>(run: &'r RunFile, whole: &'r [Lap]) -> impl Fn(usize) -> Option<String> + 'r {
    let times_s: Vec<f64> = run.rows.since_start_s().collect();
    let seen: Vec<bool> = run.rows.position_m.iter().map(Option::is_some).collect();
    let holes = long_holes(&times_s, &seen, whole);
    move |number| {
        let Hole { from_s, to_s, row } = hole_in(&holes, whole, number)?;
        Some(format!(
            "{}: from here on the robot is not seen for {:.1} s",
            run.place(*row),
            to_s - from_s
        ))
    }
}
