//! An extended Kalman filter over the pose, driven by the logged commands, with the camera's positions and all eight
//! readings as measurements, one number after the other.

use sim::{
    Forecast, Look, Outlook, Pose, PoseMatrix, ReadingNoise, Robot, RunRules, Vec2, WheelSpeeds, World,
};

use super::evidence::SIGHT;
use super::moments::{Cut, FINE, Likelihood, cut, likelihood_of_cut};
use super::rows::{LogRow, start_pose};

/// Numbers measured in a control step: camera x and y, then the eight readings.
pub(crate) const MEASURED: usize = 10;

/// Which of the numbers of a control step count, bit by bit.
pub(crate) type Used = u16;

/// What the filter did in one control step: enough to follow a small change of the model through it.
#[derive(Debug, Clone)]
pub(crate) struct Instant {
    pub(crate) time_s: f64,
    pub(crate) used: Used,
    /// Pose before the camera's position.
    pub(crate) seen_from: Pose,
    /// What the camera should have seen there.
    pub(crate) seen: Vec2,
    /// Pose and covariance at which the readings were expected.
    pub(crate) sensed_from: Pose,
    pub(crate) covariance: PoseMatrix,
    /// Expected readings before the cut, what the numbers measured before changed of them by the readings' memory, the readings
    /// after the cut, and the standard deviation that they were cut with.
    pub(crate) uncut: [f64; 8],
    pub(crate) remembered: [f64; 8],
    pub(crate) expected: [f64; 8],
    pub(crate) deviation: [f64; 8],
    pub(crate) look: Look,
    /// Whitened innovations and what they were multiplied by.
    pub(crate) innovation: [f64; MEASURED],
    pub(crate) per_scale: [f64; MEASURED],
    /// Of the numbers that count.
    pub(crate) likelihood: Likelihood,
    pub(crate) slope: [[f64; 3]; MEASURED],
    pub(crate) gain: [[f64; 3]; MEASURED],
    /// Pose after all of them, the command and where it led.
    pub(crate) moved_from: Pose,
    pub(crate) command: WheelSpeeds,
    pub(crate) moved_to: Pose,
    pub(crate) turned: Vec2,
}

impl Instant {
    /// Of which nothing is known.
    fn unknown() -> Self {
        let pose = Pose::new(0.0, 0.0, 0.0);
        Self {
            time_s: 0.0,
            used: 0,
            seen_from: pose,
            seen: Vec2::ZERO,
            sensed_from: pose,
            covariance: [[0.0; 3]; 3],
            uncut: [0.0; 8],
            remembered: [0.0; 8],
            expected: [0.0; 8],
            deviation: [1.0; 8],
            look: Look::default(),
            innovation: [0.0; MEASURED],
            per_scale: [1.0; MEASURED],
            likelihood: Likelihood::ONE,
            slope: [[0.0; 3]; MEASURED],
            gain: [[0.0; 3]; MEASURED],
            moved_from: pose,
            command: WheelSpeeds::default(),
            moved_to: pose,
            turned: Vec2::ZERO,
        }
    }

    /// Forgets the numbers that were measured: those of the next step may not be there.
    fn forget(&mut self) {
        (self.remembered, self.expected, self.deviation) = ([0.0; 8], [0.0; 8], [1.0; 8]);
        (self.innovation, self.per_scale) = ([0.0; MEASURED], [1.0; MEASURED]);
        (self.slope, self.gain) = ([[0.0; 3]; MEASURED], [[0.0; 3]; MEASURED]);
        self.likelihood = Likelihood::ONE;
    }

    /// Counts a number, if it does count, by its likelihood; by default that of its innovation.
    fn count(&mut self, m: usize, likelihood: Option<Likelihood>) {
        if self.used >> m & 1 == 1 {
            self.likelihood = self.likelihood.and(likelihood.unwrap_or(Likelihood {
                factor: self.per_scale[m],
                square: self.innovation[m] * self.innovation[m],
            }));
        }
    }
}

/// One stretch filtered.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace {
    pub(crate) instants: Vec<Instant>,
    /// Sum over the used numbers of -(innovation^2 + log variance) / 2, or of what is likely of readings that may be cut.
    pub(crate) log_likelihood: f64,
    /// Step that the readings are rounded to, counts.
    pub(crate) step_counts: f64,
}

/// The state of the filter.
#[derive(Debug, Clone)]
struct State {
    pose: Pose,
    covariance: PoseMatrix,
    /// What the numbers measured since the pose was last settled move it by: x and y, m, and heading, rad.
    moved: [f64; 3],
    /// What readings remember, if they lag.
    memory: Option<Memory>,
}

/// Changes of the eight readings with the pose: x and y, counts/m, and heading, counts/rad.
type Slopes = [[f64; 3]; 8];

/// The last readings as what follows of them depends on the pose: a pose that is off was off before too. As far as slip is small,
/// that is all there is to know of them.
#[derive(Debug, Clone, Copy, Default)]
struct Memory {
    slope: Slopes,
    /// What is known better since they were expected, counts.
    missed: [f64; 8],
}

impl Memory {
    /// The next readings, which keep a share of the last ones, with their own slopes: these get what the memory adds.
    fn follow(&mut self, kept: f64, slopes: &mut Slopes) {
        for (next, last) in slopes.iter_mut().zip(&self.slope) {
            (0..3).for_each(|axis| next[axis] += kept * last[axis]);
        }
        self.slope = *slopes;
        self.missed.iter_mut().for_each(|missed| *missed *= kept);
    }

    /// After the pose was moved by what was measured.
    fn learn(&mut self, by: [f64; 3]) {
        for (missed, slope) in self.missed.iter_mut().zip(&self.slope) {
            *missed += (0..3).map(|axis| slope[axis] * by[axis]).sum::<f64>();
        }
    }

    /// With slopes in terms of the pose after a displacement that turns with the heading.
    fn carry(&mut self, turned: Vec2) {
        for slope in &mut self.slope {
            slope[2] += slope[0] * turned.y - slope[1] * turned.x;
        }
    }
}

impl State {
    fn new(pose: Pose, covariance: PoseMatrix) -> Self {
        Self {
            pose,
            covariance,
            moved: [0.0; 3],
            memory: None,
        }
    }

    /// One measured number, that differs from what was expected at the pose by `missed`: its whitened innovation, scale
    /// and gain.
    #[inline]
    fn update(&mut self, missed: f64, slope: [f64; 3], noise_variance: f64) -> (f64, f64, [f64; 3]) {
        let innovation = missed - (0..3).map(|axis| slope[axis] * self.moved[axis]).sum::<f64>();
        let p = &mut self.covariance;
        let across: [f64; 3] =
            std::array::from_fn(|i| p[i][0] * slope[0] + p[i][1] * slope[1] + p[i][2] * slope[2]);
        let variance = slope[0] * across[0] + slope[1] * across[1] + slope[2] * across[2] + noise_variance;
        // The next number waits for the gain, nothing for the scale.
        let per_variance = 1.0 / variance;
        let gain = across.map(|a| a * per_variance);
        for i in 0..3 {
            for j in 0..3 {
                p[i][j] -= gain[i] * across[j];
            }
        }
        (0..3).for_each(|axis| self.moved[axis] += gain[axis] * innovation);
        let scale = per_variance.sqrt();
        (innovation * scale, scale, gain)
    }

    /// Moves the pose by what was measured.
    fn settle(&mut self) {
        self.shift(self.moved);
        if let Some(memory) = &mut self.memory {
            memory.learn(self.moved);
        }
        self.moved = [0.0; 3];
    }

    fn shift(&mut self, by: [f64; 3]) {
        self.pose.position += Vec2::new(by[0], by[1]);
        let turn = Vec2::new(by[2].cos(), by[2].sin());
        self.pose.heading = Vec2::new(
            self.pose.heading.x * turn.x - self.pose.heading.y * turn.y,
            self.pose.heading.x * turn.y + self.pose.heading.y * turn.x,
        );
    }
}

/// Difference of two poses as x, y and heading.
#[inline]
pub(crate) fn difference(a: Pose, b: Pose) -> [f64; 3] {
    let way = a.position - b.position;
    [
        way.x,
        way.y,
        b.heading.perp_dot(a.heading).atan2(b.heading.dot(a.heading)),
    ]
}

/// F P F^T for a displacement that turns with the heading.
#[inline]
fn carried(p: &PoseMatrix, turned: Vec2) -> PoseMatrix {
    let arm = [-turned.y, turned.x, 0.0];
    let half: PoseMatrix = std::array::from_fn(|i| std::array::from_fn(|j| p[i][j] + arm[i] * p[2][j]));
    std::array::from_fn(|i| std::array::from_fn(|j| half[i][j] + half[i][2] * arm[j]))
}

/// Standard deviation below which a reading is exact, counts, and no likelihood weighs it: they are written to 0.1 counts.
const EXACT_COUNTS: f64 = 0.03;

/// Control steps at the beginning that do not count where a stretch begins in a run: how fast the robot then is is not known.
const BURN_IN: usize = 48;

/// Control steps at the beginning in which readings do not guide: the heading is a guess.
const GUESSED: usize = 16;

/// Filters one stretch. `used` says for each row what counts; without it all that is there does. `step_counts` is the
/// step that the readings are rounded to.
pub(crate) fn filter(
    world: &World<'_>,
    rows: &[LogRow],
    used: Option<&[Used]>,
    step_counts: f64,
) -> Option<Trace> {
    let mut instants = Vec::with_capacity(rows.len());
    let log_likelihood = filtered(world, rows, used, step_counts, |instant| {
        instants.push(instant.clone())
    })?;
    Some(Trace {
        instants,
        log_likelihood,
        step_counts,
    })
}

/// The log-likelihood of a stretch as [`filter`] finds it.
pub(crate) fn likelihood(world: &World<'_>, rows: &[LogRow], used: &[Used], step_counts: f64) -> Option<f64> {
    filtered(world, rows, Some(used), step_counts, |_| ())
}

/// Filters one stretch and gives each control step to `each`; the log-likelihood.
pub(super) fn filtered(
    world: &World<'_>,
    rows: &[LogRow],
    used: Option<&[Used]>,
    step_counts: f64,
    mut each: impl FnMut(&Instant),
) -> Option<f64> {
    let (mut filter, burn_in) = Filter::new(world, rows, step_counts)?;
    let mut log_likelihood = 0.0;
    let mut instant = Instant::unknown();
    for (i, row) in rows.iter().enumerate() {
        let usable = match used {
            Some(used) => used[i],
            None => available(row, i),
        };
        filter.step(row, usable, i >= burn_in, &mut instant);
        log_likelihood += instant.likelihood.ln();
        each(&instant);
        if !filter.state.pose.position.x.is_finite() {
            return None;
        }
    }
    Some(log_likelihood)
}

/// The state before the first row of a stretch, and the number of rows that do not count. Where a run starts from rest, its first sighting
/// alone tells where; elsewhere the way that it then drives does.
fn start(rows: &[LogRow], robot: &Robot, rules: &RunRules) -> Option<(State, usize)> {
    let diagonal = |position_m: f64, heading_rad: f64| {
        let mut covariance = [[0.0; 3]; 3];
        (covariance[0][0], covariance[1][1]) = (position_m.powi(2), position_m.powi(2));
        covariance[2][2] = heading_rad.powi(2);
        covariance
    };
    let guess = start_pose(rows, robot, rules)?;
    let first = rows.first().filter(|row| row.starts);
    Some(match first.and_then(|row| row.observed) {
        Some(position) => (State::new(Pose { position, ..guess }, diagonal(0.05, 0.2)), 1),
        None => (State::new(guess, diagonal(0.002, 0.05)), BURN_IN),
    })
}

/// What a row has; readings do not guide the very first steps.
fn available(row: &LogRow, index: usize) -> Used {
    let camera = if row.observed.is_some() { 0b11 } else { 0 };
    if index < GUESSED {
        return camera;
    }
    let finite = |lane: &usize| row.readings[*lane].is_finite();
    (0..8)
        .filter(finite)
        .fold(camera, |used, lane| used | 1 << (lane + 2))
}

/// A filter on its way through a stretch.
struct Filter<'w> {
    forecast: Forecast<'w>,
    state: State,
    /// Step that the readings are rounded to.
    step_counts: f64,
    unseen: Unseen,
}

/// A reading of a sensor that sees no wall, which most do not: it says nothing of the pose.
struct Unseen {
    noise: ReadingNoise,
    deviation: f64,
    read: Cut,
    /// One over the standard deviation of what is read.
    scale: f64,
    /// Of a reading of 0.
    zero: Likelihood,
}

impl Unseen {
    fn new(forecast: &Forecast<'_>, step_counts: f64) -> Self {
        let noise = forecast.machine().noise;
        let deviation = noise.deviation(0.0);
        let declared = forecast.declared_noise().deviation(0.0);
        let read = cut(0.0, deviation, step_counts, declared);
        Self {
            noise,
            deviation,
            read,
            scale: 1.0 / read.variance.sqrt(),
            zero: likelihood_of_cut(0.0, 0.0, deviation, step_counts),
        }
    }
}

impl<'w> Filter<'w> {
    /// At the first of these rows, and the number of rows that do not count.
    fn new(world: &'w World<'w>, rows: &[LogRow], step_counts: f64) -> Option<(Self, usize)> {
        let forecast = Forecast::new(world).ok()?;
        let (mut state, burn_in) = start(rows, &forecast.machine().robot, world.rules())?;
        state.memory = (forecast.kept() > 0.0).then(Memory::default);
        let filter = Self {
            unseen: Unseen::new(&forecast, step_counts),
            forecast,
            state,
            step_counts,
        };
        Some((filter, burn_in))
    }

    /// One control step, which `instant` then tells.
    fn step(&mut self, row: &LogRow, usable: Used, counts: bool, instant: &mut Instant) {
        self.forecast.tick(row.time_s);
        instant.forget();
        instant.time_s = row.time_s;
        instant.used = if counts { usable } else { 0 };
        instant.seen_from = self.state.pose;
        instant.seen = self.forecast.observed(self.state.pose);
        instant.command = row.command;
        self.see(row, usable, instant);
        instant.sensed_from = self.state.pose;
        instant.covariance = self.state.covariance;
        let outlook = self.forecast.readings(self.state.pose, &self.state.covariance);
        self.sense(row, &outlook, usable, instant);
        instant.moved_from = self.state.pose;
        self.drive(row, instant);
    }

    /// The camera's position.
    fn see(&mut self, row: &LogRow, usable: Used, instant: &mut Instant) {
        let Some(observed) = row.observed.filter(|_| usable & 0b11 != 0) else {
            return;
        };
        // Positions are written to 0.1 mm.
        const ROUNDING_M2: f64 = 1e-8 / 12.0;
        let noise = self.forecast.machine().camera_noise_m.powi(2) + ROUNDING_M2;
        let slopes = camera_slopes(&self.forecast, instant.seen_from, instant.seen);
        let missed = observed - instant.seen;
        for (m, missed) in [missed.x, missed.y].into_iter().enumerate() {
            instant.slope[m] = slopes[m];
            (instant.innovation[m], instant.per_scale[m], instant.gain[m]) =
                self.state.update(missed, slopes[m], noise);
            instant.count(m, None);
        }
        self.state.settle();
    }

    /// The eight readings.
    fn sense(&mut self, row: &LogRow, outlook: &Outlook, usable: Used, instant: &mut Instant) {
        (instant.look, instant.uncut) = (outlook.look, outlook.mean);
        let noise = self.forecast.machine().noise;
        if self.unseen.noise != noise {
            self.unseen = Unseen::new(&self.forecast, self.step_counts);
        }
        let mut slopes = outlook.slope;
        if let Some(memory) = &mut self.state.memory {
            memory.follow(self.forecast.kept(), &mut slopes);
            instant.remembered = memory.missed;
        }
        for (lane, slope) in slopes.into_iter().enumerate() {
            let (m, reading) = (lane + 2, row.readings[lane]);
            let is_usable = usable >> m & 1 == 1;
            let mean = outlook.mean[lane] + instant.remembered[lane];
            if mean == 0.0 && slope == [0.0; 3] && outlook.edge_variance[lane] == 0.0 {
                self.sense_nothing(m, Some(reading).filter(|_| is_usable), instant);
                continue;
            }
            let p = &self.state.covariance;
            // The variance before the cut holds the pose's share at this moment of the sequence.
            let pose_variance: f64 = (0..3)
                .map(|i| slope[i] * (p[i][0] * slope[0] + p[i][1] * slope[1] + p[i][2] * slope[2]))
                .sum();
            let own_variance = noise.deviation(mean).powi(2) + outlook.edge_variance[lane];
            let deviation = (own_variance + pose_variance).sqrt();
            if deviation < EXACT_COUNTS {
                instant.used &= !(1 << m);
                continue;
            }
            let declared = self.forecast.declared_noise().deviation(mean);
            let read = cut(mean, deviation, self.step_counts, declared);
            (instant.expected[lane], instant.deviation[lane]) = (read.mean, deviation);
            if !is_usable {
                continue;
            }
            // The likelihood of what may be cut, by all that is known before.
            let cut_likelihood = (self.is_fine(deviation) && read.open < 1.0).then(|| {
                let moved: f64 = (0..3).map(|axis| slope[axis] * self.state.moved[axis]).sum();
                likelihood_of_cut(reading, mean + moved, deviation, self.step_counts)
            });
            let slope = slope.map(|s| s * read.open);
            let rest = (read.variance - pose_variance * read.open * read.open).max(1e-3 * read.variance);
            instant.slope[m] = slope;
            (instant.innovation[m], instant.per_scale[m], instant.gain[m]) =
                self.state.update(reading - read.mean, slope, rest);
            instant.count(m, cut_likelihood);
        }
        self.state.settle();
    }

    /// The reading of a sensor that sees no wall, if it is usable.
    fn sense_nothing(&self, m: usize, reading: Option<f64>, instant: &mut Instant) {
        let unseen = &self.unseen;
        if unseen.deviation < EXACT_COUNTS {
            instant.used &= !(1 << m);
            return;
        }
        (instant.expected[m - 2], instant.deviation[m - 2]) = (unseen.read.mean, unseen.deviation);
        let Some(reading) = reading else { return };
        instant.per_scale[m] = unseen.scale;
        instant.innovation[m] = (reading - unseen.read.mean) * unseen.scale;
        let likelihood = self.is_fine(unseen.deviation).then(|| {
            if reading > 0.0 {
                likelihood_of_cut(reading, 0.0, unseen.deviation, self.step_counts)
            } else {
                unseen.zero
            }
        });
        instant.count(m, likelihood);
    }

    /// Whether rounding is as good as noise of this standard deviation.
    fn is_fine(&self, deviation: f64) -> bool {
        self.step_counts < FINE * deviation
    }

    /// The command.
    fn drive(&mut self, row: &LogRow, instant: &mut Instant) {
        let motion = self.forecast.motion(self.state.pose, row.command);
        let doubt = self.doubt(row);
        let mut covariance = carried(&self.state.covariance, motion.turned);
        for i in 0..3 {
            for j in 0..3 {
                covariance[i][j] += motion.covariance[i][j];
            }
            covariance[i][i] += doubt[i];
        }
        (instant.moved_to, instant.turned) = (motion.pose, motion.turned);
        if let Some(memory) = &mut self.state.memory {
            memory.carry(motion.turned);
        }
        self.state = State {
            memory: self.state.memory,
            ..State::new(motion.pose, covariance)
        };
    }

    /// What a command that was not logged adds to the variance of x and y, m2, and of the heading, rad2.
    fn doubt(&self, row: &LogRow) -> [f64; 3] {
        let way_m2 = row.doubt_m * row.doubt_m;
        let turn = 2.0 * way_m2 / self.forecast.machine().robot.axle_m.powi(2);
        [way_m2, way_m2, turn]
    }
}

/// Change of the seen position with the pose.
fn camera_slopes(forecast: &Forecast<'_>, pose: Pose, seen: Vec2) -> [[f64; 3]; 2] {
    const H: f64 = 1e-5;
    if forecast.sees_plainly() {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    }
    let mut slopes = [[0.0; 3]; 2];
    for axis in 0..3 {
        let mut moved = State::new(pose, [[0.0; 3]; 3]);
        let mut by = [0.0; 3];
        by[axis] = H;
        moved.shift(by);
        let change = (forecast.observed(moved.pose) - seen) / H;
        (slopes[0][axis], slopes[1][axis]) = (change.x, change.y);
    }
    slopes
}

/// Which readings the poses of a trace let count: those whose ray is neither near the end of the range nor near the
/// silhouette of a wall. Decided once, so that every model is judged on the same numbers.
pub(crate) fn clear_readings(world: &World<'_>, trace: &Trace, rows: &[LogRow]) -> Vec<Used> {
    let Ok(forecast) = Forecast::new(world) else {
        return vec![0; rows.len()];
    };
    let range_m = forecast.machine().range_m;
    (trace.instants.iter().zip(rows).enumerate())
        .map(|(i, (instant, row))| {
            let mut used = available(row, i);
            let distances_from = |by: [f64; 3]| {
                let mut state = State::new(instant.moved_from, [[0.0; 3]; 3]);
                state.shift(by);
                forecast.distances_m(state.pose)
            };
            let turned = [-SILHOUETTE_RAD, SILHOUETTE_RAD].map(|by| distances_from([0.0, 0.0, by]));
            let about = ABOUT.map(distances_from);
            for lane in 0..8 {
                let at = instant.look.distance_m()[lane];
                let edge = (at - range_m).abs() < EDGE_M + 2.0 * instant.look.deviation_m[lane];
                // A ray that hits nothing has no such deviation.
                let missed = at >= range_m && about.iter().any(|side| side[lane] < range_m);
                let leap = turned.iter().any(|side| leaps(at, side[lane], range_m));
                if edge || missed || leap {
                    used &= !(1 << (lane + 2));
                }
            }
            used
        })
        .collect()
}

/// How far the pose may be off, as x, y and heading.
const ABOUT: [[f64; 3]; 6] = [
    [-OFF_M, 0.0, 0.0],
    [OFF_M, 0.0, 0.0],
    [0.0, -OFF_M, 0.0],
    [0.0, OFF_M, 0.0],
    [0.0, 0.0, -OFF_RAD],
    [0.0, 0.0, OFF_RAD],
];
const OFF_M: f64 = 0.002;
const OFF_RAD: f64 = 0.03;

/// Whether rays of one world end elsewhere than those of another from the poses of a trace, as a few of them tell.
pub(crate) fn reaches_elsewhere(world: &World<'_>, other: &World<'_>, trace: &Trace) -> bool {
    const EVERY: usize = 50;
    const ALIKE_M: f64 = 1e-5;
    let (Ok(own), Ok(other)) = (Forecast::new(world), Forecast::new(other)) else {
        return false;
    };
    trace.instants.iter().step_by(EVERY).any(|instant| {
        let [own, other] = [&own, &other].map(|forecast| forecast.distances_m(instant.moved_from));
        own.iter().zip(&other).any(|(a, b)| (a - b).abs() > ALIKE_M)
    })
}

/// Whether the robot of one trace is elsewhere than that of another of the same rows, by a fair part of what poses may be off.
pub(crate) fn leads_elsewhere(one: &Trace, other: &Trace) -> bool {
    const PART: f64 = 0.25;
    let apart_m = (one.instants.iter().zip(&other.instants)).map(|(one, other)| {
        one.moved_from
            .position
            .distance_squared(other.moved_from.position)
            .sqrt()
    });
    apart_m.sum::<f64>() > PART * OFF_M * one.instants.len() as f64
}

const SILHOUETTE_RAD: f64 = 0.06;
const EDGE_M: f64 = 0.002;

/// Whether a small turn makes a ray jump from one wall to another, or to none, within the range.
fn leaps(at: f64, beside: f64, range_m: f64) -> bool {
    let (at, beside) = (at.min(SIGHT * range_m), beside.min(SIGHT * range_m));
    at.min(beside) < range_m && (at - beside).abs() > 0.012 + 0.15 * at.min(beside)
}
