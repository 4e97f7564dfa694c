//! What a robot may do that the declared model does not: one file a family, one line in [`EFFECTS`] an effect.
//!
//! An effect is a [`Spec`], which tells everybody its name, stage and parameters, and a type with [`Effect`]'s hooks,
//! which act on the tick. Effects compose in the order of [`EFFECTS`], which is the order of the signal's way through
//! the robot.

mod act;
mod sense;
mod setting;

use std::fmt::Debug;

use track::Vec2;

pub(crate) use setting::Active;
pub use setting::{Pattern, Setting};

use crate::{Machine, Pose, Readings, Twist, WallPlace, WheelSpeeds};

/// Every effect the simulator knows, in the order in which they act.
pub const EFFECTS: &[Spec] = &[sense::READING_GAIN, sense::AMBIENT_OFFSET, act::SLIP_LEVEL];

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
}

impl Param {
    /// A number with the value at which the effect does nothing.
    pub const fn new(name: &'static str, unit: &'static str, neutral: f64, low: f64, high: f64) -> Self {
        Self { name, unit, neutral: Some(neutral), low, high, choices: &[] }
    }

    /// A number that says where or which.
    pub const fn place(name: &'static str, unit: &'static str, low: f64, high: f64) -> Self {
        Self { name, unit, neutral: None, low, high, choices: &[] }
    }

    /// One of several names.
    pub const fn choice(name: &'static str, choices: &'static [&'static str]) -> Self {
        Self { name, unit: "", neutral: None, low: 0.0, high: (choices.len() - 1) as f64, choices }
    }
}

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
    /// A fresh state, once per run.
    pub build: fn() -> Box<dyn Effect>,
}

impl PartialEq for Spec {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// The effect of that name.
///
/// # Errors
/// [`crate::Error::UnknownEffect`] with the nearest name.
pub fn find(name: &str) -> Result<&'static Spec, crate::Error> {
    EFFECTS.iter().find(|spec| spec.name == name).ok_or_else(|| {
        let likeness = |spec: &&Spec| (1e6 * strsim::jaro_winkler(spec.name, name)) as u64;
        let nearest = EFFECTS.iter().max_by_key(likeness).map_or("", |spec| spec.name);
        crate::Error::UnknownEffect { name: name.into(), nearest: nearest.into() }
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
    /// The command of the present control step.
    pub command: WheelSpeeds,
    /// Number of the gate that is next.
    pub gate: usize,
}

/// Where a ray met a wall.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Number of the sensor.
    pub sensor: usize,
    /// Distance along the ray, m.
    pub distance_m: f64,
    /// Cosine of the angle between the ray and the wall's normal, in [0, 1].
    pub cos_incidence: f64,
    /// The place on the exact wall.
    pub place: WallPlace,
    /// Length of that wall, m.
    pub wall_length_m: f64,
}

/// Hooks into the tick. Each gets the values of the effect's parameters in the order of its [`Spec`]; each does
/// nothing unless an effect says otherwise.
pub trait Effect: Debug + Send {
    /// Changes constants of the machine.
    fn machine(&self, _values: &[f64], _machine: &mut Machine) {}
    /// How far the wall is moved here, m, positive to the left of the driving direction.
    fn displacement_m(&self, _values: &[f64], _at: WallPlace, _wall_length_m: f64) -> f64 {
        0.0
    }
    /// Whether the straight piece between two places must be divided before it is moved.
    fn divides(&self, _values: &[f64], _piece: (WallPlace, WallPlace), _wall_length_m: f64) -> bool {
        false
    }
    /// Factor on the response of one ray; asked only where [`Effect::weighs_rays`] says so.
    fn ray_factor(&self, _values: &[f64], _hit: &Hit) -> f64 {
        1.0
    }
    /// Whether [`Effect::ray_factor`] must be asked.
    fn weighs_rays(&self) -> bool {
        false
    }
    /// Changes the readings before noise.
    fn readings(&mut self, _values: &[f64], _now: &Moment, _readings: &mut Readings) {}
    /// Changes the readings after noise, before they are cut to the scale.
    fn noisy_readings(&mut self, _values: &[f64], _readings: &mut Readings) {}
    /// Changes the speeds that the wheels are driven at, once per physics step.
    fn drive(&mut self, _values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels
    }
    /// Changes the slip draws of the left and the right wheel, in [-1, 1].
    fn slip(&mut self, _values: &[f64], draws: [f64; 2]) -> [f64; 2] {
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
