//! Where a world's file is found.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::{WORLDS, read};
use crate::output::Input;

/// The text of a world's file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WorldSource {
    /// What messages call it: the path, or the name of a shipped world.
    pub(crate) label: String,
    /// `None` for a shipped world.
    pub(crate) path: Option<PathBuf>,
    pub(crate) text: String,
    /// For the manifest.
    pub(crate) input: Input,
}

/// The world that `name` stands for: the file `override_path` if there is one; else a file of
/// that name beside the file `beside` that names it (in the working folder without one); else
/// the shipped world of that name.
///
/// # Errors
/// A file that cannot be read; a name that is neither a file nor a shipped world.
pub(crate) fn world_source(
    name: &str,
    beside: Option<&Path>,
    override_path: Option<&Path>,
) -> Result<WorldSource> {
    let folder = beside.and_then(Path::parent).unwrap_or(Path::new(""));
    let path = override_path.map_or_else(|| folder.join(name), Path::to_owned);
    if override_path.is_some() || path.is_file() {
        return from_file(path);
    }
    match WORLDS.iter().find(|(shipped, _)| *shipped == name) {
        Some((name, text)) => Ok(WorldSource {
            label: format!("shipped world {name}"),
            path: None,
            text: (*text).to_owned(),
            input: Input::of(format!("shipped world {name}"), text.as_bytes()),
        }),
        None => bail!(unknown(name, &path)),
    }
}

fn from_file(path: PathBuf) -> Result<WorldSource> {
    let label = path.display().to_string();
    let bytes = read(&path)?;
    let input = Input::of(label.clone(), &bytes);
    let text = String::from_utf8(bytes)
        .with_context(|| format!("{label} is not UTF-8 text; save the file as UTF-8"))?;
    Ok(WorldSource {
        label,
        path: Some(path),
        text,
        input,
    })
}

fn unknown(name: &str, path: &Path) -> String {
    let shipped: Vec<_> = WORLDS.iter().map(|(shipped, _)| *shipped).collect();
    let shipped = shipped.join(", ");
    let path = path.display();
    format!("unknown world `{name}`: there is no file {path}; shipped worlds: {shipped}")
}
