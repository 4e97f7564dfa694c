//! A model file with what the command line sets, over the shipped model.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};

use super::{Config, Document, MODEL, WorldSource, document, world_source};
use crate::output::Input;

/// Where a model comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ModelSource<'a> {
    /// A user's file.
    Path(&'a Path),
    /// The shipped model as it is.
    Embedded,
}

/// A configuration and where each of its keys was set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModelFile {
    /// The shipped model, the file over it, `--set` over that.
    pub(crate) config: Config,
    /// `None` for the shipped model.
    pub(crate) path: Option<PathBuf>,
    /// For the manifest.
    pub(crate) input: Input,
    document: Document,
    sets: Vec<(String, String)>,
}

impl ModelFile {
    /// The model of a file with the `KEY=VALUE`s of `--set`.
    ///
    /// # Errors
    /// A file that cannot be read or is not TOML; an unknown key, with the nearest known; a value
    /// of the wrong type or not finite. Each with file and line, or with the `--set` at fault.
    pub(crate) fn load(source: ModelSource<'_>, sets: &[String]) -> Result<Self> {
        let (path, label, bytes) = match source {
            ModelSource::Path(path) => (
                Some(path.to_owned()),
                path.display().to_string(),
                document::read(path)?,
            ),
            ModelSource::Embedded => (None, "shipped model.toml".into(), MODEL.into()),
        };
        let input = Input::of(label.clone(), &bytes);
        let document = Document::parse(label, bytes)?;
        let config = Config::shipped()
            .overlaid(&document.table)
            .map_err(|fault| document.error(&fault.key, &fault))?;
        let mut model = Self {
            config,
            path,
            input,
            document,
            sets: Vec::new(),
        };
        sets.iter().try_for_each(|set| model.set(set))?;
        Ok(model)
    }

    fn set(&mut self, set: &str) -> Result<()> {
        let (key, value) = set
            .split_once('=')
            .ok_or_else(|| anyhow!("--set {set}: a key and a value are needed, as KEY=VALUE"))?;
        let key = key.trim();
        self.config = self
            .config
            .with(key, value)
            .with_context(|| format!("--set {set}"))?;
        self.sets.push((key.to_owned(), value.trim().to_owned()));
        Ok(())
    }

    /// The line of a dotted key in the file, from 1; `None` where it is left out.
    pub(crate) fn line_of(&self, key: &str) -> Option<usize> {
        self.document.line_of(key)
    }

    /// Whether `--set` gives this key or a table or array around it.
    pub(crate) fn is_set(&self, key: &str) -> bool {
        self.set_of(key).is_some()
    }

    /// Whether the file or the command line names this key, rather than leaving it out.
    pub(crate) fn names(&self, key: &str) -> bool {
        self.is_set(key) || self.path.is_some() && self.line_of(key).is_some()
    }

    /// The message with the place where its key was set: `FILE:LINE: message`.
    pub(crate) fn located(&self, key: &str, message: impl std::fmt::Display) -> anyhow::Error {
        match self.set_of(key) {
            Some((set, value)) => anyhow!("--set {set}={value}: {message}"),
            None => self.document.error(key, message),
        }
    }

    /// The world of this model; `override_path` is that of `--world`.
    ///
    /// A file is looked for beside the model, or in the working folder if `--set` names it.
    ///
    /// # Errors
    /// A file that cannot be read, and a name that is neither a file nor a shipped world.
    pub(crate) fn world(&self, override_path: Option<&Path>) -> Result<WorldSource> {
        let set = self.set_of("world");
        let beside = self.path.as_deref().filter(|_| set.is_none());
        world_source(&self.config.world, beside, override_path).map_err(|error| match override_path {
            Some(_) => error,
            None => self.located("world", format!("{error:#}")),
        })
    }

    /// The last `--set` of this key or of a table or array around it.
    fn set_of(&self, key: &str) -> Option<&(String, String)> {
        self.sets.iter().rev().find(|(set, _)| {
            key.strip_prefix(set.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    }
}
