//! What several tests share.
use crate::Course;

/// The shipped circuit.
pub(crate) fn circuit() -> Course {
    Course::from_toml(TEXT).unwrap()
}

pub(crate) const TEXT: &str = include_str!("../../../worlds/roduit2007/world.toml");
