//! An effect with the values of its parameters, constant, by run or by time.

use super::{EFFECTS, Effect, Spec};
use crate::Error;
use crate::sensor::check;

/// How the values of an effect's parameters go over the runs of a data set.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    /// The same values always.
    Constant(Vec<f64>),
    /// One list of values for each run, in the order of the runs.
    ByRun(Vec<Vec<f64>>),
    /// Values at the run's start and their change per second.
    ByTime {
        /// Values at the run's start.
        start: Vec<f64>,
        /// Change of each, per second.
        per_s: Vec<f64>,
    },
}

/// An effect with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Which effect.
    pub spec: &'static Spec,
    /// Its values.
    pub pattern: Pattern,
}

impl Setting {
    /// An effect with the same values always.
    pub fn constant(spec: &'static Spec, values: impl Into<Vec<f64>>) -> Self {
        Self { spec, pattern: Pattern::Constant(values.into()) }
    }

    /// The values at the start of a run and their change per second.
    ///
    /// # Errors
    /// A run beyond the list of a pattern by run.
    pub fn values(&self, run: usize) -> Result<(&[f64], Option<&[f64]>), Error> {
        match &self.pattern {
            Pattern::Constant(values) => Ok((values, None)),
            Pattern::ByTime { start, per_s } => Ok((start, Some(per_s))),
            Pattern::ByRun(runs) => runs.get(run).map(|values| (values.as_slice(), None)).ok_or(Error::Invalid {
                key: format!("effect.{}", self.spec.name),
                reason: format!("has values for {} runs and is asked for run {}", runs.len(), run + 1),
            }),
        }
    }

    /// Nothing, if every value is in its parameter's range. `index` is the place in the list of effects.
    ///
    /// # Errors
    /// The first value that is not.
    pub fn check(&self, index: usize) -> Result<(), Error> {
        let lists: Vec<&Vec<f64>> = match &self.pattern {
            Pattern::Constant(values) | Pattern::ByTime { start: values, .. } => vec![values],
            Pattern::ByRun(runs) => runs.iter().collect(),
        };
        for values in lists {
            for (param, &value) in self.spec.params.iter().zip(values) {
                check(&format!("effect.{index}.{}", param.name), value, param.low, param.high)?;
            }
        }
        if let Pattern::ByTime { per_s, .. } = &self.pattern {
            for (param, &value) in self.spec.params.iter().zip(per_s) {
                check(&format!("effect.{index}.{}_per_s", param.name), value, -1e6, 1e6)?;
            }
        }
        Ok(())
    }

    /// The place of the effect in the signal's way through the robot; an effect outside the registry comes last.
    pub(crate) fn order(&self) -> usize {
        EFFECTS.iter().position(|spec| spec == self.spec).unwrap_or(EFFECTS.len())
    }
}

/// An effect at work in one run.
#[derive(Debug)]
pub(crate) struct Active {
    pub(crate) values: Vec<f64>,
    start: Vec<f64>,
    per_s: Option<Vec<f64>>,
    pub(crate) effect: Box<dyn Effect>,
}

impl Active {
    /// The effects of one run in the order in which they act.
    pub(crate) fn all(settings: &[Setting], run: usize) -> Result<Vec<Self>, Error> {
        let mut ordered: Vec<&Setting> = settings.iter().collect();
        ordered.sort_by_key(|setting| setting.order());
        ordered.into_iter().map(|setting| Self::new(setting, run)).collect()
    }

    fn new(setting: &Setting, run: usize) -> Result<Self, Error> {
        let (start, per_s) = setting.values(run)?;
        Ok(Self {
            values: start.to_vec(),
            start: start.to_vec(),
            per_s: per_s.map(<[f64]>::to_vec),
            effect: (setting.spec.build)(),
        })
    }

    /// Whether the values change in time.
    pub(crate) fn drifts(&self) -> bool {
        self.per_s.is_some()
    }

    /// Moves the values to a time since the run began.
    pub(crate) fn advance(&mut self, time_s: f64) {
        if let Some(per_s) = &self.per_s {
            for ((value, start), slope) in self.values.iter_mut().zip(&self.start).zip(per_s) {
                *value = start + slope * time_s;
            }
        }
    }
}
