//! A kinematic e-puck that drives laps between walls: ray-cast infra-red sensors, two controllers, slipping wheels,
//! an overhead camera, and the effects that a real robot adds to these.
//!
//! A [`Scene`] is a circuit with its walls cut into straight pieces, a [`World`] what one run of a [`Model`] drives
//! in (nothing in it changes, so threads share it), a [`Run`] everything that changes. The tick has five stages,
//! always in this order: sense, decide, act, move, observe.

// What benchmarks and tests stand on names this crate as its users do.
#[cfg(test)]
extern crate self as sim;

mod apparatus;
mod cast;
mod cones;
mod controller;
mod cut;
mod effects;
mod error;
mod forecast;
mod model;
mod noise;
mod outlook;
mod robot;
mod run;
mod sensor;
mod tape;
mod walls;
mod world;

pub use cast::{Caster, CasterKind, Hits, LANES, Rays, segment_distance_m};
pub use controller::Controller;
pub use cut::{max_error_for, segment_count};
pub use effects::{
    Area, EFFECTS, Effect, Hit, Hook, Moment, Param, Pattern, RayHits, Setting, Site, Spec, Stage, UNLISTED,
    find, unlisted_area, unlisted_at, unlisted_on_floor,
};
pub use error::Error;
pub use forecast::{Forecast, Motion, PoseMatrix};
pub use model::{Machine, Model, RunRules, WallRules};
pub use noise::{Stream, Streams};
pub use outlook::{Look, Outlook, Places};
pub use robot::{Pose, Robot, Twist, WheelSpeeds};
pub use run::{Drive, Run, Start, Step, drive, drive_from, drive_until};
pub use sensor::{Beam, Combine, Mount, ReadingNoise, Readings, Response};
pub use tape::{Draws, Tape};
pub use track::Vec2;
pub use walls::{WallPlace, Walls};
pub use world::{Circuit, Scene, World};
