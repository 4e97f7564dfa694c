//! Walls as b-splines, their straight segments, gates, and the sampling of a path.
//!
//! A [`Course`] is read from a world file: two closed [`Wall`]s, each a chain of uniform cubic b-splines, and the
//! direction of driving. A wall gives its points by arc length, the nearest point to anywhere, and a [`Chain`] of
//! straight segments within a maximal error. [`Gates`] stand across the corridor at equal distances along its
//! midline; a [`LapTracker`] watches a robot's positions go by and hands out each [`Lap`] as the positions at
//! which the gates were crossed.
//!
//! SI units and radians throughout; x right, y up. Nothing here draws a random number.
//!
//! ```
//! use track::{Course, Side};
//!
//! let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
//! assert_eq!(course.wall(Side::Outer).flatten(0.005)?.vertices.len(), 27);
//! assert_eq!(course.wall(Side::Inner).flatten(0.005)?.vertices.len(), 20);
//! let gates = course.gates(100)?;
//! assert!((gates.midline_length_m() - 3.2480).abs() < 1e-4);
//! # Ok::<(), track::Error>(())
//! ```

mod course;
mod crossing;
mod error;
mod flatten;
mod gates;
mod lap;
mod midline;
mod numeric;
mod smooth;
mod spline;
#[cfg(test)]
mod testing;
mod wall;

pub use course::{Corridor, Course, Direction, Side};
pub use error::Error;
pub use flatten::{Chain, Vertex};
pub use gates::{Gate, Gates, Way};
pub use lap::{Lap, LapTracker, laps};
pub use parry2d::math::Vector as Vec2;
pub use smooth::moving_mean;
pub use spline::Spline;
pub use wall::{Nearest, Wall};
