//! What a folder was made from.

use std::fmt::Write;

use serde::Serialize;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

const PROGRAM: &str = "lapwing";

/// A file that a result depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Input {
    /// As it was given, or what stands for an embedded file.
    pub(crate) path: String,
    /// 64 hexadecimal digits, of the bytes on disk.
    pub(crate) sha256: String,
}

impl Input {
    /// The entry for these bytes.
    pub(crate) fn of(path: impl Into<String>, bytes: &[u8]) -> Self {
        Self {
            path: path.into(),
            sha256: sha256(bytes),
        }
    }
}

/// The SHA-256 of bytes: 64 hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .fold(String::with_capacity(64), |mut digits, byte| {
            write!(digits, "{byte:02x}").expect("writing to a string cannot fail");
            digits
        })
}

/// `manifest.json` but for the version, which is that of the program.
#[derive(Debug, Clone)]
pub(crate) struct Manifest {
    /// The program's name first.
    pub(crate) command_line: Vec<String>,
    pub(crate) seed: u64,
    /// As it was checked, defaults included.
    pub(crate) configuration: Value,
    pub(crate) inputs: Vec<Input>,
    /// Wall time of the whole command.
    pub(crate) duration_s: f64,
}

impl Manifest {
    /// The text of `manifest.json` beside these files.
    pub(crate) fn to_json(&self, files: &[String]) -> String {
        let Self {
            command_line,
            seed,
            configuration,
            inputs,
            duration_s,
        } = self;
        let manifest = json!({
            "program": PROGRAM,
            "version": env!("CARGO_PKG_VERSION"),
            "command_line": command_line,
            "seed": seed,
            "configuration": configuration,
            "inputs": inputs,
            "files": files,
            "duration_s": (duration_s * 1000.0).round() / 1000.0,
        });
        format!("{manifest:#}\n")
    }

    /// Whether these bytes are a manifest of this program, of whatever version.
    pub(crate) fn is_ours(bytes: &[u8]) -> bool {
        serde_json::from_slice::<Value>(bytes)
            .is_ok_and(|manifest| manifest["program"] == PROGRAM && manifest["version"].is_string())
    }

    /// The files that a manifest of this program lists; `None` if it lists none, as earlier ones do.
    pub(crate) fn files(bytes: &[u8]) -> Option<Vec<String>> {
        let manifest: Value = serde_json::from_slice(bytes).ok()?;
        serde_json::from_value(manifest["files"].clone()).ok()
    }
}
