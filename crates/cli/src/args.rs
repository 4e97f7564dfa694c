//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// How far is a simulated robot from the real one, and why?
///
/// lapwing drives a simulated e-puck round a walled circuit, samples every lap, simulated or measured, at gates across
/// the track, and compares the laps with a Point Distribution Model (Roduit, Martinoli and Jacot, IROS 2007).
///
/// Without a command it reproduces the paper's experiments on the laps it ships: `lapwing reproduce --out lapwing-report`.
#[derive(Debug, Parser)]
#[command(name = "lapwing", version, max_term_width = 110)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// Flags of every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct Global {
    /// Seed of all random numbers: the same seed gives the same bytes
    #[arg(long, global = true, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Threads to work with; the results do not depend on it [default: all cores]
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Nothing on stderr but errors: no progress, and no remarks on the data
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
}

/// What the program can be asked for.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Reproduce(Reproduce),
    Drive(Drive),
    Compare(Compare),
    Sweep(Sweep),
    #[command(subcommand)]
    World(World),
    FitSensor(FitSensor),
    Trace(Trace),
    #[command(subcommand)]
    Bench(Bench),
    Effects(Effects),
}

/// A model and what is set otherwise in it.
#[derive(Debug, Clone, Args)]
pub(crate) struct ModelArgs {
    /// Model file (TOML); what it leaves out is as in the shipped model. `roduit2007` names the shipped one
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) settings: Settings,
}

/// What is set otherwise in a model.
#[derive(Debug, Clone, Args)]
pub(crate) struct Settings {
    /// Set one key of the model, e.g. slip.level=1 or controller.kind=rule-based; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// World file to use instead of the one that the model names
    #[arg(long, value_name = "FILE")]
    pub(crate) world: Option<PathBuf>,
}

/// Both experiments of the paper on the circuit: tables, figures, report
///
/// These are the two controllers of section IV, and the sensor models, the wall approximation, the wheel slip, and all of them
/// together; every table of the paper beside ours, every figure, and each claim with its numbers.
/// In the end what the model lacks in these laps is traced, and Tables II and III are made again with it.
///
/// Example: lapwing reproduce --seeds 100 --out report
#[derive(Debug, Args)]
pub(crate) struct Reproduce {
    /// Measured data set; give one per controller [default: the laps that are shipped]
    #[arg(long, value_name = "DIR")]
    pub(crate) measured: Vec<PathBuf>,
    /// Folder for the report, in place of an earlier result there [default: lapwing-report]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// How often everything is simulated, each time with random numbers of its own: what the intervals rest on
    #[arg(long, default_value_t = SEEDS, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) seeds: u32,
    /// Leave out the last part, which traces what the model lacks in the measured laps
    #[arg(long)]
    pub(crate) no_trace: bool,
    #[command(flatten)]
    pub(crate) signatures: Signatures,
    /// Print tables.json instead of tables
    #[arg(long)]
    pub(crate) json: bool,
}

/// Where the signatures of models are kept.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct Signatures {
    /// Folder in which the signatures of models are kept [default: the platform's cache folder]
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
    /// Simulate the signatures anew and keep nothing
    #[arg(long)]
    pub(crate) no_cache: bool,
}

/// Of `--seeds` of [`Reproduce`].
const SEEDS: u32 = 40;

impl Default for Reproduce {
    fn default() -> Self {
        Self {
            measured: Vec::new(),
            out: None,
            seeds: SEEDS,
            no_trace: false,
            signatures: Signatures::default(),
            json: false,
        }
    }
}

/// Simulate laps and write them as a data set
///
/// The folder holds a CSV for each run, which `compare`, `sweep` and `trace` read, the model, and a picture of the laps.
///
/// Example: lapwing drive roduit2007 --set slip.level=1 --runs 4 --laps 20 --log --out slippery
#[derive(Debug, Args)]
pub(crate) struct Drive {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// Number of runs, each from a random start of its own [default: 4, or as many as the model has values by run]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) runs: Option<u32>,
    /// Whole laps per run after the first, which is dropped
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) laps: u32,
    /// Write readings and commands too
    #[arg(long)]
    pub(crate) log: bool,
    /// Force a way of casting rays
    #[arg(long, value_name = "NAME", value_parser = ["brute", "bvh", "cells", "tree"])]
    pub(crate) caster: Option<String>,
    /// Name of the data set [default: the controller and a hash of the configuration]
    #[arg(long)]
    pub(crate) name: Option<String>,
    /// Folder for the data set, in place of an earlier result there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Print the summary as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Compare data sets, runs or gate tables with a Point Distribution Model
///
/// Builds one Point Distribution Model of all clusters together and gives the distance of every pair (eq. 8), Hotelling's
/// test (eq. 9) and the energy test.
///
/// Each of the arguments is a data set (a folder; every run is a cluster), one run's CSV, or with --sampled a table of
/// laps that are sampled already. Clusters are named after data set and run, or after the table; names that repeat give
/// way to the paths as they were given.
///
/// Example: lapwing compare slippery real --modes 5
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// Data sets, runs, or gate tables
    #[arg(required = true, value_name = "DATA")]
    pub(crate) data: Vec<PathBuf>,
    /// Modes of the PDM to compare in: a number, or all, which is as many as each pair has laps for [default: 2, or 1 where
    /// there is no second]
    #[arg(long, value_name = "R")]
    pub(crate) modes: Option<String>,
    /// The arguments are CSV files with one row per lap and one numeric column per coordinate
    #[arg(long)]
    pub(crate) sampled: bool,
    /// Permutations of the energy test
    #[arg(long, default_value_t = 999, value_name = "N")]
    pub(crate) permutations: u32,
    /// World file to use instead of the one that the data sets name
    #[arg(long, value_name = "FILE", conflicts_with = "sampled")]
    pub(crate) world: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    pub(crate) json: bool,
    /// Folder for tables, pictures, the laps as gate tables and their places in the modes, in place of an earlier result
    /// there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Simulate a grid of model settings and compare each with measured runs
///
/// All values given of one key are combined with all of the others. A grid point is simulated whole and compared with every
/// measured run.
///
/// Example: lapwing sweep roduit2007 --vary wall.max_error_m=0.001,0.01 --vary slip.level=0.1,1 --measured real --out sweep
#[derive(Debug, Args)]
pub(crate) struct Sweep {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// A key of the model and the values it takes; may be repeated
    #[arg(long, required = true, value_name = "KEY=V1,V2,...")]
    pub(crate) vary: Vec<String>,
    /// Measured data set
    #[arg(long, value_name = "DIR")]
    pub(crate) measured: PathBuf,
    /// Simulated runs per grid point and seed
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) runs: u32,
    /// Whole laps per run
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) laps: u32,
    /// How often the whole grid is simulated, each time with a seed of its own
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) seeds: u32,
    /// Go on with a sweep that was stopped
    #[arg(long)]
    pub(crate) resume: bool,
    /// Folder for tables and pictures, in place of an earlier result there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Print sweep.json
    #[arg(long)]
    pub(crate) json: bool,
}

/// Look at a world file: check it, cut its walls
///
/// Example: lapwing world check circuit.toml
#[derive(Debug, Subcommand)]
pub(crate) enum World {
    /// Check a world file: walls, lengths, corridor width, gates
    ///
    /// A wall that has a gap or a corner, crosses itself or the other, or leaves the shipped robot no room is refused, with its
    /// place and how to mend it.
    ///
    /// Example: lapwing world check circuit.toml --out course
    Check {
        /// World file, or the name of a shipped world
        world: PathBuf,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        /// Folder for the picture of the course, in place of an earlier result there
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
    /// Cut the walls into straight segments for given maximal errors
    ///
    /// Example: lapwing world segments roduit2007 --max-error 0.001,0.005
    Segments {
        /// World file, or the name of a shipped world
        world: PathBuf,
        /// Maximal distances of a segment from the exact wall, m
        #[arg(
            long,
            required = true,
            value_delimiter = ',',
            value_name = "M,...",
            allow_negative_numbers = true
        )]
        max_error: Vec<f64>,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        /// Folder for the picture of N against the error, in place of an earlier result there
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

/// Fit the nonlinear response of an infra-red sensor to measured pairs
///
/// Fits reading = a / (1 + (d/d0)^p) by least squares on log reading, and ends with the settings that take the result into a
/// model. The pairs must lie on both sides of d0, where the reading has halved.
///
/// Example: lapwing fit-sensor pairs.csv --columns distance_m,counts
#[derive(Debug, Args)]
pub(crate) struct FitSensor {
    /// CSV with a header; by default the first column is the distance in m and the second the reading
    pub(crate) pairs: PathBuf,
    /// Names of the two columns
    #[arg(long, value_delimiter = ',', num_args = 1, value_name = "D,R")]
    pub(crate) columns: Option<Vec<String>>,
    /// Print one JSON document
    #[arg(long)]
    pub(crate) json: bool,
    /// Folder for the picture, in place of an earlier result there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// List the effects that the simulator knows beyond the declared model
///
/// Each with its stage, what it does, and its parameters: the range of each, its unit, and the value at which the effect changes
/// nothing. They stand in a model as `[[effect]]` tables; a value that changes in time (by = "time") goes no farther than the end of
/// its range.
///
/// Example: lapwing effects --json
#[derive(Debug, Args)]
pub(crate) struct Effects {
    /// Print one JSON document
    #[arg(long)]
    pub(crate) json: bool,
}

/// Trace what the model lacks in measured laps, add it, and tell the error before and after
///
/// Finds the residual between the declared model and measured laps, names the effect behind it with its size, what else it
/// could be, and how far the simulation is from the robot before and after the effect is added.
///
/// Example: lapwing trace roduit2007 --measured real --out diagnosis
#[derive(Debug, Args)]
pub(crate) struct Trace {
    #[command(flatten)]
    pub(crate) model: ModelArgs,
    /// Measured data set; more than one, which may be declared otherwise, are traced together. Logs are used of those that
    /// have one for every run
    #[arg(long, required = true, value_name = "DIR")]
    pub(crate) measured: Vec<PathBuf>,
    /// Data set that no fit sees, to measure the error on; declared as one of the measured ones [default: each run is left
    /// out of the fit in turn]
    #[arg(long, value_name = "DIR")]
    pub(crate) held_out: Option<PathBuf>,
    /// Folder for the report, in place of an earlier result there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) signatures: Signatures,
    /// Print trace.json
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measure what the program itself costs
///
/// Example: lapwing bench rays --segments 47,1000
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    /// Ray casting: cost against the number of segments, and faithfulness against cost
    ///
    /// Eight rays at the poses of a driven lap, by a plain loop, the BVH of parry2d and lapwing's own casters. Leave the
    /// machine alone while it measures.
    ///
    /// Example: lapwing bench rays --segments 47,1000 --out rays
    Rays {
        /// Numbers of segments; the circuit is cut as finely as they need
        #[arg(
            long,
            value_delimiter = ',',
            default_value = "15,33,47,105,1000,10000,100000",
            value_name = "N,...",
            value_parser = clap::value_parser!(u32).range(1..)
        )]
        segments: Vec<u32>,
        /// Draws behind every interval of faithfulness
        #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
        seeds: u32,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        /// Folder for tables and pictures, in place of an earlier result there
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}
