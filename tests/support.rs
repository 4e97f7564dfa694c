//! Running the program, and what it leaves behind.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// The folder of the repository.
pub(crate) const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// The program.
pub(crate) const LAPWING: &str = env!("CARGO_BIN_EXE_lapwing");

/// What a call of the program gave.
#[derive(Debug)]
pub(crate) struct Ran {
    /// Exit status; none if a signal ended it.
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ran {
    /// The program refused, and said this.
    pub(crate) fn is_refused_with(&self, said: &str) {
        assert!(
            self.status == Some(2) && self.stderr.contains(said),
            "{}",
            self.stderr
        );
    }
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// A folder to work in; it is removed in the end.
#[derive(Debug)]
pub(crate) struct Scratch(TempDir);

impl Scratch {
    pub(crate) fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file, with its folder.
    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The program, to be run in this folder, so that messages have short paths.
    pub(crate) fn command<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(LAPWING);
        command.args(args).current_dir(self.0.path());
        command
    }

    /// Runs the program in this folder.
    pub(crate) fn run<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Ran {
        self.command(args).output().unwrap().into()
    }

    /// Runs the program in this folder, which must succeed.
    pub(crate) fn done<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Ran {
        let ran = self.run(args);
        assert_eq!(ran.status, Some(0), "{}", ran.stderr);
        ran
    }

    /// Simulates so many runs of so many laps of the shipped model, with further arguments, into a folder of this one.
    pub(crate) fn drive(&self, runs: u32, laps: u32, folder: &str, more: &[&str]) -> Ran {
        let [runs, laps] = [runs, laps].map(|count| count.to_string());
        let drive = [
            "drive",
            "roduit2007",
            "--runs",
            &runs,
            "--laps",
            &laps,
            "--out",
            folder,
        ];
        self.done([&drive, more].concat())
    }

    /// Runs the program in this folder, which must print one JSON document.
    pub(crate) fn json<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Value {
        serde_json::from_str(&self.done(args).stdout).unwrap()
    }

    /// Runs the program in this folder, which must refuse with this message and leave everything as it was.
    pub(crate) fn refuses(&self, args: &[&str], message: &str) {
        let before = files(self.0.path());
        let ran = self.run(args);
        assert_eq!(ran.stderr, format!("lapwing: {message}\n"), "lapwing {args:?}");
        assert_eq!(
            (ran.status, ran.stdout.as_str()),
            (Some(2), ""),
            "lapwing {args:?}"
        );
        let after = files(self.0.path());
        assert!(
            before == after,
            "lapwing {args:?} changed {:?} to {:?}",
            before.keys(),
            after.keys()
        );
    }

    /// The files in a folder of this one and their bytes, but for those that may differ from run to run.
    pub(crate) fn results(&self, folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut results = files(&self.path(folder));
        let varies =
            |path: &Path| path.ends_with("manifest.json") || path.to_string_lossy().contains("timing");
        results.retain(|path, _| !varies(path));
        assert!(!results.is_empty(), "{folder} is empty");
        results
    }
}

/// Presses Ctrl-C on a program that runs, and waits for its end.
pub(crate) fn interrupt(child: Child) -> Ran {
    let signal = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(signal.unwrap().success());
    child.wait_with_output().unwrap().into()
}

/// All files below a folder with their bytes, and its subfolders without any.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(inner) = folders.pop() {
        for entry in fs::read_dir(inner).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().to_owned();
            if path.is_dir() {
                found.insert(name, Vec::new());
                folders.push(path);
            } else {
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

/// The files that differ between two folders.
pub(crate) fn differing(a: &BTreeMap<PathBuf, Vec<u8>>, b: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<PathBuf> {
    a.keys()
        .chain(b.keys())
        .filter(|path| a.get(*path) != b.get(*path))
        .cloned()
        .collect()
}

/// The path of a file of the repository.
pub(crate) fn repository(path: &str) -> String {
    format!("{ROOT}/{path}")
}

/// The text of the shipped world with one thing replaced, which must be there.
pub(crate) fn world_with(old: &str, new: &str) -> String {
    let text = fs::read_to_string(repository("worlds/roduit2007/world.toml")).unwrap();
    assert!(text.contains(old), "the world has no {old}");
    text.replacen(old, new, 1)
}

/// A measured data set that is shipped.
pub(crate) fn measured(name: &str) -> String {
    repository(&format!("worlds/roduit2007/measured/{name}"))
}
