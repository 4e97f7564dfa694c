//! The program under test, run as its user runs it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use toml::Table;

use crate::labels::{Controller, Set};
use crate::score::Trace;

/// The binary, and the folder that everything goes to.
#[derive(Debug)]
pub(crate) struct Lapwing {
    binary: PathBuf,
    /// Tells builds of the program apart.
    pub(crate) build: String,
    pub(crate) out: PathBuf,
}

/// What an answer cost, and which build gave it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Timing {
    pub(crate) seconds: f64,
    pub(crate) build: String,
}

/// Runs to be simulated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drive {
    pub(crate) runs: usize,
    /// Of each run.
    pub(crate) laps: usize,
    pub(crate) log: bool,
    pub(crate) seed: u64,
}

impl Lapwing {
    /// The binary beside this example, built anew where cargo runs us.
    ///
    /// # Errors
    /// A build that fails, no binary, a folder that cannot be made.
    pub(crate) fn built(out: &Path) -> Result<Self> {
        let exe = std::env::current_exe()?;
        let beside = (exe.parent().and_then(Path::parent)).context("this example has no folder")?;
        if let Some(cargo) = std::env::var_os("CARGO") {
            let target = beside.parent().context("there is no target folder")?;
            let mut build = Command::new(cargo);
            build.current_dir(env!("CARGO_MANIFEST_DIR"));
            build
                .args(["build", "--bin", "lapwing", "--target-dir"])
                .arg(target);
            if beside.ends_with("release") {
                build.arg("--release");
            }
            ensure!(build.status()?.success(), "lapwing does not build");
        }
        let binary = beside.join(format!("lapwing{}", std::env::consts::EXE_SUFFIX));
        let bytes = fs::read(&binary)
            .with_context(|| format!("{}: not there; build lapwing first", binary.display()))?;
        let digest = Sha256::digest(&bytes);
        let build = digest.iter().take(6).map(|byte| format!("{byte:02x}")).collect();
        fs::create_dir_all(out.join("traces"))
            .with_context(|| format!("{}: cannot be made", out.display()))?;
        let out = out.to_owned();
        Ok(Self { binary, build, out })
    }

    /// The answer to a data set: the one that is kept, or else a new one. A set that cannot be traced has an answer that
    /// says so, which is not kept.
    ///
    /// # Errors
    /// A file that cannot be read or written.
    pub(crate) fn trace(&self, set: &Set) -> Result<(Trace, Timing)> {
        let name = &set.label.name;
        let kept = self.kept_file(name);
        let timed = kept.with_extension("timing.json");
        if kept.exists() {
            return Ok((
                Trace::new(&read_json(&kept)?)?,
                serde_json::from_value(read_json(&timed)?)?,
            ));
        }
        let work = self.work_folder(name);
        let start = Instant::now();
        let mut command = Command::new(&self.binary);
        command.args(["trace", "roduit2007", "--json", "--quiet", "--set"]);
        command.arg(format!("controller.kind={}", set.label.controller.name()));
        command.arg("--measured").arg(&set.folder);
        command.arg("--out").arg(&work);
        command.arg("--cache").arg(self.out.join("cache"));
        let output = self.run(&mut command)?;
        let timing = Timing {
            seconds: start.elapsed().as_secs_f64(),
            build: self.build.clone(),
        };
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            return Ok((Trace::failed(message.trim()), timing));
        }
        let document: Value =
            serde_json::from_slice(&output.stdout).with_context(|| format!("{name}: no JSON on stdout"))?;
        let trace = Trace::new(&document).with_context(|| format!("{name}: not as trace.json should be"))?;
        fs::write(&timed, serde_json::to_string(&timing)?)?;
        keep(&kept, &format!("{document:#}\n"), &work)?;
        Ok((trace, timing))
    }

    /// The declared model with the effects of a data set, as a file.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(crate) fn model_file(
        &self,
        controller: Controller,
        effects: Vec<Table>,
        set: &str,
    ) -> Result<PathBuf> {
        let folder = self.out.join("models");
        fs::create_dir_all(&folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
        let mut kind = Table::new();
        kind.insert("kind".into(), controller.name().into());
        let mut model = Table::new();
        model.insert("controller".into(), kind.into());
        let effects = effects.into_iter().map(toml::Value::Table).collect();
        model.insert("effect".into(), toml::Value::Array(effects));
        let path = folder.join(format!("{set}.toml"));
        fs::write(&path, toml::to_string(&model)?)?;
        Ok(path)
    }

    /// Simulates a data set with a model file.
    ///
    /// # Errors
    /// A model that the program refuses.
    pub(crate) fn drive(&self, model: &Path, drive: Drive, to: &Path) -> Result<Value> {
        let mut command = Command::new(&self.binary);
        command.arg("drive").arg(model).args(["--json", "--quiet"]);
        let Drive {
            runs,
            laps,
            log,
            seed,
        } = drive;
        for (flag, number) in [("--runs", runs as u64), ("--laps", laps as u64), ("--seed", seed)] {
            command.args([flag, &number.to_string()]);
        }
        command.args(log.then_some("--log"));
        let output = self.done(command.arg("--out").arg(to), model)?;
        Ok(serde_json::from_slice(&output.stdout)?)
    }

    /// Samples the laps of a data set at the gates: tables in `TO/laps`, one for each run.
    ///
    /// # Errors
    /// A data set that the program refuses.
    pub(crate) fn sample(&self, set: &Path, to: &Path) -> Result<()> {
        let mut command = Command::new(&self.binary);
        command.arg("compare").arg(set);
        command.args(["--quiet", "--permutations", "0"]);
        self.done(command.arg("--out").arg(to), set)?;
        Ok(())
    }

    /// A number that is kept with the answers, made in a folder for what comes and goes if it is not there yet.
    ///
    /// # Errors
    /// Those of making it, and a file that cannot be read or written.
    pub(crate) fn kept(&self, name: &str, make: impl FnOnce(&Path) -> Result<f64>) -> Result<f64> {
        let kept = self.kept_file(name);
        if kept.exists() {
            return Ok(serde_json::from_value(read_json(&kept)?)?);
        }
        let work = self.work_folder(name);
        fs::create_dir_all(&work).with_context(|| format!("{}: cannot be made", work.display()))?;
        let number = make(&work)?;
        keep(&kept, &serde_json::to_string(&number)?, &work)?;
        Ok(number)
    }

    /// What a command prints that is to succeed with a file or folder.
    fn done(&self, command: &mut Command, with: &Path) -> Result<Output> {
        let output = self.run(command)?;
        let message = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "{}: {}", with.display(), message.trim());
        Ok(output)
    }

    /// Where what is known of a data set is kept.
    fn kept_file(&self, name: &str) -> PathBuf {
        self.out.join("traces").join(format!("{name}.json"))
    }

    /// The folder for what comes and goes until then.
    fn work_folder(&self, name: &str) -> PathBuf {
        self.out.join("work").join(name)
    }

    fn run(&self, command: &mut Command) -> Result<Output> {
        let output = command.output();
        output.with_context(|| format!("{}: does not start", self.binary.display()))
    }
}

/// How many answers each build gave.
pub(crate) fn builds<'a>(timings: impl Iterator<Item = &'a Timing>) -> BTreeMap<&'a str, usize> {
    let mut counts = BTreeMap::new();
    timings.for_each(|timing| *counts.entry(timing.build.as_str()).or_default() += 1);
    counts
}

fn read_json(path: &Path) -> Result<Value> {
    let shown = path.display();
    let text = fs::read_to_string(path).with_context(|| format!("{shown}: cannot be read"))?;
    serde_json::from_str(&text).with_context(|| format!("{shown}: no JSON"))
}

/// Writes a file, which is there whole or not at all, and removes the folder that it came of.
fn keep(path: &Path, text: &str, work: &Path) -> Result<()> {
    let partial = path.with_extension("partial");
    fs::write(&partial, text)?;
    fs::rename(&partial, path)?;
    fs::remove_dir_all(work).with_context(|| format!("{}: cannot be removed", work.display()))
}
