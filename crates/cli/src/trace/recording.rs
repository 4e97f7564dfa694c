//! Measured data sets on the model that they declare, and simulations of the same shape.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use diagnose::{Extent, ObservedRun, Unseen, coarse_unit_m};
use rayon::prelude::*;
use sim::{Draws, Setting, Start, Step, Streams, Vec2, World};
use track::Lap;

use super::beginnings::Beginnings;
use super::checks::{belongs, is_timed};
use super::tapes::Tapes;
use crate::config::{Config, ModelFile};
use crate::dataset::{DataSet, RunFile};
use crate::interrupt;
use crate::laps::{Measured, SampledRun};
use crate::session::Session;
use crate::setup::{self, Setup};
use crate::table::counted;

/// A measured data set with the model that it declares.
#[derive(Debug)]
pub(crate) struct Recording {
    pub(crate) config: Config,
    pub(crate) setup: Setup,
    pub(crate) measured: Measured,
    /// The same model with walls that another program may have cut.
    pub(super) cuts: Vec<Setup>,
    /// Where in its laps the camera did not see the robot, run by run.
    pub(super) unseen: Vec<Unseen>,
    /// How its runs begin, as far as that is known.
    pub(super) beginnings: Beginnings,
    /// What its positions are multiples of, m, if that is coarse: to the model that is noise of the camera.
    pub(super) written_m: Option<f64>,
    /// Text of the world file.
    pub(super) world: String,
    /// Its first run's number among those of all recordings.
    pub(super) first_run: usize,
    tapes: Tapes,
}

/// A run to be simulated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunPlace<'a> {
    /// Its number among those of all recordings: effects that go by run have a value for each.
    pub(crate) number: usize,
    /// Where it starts, if not at random.
    pub(crate) start: Option<Start>,
    /// Where in its laps the camera does not see it, if anywhere.
    pub(crate) unseen: Option<&'a Unseen>,
    /// Whether the camera sees it begin.
    pub(crate) begins: bool,
}

/// When and where a robot was seen, s and m.
type SeenPath = Vec<(f64, Vec2)>;

impl RunPlace<'_> {
    /// The closed laps of a run in this place, as they are seen, on their path.
    ///
    /// # Errors
    /// An effect without values for this run.
    pub(super) fn drive<'w>(
        &self,
        setup: &Setup,
        world: &'w World<'w>,
        draws: impl Into<Draws<'w>>,
        laps: usize,
    ) -> Result<(Vec<Lap>, SeenPath), sim::Error> {
        let mut path = Vec::new();
        let record = |step: &Step| path.push((step.time_s, step.observed));
        let mut closed = sim::drive_from(world, draws, self.start, laps, record)?.laps;
        closed.retain(|lap| lap.missed.is_empty());
        if let Some(unseen) = self.unseen {
            closed = setup.seen_through(unseen, closed, &mut path);
        }
        Ok((closed, path))
    }

    /// A run in this place with laps that were seen on a path, as a diagnosis takes it.
    fn observed(&self, setup: &Setup, laps: Vec<Lap>, path: &[(f64, Vec2)]) -> ObservedRun {
        let observed = setup.observed(laps, path);
        if self.begins {
            return observed;
        }
        ObservedRun {
            beginning: None,
            before: Vec::new(),
            ..observed
        }
    }
}

impl Recording {
    /// Data sets, checked against the model.
    ///
    /// # Errors
    /// Data of another world or controller, a run without laps, a model that cannot drive.
    pub(super) fn all(
        session: &Session,
        file: &ModelFile,
        world: Option<&Path>,
        sets: Vec<DataSet>,
    ) -> Result<Vec<Self>> {
        /// Memory for draws that simulations share.
        const TAPE_BYTES: usize = 384 << 20;
        let mut recordings: Vec<Self> = Vec::with_capacity(sets.len());
        for mut set in sets {
            let (first_run, name) = (runs(&recordings).count(), set.name.clone());
            for number in 2.. {
                if recordings.iter().all(|other| other.measured.set.name != set.name) {
                    break;
                }
                set.name = format!("{name} ({number})");
            }
            let next = Self::new(session, file, world, set, first_run)?;
            if let Some(first) = recordings.first() {
                let [all, own] = [first, &next].map(|recording| recording.config.run.gates);
                ensure!(
                    own == all,
                    "{}: declares {own} gates (run.gates), and {} has {all}: laps are compared at the same gates",
                    next.measured.set.folder.display(),
                    first.measured.set.folder.display()
                );
            }
            recordings.push(next);
        }
        let share = TAPE_BYTES / recordings.len().max(1);
        for recording in &mut recordings {
            let Setup { scene, model } = &recording.setup;
            let world = scene.world(model, recording.first_run)?;
            recording.tapes = Tapes::new(&world, &recording.shape(), share);
        }
        Ok(recordings)
    }

    fn new(
        session: &Session,
        file: &ModelFile,
        world: Option<&Path>,
        set: DataSet,
        first_run: usize,
    ) -> Result<Self> {
        let config = set.declared_config(&file.config)?;
        let source = file.world(world)?;
        belongs(&set, &config, &source.text)?;
        let circuit = setup::circuit(&source, config.run.gates)?;
        let config = config.going_round(&circuit.course);
        let measured = Measured::on(set, circuit.clone(), &file.config)?;
        measured
            .runs
            .iter()
            .flat_map(SampledRun::remarks)
            .for_each(|remark| session.remark(&remark));
        let mut setup =
            Setup::new(&config, circuit, None).map_err(|error| setup::locate(file, &source, error))?;
        let positions = measured
            .set
            .runs
            .iter()
            .flat_map(|run| run.rows.position_m.iter().flatten());
        let written_m = coarse_unit_m(positions.flatten().copied());
        setup.see_in_steps(written_m);
        is_timed(&measured, &setup)?;
        // An effect of the model may have too few values by run.
        for run in first_run..first_run + measured.runs.len() {
            let world = setup.scene.world(&setup.model, run);
            world.map_err(|error| setup::locate(file, &source, error))?;
        }
        let cuts = diagnose::other_cuts(&setup.scene, &setup.model)
            .into_iter()
            .map(|scene| Setup {
                scene,
                model: setup.model.clone(),
            })
            .collect();
        Ok(Self {
            tapes: Tapes::NONE,
            unseen: unseen(&measured, setup.model.run.control_step_s),
            beginnings: Beginnings::of(&measured, &setup),
            written_m,
            config,
            setup,
            measured,
            cuts,
            world: source.text,
            first_run,
        })
    }

    /// Laps of each run.
    pub(super) fn shape(&self) -> Vec<usize> {
        self.measured.runs.iter().map(|run| run.laps.len()).collect()
    }

    /// The measured runs.
    fn observed(&self) -> Vec<ObservedRun> {
        let places = self.places(&[]);
        let observed = |(i, run): (usize, &SampledRun)| {
            let path: Vec<_> = self.measured.seen(i).collect();
            places[i].observed(&self.setup, run.laps.clone(), &path)
        };
        self.measured.runs.iter().enumerate().map(observed).collect()
    }

    /// Whether walls that were prepared for another one's model serve this one's: its walls are cut alike, and its body and the
    /// places of its sensors are the same.
    pub(super) fn shares_walls_with(&self, other: &Self) -> bool {
        let [own, others] = [self, other].map(|recording| &recording.setup.model);
        own.wall == others.wall
            && own.machine.robot.body_radius_m == others.machine.robot.body_radius_m
            && own.machine.mounts == others.machine.mounts
    }

    /// Whether the declared model leads one to expect the same laps of every run, wherever the run starts.
    pub(super) fn expects_the_same_of_runs(&self) -> bool {
        self.runs_are_alike() && !self.has_holes()
    }

    /// Clocks that do not show as much time as there were control steps, in words.
    pub(super) fn clocks_in_words(&self) -> Vec<String> {
        /// Share by which a clock may be off.
        const OFF: f64 = 1e-3;
        let step_s = self.setup.model.run.control_step_s;
        let of_run = |(run, file): (&SampledRun, &RunFile)| {
            let steps = file.rows.t_s.windows(2).map(|pair| pair[1] - pair[0]);
            let next: Vec<f64> = steps.filter(|apart_s| *apart_s < 1.5 * step_s).collect();
            let mean_s = next.iter().sum::<f64>() / next.len() as f64;
            ((mean_s / step_s - 1.0).abs() > OFF).then(|| {
                format!(
                    "Run {}: its rows are {:.2} ms apart, and a control step is {} ms: whatever takes time in its laps is by that \
                     clock.",
                    run.name,
                    1000.0 * mean_s,
                    1000.0 * step_s
                )
            })
        };
        let runs = self.measured.runs.iter().zip(&self.measured.set.runs);
        runs.filter_map(of_run).collect()
    }

    /// Control steps of logs that have no row, in words.
    pub(super) fn missing_rows_in_words(&self) -> Vec<String> {
        let step_s = self.setup.model.run.control_step_s;
        let of_run = |file: &RunFile| {
            file.rows.log.as_ref()?;
            let t_s = &file.rows.t_s;
            let steps = t_s
                .windows(2)
                .map(|pair| ((pair[1] - pair[0]) / step_s).round() as usize);
            let missing: Vec<usize> = steps.map(|steps| steps.saturating_sub(1)).collect();
            let (row, most) = missing.iter().enumerate().max_by_key(|(_, missing)| **missing)?;
            (*most > 0).then(|| {
                format!(
                    "{}: {} control steps of this run have no row, {most} of them after this one.",
                    file.place(row),
                    missing.iter().sum::<usize>()
                )
            })
        };
        self.measured.set.runs.iter().filter_map(of_run).collect()
    }

    /// Whether the camera did not see the robot throughout its laps.
    pub(super) fn has_holes(&self) -> bool {
        !self.unseen.iter().all(Unseen::is_nothing)
    }

    /// Whether the declared model does the same in every run, wherever the run starts.
    fn runs_are_alike(&self) -> bool {
        self.setup.model.effects.iter().all(Setting::same_in_every_run)
    }

    /// The measured runs as places of runs simulated with these effects: they start where the measured ones did if what the
    /// robot does changes in the course of a run.
    pub(super) fn places(&self, effects: &[Setting]) -> Vec<RunPlace<'_>> {
        let changes = (self.setup.model.effects.iter().chain(effects)).any(Setting::depends_on_time);
        self.places_from(changes)
    }

    /// The measured runs as places of simulated ones, which start where those did or anywhere.
    fn places_from(&self, their_starts: bool) -> Vec<RunPlace<'_>> {
        (self.measured.runs.iter().zip(&self.unseen).enumerate())
            .map(|(i, (run, unseen))| RunPlace {
                number: self.first_run + i,
                start: their_starts.then(|| run.start()),
                unseen: Some(unseen).filter(|unseen| !unseen.is_nothing()),
                begins: self.beginnings.is_known(i),
            })
            .collect()
    }

    /// One simulated data set of this one's shape, as far as it is asked for; `None` where a run does not complete its laps.
    pub(super) fn simulate(
        &self,
        effects: &[Setting],
        seeds: Seeds,
        extent: Extent,
    ) -> Option<Vec<ObservedRun>> {
        let places = match extent {
            Extent::FromTheirStarts => self.places_from(true),
            Extent::Whole | Extent::FirstRuns => self.places(effects),
        };
        self.simulate_at(places, &self.setup, effects, seeds, extent)
    }

    /// The same of another setup, whatever was measured unless the declared model itself changes in the course of a run.
    pub(super) fn simulate_anywhere(
        &self,
        setup: &Setup,
        effects: &[Setting],
        seeds: Seeds,
        extent: Extent,
    ) -> Option<Vec<ObservedRun>> {
        self.simulate_at(self.places(&[]), setup, effects, seeds, extent)
    }

    fn simulate_at(
        &self,
        places: Vec<RunPlace<'_>>,
        setup: &Setup,
        effects: &[Setting],
        seeds: Seeds,
        extent: Extent,
    ) -> Option<Vec<ObservedRun>> {
        let runs = extent.runs(places.len());
        let places = self.shape().into_iter().zip(places);
        self.drive(setup, effects, seeds, places.take(runs))
    }

    /// One simulated data set of a setup whose robots draw as the recording's do: so many laps of a run at each place.
    pub(super) fn drive<'a>(
        &self,
        setup: &Setup,
        effects: &[Setting],
        seeds: Seeds,
        runs: impl Iterator<Item = (usize, RunPlace<'a>)>,
    ) -> Option<Vec<ObservedRun>> {
        if interrupt::check().is_err() {
            return None;
        }
        let mut model = setup.model.clone();
        model.effects.extend_from_slice(effects);
        let run = |(run, (laps, place)): (usize, (usize, RunPlace<'_>))| {
            let world = setup.scene.world(&model, place.number).ok()?;
            let draws = self.tapes.draws(&world, seeds, run, laps);
            let (closed, path) = place.drive(setup, &world, draws, laps).ok()?;
            (closed.len() == laps).then(|| place.observed(setup, closed, &path))
        };
        // Of few data sets the last would keep one thread busy for all its runs.
        let runs: Vec<_> = runs.enumerate().collect();
        runs.into_par_iter().map(run).collect()
    }
}

/// The seed of a session and the number of a simulated data set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seeds {
    pub(super) session: u64,
    pub(super) set: u64,
}

impl Seeds {
    /// The streams of a run. Data sets of a fit have seeds of their own, far from those that a user's `drive` has.
    pub(super) fn streams(self, run: usize) -> Streams {
        Streams {
            seed: (self.session << 20) + (1 << 50) + self.set,
            run: run as u64,
        }
    }
}

/// One simulated data set of the shape of some recordings together, as far as it is asked for.
pub(super) fn simulate_all(
    recordings: &[&Recording],
    effects: &[Setting],
    seeds: Seeds,
    extent: Extent,
) -> Option<Vec<ObservedRun>> {
    let parts = (recordings.iter()).map(|recording| recording.simulate(effects, seeds, extent));
    Some(parts.collect::<Option<Vec<_>>>()?.concat())
}

/// Runs that no fit has seen.
#[derive(Debug)]
pub(super) struct HeldOut {
    /// The number of the recording that declares the same.
    pub(super) recording: usize,
    pub(super) runs: Vec<SampledRun>,
    /// Where in its laps the camera did not see the robot, run by run.
    pub(super) unseen: Vec<Unseen>,
    /// How they begin, as far as that is known.
    pub(super) beginnings: Beginnings,
}

impl HeldOut {
    /// The runs of a data set, on the circuit of a recording that declares the same.
    ///
    /// # Errors
    /// Data of another world, controller or declaration.
    pub(super) fn new(recordings: &[Recording], file: &ModelFile, set: DataSet) -> Result<Self> {
        let course = &recordings[0].setup.scene.circuit().course;
        let config = set.declared_config(&file.config)?.going_round(course);
        let shown = set.folder.display().to_string();
        let place = recordings
            .iter()
            .position(|recording| recording.config == config)
            .with_context(|| {
                format!(
                    "{shown}: declares other settings ([declared], controller) than every --measured data set"
                )
            })?;
        belongs(&set, &config, &recordings[place].world)?;
        let Recording { measured, setup, .. } = &recordings[place];
        let measured = Measured::on(set, measured.circuit.clone(), &file.config)?;
        is_timed(&measured, setup)?;
        Ok(Self {
            recording: place,
            unseen: unseen(&measured, setup.model.run.control_step_s),
            beginnings: Beginnings::of(&measured, setup),
            runs: measured.runs,
        })
    }
}

/// Where in its laps the camera did not see the robot, run by run.
fn unseen(measured: &Measured, step_s: f64) -> Vec<Unseen> {
    let of_run = |(i, run): (usize, &SampledRun)| {
        let seen_s: Vec<f64> = measured.seen(i).map(|(time_s, _)| time_s).collect();
        Unseen::of(&run.laps, &seen_s, step_s)
    };
    measured.runs.iter().enumerate().map(of_run).collect()
}

/// Every run of all recordings.
pub(super) fn runs(recordings: &[Recording]) -> impl Iterator<Item = &SampledRun> {
    recordings.iter().flat_map(|recording| &recording.measured.runs)
}

/// The file of every run of all recordings.
pub(super) fn files(recordings: &[Recording]) -> impl Iterator<Item = &RunFile> {
    recordings
        .iter()
        .flat_map(|recording| &recording.measured.set.runs)
}

/// Every run of some recordings, with its laps.
///
/// # Errors
/// A run of which too few laps count.
pub(super) fn observed_runs(recordings: &[&Recording]) -> Result<Vec<ObservedRun>> {
    let observed: Vec<ObservedRun> = (recordings.iter())
        .flat_map(|recording| recording.observed())
        .collect();
    let measured = || recordings.iter().map(|recording| &recording.measured);
    let files = measured().flat_map(|measured| &measured.set.runs);
    let runs = measured().flat_map(|measured| &measured.runs);
    for ((run, file), observed) in runs.zip(files).zip(&observed) {
        ensure!(
            observed.laps.len() >= 3,
            "{}: {} after the first, which is not analysed: at least 3 in every run are needed to trace anything; {}",
            file.path.display(),
            counted(observed.laps.len(), "whole lap"),
            if run.wanted < 3 {
                "raise `laps` in dataset.toml if there are more, or measure longer"
            } else {
                "leave the run out of `runs` in dataset.toml, or measure it again"
            }
        );
    }
    Ok(observed)
}
