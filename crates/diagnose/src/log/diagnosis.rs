//! From logs to an answer.

use std::collections::BTreeMap;

use sim::{Model, Scene, Setting, Stage, find};

use super::catalogue::Variant;
use super::channels::Channel;
use super::decide::{Decided, Decision, decision};
use super::evidence::{Evidence, widened};
use super::filter::MEASURED;
use super::groups::{area_variants, settling_variants, unlisted_variants};
use super::implausible::{Implausible, take_out_spikes};
use super::leads::Lead;
use super::recut::recut;
use super::refined::Refined;
use super::rows::{LogRow, LoggedRun, bridged, without_logs};
use super::search::{NOT_FAR, RIVAL, Search};
use super::steps::{reading_step, written_step};
use super::unnamed::Unnamed;
use crate::answer::indistinguishable;
use crate::candidate::stage_of;
use crate::corners::{Corners, EXACT};
use crate::{Answer, Candidate, Cause, Detectable, Error, Explanation, Verdict, Watch};

/// What robot logs say of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct LogDiagnosis {
    /// What is claimed.
    pub answer: Answer,
    /// The controller.
    pub decide: Decided,
    /// Probability that as much is found in the logs of a robot that is as declared.
    pub p: f64,
    /// What was not used.
    pub spoilt: Spoilt,
    /// Camera x and y, then S0 to S7, under the best explanation.
    pub channels: [Channel; MEASURED],
    /// Where the walls seem to be cut.
    pub corners: Corners,
    /// Control steps that were used.
    pub steps: usize,
    /// How large effects on motion, readings, walls and camera must be to show in these logs.
    pub detectable: Vec<Detectable>,
}

/// What of logs was spoilt after the robot had driven by it, run by run.
#[derive(Debug, Clone, PartialEq)]
pub struct Spoilt {
    /// The rows whose commands do not follow from their readings as those of nearly all others do.
    pub rows: Vec<Vec<usize>>,
    /// Readings that leap away for a few rows.
    pub readings: Vec<Vec<Implausible>>,
}

/// Whether laps, which were not asked for them, agree with effects.
pub type Agree<'a> = dyn Fn(&[Setting]) -> bool + 'a;

/// What the robot's logs say that the model lacks, which may be declared otherwise in some runs than in others, but for its walls, its
/// body and the places of its sensors. Of what they do not tell apart comes first what laps `agree` with; `watch` is told what is being
/// tried.
///
/// # Errors
/// A logged run's model that the scene was not made for; logs of which no stretch of 200 control steps with positions and commands
/// can be followed.
pub fn diagnose_logs(
    scene: &Scene,
    runs: &[LoggedRun<'_>],
    agree: &Agree<'_>,
    watch: &Watch<'_>,
) -> Result<LogDiagnosis, Error> {
    watch("the controller");
    let mut decision = decision(runs);
    let spoilt = std::mem::take(&mut decision.spoilt);
    let mut mended: Vec<Vec<LogRow>> = (runs.iter().zip(&spoilt))
        .map(|(run, spoilt)| without_logs(run.rows, spoilt))
        .collect();
    let models: Vec<&Model> = runs.iter().map(|run| run.model).collect();
    let at_end = |model: &&Model| model.machine.response.reading(model.machine.range_m);
    let edge_counts = models.iter().map(at_end).fold(0.0, f64::max);
    let spoilt = Spoilt {
        rows: spoilt,
        readings: take_out_spikes(&mut mended, edge_counts),
    };
    let mended: Vec<Vec<LogRow>> = (mended.iter().zip(&models))
        .map(|(rows, model)| bridged(rows, &model.run))
        .collect();
    let runs: &[&[LogRow]] = &mended.iter().map(Vec::as_slice).collect::<Vec<_>>();
    let logged = (models.iter().zip(runs)).filter(|(_, rows)| !rows.is_empty());
    let (wide, scene) = widened(logged.map(|(model, _)| *model), scene)?;
    let step = reading_step(runs);
    let declared = Evidence::new(&scene, &models, runs, step.unwrap_or_else(|| written_step(runs)))?;
    if declared.stretches.is_empty() {
        return Err(Error::NoLog);
    }
    watch("where the walls are cut");
    let first = recut(&scene, &wide, &declared, &[]).and_then(|found| found.cut);
    let mut search = Search::new(
        declared.elsewhere(first.as_ref().map_or(&scene, |found| &found.1)),
        step,
    )?;
    watch("each effect by the log");
    let Some(leads) = search.alone() else {
        return Ok(search.answer(decision, spoilt, corners_of(&first)));
    };
    // Where walls or the robot then are elsewhere, so are the readings that no edge spoils.
    let clear = search.evidence.clear_with_each(search.rivals());
    let was_clear = clear.is_none();
    if let Some(clear) = clear {
        watch(&format!(
            "the readings that count with {}",
            search.best_in_words()
        ));
        // They are refined once more when it is known where the walls are cut.
        search = search.renewed(clear, RIVAL)?;
    }
    let logs = Logs {
        scene: &scene,
        wide: &wide,
        declared: &declared,
        leads: &leads,
        agree,
        watch,
    };
    logs.between_walls(search, corners_of(&first), was_clear, 0, (decision, spoilt))
}

/// The logs between the declared walls, and what linear algebra ranks there.
struct Logs<'l> {
    scene: &'l Scene,
    wide: &'l Model,
    declared: &'l Evidence<'l>,
    leads: &'l [Lead],
    agree: &'l Agree<'l>,
    watch: &'l Watch<'l>,
}

impl Logs<'_> {
    /// The answer of a search between the walls that the logs like best beside its best candidate; `is_clear` if the readings that count
    /// are those that do beside that. What is missing blurs where the corners are: they are looked for again after each of the
    /// rounds in which further effects were found.
    fn between_walls(
        &self,
        search: Search<'_>,
        corners: Corners,
        is_clear: bool,
        rounds: usize,
        rest: (Decision, Spoilt),
    ) -> Result<LogDiagnosis, Error> {
        let best = search.best_in_words();
        (self.watch)(&format!("where the walls are cut with {best}"));
        let uncut = search.evidence.elsewhere(self.scene);
        // With the sizes that they have there and, as corners that are wrong spoil these too, with those between the declared walls.
        let sizes = [
            Some(search.best().to_vec()),
            (corners != EXACT).then(|| search.best_by(&uncut)).flatten(),
        ];
        let again = (sizes.into_iter().flatten())
            .filter_map(|settings| recut(self.scene, self.wide, &uncut, &settings))
            .max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
            .and_then(|found| found.cut);
        (self.watch)(&format!("what is beside {best}"));
        let found = corners_of(&again);
        if is_clear && found == corners {
            return self.one_more_beside(search, corners, rounds, rest);
        }
        let declared = (self.declared).elsewhere(again.as_ref().map_or(self.scene, |found| &found.1));
        let clear = declared.clear_with_each(search.rivals());
        self.one_more_beside(
            search.renewed(clear.unwrap_or(declared), NOT_FAR)?,
            found,
            rounds,
            rest,
        )
    }

    /// The answer of a search that may find one more effect.
    fn one_more_beside(
        &self,
        mut search: Search<'_>,
        corners: Corners,
        rounds: usize,
        rest: (Decision, Spoilt),
    ) -> Result<LogDiagnosis, Error> {
        /// Effects at most; between other walls there may be fewer again.
        const MOST: usize = 3;
        /// Rounds in which they are looked for at most: one that is found may do without another.
        const ROUNDS: usize = 3;
        if rounds == 0 {
            search.unnamed = search.unnamed_before_pairs(self.leads);
        }
        let found = if search.unnamed.is_some() {
            None
        } else if rounds < ROUNDS && search.best().len() < MOST && search.one_more(self.leads) {
            Some(rounds + 1)
        } else if rounds <= ROUNDS && search.exchange() {
            // What is found in place of others is the last.
            Some(ROUNDS + 1)
        } else {
            None
        };
        if let Some(rounds) = found {
            let is_clear = search.evidence.clear_with_each(search.rivals()).is_none();
            return self.between_walls(search, corners, is_clear, rounds, rest);
        }
        let (decision, spoilt) = rest;
        search.prefer_what_laps_agree_with(&decision.decided, self.agree);
        search.finish();
        Ok(search.answer(decision, spoilt, corners))
    }
}

/// The corners of walls that were cut elsewhere than declared, or the declared ones.
fn corners_of(cut: &Option<(Corners, Scene)>) -> Corners {
    cut.as_ref().map_or(EXACT, |found| found.0)
}

impl Search<'_> {
    fn answer(self, decision: Decision, spoilt: Spoilt, corners: Corners) -> LogDiagnosis {
        let Decision {
            decided: decide,
            without,
            ..
        } = decision;
        let certain = self.certain(&decide);
        let is_certain = !certain.is_empty();
        let mut explanations: Vec<Explanation> = Vec::new();
        for refined in self.found.iter().take(12) {
            let explanation = self.explanation(refined, &certain);
            // What was refined from several sizes may have come to one.
            if explanations
                .iter()
                .all(|other| other.label() != explanation.label())
            {
                explanations.push(explanation);
            }
        }
        let unnamed = self.unnamed.as_ref().and_then(|u| u.refined.as_ref());
        if let Some(refined) = unnamed {
            explanations.insert(0, self.explanation(refined, &certain));
        }
        if explanations.is_empty() && !certain.is_empty() {
            explanations.push(Explanation {
                gain: certain[0].gain,
                gain_error: 0.0,
                score: certain[0].gain,
                effects: certain,
                share: 1.0,
                remainder_p: Some(self.p),
                remainder: None,
            });
        }
        let no_controller = matches!(decide, Decided::NoController { .. });
        let matters = self.remainder.matters();
        let verdict = match &self.unnamed {
            _ if no_controller => Verdict::Unexplained,
            Some(Unnamed { refined: None, .. }) => Verdict::Unexplained,
            Some(_) if matters => Verdict::PartlyExplained,
            None if explanations.is_empty() => Verdict::Faithful,
            None if matters => Verdict::PartlyExplained,
            _ => Verdict::Explained,
        };
        let cause = if no_controller {
            Some(Cause {
                stage: Stage::Decide,
                acts_on: "command".into(),
                depends_on: "reading".into(),
            })
        } else {
            self.unnamed.as_ref().map(|unnamed| unnamed.cause.clone())
        };
        let indistinguishable = indistinguishable(explanations.iter());
        let mut answer = Answer {
            verdict,
            explanations,
            indistinguishable,
            left_out: Vec::new(),
            cause,
        };
        answer.left_out = if !answer.settings().is_empty() {
            self.without_each(without, unnamed.or(self.found.first()))
        } else {
            vec![Vec::new(); without.len()]
        };
        LogDiagnosis {
            answer,
            decide,
            spoilt,
            p: if is_certain { 0.0 } else { self.p },
            channels: self.channels,
            corners,
            steps: self.control_steps,
            detectable: self.detectable,
        }
    }

    /// Of the explanations that the logs do not tell from the best the first that laps agree with becomes the best, if there is one.
    fn prefer_what_laps_agree_with(&mut self, decide: &Decided, agree: &Agree<'_>) {
        if self.unnamed.is_some() {
            return;
        }
        let certain = self.certain(decide);
        let explained = |refined: &Refined| self.explanation(refined, &certain);
        let explanations: Vec<Explanation> = self.found.iter().map(explained).collect();
        let alike: Vec<usize> = (0..explanations.len())
            .filter(|&place| explanations[0].is_not_told_from(&explanations[place]))
            .collect();
        if alike.len() < 2 {
            return;
        }
        let agrees = |place: &&usize| agree(&explanations[**place].settings());
        if let Some(&first) = alike.iter().find(agrees) {
            self.found[..=first].rotate_right(1);
        }
    }

    /// The effects that need no fit: the controller's, and the multiples that readings were rounded to.
    fn certain(&self, decide: &Decided) -> Vec<Candidate> {
        let mut certain = match decide {
            Decided::Changed(effects) => effects.clone(),
            _ => Vec::new(),
        };
        certain.extend(self.rounding());
        certain
    }

    /// The multiples that readings were rounded to.
    fn rounding(&self) -> Option<Candidate> {
        let counts = self.rounding_counts?;
        let spec = find("reading-step").ok()?;
        Some(Candidate {
            setting: Setting::constant(spec, [counts]),
            standard_errors: vec![2e-4 * counts],
            intervals: BTreeMap::new(),
            gain: self.rounding_gain,
            fitted: 1,
            weight: 1.0,
        })
    }

    fn explanation(&self, refined: &Refined, certain: &[Candidate]) -> Explanation {
        let own = (refined.settings.iter())
            .zip(&refined.standard_errors)
            .map(|(setting, errors)| Candidate {
                setting: setting.clone(),
                standard_errors: errors.clone(),
                intervals: BTreeMap::new(),
                gain: refined.gain,
                fitted: errors.iter().filter(|error| **error > 0.0).count(),
                weight: 1.0,
            });
        let was_looked_at = self.remainder.beside == refined.settings;
        Explanation {
            effects: certain.iter().cloned().chain(own).collect(),
            gain: refined.gain,
            gain_error: 0.0,
            score: refined.score(),
            share: refined.gain / (refined.gain + self.left_beside(refined)).max(1e-9),
            remainder_p: was_looked_at.then_some(self.remainder.p),
            remainder: None,
        }
    }

    /// Log-likelihood that further effects would gain beside the best explanation of which that is known; other explanations lack
    /// what they gain less than that.
    fn left_beside(&self, refined: &Refined) -> f64 {
        let best = self.remainder.gain;
        let left = best * self.remainder.share / (1.0 - self.remainder.share).max(1e-9);
        left + (best - refined.gain).max(0.0)
    }

    /// The answer's effects with sizes fitted to all runs but one, for each run: `best` beside the controller's constants `without` the
    /// run.
    fn without_each(&self, without: Vec<Vec<Setting>>, best: Option<&Refined>) -> Vec<Vec<Setting>> {
        let stage = |setting: &Setting| stage_of(setting);
        let settling = best.into_iter().flat_map(|best| &best.settings).map(stage);
        let variants: Vec<Variant> = (self.variants.iter().cloned())
            .chain(unlisted_variants())
            .chain(area_variants())
            .chain(settling.flat_map(settling_variants))
            .collect();
        let rounding: Vec<Setting> = self
            .rounding()
            .map(|rounding| rounding.setting)
            .into_iter()
            .collect();
        let refitted = match best {
            Some(best) => best.without_each(&self.evidence, &variants),
            None => vec![Vec::new(); without.len()],
        };
        (without.into_iter().zip(refitted))
            .map(|(constants, refitted)| [constants, rounding.clone(), refitted].concat())
            .collect()
    }
}
