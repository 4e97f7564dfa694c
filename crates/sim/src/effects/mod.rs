//! What a robot may do that the declared model does not: one file a family, one line in [`EFFECTS`] an effect.
//!
//! An effect is a [`Spec`], which tells everybody its name, stage and parameters, and a type with [`Effect`]'s hooks,
//! which act on the tick. Effects compose in the order of [`EFFECTS`], which is the order of the signal's way through
//! the robot.

mod act;
mod area;
mod chain;
mod decide;
mod kept;
mod observe;
mod plain;
mod ray_hits;
mod rays;
mod sense;
mod setting;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod unlisted;
mod world;

use std::fmt::Debug;

use track::Vec2;

pub use area::Area;
pub(crate) use chain::Chain;
pub use ray_hits::RayHits;
pub(crate) use setting::Active;
pub use setting::{Pattern, Setting};
pub use unlisted::{UNLISTED, unlisted_area, unlisted_at, unlisted_on_floor};

use crate::{Machine, Pose, Readings, Twist, WallPlace, WheelSpeeds};

/// Every effect the simulator knows, in the order in which they act. Wall effects add up and may stand anywhere.
pub const EFFECTS: &[Spec] = &[
    rays::CONE_OF_VIEW,
    rays::DISTANCE_SCALE,
    rays::RESPONSE_EXPONENT,
    rays::SENSOR_ROTATION,
    rays::SENSOR_REACH,
    rays::INCIDENCE_FALLOFF,
    sense::READING_GAIN,
    sense::ONE_SENSOR_GAIN,
    sense::READING_DRIFT,
    sense::AMBIENT_OFFSET,
    sense::ONE_SENSOR_OFFSET,
    sense::DIRECTIONAL_LIGHT,
    sense::CROSSTALK,
    sense::SENSOR_LAG,
    sense::READING_NOISE,
    sense::READING_STEP,
    decide::CONTROLLER_GAIN,
    decide::CONTROLLER_SPEED,
    act::COMMAND_DELAY,
    act::DEAD_BAND,
    act::SPEED_STEP,
    act::MOTOR_LAG,
    act::ACCELERATION_LIMIT,
    act::SLIP_LEVEL,
    act::SLIP_MEMORY,
    act::WHEEL_ASYMMETRY,
    act::WHEEL_SCALE,
    act::BATTERY_SAG,
    act::AXLE_LENGTH,
    act::TURN_SCRUB,
    act::FLOOR_TILT,
    world::OUTER_WALL_OFFSET,
    world::INNER_WALL_OFFSET,
    world::WALL_BUMP,
    rays::OUTER_WALL_REFLECTANCE,
    rays::INNER_WALL_REFLECTANCE,
    rays::REFLECTANCE_PATCH,
    observe::MARKER_OFFSET,
    observe::CAMERA_DISTORTION,
    observe::CAMERA_SCALE,
    observe::CAMERA_ROTATION,
    observe::CAMERA_OFFSET,
    observe::CAMERA_NOISE,
];

/// Stage of the control loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Distance to reading.
    Sense,
    /// Readings to commands.
    Decide,
    /// Commands to motion.
    Act,
    /// The walls.
    World,
    /// The overhead camera.
    Observe,
}

impl Stage {
    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sense => "sense",
            Self::Decide => "decide",
            Self::Act => "act",
            Self::World => "world",
            Self::Observe => "observe",
        }
    }
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Param {
    /// Key in `[[effect]]` tables; ends in its unit.
    pub name: &'static str,
    /// Unit; empty for a ratio.
    pub unit: &'static str,
    /// The value at which the effect does nothing; `None` for a parameter that only says where or which.
    pub neutral: Option<f64>,
    /// Smallest value allowed.
    pub low: f64,
    /// Largest value allowed.
    pub high: f64,
    /// The names of the values 0, 1, ... of a parameter that is no number.
    pub choices: &'static [&'static str],
    /// Whether only whole numbers mean something.
    pub whole: bool,
}

impl Param {
    /// A number with the value at which the effect does nothing.
    pub const fn new(name: &'static str, unit: &'static str, neutral: f64, low: f64, high: f64) -> Self {
        let place = Self::place(name, unit, low, high);
        Self {
            neutral: Some(neutral),
            ..place
        }
    }

    /// A number that says where or which, or has no value at which the effect does nothing.
    pub const fn place(name: &'static str, unit: &'static str, low: f64, high: f64) -> Self {
        Self {
            name,
            unit,
            neutral: None,
            low,
            high,
            choices: &[],
            whole: false,
        }
    }

    /// One of the numbers 0, 1, ..., `count` - 1.
    pub const fn number_of(name: &'static str, count: usize) -> Self {
        let place = Self::place(name, "", 0.0, (count - 1) as f64);
        Self { whole: true, ..place }
    }

    /// One of several names.
    pub const fn choice(name: &'static str, choices: &'static [&'static str]) -> Self {
        let number = Self::number_of(name, choices.len());
        Self { choices, ..number }
    }
}

/// A direction on the floor, counter-clockwise from +x.
const AZIMUTH: Param = Param::place(
    "azimuth_rad",
    "rad",
    -std::f64::consts::TAU,
    std::f64::consts::TAU,
);

/// What everybody needs to know of an effect.
#[derive(Debug, Clone, Copy)]
pub struct Spec {
    /// Name in configuration and reports.
    pub name: &'static str,
    /// Where in the loop it acts.
    pub stage: Stage,
    /// One line for the user.
    pub summary: &'static str,
    /// Its parameters, in the order in which the hooks get their values.
    pub params: &'static [Param],
    /// A parameter with any number of values, which come after those of `params`.
    pub list: Option<Param>,
    /// A fresh state, once per run.
    pub build: fn() -> Box<dyn Effect>,
}

impl Spec {
    /// The parameter of a value by its place: all beyond those of `params` are the list's, if there is one.
    pub fn param(&self, place: usize) -> Option<&Param> {
        self.params.get(place).or(self.list.as_ref())
    }

    /// The place of a parameter's value by its name.
    pub fn place_of(&self, name: &str) -> Option<usize> {
        self.params.iter().position(|param| param.name == name)
    }

    /// Whether its one parameter is a rate of change in the course of a run.
    pub fn drifts(&self) -> bool {
        matches!(self.params, [Param { name: "per_s", .. }])
    }
}

impl PartialEq for Spec {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// The effect of that name, [`UNLISTED`] included.
///
/// # Errors
/// [`crate::Error::UnknownEffect`] with the nearest name.
///
/// ```
/// let gain = sim::find("reading-gain")?;
/// assert_eq!(gain.params[0].neutral, Some(1.0));
/// let drifting = sim::Pattern::ByTime { start: vec![1.0], per_s: vec![1e-4] };
/// assert!(sim::Setting { spec: gain, pattern: drifting }.check(0).is_ok());
/// # Ok::<(), sim::Error>(())
/// ```
pub fn find(name: &str) -> Result<&'static Spec, crate::Error> {
    let mut known = EFFECTS.iter().chain([&UNLISTED]);
    known.find(|spec| spec.name == name).ok_or_else(|| {
        let likeness = |spec: &&Spec| (1e6 * strsim::jaro_winkler(spec.name, name)) as u64;
        let nearest = EFFECTS.iter().max_by_key(likeness).map_or("", |spec| spec.name);
        crate::Error::UnknownEffect {
            name: name.into(),
            nearest: nearest.into(),
        }
    })
}

/// What the hooks may know of the present moment.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// Time since the run began, s.
    pub time_s: f64,
    /// Length of the step that is being taken, s: a control step in the sense stage, else a physics step.
    pub step_s: f64,
    /// The robot's true pose at the beginning of the step.
    pub pose: Pose,
    /// The latest command: in the sense and observe stages that of the control step before.
    pub command: WheelSpeeds,
    /// Number of the gate that is next.
    pub gate: usize,
    /// Number of gates.
    pub gate_count: usize,
    /// The middle of the arena, m.
    pub arena_middle: Vec2,
}

/// A place on a wall and what there is to know of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// The place on the exact wall.
    pub place: WallPlace,
    /// Length of that wall, m.
    pub wall_length_m: f64,
    /// 1 where the left of the driving direction is away from the corridor, -1 where it is towards it.
    pub outward: f64,
}

impl Site {
    /// Arc length from here to a place on the same wall, the shorter way round, m.
    pub fn arc_m(&self, fraction: f64) -> f64 {
        let ahead = (fraction - self.place.fraction).rem_euclid(1.0);
        ahead.min(1.0 - ahead) * self.wall_length_m
    }
}

/// Where a ray met a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Number of the sensor.
    pub sensor: usize,
    /// Distance along the ray, m.
    pub distance_m: f64,
    /// Cosine of the angle between the ray and the wall's normal, in [0, 1].
    pub cos_incidence: f64,
    /// The place on the exact wall.
    pub site: Site,
}

/// A place in the tick where an effect may act: one of the methods of [`Effect`] that are called while a robot drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hook {
    /// [`Effect::ray_factors`].
    RayFactors,
    /// [`Effect::readings`].
    Readings,
    /// [`Effect::noisy_readings`].
    NoisyReadings,
    /// [`Effect::drive`].
    Drive,
    /// [`Effect::slip`].
    Slip,
    /// [`Effect::ground`].
    Ground,
    /// [`Effect::twist`].
    Twist,
    /// [`Effect::drift_m_s`].
    Drift,
    /// [`Effect::observed`].
    Observed,
}

impl Hook {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::RayFactors,
        Self::Readings,
        Self::NoisyReadings,
        Self::Drive,
        Self::Slip,
        Self::Ground,
        Self::Twist,
        Self::Drift,
        Self::Observed,
    ];
}

/// Hooks into the tick. Each gets the values of the effect's parameters in the order of its [`Spec`]; each does
/// nothing unless an effect says otherwise.
pub trait Effect: Debug + Send {
    /// Those of the hooks called while a robot drives that it has; the others are not called. All, unless it says otherwise.
    fn hooks(&self) -> &'static [Hook] {
        &Hook::ALL
    }
    /// What changes constants of the machine, if anything does.
    fn on_machine(&self) -> Option<fn(&[f64], &mut Machine)> {
        None
    }
    /// How far the wall is moved here, m, positive to the left of the driving direction.
    fn displacement_m(&self, _values: &[f64], _at: &Site) -> f64 {
        0.0
    }
    /// Whether the straight piece between two places must be divided before it is moved.
    fn divides(&self, _values: &[f64], _from: &Site, _to: &Site) -> bool {
        false
    }
    /// Factor on the response of one ray.
    fn ray_factor(&self, _values: &[f64], _hit: &Hit) -> f64 {
        1.0
    }
    /// Multiplies factors on the responses of eight rays by [`Effect::ray_factor`] of each; an effect that computes them faster all at
    /// once gives the same bits. Rays that met no wall may get any.
    fn ray_factors(&self, values: &[f64], hits: &RayHits<'_>, factors: &mut Readings) {
        for lane in hits.lanes() {
            factors[lane] *= self.ray_factor(values, &hits.hit(lane));
        }
    }
    /// Changes the readings before noise.
    fn readings(&mut self, _values: &[f64], _now: &Moment, _machine: &Machine, _readings: &mut Readings) {}
    /// Changes the readings after noise, before they are cut to the scale.
    fn noisy_readings(&mut self, _values: &[f64], _readings: &mut Readings) {}
    /// Changes the speeds that the wheels are driven at, once per physics step.
    fn drive(&mut self, _values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels
    }
    /// Changes the slip draws of the left and the right wheel, in [-1, 1]. Two numbers that go through registers: an array would go
    /// through memory, which the processor would wait for at every call.
    fn slip(&mut self, _values: &[f64], draws: (f64, f64)) -> (f64, f64) {
        draws
    }
    /// Changes the speeds of the wheels over the ground.
    fn ground(&mut self, _values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels
    }
    /// Changes the motion of the body.
    fn twist(&mut self, _values: &[f64], _now: &Moment, twist: Twist) -> Twist {
        twist
    }
    /// A velocity added to the robot's, m/s.
    fn drift_m_s(&self, _values: &[f64], _now: &Moment) -> Vec2 {
        Vec2::ZERO
    }
    /// Changes the position that the camera sees, before its noise.
    fn observed(&self, _values: &[f64], _now: &Moment, position: Vec2) -> Vec2 {
        position
    }
}
