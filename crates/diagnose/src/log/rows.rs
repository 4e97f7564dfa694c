//! What a robot and the camera above it have written down.

use sim::{Model, Pose, Readings, Robot, RunRules, Step, Vec2, WheelSpeeds};

/// A run's log and the model that its data set declares.
#[derive(Debug, Clone, Copy)]
pub struct LoggedRun<'a> {
    /// The model.
    pub model: &'a Model,
    /// The rows in time order, from the run's start; none of a run without a log.
    pub rows: &'a [LogRow],
}

/// One control step of a run's file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogRow {
    /// Time since the run began, s.
    pub time_s: f64,
    /// Whether the robot starts here, from rest.
    pub starts: bool,
    /// Where the camera saw the robot, m.
    pub observed: Option<Vec2>,
    /// The readings that the controller saw, counts; NaN where they are missing.
    pub readings: Readings,
    /// The wheel speeds that it commanded, m/s; NaN where they are missing.
    pub command: WheelSpeeds,
    /// Standard deviation of what a wheel is commanded to go in the step, m, where that was not logged; 0 where it was.
    pub doubt_m: f64,
}

impl From<Step> for LogRow {
    fn from(step: Step) -> Self {
        Self {
            time_s: step.time_s,
            starts: step.time_s == 0.0,
            observed: Some(step.observed),
            readings: step.readings,
            command: step.command,
            doubt_m: 0.0,
        }
    }
}

impl LogRow {
    /// A control step of which nothing was logged.
    fn empty(time_s: f64) -> Self {
        Self {
            time_s,
            starts: false,
            observed: None,
            readings: [f64::NAN; 8],
            command: UNKNOWN,
            doubt_m: 0.0,
        }
    }

    /// The same without what another row lacks: a position, readings.
    pub(crate) fn with_holes_of(mut self, other: &Self) -> Self {
        self.observed = self.observed.filter(|_| other.observed.is_some());
        for (reading, other) in self.readings.iter_mut().zip(other.readings) {
            if !other.is_finite() {
                *reading = f64::NAN;
            }
        }
        self
    }

    /// Whether it has readings, or some of them, and the command that followed.
    pub fn tells(&self) -> bool {
        self.commands() && self.readings.iter().any(|reading| reading.is_finite())
    }

    /// Whether the command is known.
    pub(crate) fn commands(&self) -> bool {
        self.command.left_m_s.is_finite() && self.command.right_m_s.is_finite()
    }
}

/// The rows of a run, without readings and commands in some of them.
pub(crate) fn without_logs(rows: &[LogRow], where_not: &[usize]) -> Vec<LogRow> {
    let mut rows = rows.to_vec();
    for &row in where_not {
        rows[row].readings = [f64::NAN; 8];
        rows[row].command = UNKNOWN;
    }
    rows
}

const UNKNOWN: WheelSpeeds = WheelSpeeds {
    left_m_s: f64::NAN,
    right_m_s: f64::NAN,
};

/// The rows of a run with those that are missing, where these are few in a row, and with commands where these are missing: on a
/// line between those before and after, which may be off by as much as these differ.
pub(crate) fn bridged(rows: &[LogRow], rules: &RunRules) -> Vec<LogRow> {
    let mut whole: Vec<LogRow> = Vec::with_capacity(rows.len());
    for row in rows {
        if let Some(before) = whole.last().map(|before| before.time_s) {
            let steps = ((row.time_s - before) / rules.control_step_s).round();
            if (2.0..=BRIDGED as f64 + 1.0).contains(&steps) {
                let time_s = |missing: u32| before + f64::from(missing) * (row.time_s - before) / steps;
                whole.extend((1..steps as u32).map(|missing| LogRow::empty(time_s(missing))));
            }
        }
        whole.push(*row);
    }
    let mut known = None;
    for row in 0..whole.len() {
        if !whole[row].commands() {
            continue;
        }
        if let Some(before) = known.filter(|before| (2..=BRIDGED + 1).contains(&(row - before))) {
            bridge(&mut whole[before..=row], rules);
        }
        known = Some(row);
    }
    whole
}

/// Commands between the first and the last of some rows.
fn bridge(rows: &mut [LogRow], rules: &RunRules) {
    /// What a command may be off where those beside it are alike, m/s.
    const LEAST_M_S: f64 = 1e-3;
    let last = rows.len() - 1;
    let (from, to) = (rows[0].command, rows[last].command);
    let leap_m_s = (to.left_m_s - from.left_m_s)
        .abs()
        .max((to.right_m_s - from.right_m_s).abs());
    for (place, row) in rows.iter_mut().enumerate().take(last).skip(1) {
        let share = place as f64 / last as f64;
        let between = |from: f64, to: f64| from + share * (to - from);
        row.command = WheelSpeeds {
            left_m_s: between(from.left_m_s, to.left_m_s),
            right_m_s: between(from.right_m_s, to.right_m_s),
        };
        row.doubt_m = rules.control_step_s * LEAST_M_S.max(0.5 * leap_m_s);
    }
}

/// Control steps in a row that are bridged.
const BRIDGED: usize = 3;

/// Whether there is a stretch of these rows that a filter can follow.
pub fn can_be_followed(rows: &[LogRow], model: &Model) -> bool {
    let rows = bridged(rows, &model.run);
    let robot = &model.machine.robot;
    let mut found = stretches(&rows, &model.run).into_iter();
    found.any(|rows| start_pose(rows, robot, &model.run).is_some())
}

/// Stretches of rows that follow each other without a gap and know their commands; the rest is left out.
pub(crate) fn stretches<'a>(rows: &'a [LogRow], rules: &RunRules) -> Vec<&'a [LogRow]> {
    /// Share of a control step that times may be off: clocks of logs jitter.
    const OFF: f64 = 0.5;
    let mut found = Vec::new();
    let mut start = 0;
    for i in 0..=rows.len() {
        let broken = i == rows.len()
            || !rows[i].commands()
            || i > start
                && (rows[i].time_s - rows[i - 1].time_s - rules.control_step_s).abs()
                    > OFF * rules.control_step_s;
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
    let first = rows.iter().find_map(|row| row.observed)?;
    let mut at = Pose::new(0.0, 0.0, 0.0);
    let (mut count, mut from, mut to) = (0_usize, Vec2::ZERO, Vec2::ZERO);
    let (mut square_m2, mut turn) = (0.0, Vec2::ZERO);
    for row in rows {
        if let Some(seen) = row.observed {
            let (p, q) = (at.position, seen - first);
            count += 1;
            (from, to) = (from + p, to + q);
            square_m2 += p.length_squared();
            turn += Vec2::new(p.dot(q), p.perp_dot(q));
        }
        at = robot.roll(at, row.command, rules.control_step_s);
        if count >= LEAST_ROWS {
            let count = count as f64;
            let (middle, seen) = (from / count, to / count);
            if square_m2 / count - middle.length_squared() > LEAST_SPREAD_M * LEAST_SPREAD_M {
                let heading = (turn - Vec2::new(middle.dot(seen), middle.perp_dot(seen)) * count).normalize();
                let turned = Pose {
                    position: Vec2::ZERO,
                    heading,
                }
                .rotate(middle);
                return Some(Pose {
                    position: first + seen - turned,
                    heading,
                });
            }
        }
    }
    None
}
