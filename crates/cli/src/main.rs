//! lapwing on the command line: files, configuration, experiments, reports.
#![allow(clippy::print_stdout)] // results go to stdout

mod args;
mod case_study;
mod commands;
mod config;
mod dataset;
mod experiments;
mod figures;
mod gate_table;
mod interrupt;
mod laps;
mod output;
mod progress;
mod ray_study;
mod report;
mod session;
mod setup;
mod sightings;
mod table;
#[cfg(test)]
mod testing;
mod trace;

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

use args::{Cli, Command, Reproduce};
use session::Session;

fn main() -> ExitCode {
    // clap exits with 2 on bad arguments and with 0 after --help.
    let cli = Cli::parse();
    match run(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lapwing: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(cli: Cli) -> Result<()> {
    interrupt::install()?;
    if let Some(threads) = cli.global.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()?;
    }
    let session = Session::new(cli.global);
    match cli
        .command
        .unwrap_or_else(|| Command::Reproduce(Reproduce::default()))
    {
        Command::Reproduce(args) => commands::reproduce::run(&session, &args),
        Command::Drive(args) => commands::drive::run(&session, &args),
        Command::Compare(args) => commands::compare::run(&session, &args),
        Command::Sweep(args) => commands::sweep::run(&session, &args),
        Command::World(args) => commands::world::run(&session, &args),
        Command::FitSensor(args) => commands::fit_sensor::run(&session, &args),
        Command::Trace(args) => commands::trace::run(&session, &args),
        Command::Bench(args) => commands::bench::run(&session, &args),
        Command::Effects(args) => commands::effects::run(&session, &args),
    }
}
