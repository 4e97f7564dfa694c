//! Robots made for a test, `lapwing trace` on their files, and what it said.

use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;
use sim::{Controller, Model, Scene, Setting, Step, Streams};

use crate::ground;
use crate::support::{Ran, Scratch, repository};

/// Runs, and laps of each, of the camera-only data sets: all have the same, so that they share their signatures.
pub(crate) const RUNS: usize = 4;
pub(crate) const LAPS: usize = 5;

/// With camera data alone of the Braitenberg controller these are one class.
pub(crate) const GAINS: [&str; 3] = ["reading-gain", "distance-scale", "controller-gain"];

/// The names of runs.
pub(crate) const NAMES: [&str; 8] = ["a", "b", "c", "d", "e", "f", "g", "h"];

/// A robot to be recorded: the declared one with effects that may be in no list.
#[derive(Debug, Clone)]
pub(crate) struct Robot {
    pub(crate) controller: Controller,
    pub(crate) effects: Vec<Setting>,
    /// Laps of each run.
    pub(crate) laps: Vec<usize>,
    /// Whether its own log is kept.
    pub(crate) log: bool,
    /// Keys of the model that are set otherwise, as `[declared]` has them.
    pub(crate) declared: &'static str,
}

impl Robot {
    /// The declared robot with the reactive controller and one effect, seen by the camera alone.
    pub(crate) fn with(effect: Setting) -> Self {
        Self {
            controller: ground::braitenberg(),
            effects: vec![effect],
            laps: vec![LAPS; RUNS],
            log: false,
            declared: "",
        }
    }

    /// The same robot with its log, for fewer laps: readings and commands say more.
    pub(crate) fn logged(self, laps: &[usize]) -> Self {
        Self {
            log: true,
            laps: laps.to_vec(),
            ..self
        }
    }

    /// Drives and writes the data set.
    pub(crate) fn record(&self, scratch: &Scratch, folder: &str) {
        let mut model: Model = ground::model(self.controller, 0.005);
        let scene = Scene::new(ground::circuit(), &model, None).unwrap();
        model.effects.clone_from(&self.effects);
        for (run, &laps) in self.laps.iter().enumerate() {
            let world = scene.world(&model, run).unwrap();
            let streams = Streams {
                seed: 20_07,
                run: run as u64,
            };
            let mut text = self.header();
            let drive = sim::drive(&world, streams, laps, |step| self.push(&mut text, step)).unwrap();
            assert_eq!((drive.laps.len(), drive.timed_out), (laps, false), "{folder}");
            scratch.write(&format!("{folder}/run_{}.csv", NAMES[run]), text);
        }
        scratch.write(&format!("{folder}/dataset.toml"), self.description(folder));
    }

    /// As models call it.
    pub(crate) fn controller_name(&self) -> &'static str {
        match self.controller {
            Controller::Braitenberg { .. } => "braitenberg",
            Controller::RuleBased { .. } => "rule-based",
        }
    }

    fn description(&self, name: &str) -> String {
        let controller = self.controller_name();
        let most = self.laps.iter().max().unwrap();
        format!(
            "name = {name:?}\nworld = \"roduit2007\"\ncontroller = {controller:?}\nruns = {:?}\nlaps = {most}\n\
             note = \"made for a test\"\n\n[declared]\n{}\n",
            &NAMES[..self.laps.len()],
            self.declared
        )
    }

    fn header(&self) -> String {
        let log = ",ps0,ps1,ps2,ps3,ps4,ps5,ps6,ps7,left_m_s,right_m_s";
        format!("t_s,x_m,y_m{}\n", if self.log { log } else { "" })
    }

    /// Numbers are rounded here and nowhere else.
    fn push(&self, text: &mut String, step: &Step) {
        let Step {
            time_s,
            observed,
            readings,
            command,
        } = step;
        write!(text, "{time_s:.3},{:.4},{:.4}", observed.x, observed.y).unwrap();
        if self.log {
            readings.iter().for_each(|r| write!(text, ",{r:.1}").unwrap());
            write!(text, ",{:.5},{:.5}", command.left_m_s, command.right_m_s).unwrap();
        }
        text.push('\n');
    }
}

/// The folder in which all tests keep signatures. It is emptied once: signatures of yesterday's program are not today's.
pub(crate) fn signatures() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("signatures");
        if folder.exists() {
            fs::remove_dir_all(&folder).unwrap();
        }
        folder
    })
}

/// Makes the signatures that camera-only data sets of one controller share, before several tests make them at once.
pub(crate) fn share_signatures(controller: &str) {
    static BRAITENBERG: OnceLock<()> = OnceLock::new();
    static RULE_BASED: OnceLock<()> = OnceLock::new();
    let (once, faithful) = match controller {
        "braitenberg" => (&BRAITENBERG, "faithful"),
        _ => (&RULE_BASED, "faithful_rule_based"),
    };
    once.get_or_init(|| {
        trace(&Scratch::new(), controller, &practice(faithful), &[]);
    });
}

/// A data set of a separate program.
pub(crate) fn practice(name: &str) -> String {
    repository(&format!("tests/data/practice/{name}"))
}

/// What `lapwing trace` says of a data set, written to the folder `out`.
pub(crate) fn trace(scratch: &Scratch, controller: &str, measured: &str, more: &[&str]) -> Value {
    let ran = try_trace(scratch, controller, measured, more);
    assert_eq!(ran.status, Some(0), "{measured}: {}", ran.stderr);
    serde_json::from_str(&scratch.read("out/trace.json")).unwrap()
}

/// `lapwing trace` with the folder of signatures that all tests share, whatever becomes of it.
pub(crate) fn try_trace(scratch: &Scratch, controller: &str, measured: &str, more: &[&str]) -> Ran {
    let kind = format!("controller.kind={controller}");
    let cache = signatures().to_str().unwrap();
    let args = [
        "trace",
        "roduit2007",
        "--set",
        &kind,
        "--measured",
        measured,
        "--out",
        "out",
        "--cache",
        cache,
        "--quiet",
    ];
    scratch.run([args.as_slice(), more].concat())
}

/// The names of the effects that are claimed, in order.
pub(crate) fn names(trace: &Value) -> Vec<&str> {
    let effects = trace["effects"].as_array().unwrap();
    effects.iter().map(|e| e["name"].as_str().unwrap()).collect()
}

/// The verdict and the names claimed must be these.
pub(crate) fn says(trace: &Value, verdict: &str, expected: &[&str]) {
    assert_eq!(
        (trace["verdict"].as_str().unwrap(), names(trace)),
        (verdict, expected.to_vec()),
        "{trace:#}"
    );
}

/// The answer to the logs of a robot, which has to be these effects and nothing else.
pub(crate) fn explained_in_logs(robot: &Robot, expected: &[&str]) -> Value {
    let scratch = Scratch::new();
    robot.record(&scratch, "set");
    let found = trace(&scratch, robot.controller_name(), "set", &[]);
    says(&found, "explained", expected);
    found
}

/// A parameter's interval, widened to twice its width and by a hundredth of the effect, holds the truth.
pub(crate) fn holds(effect: &Value, parameter: &str, truth: f64, neutral: f64) {
    let all = effect["parameters"].as_array().unwrap();
    let found = all.iter().find(|p| p["name"] == parameter).unwrap();
    let [value, low, high] = ["value", "low", "high"].map(|key| found[key].as_f64().unwrap());
    let allowed = (high - low) + 0.01 * (truth - neutral).abs();
    assert!(
        (value - truth).abs() <= allowed,
        "{} {parameter}: {value} found, {truth} is true, {allowed} allowed",
        effect["name"]
    );
}

/// The first effect must have no name and these words: its stage, what it acts on and depends on, its basis. Returns its coefficients.
pub(crate) fn without_name(trace: &Value, words: [&str; 4]) -> Vec<f64> {
    let effect = &trace["effects"][0];
    let said = ["name", "stage", "acts_on", "depends_on", "basis"].map(|key| effect[key].as_str().unwrap());
    assert_eq!((said[0], &said[1..]), ("unlisted", &words[..]), "{trace:#}");
    let coefficients = effect["coefficients"].as_array().unwrap().iter();
    coefficients.map(|number| number.as_f64().unwrap()).collect()
}

/// No listed effect is claimed: what is said has no name and sits in that stage, or nothing is said at all.
pub(crate) fn never_a_listed_name(trace: &Value, stage: &str) {
    let verdict = trace["verdict"].as_str().unwrap();
    let said = (names(trace), trace["residual"]["stage"].as_str());
    println!("{verdict}: {said:?} {}", trace["residual"]["depends_on"]);
    assert_ne!(verdict, "faithful", "{trace:#}");
    if verdict != "unexplained" {
        assert_eq!(said, (vec!["unlisted"], Some(stage)), "{trace:#}");
    }
}

/// Every row of a run's file, changed or left out.
pub(crate) fn rewrite(
    scratch: &Scratch,
    run: &str,
    change: impl Fn(usize, Vec<String>) -> Option<Vec<String>>,
) {
    let text = scratch.read(run);
    let mut lines = text.lines();
    let mut rewritten = lines.next().unwrap().to_owned() + "\n";
    for (row, line) in lines.enumerate() {
        let fields = line.split(',').map(str::to_owned).collect();
        if let Some(fields) = change(row, fields) {
            rewritten += &(fields.join(",") + "\n");
        }
    }
    scratch.write(run, rewritten);
}

/// Every position, reading or time of a file in these columns, changed.
pub(crate) fn with_columns(
    scratch: &Scratch,
    run: &str,
    columns: Range<usize>,
    change: impl Fn(f64) -> String,
) {
    rewrite(scratch, run, |_, mut fields| {
        for field in &mut fields[columns.clone()] {
            *field = change(field.parse().unwrap());
        }
        Some(fields)
    });
}
