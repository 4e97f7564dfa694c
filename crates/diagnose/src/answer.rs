//! What a diagnosis says in the end, from laps or from logs.

use sim::{Pattern, Setting, Stage, UNLISTED};

use crate::{Candidate, FourNumbers};

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
    /// Share of what exceeds the declared model's expectation that it explains.
    pub share: f64,
    /// Probability of what remains by chance.
    pub remainder_p: f64,
    /// What remains, as laps tell it.
    pub remainder: Option<FourNumbers>,
}

impl Explanation {
    /// The effects as the simulator takes them.
    pub fn settings(&self) -> Vec<Setting> {
        self.effects.iter().map(|effect| effect.setting.clone()).collect()
    }

    /// The effects' names.
    pub fn names(&self) -> Vec<&'static str> {
        self.effects
            .iter()
            .map(|effect| effect.setting.spec.name)
            .collect()
    }

    /// What the effects are, for a reader.
    pub fn label(&self) -> String {
        let labels: Vec<String> = self.effects.iter().map(Candidate::label).collect();
        labels.join(" + ")
    }
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
            "camera x" | "camera y" => Stage::Observe,
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

    /// The effects that are claimed, as the simulator takes them.
    pub fn settings(&self) -> Vec<Setting> {
        self.claimed().map(Explanation::settings).unwrap_or_default()
    }
}
