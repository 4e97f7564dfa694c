//! Where the files of a data set are: in a folder, or in this program.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::config::{ControllerKind, read};

/// A data set inside this program.
#[derive(Debug)]
pub(crate) struct Shipped {
    /// The folder it has in the repository, for messages and manifests.
    folder: &'static str,
    controller: ControllerKind,
    /// Name and bytes of each file.
    files: &'static [(&'static str, &'static [u8])],
}

/// The files of a folder below `worlds/roduit2007/measured`.
macro_rules! shipped {
    ($folder:literal, $controller:expr) => {
        Shipped {
            folder: concat!("shipped laps/", $folder),
            controller: $controller,
            files: shipped!(@ $folder, "dataset.toml", "run_a.csv.gz", "run_b.csv.gz", "run_c.csv.gz", "run_d.csv.gz"),
        }
    };
    (@ $folder:literal, $($file:literal),+) => {
        &[$(($file, include_bytes!(concat!("../../../../worlds/roduit2007/measured/", $folder, "/", $file)))),+]
    };
}

/// The laps that stand in for the paper's, one data set per controller.
static SHIPPED: [Shipped; 2] = [
    shipped!("case_rule_based", ControllerKind::RuleBased),
    shipped!("case_braitenberg", ControllerKind::Braitenberg),
];

impl Shipped {
    /// The shipped laps of a controller.
    pub(crate) fn of(controller: ControllerKind) -> &'static Self {
        let of = |shipped: &&Self| shipped.controller == controller;
        SHIPPED
            .iter()
            .find(of)
            .expect("there are shipped laps of both controllers")
    }

    fn file(&self, name: &str) -> Option<&'static [u8]> {
        self.files
            .iter()
            .find(|(file, _)| *file == name)
            .map(|(_, bytes)| *bytes)
    }
}

/// Where the files of a data set are.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Source<'a> {
    /// On disk.
    Folder(&'a Path),
    /// In this program.
    Shipped(&'static Shipped),
}

impl Source<'_> {
    /// The folder, or what stands for it in messages.
    pub(crate) fn folder(&self) -> PathBuf {
        match self {
            Self::Folder(folder) => (*folder).to_owned(),
            Self::Shipped(shipped) => PathBuf::from(shipped.folder),
        }
    }

    /// Whether there is a file of this name.
    pub(super) fn holds(&self, name: &str) -> bool {
        match self {
            Self::Folder(folder) => folder.join(name).is_file(),
            Self::Shipped(shipped) => shipped.file(name).is_some(),
        }
    }

    /// The bytes of a file of this data set.
    ///
    /// # Errors
    /// Names the file and why it cannot be read.
    pub(super) fn read(&self, path: &Path) -> Result<Cow<'static, [u8]>> {
        match self {
            Self::Folder(_) => Ok(Cow::Owned(read(path)?)),
            Self::Shipped(shipped) => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let found = shipped
                    .file(&name)
                    .with_context(|| format!("no {name} is shipped"))?;
                Ok(Cow::Borrowed(found))
            }
        }
    }
}
