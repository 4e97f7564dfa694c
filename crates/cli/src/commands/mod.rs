//! One file a command.

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod drive;
pub(crate) mod effects;
pub(crate) mod fit_sensor;
pub(crate) mod reproduce;
pub(crate) mod sweep;
pub(crate) mod trace;
pub(crate) mod world;
