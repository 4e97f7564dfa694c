//! Sightings of the robot where it cannot be.

use crate::dataset::RunFile;

/// Takes sightings away where no robot can have been between those beside them, and says which.
pub(crate) fn without_strays(run: &mut RunFile) -> Vec<String> {
    let path = run.path.display().to_string();
    let rows = &mut run.rows;
    let say = |row: usize| {
        let [x, y] = rows.position_m[row].unwrap_or([f64::NAN; 2]);
        let time_s = rows.t_s[row];
        format!(
            "{path}: at t_s = {time_s:.3} the robot is seen at ({x}, {y}), where it cannot get from where it is seen \
             before and after; taken as not seen"
        )
    };
    let strays = strays(&rows.t_s, &rows.position_m);
    let words = strays.iter().map(|&row| say(row)).collect();
    for row in strays {
        rows.position_m[row] = None;
    }
    words
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

#[cfg(test)]
mod tests {
    use super::*;

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
