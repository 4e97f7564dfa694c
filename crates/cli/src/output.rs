//! Folders under `--out`: they appear whole or not at all.
//!
//! Work happens in `DIR.partial`, which a marker file shows to be ours and which a lock keeps from
//! being used twice. [`OutDir::finish`] writes the manifest and renames the folder to `DIR`.

mod manifest;

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};

pub(crate) use manifest::{Input, Manifest, sha256};

const MANIFEST: &str = "manifest.json";
const MARKER: &str = ".lapwing-partial";

/// What a folder is made by; a half-written one goes on only with the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Work {
    pub(crate) command: String,
    /// A hash of everything that decides the contents.
    pub(crate) configuration: String,
}

impl Work {
    /// The work of a command on a configuration: whatever decides what it writes, seed included.
    pub(crate) fn new(command: &str, configuration: &impl Serialize) -> Self {
        let json = serde_json::to_vec(configuration)
            .expect("configurations hold only numbers, strings, arrays and tables");
        Self {
            command: command.to_owned(),
            configuration: sha256(&json),
        }
    }
}

/// A folder in the making. Dropped unfinished it leaves nothing, or `DIR.partial` if kept.
#[derive(Debug)]
pub(crate) struct OutDir {
    dir: PathBuf,
    partial: PathBuf,
    /// Locked as long as it is open.
    marker: Option<File>,
    keep: bool,
    resumed: bool,
}

impl OutDir {
    /// The folder in the making for `dir`, empty, or with `resume` what an earlier run of the same
    /// work left in `DIR.partial`; what is made depends on `inputs`.
    ///
    /// # Errors
    /// `dir` is a file or a folder with anything but our results, or holds an input; `DIR.partial` is
    /// not ours, in use, or with `resume` of other work; the place cannot be written to.
    pub(crate) fn create(dir: &Path, work: &Work, inputs: &[Input], resume: bool) -> Result<Self> {
        let dir = &behind_link(dir);
        let (partial, replaced) = (beside(dir, ".partial")?, beside(dir, ".replaced")?);
        recover(dir, &replaced)?;
        refuse_foreign(dir)?;
        refuse_inputs(dir, inputs)?;
        // An empty one is what a run left that was killed as it cleared up.
        let there = partial.symlink_metadata().is_ok() && fs::remove_dir(&partial).is_err();
        let lock = there.then(|| lock_ours(&partial)).transpose()?;
        let resumed = there && resume;
        if resumed {
            refuse_other_work(&partial, work)?;
        } else if there {
            remove_ours(&partial).with_context(|| format!("cannot remove {}", partial.display()))?;
        }
        let marker = match lock {
            Some(lock) if resumed => lock,
            _ => start(&partial, work)?,
        };
        Ok(Self {
            dir: dir.to_owned(),
            partial,
            marker: Some(marker),
            keep: false,
            resumed,
        })
    }

    /// From here on an error or an interrupt leaves `DIR.partial`, for `--resume`.
    pub(crate) fn keep_partial(&mut self) {
        self.keep = true;
    }

    /// Whether there is earlier work to go on from.
    pub(crate) fn resumed(&self) -> bool {
        self.resumed
    }

    /// Where files are while they are made: `DIR.partial`.
    pub(crate) fn path(&self) -> &Path {
        &self.partial
    }

    /// Writes a file, whole or not at all; `name` may lead into a subfolder.
    ///
    /// # Errors
    /// Names the file and the cause, a full disk for example.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<()> {
        let path = self.at(name)?;
        write_whole(&path, bytes.as_ref()).map_err(|error| unwritable(&path, &error))
    }

    /// A file of this folder, such as earlier work left it; `None` if it is not there.
    ///
    /// # Errors
    /// It is there and cannot be read.
    pub(crate) fn read(&self, name: &str) -> Result<Option<Vec<u8>>> {
        let path = self.at(name)?;
        match fs::read(&path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    /// Removes a file or a subfolder that was needed only on the way.
    ///
    /// # Errors
    /// It is there and cannot be removed.
    pub(crate) fn remove(&self, name: &str) -> Result<()> {
        let path = self.at(name)?;
        remove_if_there(&path).with_context(|| format!("cannot remove {}", path.display()))
    }

    /// Writes the manifest and gives the folder its name, in place of our earlier one.
    ///
    /// # Errors
    /// The manifest cannot be written, or the folder not renamed; an earlier one then stands again.
    pub(crate) fn finish(mut self, manifest: &Manifest) -> Result<()> {
        let files =
            files_in(&self.partial).with_context(|| format!("cannot read {}", self.partial.display()))?;
        self.write(MANIFEST, manifest.to_json(&files))?;
        refuse_foreign(&self.dir)?;
        let replaced = beside(&self.dir, ".replaced")?;
        let rename = |from: &Path, to: &Path| {
            fs::rename(from, to).with_context(|| {
                let (from, to) = (from.display(), to.display());
                format!("cannot rename {from} to {to}")
            })
        };
        let earlier = self.dir.exists();
        if earlier {
            rename(&self.dir, &replaced)?;
        }
        if let Err(error) = rename(&self.partial, &self.dir) {
            if earlier {
                rename(&replaced, &self.dir)?;
            }
            return Err(error);
        }
        self.keep = true; // nothing is left at DIR.partial that would be ours to remove
        self.marker = None;
        // What is left over now spoils no result, and the next run removes it.
        let _ = fs::remove_file(self.dir.join(MARKER));
        if earlier {
            let _ = fs::remove_dir_all(&replaced);
        }
        Ok(())
    }

    fn at(&self, name: &str) -> Result<PathBuf> {
        let inside = Path::new(name)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        ensure!(
            inside && !name.is_empty(),
            "`{name}` is not a file name inside the output folder"
        );
        Ok(self.partial.join(name))
    }
}

impl Drop for OutDir {
    fn drop(&mut self) {
        if !self.keep {
            // Nobody is left to be told; a next run removes what this one could not.
            let _ = remove_ours(&self.partial);
        }
    }
}

/// Where a link leads that a user has put in the place of a folder, which is then the one to be replaced.
fn behind_link(dir: &Path) -> PathBuf {
    let is_link = dir.symlink_metadata().is_ok_and(|there| there.is_symlink());
    let target = is_link.then(|| fs::canonicalize(dir).ok()).flatten();
    target.unwrap_or_else(|| dir.to_owned())
}

/// Removes a folder with its marker last: if that is cut short, it still shows to be ours.
fn remove_ours(partial: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(partial)? {
        let entry = entry?;
        if entry.file_name() == MARKER {
            continue;
        }
        remove_if_there(&entry.path())?;
    }
    fs::remove_dir_all(partial)
}

/// Removes a file, or a folder with all that is in it.
fn remove_if_there(path: &Path) -> std::io::Result<()> {
    match path.symlink_metadata() {
        Ok(what) if what.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(_) => Ok(()),
    }
}

fn beside(dir: &Path, ending: &str) -> Result<PathBuf> {
    let Some(name) = dir.file_name() else {
        bail!("{} cannot be an output folder; name a new one", dir.display());
    };
    let mut name = OsString::from(name);
    name.push(ending);
    Ok(dir.with_file_name(name))
}

/// Puts back what a run that was killed while replacing it had moved aside.
fn recover(dir: &Path, replaced: &Path) -> Result<()> {
    if !replaced.is_dir() || !is_ours(replaced) {
        return Ok(());
    }
    if dir.exists() {
        fs::remove_dir_all(replaced)
    } else {
        fs::rename(replaced, dir)
    }
    .with_context(|| format!("cannot clear away {}", replaced.display()))
}

fn refuse_foreign(dir: &Path) -> Result<()> {
    let shown = dir.display();
    if dir.symlink_metadata().is_err() {
        return Ok(());
    }
    if !dir.is_dir() {
        bail!("{shown} is there and is not a folder; name another with --out, or move it away");
    }
    let cannot_read = || format!("cannot read {shown}");
    let mut entries = fs::read_dir(dir).with_context(cannot_read)?;
    let manifest = fs::read(dir.join(MANIFEST)).unwrap_or_default();
    if entries.next().is_some() && !Manifest::is_ours(&manifest) {
        bail!(
            "{shown} is there and holds no manifest.json of lapwing, so it is not replaced; \
             name another folder with --out, or move it away"
        );
    }
    if let Some(written) = Manifest::files(&manifest) {
        let found = files_in(dir).with_context(cannot_read)?;
        if let Some(other) = found.iter().find(|file| !written.contains(file)) {
            bail!(
                "{shown} holds {other}, which lapwing did not write, so it is not replaced; \
                 move that file away, or name another folder with --out"
            );
        }
    }
    Ok(())
}

/// A folder that is replaced must hold nothing that the results are made from.
fn refuse_inputs(dir: &Path, inputs: &[Input]) -> Result<()> {
    let Ok(whole) = dir.canonicalize() else {
        return Ok(());
    };
    // What is embedded is no file.
    let lies_within =
        |input: &&Input| fs::canonicalize(&input.path).is_ok_and(|input| input.starts_with(&whole));
    if let Some(input) = inputs.iter().find(lies_within) {
        bail!(
            "{} lies in {}, which would be replaced; name another folder with --out",
            input.path,
            dir.display()
        );
    }
    Ok(())
}

/// The files in a folder and below it, but for the manifest and the marker, in order; names with `/`.
fn files_in(dir: &Path) -> std::io::Result<Vec<String>> {
    fn walk(dir: &Path, below: &str, files: &mut Vec<String>) -> std::io::Result<()> {
        for entry in fs::read_dir(dir)? {
            let entry = entry?;
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                walk(&entry.path(), &format!("{name}/"), files)?;
            } else if name != MANIFEST && name != MARKER {
                files.push(name);
            }
        }
        Ok(())
    }
    let mut files = Vec::new();
    walk(dir, "", &mut files)?;
    files.sort();
    Ok(files)
}

fn is_ours(dir: &Path) -> bool {
    fs::read(dir.join(MANIFEST)).is_ok_and(|bytes| Manifest::is_ours(&bytes))
}

fn lock_ours(partial: &Path) -> Result<File> {
    let shown = partial.display();
    let Ok(marker) = OpenOptions::new()
        .read(true)
        .append(true)
        .open(partial.join(MARKER))
    else {
        bail!("{shown} is there and was not made by lapwing; move it away");
    };
    lock(marker, partial)
}

fn lock(marker: File, partial: &Path) -> Result<File> {
    match marker.try_lock() {
        Err(TryLockError::WouldBlock) => bail!(
            "{} is in use by another run of lapwing; wait for it, or name another folder with --out",
            partial.display()
        ),
        // Some network file systems know no locks: the marker alone must do there.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(marker),
    }
}

fn refuse_other_work(partial: &Path, work: &Work) -> Result<()> {
    let shown = partial.display();
    let bytes = fs::read(partial.join(MARKER)).with_context(|| format!("cannot read {shown}"))?;
    let other = match serde_json::from_slice::<Work>(&bytes) {
        Ok(started) if started == *work => return Ok(()),
        Ok(started) if started.command != work.command => {
            format!("by `lapwing {}`", started.command)
        }
        Ok(_) => "with another configuration, seed or input".to_owned(),
        Err(_) => "by something else".to_owned(),
    };
    bail!("{shown} was begun {other}; run without --resume to begin anew, or name another folder")
}

/// Makes `DIR.partial` with its marker, locked.
fn start(partial: &Path, work: &Work) -> Result<File> {
    let cannot = |error| {
        let shown = partial.display();
        anyhow!("cannot create {shown}: {error}; name a folder with --out that can be written to")
    };
    fs::create_dir_all(partial).map_err(cannot)?;
    let marker = File::create(partial.join(MARKER)).map_err(cannot)?;
    let mut marker = lock(marker, partial)?;
    let json = serde_json::to_vec(work).expect("two strings have a form in JSON");
    let written = marker
        .write_all(&json)
        .map_err(|error| unwritable(partial, &error));
    if written.is_err() {
        let _ = fs::remove_dir_all(partial); // the error to report is the first one
    }
    written.map(|()| marker)
}

/// What to say of a file under `--out` that cannot be written.
pub(crate) fn unwritable(path: &Path, error: &std::io::Error) -> anyhow::Error {
    let shown = path.display();
    anyhow!("cannot write {shown}: {error}; make room there, or name another folder with --out")
}

/// By way of a temporary name, so that a killed run leaves no half file for `--resume`.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".tmp");
    let unfinished = path.with_file_name(name);
    let written = fs::write(&unfinished, bytes).and_then(|()| fs::rename(&unfinished, path));
    if written.is_err() {
        let _ = fs::remove_file(&unfinished); // the error to report is the first one
    }
    written
}

#[cfg(test)]
mod tests;
