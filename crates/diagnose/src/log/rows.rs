//! What a robot and the camera above it have written down.

use sim::{Pose, Readings, Robot, RunRules, Step, Vec2, WheelSpeeds};

/// One control step of a run's file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogRow {
    /// Time since the run began, s.
    pub time_s: f64,
    /// Where the camera saw the robot, m.
    pub observed: Option<Vec2>,
    /// The readings that the controller saw, counts; NaN where they are missing.
    pub readings: Readings,
    /// The wheel speeds that it commanded, m/s; NaN where they are missing.
    pub command: WheelSpeeds,
}

impl From<Step> for LogRow {
    fn from(step: Step) -> Self {
        Self {
            time_s: step.time_s,
            observed: Some(step.observed),
            readings: step.readings,
            command: step.command,
        }
    }
}

impl LogRow {
    /// Whether it has readings and the command that followed them.
    pub fn tells(&self) -> bool {
        self.commands() && self.read().is_some()
    }

    /// Whether the command is known.
    pub(crate) fn commands(&self) -> bool {
        self.command.left_m_s.is_finite() && self.command.right_m_s.is_finite()
    }

    /// The readings, where none is missing.
    pub(crate) fn read(&self) -> Option<&Readings> {
        self.readings
            .iter()
            .all(|reading| reading.is_finite())
            .then_some(&self.readings)
    }
}

/// The rows of a run, without readings and commands in some of them.
pub(crate) fn without_logs(rows: &[LogRow], where_not: &[usize]) -> Vec<LogRow> {
    let mut rows = rows.to_vec();
    for &row in where_not {
        rows[row].readings = [f64::NAN; 8];
        rows[row].command = WheelSpeeds {
            left_m_s: f64::NAN,
            right_m_s: f64::NAN,
        };
    }
    rows
}

/// Stretches of rows that follow each other without a gap and know their commands; the rest is left out.
pub(crate) fn stretches<'a>(rows: &'a [LogRow], rules: &RunRules) -> Vec<&'a [LogRow]> {
    let mut found = Vec::new();
    let mut start = 0;
    for i in 0..=rows.len() {
        let broken = i == rows.len()
            || !rows[i].commands()
            || i > start
                && (rows[i].time_s - rows[i - 1].time_s - rules.control_step_s).abs()
                    > 0.25 * rules.control_step_s;
        if broken {
            if i - start >= SHORTEST {
                found.push(&rows[start..i]);
            }
            start = if i < rows.len() && rows[i].commands() {
                i
            } else {
                i + 1
            };
        }
    }
    found
}

/// Control steps below which a stretch tells too little to begin a filter.
const SHORTEST: usize = 200;

/// The pose at the beginning of a stretch: the dead-reckoned path laid over the first positions seen, by turning and
/// moving it (Procrustes). `None` where the camera saw too little of it.
pub(crate) fn start_pose(rows: &[LogRow], robot: &Robot, rules: &RunRules) -> Option<Pose> {
    const LEAST_ROWS: usize = 32;
    const LEAST_SPREAD_M: f64 = 0.03;
    let mut at = Pose::new(0.0, 0.0, 0.0);
    let mut pairs: Vec<(Vec2, Vec2)> = Vec::new();
    for row in rows {
        pairs.extend(row.observed.map(|seen| (at.position, seen)));
        at = robot.roll(at, row.command, rules.control_step_s);
        if pairs.len() >= LEAST_ROWS {
            let count = pairs.len() as f64;
            let (from, to) = pairs
                .iter()
                .fold((Vec2::ZERO, Vec2::ZERO), |(a, b), (p, q)| (a + *p, b + *q));
            let (from, to) = (from / count, to / count);
            let spread_m2: f64 = pairs.iter().map(|(p, _)| p.distance_squared(from)).sum::<f64>() / count;
            if spread_m2.sqrt() > LEAST_SPREAD_M {
                let turn = pairs.iter().fold(Vec2::ZERO, |sum, (p, q)| {
                    let (p, q) = (*p - from, *q - to);
                    sum + Vec2::new(p.dot(q), p.perp_dot(q))
                });
                let heading = turn.normalize();
                let turned = Pose {
                    position: Vec2::ZERO,
                    heading,
                }
                .rotate(from);
                return Some(Pose {
                    position: to - turned,
                    heading,
                });
            }
        }
    }
    None
}
