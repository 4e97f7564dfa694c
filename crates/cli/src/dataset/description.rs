//! `dataset.toml`: what a data set says about itself.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use toml::{Table, Value};

use super::{DESCRIPTION, DataSet, LAPS, Source};
use crate::config::{Config, ControllerKind, Document, nearest};
use crate::output::Input;
use crate::setup;

/// Of a data set of laps.
const KEYS: [&str; 9] = [
    "name",
    "kind",
    "world",
    "controller",
    "runs",
    "laps",
    "note",
    "from_start",
    "declared",
];

/// What the rows of a data set are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Laps of a course, seen by a camera.
    Laps,
    /// Commands and poses of drives anywhere.
    DriveLog,
}

/// The data set without its runs, and their names and files.
///
/// # Errors
/// File, line, what is wrong and how to mend it.
pub(super) fn load(source: Source<'_>) -> Result<(DataSet, Vec<(String, PathBuf)>)> {
    let path = source.folder().join(DESCRIPTION);
    let bytes = source.read(&path)?;
    let label = path.display().to_string();
    let input = Input::of(label.clone(), &bytes);
    let description = Description(Document::parse(label, bytes.into_owned())?);
    if description.kind()? == Kind::DriveLog {
        return Err(description.error("kind", "drive logs cannot be read here yet"));
    }
    description.refuse_unknown_keys()?;
    let set = DataSet {
        name: description.required_text("name")?,
        folder: source.folder(),
        kind: Kind::Laps,
        world: Some(description.required_text("world")?),
        controller: Some(description.controller()?),
        laps: description.laps()?,
        note: description.text("note")?.unwrap_or_default(),
        from_start: description.starts()?,
        declared: description.declared()?,
        runs: Vec::new(),
        inputs: vec![input],
    };
    Ok((set, description.runs(source)?))
}

/// The data set of a folder that has no `dataset.toml`.
pub(super) fn nameless(folder: &Path) -> DataSet {
    let full = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = full.file_name().unwrap_or_default().to_string_lossy();
    DataSet {
        name: name.into_owned(),
        folder: folder.to_owned(),
        kind: Kind::Laps,
        world: None,
        controller: None,
        laps: LAPS,
        note: String::new(),
        from_start: true,
        declared: Table::new(),
        runs: Vec::new(),
        inputs: Vec::new(),
    }
}

struct Description(Document);

impl Description {
    fn get(&self, key: &str) -> Option<&Value> {
        self.0.table.get(key)
    }

    fn error(&self, key: &str, message: impl std::fmt::Display) -> anyhow::Error {
        self.0.error(key, format!("`{key}`: {message}"))
    }

    fn refuse_unknown_keys(&self) -> Result<()> {
        let unknown = |key: &&String| !KEYS.contains(&key.as_str());
        self.0.table.keys().find(unknown).map_or(Ok(()), |key| {
            let nearest = nearest(key, KEYS).join(", ");
            let message = format!("unknown key `{key}`; nearest known: {nearest}");
            Err(self.0.error(key, message))
        })
    }

    fn text(&self, key: &str) -> Result<Option<String>> {
        match self.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(value) => Err(self.error(key, format!("{value} is not a string, as is needed"))),
        }
    }

    fn required_text(&self, key: &str) -> Result<String> {
        let missing = || anyhow!("{}: `{key}` is missing; add it, a string", self.0.label);
        self.text(key)?.ok_or_else(missing)
    }

    fn kind(&self) -> Result<Kind> {
        match self.text("kind")?.as_deref() {
            None | Some("laps") => Ok(Kind::Laps),
            Some("drive-log") => Ok(Kind::DriveLog),
            Some(other) => {
                let message = format!("unknown kind `{other}`; known: laps, drive-log");
                Err(self.error("kind", message))
            }
        }
    }

    fn controller(&self) -> Result<ControllerKind> {
        let name = self.required_text("controller")?;
        ControllerKind::from_name(&name).ok_or_else(|| {
            let nearest = nearest(&name, ControllerKind::NAMES.iter().copied()).join(", ");
            let known = ControllerKind::NAMES.join(", ");
            let message = format!("unknown controller `{name}`; nearest: {nearest}; known: {known}");
            self.error("controller", message)
        })
    }

    fn laps(&self) -> Result<usize> {
        let Some(laps) = self.get("laps") else {
            return Ok(LAPS);
        };
        let count = laps.as_integer().filter(|&laps| laps >= 1);
        count
            .and_then(|laps| usize::try_from(laps).ok())
            .ok_or_else(|| self.error("laps", format!("{laps} is not a whole number from 1")))
    }

    fn starts(&self) -> Result<bool> {
        self.get("from_start").map_or(Ok(true), |value| {
            let needed = || self.error("from_start", format!("{value} is neither true nor false"));
            value.as_bool().ok_or_else(needed)
        })
    }

    /// The keys of the model that the data set sets, checked as in a model's file.
    fn declared(&self) -> Result<Table> {
        let declared = match self.get("declared") {
            None => return Ok(Table::new()),
            Some(Value::Table(declared)) => declared,
            Some(_) => return Err(self.error("declared", "a table is needed, as [declared]")),
        };
        let at = |key: &str| format!("declared.{key}");
        for (key, own) in [("world", "world"), ("controller.kind", "controller")] {
            if self.0.line_of(&at(key)).is_some() {
                let message = format!("[declared] {key}: `{own}` of the data set says that; remove it here");
                return Err(self.0.error(&at(key), message));
            }
        }
        let config =
            (Config::shipped().overlaid(declared)).map_err(|fault| self.0.error(&at(&fault.key), fault))?;
        setup::check(&config).map_err(|error| self.0.error(&at(error.key().unwrap_or_default()), &error))?;
        Ok(declared.clone())
    }

    fn runs(&self, source: Source<'_>) -> Result<Vec<(String, PathBuf)>> {
        let needed = "the names of the runs are needed, as runs = [\"a\", \"b\"]";
        let names = match self.get("runs") {
            None => return Err(anyhow!("{}: `runs` is missing; {needed}", self.0.label)),
            Some(Value::Array(names)) if !names.is_empty() => names,
            Some(_) => return Err(self.error("runs", needed)),
        };
        let mut runs: Vec<(String, PathBuf)> = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let fault = |message: String| self.0.error(&format!("runs.{index}"), message);
            let Some(name) = name.as_str().filter(|name| is_plain(name)) else {
                return Err(fault(format!("{name} is no name of a run; {needed}")));
            };
            if runs.iter().any(|(other, _)| other == name) {
                return Err(fault(format!("run `{name}` is named twice; remove one")));
            }
            let path = run_path(source, name).map_err(fault)?;
            runs.push((name.to_owned(), path));
        }
        Ok(runs)
    }
}

/// Whether a name can be part of a file's name and cannot lead out of the folder.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && !name.contains(['/', '\\', '\0'])
}

fn run_path(source: Source<'_>, name: &str) -> Result<PathBuf, String> {
    let names = [format!("run_{name}.csv"), format!("run_{name}.csv.gz")];
    let [plain, packed] = names.each_ref().map(|file| source.folder().join(file));
    match names.map(|file| source.holds(&file)).into() {
        (true, false) => Ok(plain),
        (false, true) => Ok(packed),
        (true, true) => Err(format!(
            "run `{name}` is there as {} and as .csv.gz; remove one",
            plain.display()
        )),
        (false, false) => Err(format!(
            "run `{name}` has no file {} nor .csv.gz; add it, or take the run out of `runs`",
            plain.display()
        )),
    }
}
