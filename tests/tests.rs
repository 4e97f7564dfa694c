//! The program as its user runs it.
// In tests, as clippy.toml says; helpers stand outside test functions here.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod case_study;
mod cli;
mod declared;
mod determinism;
mod errors;
mod iris;
mod support;
mod sweep;
mod world;
