//! Data sets on disk: a folder with `dataset.toml` and one CSV for each run.

mod csv_file;
mod description;
mod read;
mod source;
mod write;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use toml::Table;

use crate::config::{Config, ControllerKind, WorldSource, world_source};
use crate::output::Input;

pub(crate) use csv_file::CsvFile;
pub(crate) use description::Kind;
pub(crate) use read::LOG_COLUMNS;
use source::{Shipped, Source};
pub(crate) use write::{DataSetToWrite, run_name, write_dataset};

/// What describes a data set.
pub(crate) const DESCRIPTION: &str = "dataset.toml";

/// Laps kept of each run where the data set does not say.
pub(crate) const LAPS: usize = 20;

/// Runs of one robot on one course, as they were recorded.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DataSet {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    pub(crate) kind: Kind,
    /// As the data set names it; `None` only for a run without a `dataset.toml` beside it.
    pub(crate) world: Option<String>,
    /// As the data set names it; `None` only for a run without a `dataset.toml` beside it.
    pub(crate) controller: Option<ControllerKind>,
    /// Laps to keep of each run, at least 1.
    pub(crate) laps: usize,
    /// What was measured and how.
    pub(crate) note: String,
    /// Whether the first row of each file is its run's start, from rest.
    pub(crate) from_start: bool,
    /// Keys of the model that were set otherwise, nested; known and of the right type.
    pub(crate) declared: Table,
    /// In the order of `dataset.toml`, at least one.
    pub(crate) runs: Vec<RunFile>,
    /// Every file that was read, with the hash of its bytes on disk.
    pub(crate) inputs: Vec<Input>,
}

/// One run and the file it was read from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunFile {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) rows: Rows,
    /// Line of each row in the file.
    lines: Vec<usize>,
}

impl RunFile {
    /// File and line of a row, for messages.
    pub(crate) fn place(&self, row: usize) -> String {
        format!("{}:{}", self.path.display(), self.lines[row])
    }

    /// What is said of rows that share a fault, and what becomes of them: of each by itself, or of the first if they are many.
    pub(crate) fn tell(&self, rows: &[usize], what: impl Fn(usize) -> String, becomes: &str) -> Vec<String> {
        const FEW: usize = 3;
        let one = |&row: &usize| format!("{}: {}; {becomes}", self.place(row), what(row));
        if rows.len() <= FEW {
            return rows.iter().map(one).collect();
        }
        vec![format!(
            "{}, as {} more of this run",
            one(&rows[0]),
            rows.len() - 1
        )]
    }
}

/// A run, one row per control step: T rows in all.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Rows {
    /// T times of whatever clock the file has, rising.
    pub(crate) t_s: Vec<f64>,
    /// T positions, x and y in m; `None` where the camera saw nothing.
    pub(crate) position_m: Vec<Option<[f64; 2]>>,
    /// The robot's own log, where it was kept.
    pub(crate) log: Option<Log>,
}

/// What the robot read and commanded, one row per control step; NaN where a field is empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Log {
    /// T x 8 readings in counts, S0 to S7.
    pub(crate) readings: Vec<[f64; 8]>,
    /// T commands.
    pub(crate) left_m_s: Vec<f64>,
    /// T commands.
    pub(crate) right_m_s: Vec<f64>,
}

impl Rows {
    /// T times since the run began, s.
    pub(crate) fn since_start_s(&self) -> impl Iterator<Item = f64> {
        let first = self.t_s.first().copied().unwrap_or_default();
        self.t_s.iter().map(move |t_s| t_s - first)
    }

    /// Whether a camera saw the same of two runs, as far as the shorter one goes and whatever their clocks say.
    pub(crate) fn begins_as(&self, other: &Self) -> bool {
        self.position_m.iter().zip(&other.position_m).all(|(a, b)| a == b)
    }
}

impl DataSet {
    /// The data set in a folder; `path` may also be its `dataset.toml`.
    ///
    /// # Errors
    /// A file that is missing or cannot be read, or that is at fault: file, line, what and how to
    /// mend it. A drive log, which is not read yet.
    pub(crate) fn load(path: &Path) -> Result<Self> {
        let folder = if path.ends_with(DESCRIPTION) {
            folder_of(path)
        } else {
            path
        };
        if !folder.is_dir() {
            let shown = folder.display();
            bail!("{shown} is not a folder; a data set is a folder with {DESCRIPTION} in it");
        }
        Self::from_source(Source::Folder(folder))
    }

    /// The laps of a controller that are shipped with this program.
    ///
    /// # Errors
    /// None, as a test shows.
    pub(crate) fn shipped(controller: ControllerKind) -> Result<Self> {
        Self::from_source(Source::Shipped(Shipped::of(controller)))
    }

    /// Whether these are laps that are shipped with this program.
    pub(crate) fn is_shipped(&self) -> bool {
        self.controller
            .is_some_and(|controller| Source::Shipped(Shipped::of(controller)).folder() == self.folder)
    }

    fn from_source(source: Source<'_>) -> Result<Self> {
        let (mut set, names) = description::load(source)?;
        let runs: Vec<_> = names
            .into_par_iter()
            .map(|(name, path)| load_run(source, name, path))
            .collect();
        for run in runs {
            let (run, input) = run?;
            set.runs.push(run);
            set.inputs.push(input);
        }
        Ok(set)
    }

    /// The model for this data set: what it declares over `model`, and its controller.
    ///
    /// # Errors
    /// None for a data set that was loaded, whose declared keys are checked.
    pub(crate) fn declared_config(&self, model: &Config) -> Result<Config> {
        model.apply_declared(&self.declared).with_context(|| {
            let folder = self.folder.display();
            format!("{folder}/{DESCRIPTION}: [declared]")
        })
    }

    /// The world of this data set; `override_path` is that of `--world`.
    ///
    /// # Errors
    /// Nothing names a world, or the one that is named is not found.
    pub(crate) fn world_source(&self, override_path: Option<&Path>) -> Result<WorldSource> {
        let description = self.folder.join(DESCRIPTION);
        if override_path.is_none() && self.world.is_none() {
            let shown = description.display();
            bail!("no {shown} names the world of this run; name its file with --world");
        }
        let world = self.world.as_deref().unwrap_or_default();
        world_source(world, Some(&description), override_path).map_err(|error| match override_path {
            Some(_) => error,
            None => error.context(format!("{}: `world`", description.display())),
        })
    }
}

/// The data set of one run's CSV alone, with what the `dataset.toml` beside it says; without one
/// its name is the folder's.
///
/// # Errors
/// As [`DataSet::load`].
pub(crate) fn load_run_csv(path: &Path) -> Result<DataSet> {
    let folder = folder_of(path);
    let source = Source::Folder(folder);
    let mut set = if source.holds(DESCRIPTION) {
        description::load(source)?.0
    } else {
        description::nameless(folder)
    };
    let (run, input) = load_run(source, run_name_of(path), path.to_owned())?;
    set.runs.push(run);
    set.inputs.push(input);
    Ok(set)
}

fn load_run(source: Source<'_>, name: String, path: PathBuf) -> Result<(RunFile, Input)> {
    let (rows, lines, input) = read::run(&path, &source.read(&path)?)?;
    let run = RunFile {
        name,
        path,
        rows,
        lines,
    };
    Ok((run, input))
}

/// The folder of a file; that of a bare file name is the working folder.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// `a` for `run_a.csv.gz`; the stem of a file that is named otherwise.
fn run_name_of(path: &Path) -> String {
    let stem = CsvFile::stem(path);
    stem.strip_prefix("run_").unwrap_or(&stem).to_owned()
}

#[cfg(test)]
mod tests;
