//! The declared model as its file states it, and nothing else.
//!
//! [`Config`] mirrors `model.toml`. The shipped file underlies the user's key by key, so defaults
//! stand where a user sees them. Only names, types and finiteness are checked here; ranges are
//! the business of whoever builds a world from it, who reports them with [`ModelFile::located`].

mod document;
mod keys;
mod model_file;
mod world;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

pub(crate) use document::{Document, read};
pub(crate) use keys::{Fault, nearest};
pub(crate) use model_file::{ModelFile, ModelSource};
pub(crate) use world::{WorldSource, world_source};

/// The shipped model, which underlies every other.
pub(crate) const MODEL: &str = include_str!("../../../worlds/roduit2007/model.toml");

/// The shipped worlds: name and text.
pub(crate) const WORLDS: &[(&str, &str)] = &[(
    "roduit2007",
    include_str!("../../../worlds/roduit2007/world.toml"),
)];

/// An enum whose variants are words of the file, with all those words in `NAMES`.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($variant:ident = $word:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        pub(crate) enum $name { $(#[serde(rename = $word)] $variant),+ }

        #[allow(dead_code, reason = "not every enum of the file needs every function")]
        impl $name {
            /// The words of the file, in the order of the variants.
            pub(crate) const NAMES: &[&str] = &[$($word),+];

            /// The word of the file.
            pub(crate) fn name(self) -> &'static str {
                match self { $($name::$variant => $word),+ }
            }

            /// The variant of a word of the file.
            pub(crate) fn from_name(name: &str) -> Option<Self> {
                match name { $($word => Some($name::$variant),)+ _ => None }
            }
        }
    };
}

words!(
    /// Which response turns a distance into a reading.
    SensorKind { Improved = "improved", Original = "original" });
words!(
    /// What is averaged over the rays of a cone.
    Combine { Responses = "responses", Distances = "distances" });
words!(
    /// The controllers of the paper, 2 and 1.
    ControllerKind { Braitenberg = "braitenberg", RuleBased = "rule-based" });
words!(
    /// Which way round the robot drives.
    Direction { World = "world", Clockwise = "clockwise", CounterClockwise = "counter-clockwise" });
words!(
    /// How the parameters of an effect vary.
    Pattern { Run = "run", Time = "time" });

impl Direction {
    /// The way round a course: its own unless another is named.
    pub(crate) fn on(self, course: &track::Course) -> track::Direction {
        match self {
            Self::World => course.direction,
            Self::Clockwise => track::Direction::Clockwise,
            Self::CounterClockwise => track::Direction::CounterClockwise,
        }
    }
}

/// `model.toml`: world, robot, sensors, controller, noise and further effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    /// A file beside the one that names it, or a shipped world.
    pub(crate) world: String,
    pub(crate) wall: Wall,
    pub(crate) robot: Robot,
    pub(crate) sensor: Sensor,
    pub(crate) controller: Controller,
    pub(crate) slip: Slip,
    pub(crate) camera: Camera,
    pub(crate) run: Run,
    /// In the order of the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) effect: Vec<Effect>,
}

/// `[wall]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wall {
    pub(crate) max_error_m: f64,
    pub(crate) thickness_m: f64,
}

/// `[robot]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Robot {
    pub(crate) body_radius_m: f64,
    pub(crate) axle_m: f64,
    pub(crate) wheel_radius_m: f64,
    pub(crate) wheel_speed_limit_m_s: f64,
}

/// `[sensor]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sensor {
    pub(crate) kind: SensorKind,
    pub(crate) range_m: f64,
    pub(crate) full_scale_counts: f64,
    pub(crate) rays: usize,
    pub(crate) half_angle_rad: f64,
    pub(crate) combine: Combine,
    /// S0 to S7.
    pub(crate) mounts: [Mount; 8],
    pub(crate) improved: Improved,
    pub(crate) original: Original,
}

/// One of `sensor.mounts`, in the body frame: x forward, y left.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Mount {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) angle_rad: f64,
}

/// `[sensor.improved]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Improved {
    pub(crate) a_counts: f64,
    pub(crate) d0_m: f64,
    pub(crate) exponent: f64,
    pub(crate) noise_fraction: f64,
    pub(crate) noise_counts: f64,
}

/// `[sensor.original]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Original {
    /// Distance in m and reading in counts.
    pub(crate) table: Vec<[f64; 2]>,
    pub(crate) noise_fraction: f64,
}

/// `[controller]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Controller {
    pub(crate) kind: ControllerKind,
    pub(crate) speed_m_s: f64,
    pub(crate) gain_per_count: f64,
    pub(crate) threshold_counts: f64,
    pub(crate) step_s: f64,
}

/// `[slip]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Slip {
    pub(crate) level: f64,
}

/// `[camera]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Camera {
    pub(crate) noise_m: f64,
}

/// `[run]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Run {
    pub(crate) direction: Direction,
    /// Per control step.
    pub(crate) physics_steps: usize,
    pub(crate) gates: usize,
    pub(crate) start_offset_m: f64,
    pub(crate) start_heading_rad: f64,
    /// In nominal lap times.
    pub(crate) patience_laps: f64,
}

/// `[[effect]]`: its parameters are those of the effect's own list, so any key may stand here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Effect {
    pub(crate) kind: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) by: Option<Pattern>,
    /// Numbers, words, and arrays of them.
    #[serde(flatten)]
    pub(crate) parameters: Table,
}

impl Config {
    /// The declared model as shipped.
    pub(crate) fn shipped() -> Self {
        toml::from_str(MODEL).expect("the shipped model loads, which a test checks")
    }

    /// The text of a model file that loads back to this very configuration.
    pub(crate) fn to_toml(&self) -> String {
        toml::to_string(self).expect("every field of a configuration has a form in TOML")
    }

    /// This configuration with the keys of `declared` (nested or dotted) set otherwise.
    ///
    /// # Errors
    /// An unknown key, or a value of the wrong type or not finite.
    pub(crate) fn apply_declared(&self, declared: &Table) -> anyhow::Result<Self> {
        Ok(self.overlaid(declared)?)
    }

    /// This configuration with the way round named that it has on a course.
    pub(crate) fn going_round(mut self, course: &track::Course) -> Self {
        self.run.direction = match self.run.direction.on(course) {
            track::Direction::Clockwise => Direction::Clockwise,
            track::Direction::CounterClockwise => Direction::CounterClockwise,
        };
        self
    }

    /// This configuration with one key set: `value` as on the command line.
    ///
    /// # Errors
    /// An unknown key, or a value of the wrong type or not finite.
    pub(crate) fn with(&self, key: &str, value: &str) -> anyhow::Result<Self> {
        let mut table = self.to_table();
        keys::set(&mut table, key, keys::value(value))?;
        Ok(Self::checked(table)?)
    }

    /// As [`Self::apply_declared`], with the key at fault apart from the message.
    pub(crate) fn overlaid(&self, over: &Table) -> Result<Self, Fault> {
        let mut table = self.to_table();
        for (key, value) in over {
            keys::set(&mut table, key, value.clone())?;
        }
        Self::checked(table)
    }

    fn checked(table: Table) -> Result<Self, Fault> {
        keys::check(&table)?;
        table.try_into().map_err(|error: toml::de::Error| Fault {
            key: String::new(),
            problem: error.message().to_owned(),
        })
    }

    /// All keys, `effect` too where there is none, so that it is known to be an array.
    fn to_table(&self) -> Table {
        let mut table = Table::try_from(self).expect("every field of a configuration has a form in TOML");
        table.entry("effect").or_insert_with(|| Value::Array(Vec::new()));
        table
    }
}

#[cfg(test)]
mod tests;
