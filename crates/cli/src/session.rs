//! One call of the program: its flags, when it began, what it read.

use std::io::Write;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::args::Global;
use crate::output::{Input, Manifest};
use crate::progress::Progress;

/// One call of the program.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) global: Global,
    begun: Instant,
}

impl Session {
    pub(crate) fn new(global: Global) -> Self {
        Self {
            global,
            begun: Instant::now(),
        }
    }

    pub(crate) fn seed(&self) -> u64 {
        self.global.seed
    }

    /// Progress over `total` units of work.
    pub(crate) fn progress(&self, message: &str, total: u64) -> Progress {
        Progress::new(message, total, self.global.quiet)
    }

    /// Progress of work that ends nobody knows when.
    pub(crate) fn open_progress(&self, message: &str) -> Progress {
        Progress::open(message, self.global.quiet)
    }

    /// The manifest of a folder that is complete now.
    pub(crate) fn manifest(&self, configuration: Value, inputs: Vec<Input>) -> Manifest {
        Manifest {
            command_line: std::env::args().collect(),
            seed: self.global.seed,
            configuration,
            inputs,
            duration_s: self.begun.elapsed().as_secs_f64(),
        }
    }

    /// Prints results; a closed pipe is not an error of ours.
    pub(crate) fn print(&self, text: &str) -> Result<()> {
        match std::io::stdout().lock().write_all(text.as_bytes()) {
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            other => other.context("cannot write to stdout"),
        }
    }

    /// Prints one JSON document.
    pub(crate) fn print_json(&self, document: &Value) -> Result<()> {
        self.print(&format!("{document:#}\n"))
    }

    /// Prints a remark on stderr, unless told to be quiet.
    pub(crate) fn remark(&self, line: &str) {
        if !self.global.quiet {
            eprintln!("lapwing: {line}");
        }
    }
}
