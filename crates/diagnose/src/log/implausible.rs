//! Values in a log that the robot cannot have written.

use sim::Model;

use super::controller::AT_LIMIT_M_S;
use super::rows::LogRow;
use crate::outlying::{far, median};

/// A value that was taken out of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Implausible {
    /// Which row.
    pub row: usize,
    /// Which value of it: 0 to 7 are the readings of S0 to S7, 8 and 9 the commands to the left and the right wheel.
    pub column: usize,
    /// In counts, or m/s.
    pub value: f64,
}

/// Takes single values out of a run's log that no robot of a model writes, and says which: readings outside the sensors' range
/// and commands beyond the wheels' limit. None if there are many: that is another unit, or another robot.
pub fn take_out_implausible(rows: &mut [LogRow], model: &Model) -> Vec<Implausible> {
    let found = out_of_range(rows, model);
    taken_out(rows, found)
}

/// Takes readings that leap away for a few rows out of the logs of runs, and says which, run by run. Of the two sensors behind, that
/// is: what spoils a reading of the others shows in a command that does not follow from it, and such rows have no readings any more
/// here. What still leaps in these others was read by the robot, which then read what leaps behind it too. `edge_counts` is what a
/// reading leaps by at the end of the range.
pub(crate) fn take_out_spikes(runs: &mut [Vec<LogRow>], edge_counts: f64) -> Vec<Vec<Implausible>> {
    const BEHIND: [usize; 2] = [3, 4];
    /// Leaps that may have been spoilt all the same, as a rule does not tell all sums apart.
    const UNTOLD: usize = 2;
    let spikes = |rows: &[LogRow], sensor: usize| spikes(rows, sensor, edge_counts);
    let leaps = |sensor: usize| runs.iter().map(|rows| spikes(rows, sensor).len()).sum::<usize>();
    let read: usize = (0..8).filter(|sensor| !BEHIND.contains(sensor)).map(leaps).sum();
    if read > UNTOLD {
        return vec![Vec::new(); runs.len()];
    }
    let of_run = |rows: &mut Vec<LogRow>| {
        let of_sensor = |sensor| {
            let found = spikes(rows, sensor);
            taken_out(rows, found)
        };
        BEHIND.into_iter().flat_map(of_sensor).collect()
    };
    runs.iter_mut().map(of_run).collect()
}

/// Values are taken out if they are few.
fn taken_out(rows: &mut [LogRow], found: Vec<Implausible>) -> Vec<Implausible> {
    const FEW: usize = 3;
    const FEW_OF_ALL: f64 = 0.01;
    if found.len() > FEW.max((FEW_OF_ALL * rows.len() as f64) as usize) {
        return Vec::new();
    }
    for Implausible { row, column, .. } in &found {
        let LogRow {
            readings, command, ..
        } = &mut rows[*row];
        let value = match column {
            8 => &mut command.left_m_s,
            9 => &mut command.right_m_s,
            sensor => &mut readings[*sensor],
        };
        *value = f64::NAN;
    }
    found
}

fn out_of_range(rows: &[LogRow], model: &Model) -> Vec<Implausible> {
    let bounds = bounds(model);
    let mut found = Vec::new();
    for (row, logged) in rows.iter().enumerate() {
        let LogRow {
            readings, command, ..
        } = logged;
        let values = readings.iter().chain([&command.left_m_s, &command.right_m_s]);
        for (column, (&value, [low, high])) in values.zip(bounds).enumerate() {
            if value < low || value > high {
                found.push(Implausible { row, column, value });
            }
        }
    }
    found
}

/// Readings of one sensor that leap away for a few rows, much farther from the median of those about them than others do.
fn spikes(rows: &[LogRow], sensor: usize, edge_counts: f64) -> Vec<Implausible> {
    /// Rows to either side of which the median is taken: what lasts no longer is a spike.
    const REACH: usize = 4;
    /// What is no spike in any case, counts.
    const LEAST_COUNTS: f64 = 200.0;
    /// Times as much as a reading leaps by at the end of the range, with its noise.
    const EDGES: f64 = 1.5;
    let reading = |row: usize| rows[row].readings[sensor];
    let places: Vec<usize> = (0..rows.len()).filter(|&row| reading(row).is_finite()).collect();
    let leap = |at: usize| {
        let about = at.saturating_sub(REACH)..places.len().min(at + REACH + 1);
        (reading(places[at]) - median(about.map(|at| reading(places[at])))).abs()
    };
    let leaps: Vec<f64> = (0..places.len()).map(leap).collect();
    let far = far(&leaps, LEAST_COUNTS.max(EDGES * edge_counts));
    (places.iter().zip(leaps))
        .filter(|(_, leap)| *leap > far)
        .map(|(&row, _)| Implausible {
            row,
            column: sensor,
            value: reading(row),
        })
        .collect()
}

/// From where to where the values of a row can be.
fn bounds(model: &Model) -> [[f64; 2]; 10] {
    /// Readings that are rounded, by the robot or by the file, may lie a little outside their range, counts and share.
    const BELOW_COUNTS: f64 = 0.1;
    const BEYOND: f64 = 1.25;
    let machine = &model.machine;
    let limit_m_s = machine.robot.wheel_speed_limit_m_s + AT_LIMIT_M_S;
    std::array::from_fn(|column| match column {
        0..8 => [-BELOW_COUNTS, BEYOND * machine.full_scale_counts],
        _ => [-limit_m_s, limit_m_s],
    })
}

#[cfg(test)]
mod tests {
    use sim::WheelSpeeds;

    use super::*;

    /// Rows of a robot whose sensors see walls come and go, with noise of so many counts.
    fn rows(noise_counts: f64) -> Vec<LogRow> {
        let mut noise = sim::Streams { seed: 3, run: 0 }.open("noise");
        let row = |i: usize| {
            let time_s = 0.064 * i as f64;
            // A wall that comes into sight at once, as one beyond an edge does.
            let seen = if (i / 100).is_multiple_of(2) { 900.0 } else { 0.0 };
            LogRow {
                time_s,
                starts: false,
                observed: None,
                readings: std::array::from_fn(|_| (seen + noise_counts * noise.normal()).max(0.0)),
                command: WheelSpeeds {
                    left_m_s: 0.05,
                    right_m_s: 0.05,
                },
                doubt_m: 0.0,
            }
        };
        (0..4000).map(row).collect()
    }

    #[test]
    fn readings_that_leap_away_for_a_few_rows_are_spikes_and_edges_and_noise_are_none() {
        for noise_counts in [0.0, 10.0, 150.0] {
            let mut log = rows(noise_counts);
            assert_eq!(
                (0..8)
                    .map(|sensor| spikes(&log, sensor, 0.0).len())
                    .sum::<usize>(),
                0
            );
            (1234..1237).for_each(|row| log[row].readings[4] = 3900.0);
            let found = spikes(&log, 4, 0.0);
            let found = taken_out(&mut log, found);
            let expected = |row| Implausible {
                row,
                column: 4,
                value: 3900.0,
            };
            assert_eq!(found, [1234, 1235, 1236].map(expected));
            assert!(log[1234].readings[4].is_nan());
        }
    }

    #[test]
    fn what_the_robot_read_before_it_is_no_fault_of_the_file_behind_it() {
        let spoil = |log: &mut Vec<LogRow>, sensor: usize, count: usize| {
            (0..count).for_each(|i| log[50 + 123 * i].readings[sensor] = 3900.0);
        };
        let mut runs = [rows(10.0), rows(20.0)];
        spoil(&mut runs[1], 3, 8);
        let found = take_out_spikes(&mut runs.clone(), 0.0);
        assert_eq!((found[0].len(), found[1].len()), (0, 8));
        spoil(&mut runs[0], 6, 8);
        let found = take_out_spikes(&mut runs, 0.0);
        assert_eq!(found, [[], []]);
    }

    #[test]
    fn many_are_no_fault_of_single_values() {
        let mut log = rows(10.0);
        (0..50).for_each(|i| log[50 + 77 * i].readings[4] += 2500.0);
        let before = log.clone();
        let found = spikes(&log, 4, 0.0);
        assert_eq!((found.len(), taken_out(&mut log, found)), (50, Vec::new()));
        assert_eq!(log, before);
    }
}
