//! What all experiments share: the measured laps, and the simulated ones, drawn many times over.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use pdm::Cluster;
use rayon::prelude::*;
use sim::{Circuit, Setting, Step, Streams};

use crate::config::{Config, ControllerKind};
use crate::dataset::DataSet;
use crate::interrupt;
use crate::laps::{self, Measured, SampledRun};
use crate::output::Input;
use crate::progress::Progress;
use crate::setup::{self, Setup};

/// Runs that each controller drives (section IV-A).
pub(crate) const RUNS: usize = 4;

/// Laps of which the path as the camera saw it is kept, for drawing.
const DRAWN_LAPS: usize = 4;

/// How the Braitenberg robot is simulated; all else is as declared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Variant {
    /// Improved sensor, walls within 5 mm, 10 % slip.
    Standard,
    OriginalSensor,
    Wall1,
    Wall10,
    Wall50,
    Slip100,
}

impl Variant {
    /// All but the standard one, which drives as many runs as the measured robot.
    const OTHERS: [Self; 5] = [
        Self::OriginalSensor,
        Self::Wall1,
        Self::Wall10,
        Self::Wall50,
        Self::Slip100,
    ];

    /// The key of the model and the value that make it.
    fn setting(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Standard => None,
            Self::OriginalSensor => Some(("sensor.kind", "original")),
            Self::Wall1 => Some(("wall.max_error_m", "0.001")),
            Self::Wall10 => Some(("wall.max_error_m", "0.01")),
            Self::Wall50 => Some(("wall.max_error_m", "0.05")),
            Self::Slip100 => Some(("slip.level", "1.0")),
        }
    }

    /// Its place among the runs of a draw; of the standard one the first.
    fn place(self) -> usize {
        let other = Self::OTHERS.iter().position(|other| *other == self);
        other.map_or(0, |place| 2 * RUNS + place)
    }

    /// This variant of a model.
    fn setup(self, standard: &Config, circuit: &Arc<Circuit>) -> Result<Setup> {
        let config = match self.setting() {
            Some((key, value)) => standard.with(key, value)?,
            None => standard.clone(),
        };
        Ok(Setup::new(&config, Arc::clone(circuit), None)?)
    }

    /// Its name in tables and figures.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::OriginalSensor => "original sensor",
            Self::Wall1 => "wall error 1 mm",
            Self::Wall10 => "wall error 10 mm",
            Self::Wall50 => "wall error 50 mm",
            Self::Slip100 => "slip 100 %",
        }
    }
}

/// A simulated run.
#[derive(Debug)]
pub(crate) struct Simulated {
    pub(crate) cluster: Cluster,
    pub(crate) run: SampledRun,
    /// Physics steps in which the body touched a wall.
    pub(crate) contacts: u64,
    /// The first laps as the camera saw them, m; of the first draw only.
    pub(crate) paths: Vec<Vec<[f64; 2]>>,
}

/// Everything that is simulated, once.
#[derive(Debug)]
pub(crate) struct Draw {
    /// The standard simulation, as many runs as are measured.
    pub(crate) braitenberg: Vec<Simulated>,
    /// The same with the rule-based controller.
    pub(crate) rule_based: Vec<Simulated>,
    /// One run of each variant but the standard.
    others: Vec<Simulated>,
}

impl Draw {
    /// The runs of one of [`Study::VARIANTS`], by its place there.
    pub(crate) fn other(&self, place: usize) -> &[Simulated] {
        &self.others[place..=place]
    }

    /// The run of a variant; of the standard one the first.
    pub(crate) fn run(&self, variant: Variant) -> &Simulated {
        match Variant::OTHERS.iter().position(|other| *other == variant) {
            Some(place) => &self.others[place],
            None => &self.braitenberg[0],
        }
    }
}

/// The measured laps of both controllers on one course.
#[derive(Debug)]
pub(crate) struct Measurements {
    pub(crate) circuit: Arc<Circuit>,
    pub(crate) braitenberg: Measured,
    pub(crate) rule_based: Measured,
    world: Input,
}

impl Measurements {
    /// The laps of these folders, and the shipped ones of a controller that has none.
    ///
    /// # Errors
    /// Two folders of one controller, or of different worlds; a run that cannot be read or sampled; fewer than two runs.
    pub(crate) fn load(folders: &[PathBuf]) -> Result<Self> {
        let given = folders
            .iter()
            .map(|folder| DataSet::load(folder))
            .collect::<Result<Vec<_>>>()?;
        let of = |controller: ControllerKind| -> Result<DataSet> {
            let mut sets = given.iter().filter(|set| set.controller == Some(controller));
            match (sets.next(), sets.next()) {
                (Some(one), Some(other)) => bail!(
                    "{} and {} are both of the {} controller; give one data set per controller",
                    one.folder.display(),
                    other.folder.display(),
                    controller.name()
                ),
                (Some(one), None) => Ok(one.clone()),
                (None, _) => DataSet::shipped(controller),
            }
        };
        let (braitenberg, rule_based) = (of(ControllerKind::Braitenberg)?, of(ControllerKind::RuleBased)?);
        let (circuit, world) = circuit(&braitenberg, &rule_based)?;
        let measured = |set: DataSet| -> Result<Measured> {
            let measured = Measured::on(set, Arc::clone(&circuit), &Config::shipped())?;
            let (folder, runs) = (measured.set.folder.display(), measured.runs.len());
            ensure!(
                runs >= 2,
                "{folder} has {runs} run; a run is compared with others of its controller, so two are needed"
            );
            Ok(measured)
        };
        Ok(Self {
            braitenberg: measured(braitenberg)?,
            rule_based: measured(rule_based)?,
            circuit,
            world,
        })
    }

    /// The declared model of the Braitenberg robot.
    pub(crate) fn standard(&self) -> Result<Config> {
        declared(&self.braitenberg.set, ControllerKind::Braitenberg)
    }

    /// The declared model of the rule-based robot.
    pub(crate) fn rule_based(&self) -> Result<Config> {
        declared(&self.rule_based.set, ControllerKind::RuleBased)
    }

    /// Every file that was read.
    pub(crate) fn inputs(&self) -> Vec<Input> {
        let sets = [&self.rule_based.set, &self.braitenberg.set];
        sets.into_iter()
            .flat_map(|set| set.inputs.iter().cloned())
            .chain([self.world.clone()])
            .collect()
    }

    /// What a user must know of laps that are not there.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let runs = self.braitenberg.runs.iter().chain(&self.rule_based.runs);
        runs.flat_map(SampledRun::remarks).collect()
    }
}

/// The course that both data sets were driven on, with its gates.
fn circuit(one: &DataSet, other: &DataSet) -> Result<(Arc<Circuit>, Input)> {
    let [(world, gates), (other_world, other_gates)] = [one, other].map(|set| {
        let gates = set
            .declared_config(&Config::shipped())
            .map(|config| config.run.gates);
        (set.world_source(None), gates)
    });
    let (world, gates) = (world?, gates?);
    ensure!(
        world.text == other_world?.text && gates == other_gates?,
        "{} and {} differ in world or gates; give a data set of each controller on one course",
        one.folder.display(),
        other.folder.display()
    );
    Ok((setup::circuit(&world, gates)?, world.input))
}

/// The shipped model with what a data set declares and its controller.
fn declared(set: &DataSet, kind: ControllerKind) -> Result<Config> {
    let mut config = set.declared_config(&Config::shipped())?;
    config.controller.kind = kind;
    Ok(config)
}

/// The measured laps and D draws of the simulated ones.
#[derive(Debug)]
pub(crate) struct Study {
    pub(crate) measured: Measurements,
    /// The declared model of the Braitenberg robot: the standard variant.
    pub(crate) standard: Config,
    /// Laps kept of each simulated run.
    pub(crate) laps: usize,
    /// At least one; figures show the first.
    pub(crate) draws: Vec<Draw>,
    /// The measured Braitenberg runs as clusters.
    pub(crate) real: Vec<Cluster>,
}

/// What is simulated in a draw, one run each.
struct Plan<'a> {
    setup: &'a Setup,
    name: String,
}

impl Study {
    /// The variants that are simulated beside the standard one.
    pub(crate) const VARIANTS: [Variant; 5] = Variant::OTHERS;

    /// Runs that one draw simulates.
    pub(crate) const RUNS_PER_DRAW: usize = 2 * RUNS + Variant::OTHERS.len();

    /// Simulates `draws` times all that the experiments need; `progress` counts runs.
    ///
    /// Every run of every draw has random streams of its own: run `i` of draw `d` is run number `d * 13 + i` of the
    /// seed, so that clusters are independent, as tests between them need.
    ///
    /// # Errors
    /// What the simulator refuses, a run without a lap, an interrupt.
    pub(crate) fn new(measured: Measurements, seed: u64, draws: usize, progress: &Progress) -> Result<Self> {
        let standard = measured.standard()?;
        let setups = setups(&standard, &measured.rule_based()?, &measured.circuit)?;
        let plans = plans(&setups);
        let laps = measured.braitenberg.set.laps;
        let runs = (0..draws * plans.len()).into_par_iter().map(|number| {
            interrupt::check()?;
            let run = simulate(
                &plans[number % plans.len()],
                Streams {
                    seed,
                    run: number as u64,
                },
                laps,
            )
            .with_context(|| format!("draw {}", number / plans.len() + 1))?;
            progress.tick(1);
            Ok(Simulated {
                paths: if number < plans.len() {
                    run.paths
                } else {
                    Vec::new()
                },
                ..run
            })
        });
        let mut runs = runs.collect::<Result<Vec<_>>>()?.into_iter();
        let mut take = |count: usize| runs.by_ref().take(count).collect::<Vec<_>>();
        let draw = |_| Draw {
            braitenberg: take(RUNS),
            rule_based: take(RUNS),
            others: take(Variant::OTHERS.len()),
        };
        let draws = (0..draws).map(draw).collect();
        let real = measured.braitenberg.clusters()?;
        Ok(Self {
            measured,
            standard,
            laps,
            draws,
            real,
        })
    }

    /// For each draw one run of each variant with effects added to the model, which act as in measured run `run`; `None`
    /// where fewer than three laps are closed, the fewest that vary in two modes.
    ///
    /// The random streams are those of the study's own runs, so that draws differ by the effects alone.
    ///
    /// # Errors
    /// What the simulator refuses, an interrupt.
    pub(crate) fn with_effects(
        &self,
        seed: u64,
        effects: &[Setting],
        run: usize,
        variants: &[Variant],
        progress: &Progress,
    ) -> Result<Vec<Vec<Option<Cluster>>>> {
        const FEWEST: usize = 3;
        let setup = |variant: &Variant| -> Result<Setup> {
            let mut setup = variant.setup(&self.standard, &self.measured.circuit)?;
            setup.model.effects.extend_from_slice(effects);
            Ok(setup)
        };
        let setups = variants.iter().map(setup).collect::<Result<Vec<_>>>()?;
        let cluster = |draw: usize, place: usize| -> Result<Option<Cluster>> {
            interrupt::check()?;
            let Setup { model, scene } = &setups[place];
            let name = variants[place].name();
            let streams = Streams {
                seed,
                run: (draw * Self::RUNS_PER_DRAW + variants[place].place()) as u64,
            };
            let drive = sim::drive(&scene.world(model, run)?, streams, self.laps, |_| {})?;
            progress.tick(1);
            let run = laps::simulated(name, 0, &drive, self.laps);
            (run.laps.len() >= FEWEST)
                .then(|| lap_cluster(name, &run))
                .transpose()
        };
        (0..self.draws.len())
            .into_par_iter()
            .map(|draw| (0..variants.len()).map(|place| cluster(draw, place)).collect())
            .collect()
    }

    /// The course and its gates.
    pub(crate) fn circuit(&self) -> &Circuit {
        &self.measured.circuit
    }

    /// The names of the measured Braitenberg runs.
    pub(crate) fn runs(&self) -> Vec<String> {
        self.measured
            .braitenberg
            .runs
            .iter()
            .map(|run| run.run.clone())
            .collect()
    }

    /// The places of the measured runs that the paper singles out, d and c; the last ones where there are no such names.
    pub(crate) fn run_named(&self, name: &str, from_the_end: usize) -> usize {
        let runs = &self.measured.braitenberg.runs;
        let last = runs.len().saturating_sub(from_the_end + 1);
        runs.iter().position(|run| run.run == name).unwrap_or(last)
    }

    /// The clusters of each draw: the measured runs of these places, then these variants.
    pub(crate) fn clusters(&self, real: &[usize], variants: &[Variant]) -> Vec<Vec<&Cluster>> {
        let of = |draw| {
            let simulated = variants
                .iter()
                .map(move |&variant| &Draw::run(draw, variant).cluster);
            real.iter()
                .map(|&place| &self.real[place])
                .chain(simulated)
                .collect()
        };
        self.draws.iter().map(of).collect()
    }
}

/// The standard simulation, the rule-based one, and the other variants.
fn setups(standard: &Config, rule_based: &Config, circuit: &Arc<Circuit>) -> Result<Vec<Setup>> {
    let of = |variant: Variant, config| variant.setup(config, circuit);
    let others = Variant::OTHERS.into_iter().map(|variant| of(variant, standard));
    [of(Variant::Standard, standard), of(Variant::Standard, rule_based)]
        .into_iter()
        .chain(others)
        .collect()
}

/// The runs of a draw in the order of [`Draw`].
fn plans(setups: &[Setup]) -> Vec<Plan<'_>> {
    let names = ["standard", "rule-based"]
        .into_iter()
        .chain(Variant::OTHERS.map(Variant::name));
    let many = |count: usize, (setup, name)| {
        (0..count).map(move |_| Plan {
            setup,
            name: String::from(name),
        })
    };
    let mut setups = setups.iter().zip(names);
    let both = setups
        .by_ref()
        .take(2)
        .flat_map(|named| many(RUNS, named))
        .collect::<Vec<_>>();
    both.into_iter()
        .chain(setups.flat_map(|named| many(1, named)))
        .collect()
}

fn simulate(plan: &Plan<'_>, streams: Streams, laps: usize) -> Result<Simulated> {
    let mut seen = Vec::new();
    let drive = plan.setup.drive(streams, laps, |step: &Step| {
        seen.push((step.time_s, [step.observed.x, step.observed.y]));
    })?;
    let run = laps::simulated(&plan.name, 0, &drive, laps);
    let path = |lap: &track::Lap| {
        let inside = |(time_s, _): &&(f64, [f64; 2])| *time_s >= lap.start_s && *time_s <= lap.end_s;
        seen.iter().filter(inside).map(|(_, at)| *at).collect()
    };
    Ok(Simulated {
        cluster: lap_cluster(&plan.name, &run)?,
        contacts: drive.contacts,
        paths: run.laps.iter().take(DRAWN_LAPS).map(path).collect(),
        run,
    })
}

/// The laps of a simulated run.
fn lap_cluster(name: &str, run: &SampledRun) -> Result<Cluster> {
    Cluster::new(name, &run.offsets_m()).with_context(|| format!("simulation `{name}`: no lap closed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_is_planned_in_the_order_in_which_it_is_taken_apart() {
        let measured = Measurements::load(&[]).unwrap();
        let (standard, rule_based) = (measured.standard().unwrap(), measured.rule_based().unwrap());
        let setups = setups(&standard, &rule_based, &measured.circuit).unwrap();
        let names: Vec<String> = plans(&setups).into_iter().map(|plan| plan.name).collect();
        assert_eq!(names.len(), Study::RUNS_PER_DRAW);
        assert!(names[..RUNS].iter().all(|name| name == "standard"));
        assert!(names[RUNS..2 * RUNS].iter().all(|name| name == "rule-based"));
        assert_eq!(names[2 * RUNS..], Variant::OTHERS.map(Variant::name));
        assert_eq!(measured.inputs().len(), 11); // two descriptions, eight runs, the world
    }
}
