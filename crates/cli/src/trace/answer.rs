//! What laps and the robot's logs say together.

use std::cell::RefCell;

use anyhow::{Context, Result};
use diagnose::{
    Answer, Atlas, Baselines, Departures, Detectable, Explanation, Extent, LogDiagnosis, LoggedRun,
    ObservedRun, Verdict, Watch, diagnose_logs,
};
use sim::{Setting, Vec2};

use super::atlas::{Purpose, atlas};
use super::cache::Cache;
use super::logs::Logs;
use super::recording::{Recording, Seeds, observed_runs, simulate_all};
use crate::session::Session;

/// An answer from logs beside what the laps make of it.
#[derive(Debug)]
pub(crate) struct FromLogs {
    pub(crate) logs: LogDiagnosis,
    /// How the laps depart from the model with the answer's effects; `None` where the robot crashes.
    pub(crate) after: Option<Departures>,
    /// Whether the laps agree with the answer.
    pub(crate) confirmed: bool,
}

/// The laps of some recordings, and what the declared model leads one to expect of them.
pub(super) struct TracedLaps<'a> {
    pub(super) atlas: Atlas,
    /// Of what the cache holds of it.
    key: Option<String>,
    recordings: Vec<&'a Recording>,
    runs: Vec<ObservedRun>,
    seed: u64,
}

/// What laps make of effects that they were not asked for.
#[derive(Clone, Copy)]
struct Agreement {
    /// How they depart from the declared model.
    before: Departures,
    /// How they depart from the model with the effects; `None` where the robot crashes.
    after: Option<Departures>,
    agree: bool,
}

impl Agreement {
    fn new((before, after): (Departures, Option<Departures>)) -> Self {
        Self {
            agree: after.is_some_and(|after| !after.contradict(&before)),
            before,
            after,
        }
    }
}

/// What is claimed, and why.
pub(super) struct Named {
    pub(super) residual: Departures,
    /// Probability of what was seen if the declared model were the robot.
    pub(super) p: f64,
    pub(super) answer: Answer,
    pub(super) from_logs: Option<FromLogs>,
    pub(super) baselines: Option<Baselines>,
    pub(super) detectable: Vec<Detectable>,
}

impl<'a> TracedLaps<'a> {
    /// # Errors
    /// A run of which too few laps count, a declared model that does not complete its laps.
    pub(super) fn new(
        session: &Session,
        recordings: Vec<&'a Recording>,
        purpose: Purpose,
        cache: &Cache,
    ) -> Result<Self> {
        let runs = observed_runs(&recordings)?;
        let (atlas, key) = atlas(session, &recordings, purpose, cache)?;
        Ok(Self {
            runs,
            atlas,
            key,
            recordings,
            seed: session.seed(),
        })
    }

    /// Keeps the signatures that the diagnosis has added.
    pub(super) fn keep_what_was_added(&self, cache: &Cache) {
        if let Some(key) = self.key.as_ref().filter(|_| self.atlas.has_grown()) {
            // That it cannot be kept was said when it was made.
            let _ = cache.put(key, &self.atlas);
        }
    }

    fn simulate(&self, effects: &[Setting], set: u64, extent: Extent) -> Option<Vec<ObservedRun>> {
        let seeds = Seeds {
            session: self.seed,
            set,
        };
        simulate_all(&self.recordings, effects, seeds, extent)
    }

    /// How the laps depart from the declared model, and from the model with these effects; the latter is `None` where the robot then
    /// crashes.
    fn confirm(&self, effects: &[Setting]) -> Result<(Departures, Option<Departures>)> {
        let simulate = |effects: &[Setting], set: u64, extent: Extent| self.simulate(effects, set, extent);
        Ok(self.atlas.confirm(&simulate, &self.runs, effects)?)
    }

    /// The same, and whether these laps agree with the effects; where sizes go by run those of the `logged` recordings do, if all
    /// contradict: of a run without a log no size is known.
    fn agreement(
        &self,
        effects: &[Setting],
        logged: &impl Fn() -> Result<Option<Self>>,
    ) -> Result<Agreement> {
        let mut agreement = Agreement::new(self.confirm(effects)?);
        if !agreement.agree
            && effects.iter().any(Setting::goes_by_run)
            && let Some(logged) = logged()?
        {
            agreement.agree = Agreement::new(logged.confirm(effects)?).agree;
        }
        Ok(agreement)
    }

    /// Places along the track, from the arena's middle, m.
    fn places(&self) -> Vec<Vec2> {
        const APART_M: f64 = 0.28;
        let circuit = self.recordings[0].setup.scene.circuit();
        let gates = (APART_M / circuit.gates.spacing_m()).round().max(1.0) as usize;
        let centers = circuit.gates.iter().step_by(gates).map(|gate| gate.center);
        centers.map(|center| center - circuit.middle()).collect()
    }

    /// What the laps say; `watch` is told what is being tried.
    pub(super) fn named(&self, watch: &Watch<'_>) -> Result<Named> {
        let simulate = |effects: &[Setting], set: u64, extent: Extent| self.simulate(effects, set, extent);
        let found = self
            .atlas
            .diagnose(&simulate, &self.runs, &self.places(), watch)?;
        watch("how small effects would be seen");
        Ok(Named {
            residual: found.residual,
            p: found.p,
            answer: found.answer,
            from_logs: None,
            baselines: Some(self.atlas.baselines(&self.runs)?),
            detectable: self.atlas.detectable(&simulate),
        })
    }

    /// What the robot's logs say, stage by stage, and what the laps make of it; `logged` are the laps of the recordings that have logs,
    /// if not all have.
    pub(super) fn named_by_logs(
        &self,
        logs: &Logs,
        logged: impl Fn() -> Result<Option<Self>>,
        watch: &Watch<'_>,
    ) -> Result<Named> {
        let models = (self.recordings.iter()).flat_map(|recording| {
            let model = &recording.setup.model;
            recording.measured.runs.iter().map(move |_| model)
        });
        let runs: Vec<LoggedRun<'_>> = (models.zip(&logs.runs))
            .map(|(model, rows)| LoggedRun { model, rows })
            .collect();
        let first = self.recordings[logs.recordings[0]];
        // What the logs do not tell apart was asked already.
        let last: RefCell<Option<(Vec<Setting>, Agreement)>> = RefCell::default();
        let agreement = |effects: &[Setting]| {
            let known = last.take().filter(|(known, _)| known == effects);
            let agreement = match known {
                Some((_, agreement)) => agreement,
                None => {
                    watch("whether the laps agree");
                    self.agreement(effects, &logged)?
                }
            };
            last.replace(Some((effects.to_vec(), agreement)));
            Ok::<_, anyhow::Error>(agreement)
        };
        let agree = |effects: &[Setting]| agreement(effects).is_ok_and(|agreement| agreement.agree);
        let found = diagnose_logs(&first.setup.scene, &runs, &agree, watch)
            .with_context(|| first.measured.set.name.clone())?;
        let Agreement { before, after, agree } = agreement(&found.answer.settings())?;
        let found = FromLogs {
            // Where nothing is claimed there is nothing to agree with.
            confirmed: agree || found.answer.verdict == Verdict::Unexplained,
            logs: found,
            after,
        };
        Ok(Named {
            p: before.omnibus_p().min(found.logs.p),
            residual: before,
            answer: found.answer(),
            baselines: None,
            detectable: found.logs.detectable.clone(),
            from_logs: Some(found),
        })
    }
}

impl FromLogs {
    /// What is claimed: the logs' answer if the laps agree with it, and nothing if they do not.
    pub(crate) fn answer(&self) -> Answer {
        let mut answer = self.logs.answer.clone();
        if let (Some(best), true) = (answer.explanations.first_mut(), answer.cause.is_none()) {
            best.remainder = self.after;
        }
        if !self.confirmed {
            answer.verdict = Verdict::Unexplained;
        }
        if answer.verdict == Verdict::Unexplained {
            answer.left_out.iter_mut().for_each(Vec::clear);
        }
        answer
    }
}

/// The explanations that the data do not tell apart, the answer's first; none where nothing is claimed.
pub(crate) fn rivals(answer: &Answer) -> &[Explanation] {
    match answer.claimed() {
        Some(_) => &answer.explanations[..answer.indistinguishable],
        None => &[],
    }
}
