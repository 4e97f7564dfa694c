//! The program as its user runs it.
// In tests, as clippy.toml says; helpers stand outside test functions here.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod case_study;
mod cli;
mod comparing;
mod controls;
mod damaged;
mod declared;
mod determinism;
mod driving;
mod effects_in_logs;
mod errors;
mod fit_sensor;
#[path = "../benches/ground/mod.rs"]
mod ground;
mod iris;
mod practice;
mod separate;
mod several_sets;
mod support;
mod sweep;
mod trace_input;
mod tracing;
mod undeclared;
mod world;
