//! Signatures of a model, kept between calls.

use std::fs;
use std::path::{Path, PathBuf};

use diagnose::Atlas;

use crate::args::Signatures;
use crate::output::sha256;

/// A folder of atlases, each named after what decides its contents. A file that does not hold what it says is made anew.
#[derive(Debug)]
pub(crate) struct Cache(Option<PathBuf>);

impl Cache {
    /// The cache in a folder; the platform's own if none is given; none at all if it is not wanted.
    pub(crate) fn new(asked: &Signatures) -> Self {
        let place = || {
            let own = || directories().map(|dir| dir.join("lapwing"));
            asked.cache.clone().or_else(own)
        };
        Self((!asked.no_cache).then(place).flatten())
    }

    fn file(&self, key: &str) -> Option<PathBuf> {
        let name = format!(
            "atlas-{}-{}",
            env!("CARGO_PKG_VERSION"),
            &sha256(key.as_bytes())[..32]
        );
        self.0.as_ref().map(|folder| folder.join(name))
    }

    /// The atlas of a key, with such physics steps, if it is there and whole.
    pub(crate) fn get(&self, key: &str, physics_step_s: f64) -> Option<Atlas> {
        let bytes = fs::read(self.file(key)?).ok()?;
        let (hash, atlas) = bytes.split_at_checked(64)?;
        (sha256(atlas).as_bytes() == hash)
            .then(|| Atlas::from_bytes(atlas, physics_step_s))
            .flatten()
    }

    /// Keeps an atlas, if there is a folder for it.
    ///
    /// # Errors
    /// A folder that cannot be written, which only makes the next call take longer.
    pub(crate) fn put(&self, key: &str, atlas: &Atlas) -> Result<(), &Path> {
        let (Some(folder), Some(file)) = (self.0.as_deref(), self.file(key)) else {
            return Ok(());
        };
        let bytes = atlas.to_bytes();
        let whole = [sha256(&bytes).as_bytes(), &bytes].concat();
        let partial = file.with_extension(format!("partial{}", std::process::id()));
        fs::create_dir_all(folder)
            .and_then(|()| fs::write(&partial, whole))
            .and_then(|()| fs::rename(&partial, &file))
            .map_err(|_| {
                // A full disk may have left a part of it.
                let _ = fs::remove_file(&partial);
                folder
            })
    }
}

/// The platform's folder for caches, by its own rules.
fn directories() -> Option<PathBuf> {
    let variable = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    if cfg!(windows) {
        return variable("LOCALAPPDATA");
    }
    if cfg!(target_os = "macos") {
        return variable("HOME").map(|home| home.join("Library/Caches"));
    }
    variable("XDG_CACHE_HOME").or_else(|| variable("HOME").map(|home| home.join(".cache")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_whole_atlas_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache(Some(folder.path().to_path_buf()));
        let file = cache.file("key").unwrap();
        let no_atlas = b"seventeen laps to the left";
        let its_hash = sha256(no_atlas);
        let with_hash = |hash: &str| [hash.as_bytes(), no_atlas].concat();
        for content in [
            Vec::new(),
            its_hash.as_bytes()[..63].to_vec(),
            with_hash(&sha256(b"another")),
            with_hash(&its_hash),
        ] {
            fs::write(&file, &content).unwrap();
            assert!(cache.get("key", 0.032).is_none(), "{content:?}");
        }
        assert!(cache.get("no such key", 0.032).is_none());
    }
}
