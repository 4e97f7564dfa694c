//! The program as its user runs it.
#![allow(clippy::unwrap_used)] // in tests, as clippy.toml says; helpers stand outside test functions here

mod cli;
mod declared;
mod determinism;
mod errors;
mod iris;
mod support;
mod sweep;
mod world;
