//! What a diagnosis says in the end, from laps or from logs.

use sim::{Pattern, Setting, Stage, UNLISTED};

use crate::laps::SIGNIFICANT_P;
use crate::{Candidate, Departures};

/// How much of the residual is explained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing significant is left out of the declared model.
    Faithful,
    /// The effects leave nothing that matters.
    Explained,
    /// They help; a remainder is significant and matters.
    PartlyExplained,
    /// No name would be honest.
    Unexplained,
}

impl Verdict {
    /// The word in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Faithful => "faithful",
            Self::Explained => "explained",
            Self::PartlyExplained => "partly explained",
            Self::Unexplained => "unexplained",
        }
    }
}

/// One explanation that was tried to the end: effects that act together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The effects with their sizes, in order of importance.
    pub effects: Vec<Candidate>,
    /// Log-likelihood gained over the declared model less the price of the fitted numbers.
    pub score: f64,
    /// Log-likelihood gained.
    pub gain: f64,
    /// Its standard error by the simulations that tell it; 0 where none do.
    pub gain_error: f64,
    /// Share of what exceeds the declared model's expectation that it explains, as it is estimated: the excess that remains
    /// scatters about nothing, and where there is little to explain the share is anything.
    pub share: f64,
    /// Probability of what remains by chance; `None` where it was not looked at.
    pub remainder_p: Option<f64>,
    /// What remains, as laps tell it.
    pub remainder: Option<Departures>,
}

impl Explanation {
    /// The effects as the simulator takes them.
    pub fn settings(&self) -> Vec<Setting> {
        self.effects.iter().map(|effect| effect.setting.clone()).collect()
    }

    /// The effects with one fitted number moved by its standard error, number by number: up, or down where it would leave its range.
    pub fn moved(&self) -> Vec<Vec<Setting>> {
        let with = |number: usize, setting: Setting| {
            let mut settings = self.settings();
            settings[number] = setting;
            settings
        };
        let effects = self.effects.iter().enumerate();
        effects
            .flat_map(|(number, effect)| effect.moved().map(move |setting| with(number, setting)))
            .collect()
    }

    /// The effects' names.
    pub fn names(&self) -> Vec<&'static str> {
        self.effects
            .iter()
            .map(|effect| effect.setting.spec.name)
            .collect()
    }

    /// How many of its effects are on noise.
    pub fn noises(&self) -> usize {
        self.names().into_iter().filter(|name| is_noise(name)).count()
    }

    /// How many numbers were fitted.
    pub(crate) fn fitted(&self) -> usize {
        self.effects.iter().map(|effect| effect.fitted).sum()
    }

    /// Log-likelihood that the faults of models may gain beside it: at very high signal no model is exact.
    pub(crate) fn faults(&self) -> f64 {
        /// Share of what is explained.
        const FAULTS: f64 = 2e-4;
        FAULTS * self.gain
    }

    /// How far behind it another explanation has to be for data to tell the two apart: five units, and what simulations do not know.
    pub(crate) fn tells_apart(&self) -> f64 {
        (ALTERNATIVE + self.gain_error).max(2.0 * self.gain_error)
    }

    /// Whether data do not tell another one from it: of as many effects, with a cause without a name if it has one, and not so far behind.
    pub(crate) fn is_not_told_from(&self, other: &Self) -> bool {
        other.score >= self.score - self.tells_apart()
            && other.effects.len() == self.effects.len()
            && other.has_no_name() == self.has_no_name()
    }

    /// Whether a cause without a name is among the effects.
    pub(crate) fn has_no_name(&self) -> bool {
        self.effects.iter().any(|effect| *effect.setting.spec == UNLISTED)
    }

    /// The part of what it explains that each of its effects has, by what they do alone; they add up to 1.
    pub fn parts(&self) -> Vec<f64> {
        let total: f64 = self.effects.iter().map(|effect| effect.weight).sum();
        if total > 0.0 && total.is_finite() {
            self.effects.iter().map(|effect| effect.weight / total).collect()
        } else {
            vec![1.0 / self.effects.len() as f64; self.effects.len()]
        }
    }

    /// Whether data speak for another explanation by more effects: each further number gains five units of log-likelihood, and all of
    /// them more than the faults of models do.
    pub(crate) fn lacks_as(&self, other: &Self) -> bool {
        let numbers = other.fitted().saturating_sub(self.fitted()).max(1);
        other.effects.len() > self.effects.len()
            && !other.has_no_name()
            && other.gain - self.gain >= (ALTERNATIVE * numbers as f64).max(self.faults())
    }

    /// Share of what exceeds the declared model's expectation that it explains, in [0, 1]; `None` where laps alone tell it and that
    /// much of how they depart is often chance, of which nothing is a share.
    pub fn explained(&self, of_laps: Option<&Departures>) -> Option<f64> {
        let is_chance = of_laps.is_some_and(Departures::excess_is_chance);
        (!is_chance).then(|| self.share.clamp(0.0, 1.0))
    }

    /// Whether what remains is as likely as that by chance.
    pub(crate) fn leaves_more_likely_than(&self, p: f64) -> bool {
        self.remainder_p.is_some_and(|remainder_p| remainder_p >= p)
    }

    /// Whether nothing significant remains.
    pub fn fits(&self) -> bool {
        self.leaves_more_likely_than(SIGNIFICANT_P)
    }

    /// What the effects are, for a reader.
    pub fn label(&self) -> String {
        let labels: Vec<String> = self.effects.iter().map(Candidate::label).collect();
        labels.join(" + ")
    }
}

/// Log-likelihood within which explanations are alternatives.
pub const ALTERNATIVE: f64 = 5.0;

/// Whether an effect changes nothing but chance.
pub(crate) fn is_noise(name: &str) -> bool {
    ["slip-level", "slip-memory", "reading-noise", "camera-noise"].contains(&name)
}

/// How many of the first explanations, best first, data do not tell from the best.
pub(crate) fn indistinguishable<'a>(explanations: impl Iterator<Item = &'a Explanation> + Clone) -> usize {
    explanations.clone().next().map_or(0, |best| {
        explanations
            .take_while(|other| best.is_not_told_from(other))
            .count()
    })
}

/// Brings what data do not tell from the first of some explanations behind it and what stands there, wherever it was found, but for
/// what is the `same` as one of these; how many these are.
pub(crate) fn with_rivals_first<T>(
    found: &mut [T],
    explanation: impl Fn(&T) -> &Explanation,
    same: impl Fn(&T, &T) -> bool,
) -> usize {
    let in_order = indistinguishable(found.iter().map(&explanation));
    let mut rivals = in_order;
    for place in in_order..found.len() {
        let (known, other) = (&found[..rivals], &found[place]);
        if explanation(&found[0]).is_not_told_from(explanation(other))
            && !known.iter().any(|known| same(known, other))
        {
            found[rivals..=place].rotate_right(1);
            rivals += 1;
        }
    }
    rivals
}

/// Where a cause sits that no listed effect is.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// The stage of the loop.
    pub stage: Stage,
    /// What it acts on.
    pub acts_on: String,
    /// What it depends on; `chance` where it is noise.
    pub depends_on: String,
}

impl Cause {
    /// The cause that a setting of [`UNLISTED`] stands for; `None` for a listed effect.
    pub fn of(setting: &Setting) -> Option<Self> {
        if *setting.spec != UNLISTED {
            return None;
        }
        let values = match &setting.pattern {
            Pattern::Constant(values) => values,
            Pattern::ByTime { start, .. } => start,
            Pattern::ByRun(runs) => runs.first()?,
        };
        let word = |i: usize| UNLISTED.params[i].choices[values[i] as usize];
        let stage = match word(0) {
            "reading" | "left-right difference" => Stage::Sense,
            "camera x" | "camera y" | "camera scale" => Stage::Observe,
            _ => Stage::Act,
        };
        Some(Self {
            stage,
            acts_on: word(0).to_owned(),
            depends_on: word(1).to_owned(),
        })
    }
}

/// What is claimed, and what else was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// In a word.
    pub verdict: Verdict,
    /// Every explanation that was tried to the end, best first; the first is the answer, if there is one.
    pub explanations: Vec<Explanation>,
    /// How many of these the data do not tell apart, from the first on.
    pub indistinguishable: usize,
    /// For each run the answer's effects with sizes fitted to the other runs alone.
    pub left_out: Vec<Vec<Setting>>,
    /// Where the cause sits, if it has no name.
    pub cause: Option<Cause>,
}

impl Answer {
    /// Nothing to explain, in so many runs.
    pub fn faithful(runs: usize) -> Self {
        Self {
            verdict: Verdict::Faithful,
            explanations: Vec::new(),
            indistinguishable: 0,
            left_out: vec![Vec::new(); runs],
            cause: None,
        }
    }

    /// The explanation that is claimed; `None` where none is needed or none would be honest.
    pub fn claimed(&self) -> Option<&Explanation> {
        match self.verdict {
            Verdict::Faithful | Verdict::Unexplained => None,
            Verdict::Explained | Verdict::PartlyExplained => self.explanations.first(),
        }
    }

    /// Explanations by more effects than are claimed, for which these data speak, but not enough: those within five units of the best of
    /// these, best first.
    pub fn further(&self) -> Vec<&Explanation> {
        let Some(claimed) = self.claimed().filter(|claimed| !claimed.has_no_name()) else {
            return Vec::new();
        };
        let explanations = self.explanations.iter();
        let mut further: Vec<&Explanation> = explanations.filter(|other| claimed.lacks_as(other)).collect();
        further.sort_by(|a, b| b.score.total_cmp(&a.score));
        if let Some(best) = further.first().copied() {
            further.retain(|other| other.score >= best.score - best.tells_apart());
        }
        further
    }

    /// The effects that are claimed, as the simulator takes them.
    pub fn settings(&self) -> Vec<Setting> {
        self.claimed().map(Explanation::settings).unwrap_or_default()
    }

    /// This answer, unless it, or another that the data do not tell from it, is a slower wheel and more slip whose sizes
    /// follow from one another, as they do if wheels stand still in a share of the physics steps: one cause without a name,
    /// then, rather than two with theirs; so is noise without a name. `slip_level` is the declared model's.
    #[must_use]
    pub fn unless_stalls(mut self, slip_level: f64) -> Self {
        let alike = &self.explanations[..self.indistinguishable];
        let is_noise = |cause: &Cause| cause.depends_on == "chance";
        if (self.claimed().is_some() || self.cause.as_ref().is_some_and(is_noise))
            && alike
                .iter()
                .any(|explanation| are_stalls(explanation, slip_level))
        {
            self.verdict = Verdict::Unexplained;
            self.cause = Some(Cause {
                stage: Stage::Act,
                acts_on: "wheel speed".into(),
                depends_on: "chance".into(),
            });
            self.left_out.iter_mut().for_each(Vec::clear);
        }
        self
    }
}

/// Whether a slower wheel and more slip are what standing still in a share of the physics steps does to the mean and the
/// variance of the speed.
fn are_stalls(explanation: &Explanation, slip_level: f64) -> bool {
    /// Share, or else standard errors, by which the slip may be off.
    const OFF: (f64, f64) = (0.1, 3.0);
    let size = |name: &str| {
        let effect = explanation.effects.iter().find(|e| e.setting.spec.name == name)?;
        let Pattern::Constant(values) = &effect.setting.pattern else {
            return None;
        };
        Some((values[0], effect.standard_errors[0]))
    };
    let (Some((speed, _)), Some((slip, error)), 2) =
        (size("wheel-scale"), size("slip-level"), explanation.effects.len())
    else {
        return false;
    };
    // Slip is uniform in +-s: variance s^2 / 3 of the speed's share.
    let (stalls, declared) = (1.0 - speed, slip_level * slip_level / 3.0);
    if stalls <= 0.0 || declared == 0.0 {
        return false;
    }
    let variance = stalls * speed + speed * declared;
    let expected = (variance / declared).sqrt() / speed;
    (slip - expected).abs() < (OFF.0 * expected).max(OFF.1 * error)
}

#[cfg(test)]
mod tests {
    use sim::find;

    use super::*;

    fn answer(speed: f64, slip: f64) -> Answer {
        let effect = |name: &str, value: f64| Candidate {
            setting: Setting::constant(find(name).unwrap(), [value]),
            standard_errors: vec![0.01],
            intervals: std::collections::BTreeMap::new(),
            gain: 100.0,
            fitted: 1,
            weight: 1.0,
        };
        let explanation = Explanation {
            effects: vec![effect("wheel-scale", speed), effect("slip-level", slip)],
            score: 90.0,
            gain: 100.0,
            gain_error: 0.0,
            share: 1.0,
            remainder_p: Some(0.5),
            remainder: None,
        };
        Answer {
            verdict: Verdict::Explained,
            explanations: vec![explanation],
            indistinguishable: 1,
            left_out: Vec::new(),
            cause: None,
        }
    }

    #[test]
    fn what_is_not_told_from_the_first_is_a_rival_wherever_it_was_found() {
        let both = answer(1.01, 1.0).explanations.remove(0);
        let by = |effects: usize, score: f64| Explanation {
            effects: both.effects[..effects].to_vec(),
            score,
            ..both.clone()
        };
        let mut found = vec![
            by(2, 90.0),
            by(2, 88.0),
            by(1, 89.0),
            by(2, 84.0),
            by(2, 86.0),
            by(2, 86.5),
        ];
        let same = |a: &Explanation, b: &Explanation| (a.score - b.score).abs() < 1.0;
        assert_eq!(with_rivals_first(&mut found, |found| found, same), 3);
        let scores: Vec<f64> = found.iter().map(|found| found.score).collect();
        assert_eq!(scores, [90.0, 88.0, 86.0, 89.0, 84.0, 86.5]);
    }

    /// One effect, claimed, beside others by some effects more that gain so much more by one number each.
    fn claimed_beside(gains: &[f64]) -> Answer {
        let mut claimed = answer(1.01, 1.0);
        let both = claimed.explanations.remove(0);
        let by = |effects: usize, gain: f64| Explanation {
            effects: both.effects[..effects].to_vec(),
            gain,
            score: gain,
            ..both.clone()
        };
        let further = gains.iter().map(|more| by(2, 1000.0 + more));
        claimed.explanations = std::iter::once(by(1, 1000.0)).chain(further).collect();
        claimed
    }

    #[test]
    fn effects_share_what_is_explained_by_what_they_do() {
        let mut explanation = answer(0.9, 2.0).explanations.remove(0);
        assert_eq!(explanation.parts(), [0.5, 0.5]);
        explanation.effects[0].weight = 3.0;
        assert_eq!(explanation.parts(), [0.75, 0.25]);
        // What a cause without a name does alone is not known.
        explanation.effects[0].weight = f64::INFINITY;
        assert_eq!(explanation.parts(), [0.5, 0.5]);
    }

    #[test]
    fn what_gains_five_units_a_number_is_listed_beside_what_is_claimed() {
        let listed = |gains: &[f64]| -> Vec<f64> {
            let answer = claimed_beside(gains);
            answer.further().iter().map(|other| other.gain - 1000.0).collect()
        };
        assert_eq!(listed(&[4.9]), [] as [f64; 0]);
        // Best first, and none that the best of them rules out.
        assert_eq!(listed(&[6.0, 5.5, 12.0, 7.5, 4.0]), [12.0, 7.5]);
    }

    #[test]
    fn neither_faults_of_models_nor_what_is_not_claimed_calls_for_more() {
        let mut answer = claimed_beside(&[12.0]);
        // .02 % of what is explained may be a fault of the model.
        for explanation in &mut answer.explanations {
            explanation.gain += 69_000.0;
        }
        assert!(answer.further().is_empty());
        answer = claimed_beside(&[12.0]);
        answer.verdict = Verdict::Unexplained;
        assert!(answer.further().is_empty());
    }

    #[test]
    fn chance_has_no_share_to_explain() {
        use crate::Quadratic;
        let four = |mean_q: f64| {
            let [mean, runs] = [(mean_q, 120), (300.0, 360)].map(|(q, freedom)| Quadratic::new(q, freedom));
            let [trend, noise] = [(134.0, 120), (9.0, 20)].map(|(q, freedom)| Quadratic::new(q, freedom));
            Departures {
                mean,
                runs,
                trend,
                noise,
                start: Quadratic::new(0.0, 0),
            }
        };
        let mut found = answer(1.0, 1.0).explanations.remove(0);
        found.share = -1.25;
        // From logs all that counts is the likelihood.
        assert_eq!(found.explained(None), Some(0.0));
        assert_eq!(found.explained(Some(&four(152.0))), None);
        found.share = 1.03;
        assert_eq!(found.explained(Some(&four(1200.0))), Some(1.0));
    }

    /// The slip of standing still in one step of ten: mean 0.9, variance 0.09 + 0.9 * 0.01 / 3 of a slip of 0.1.
    fn slip_of_stalls() -> f64 {
        ((0.09_f64 + 0.003) / (0.01 / 3.0)).sqrt() / 0.9
    }

    #[test]
    fn wheels_that_stand_still_now_and_then_have_no_name() {
        let doubted = answer(0.9, slip_of_stalls()).unless_stalls(0.1);
        assert_eq!(doubted.verdict, Verdict::Unexplained);
        assert_eq!(doubted.cause.unwrap().depends_on, "chance");
    }

    #[test]
    fn it_is_enough_that_the_data_do_not_tell_it_from_the_answer() {
        let slip = slip_of_stalls();
        let mut doubted = answer(0.9, 1.5 * slip);
        doubted.explanations.extend(answer(0.9, slip).explanations);
        assert_eq!(doubted.clone().unless_stalls(0.1).verdict, Verdict::Explained);
        doubted.indistinguishable = 2;
        assert_eq!(doubted.unless_stalls(0.1).verdict, Verdict::Unexplained);
    }

    #[test]
    fn noise_without_a_name_is_theirs_too() {
        let mut refused = answer(0.9, slip_of_stalls());
        refused.verdict = Verdict::Unexplained;
        refused.cause = Some(Cause {
            stage: Stage::Sense,
            acts_on: "reading".into(),
            depends_on: "chance".into(),
        });
        assert_eq!(refused.unless_stalls(0.1).cause.unwrap().stage, Stage::Act);
    }

    #[test]
    fn other_sizes_of_the_same_two_effects_keep_their_names() {
        for (speed, slip) in [(0.9, 3.0), (1.1, 5.0), (0.99, 5.0)] {
            assert_eq!(answer(speed, slip).unless_stalls(0.1).verdict, Verdict::Explained);
        }
    }
}
