//! An effect with the values of its parameters, constant, by run or by time.

use super::unlisted::unlisted_depends_on_time;
use super::{EFFECTS, Effect, Param, Spec, UNLISTED};
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

impl Pattern {
    /// Its numbers in a row: run after run, or values at the start and then their changes per second.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Constant(values) => values.clone(),
            Self::ByRun(runs) => runs.concat(),
            Self::ByTime { start, per_s } => [start.as_slice(), per_s].concat(),
        }
    }

    /// The pattern with one of these numbers, which must be there, moved.
    #[must_use]
    pub fn moved(&self, place: usize, by: f64) -> Self {
        let mut moved = self.clone();
        let number = match &mut moved {
            Self::Constant(values) => values.get_mut(place),
            Self::ByRun(runs) => runs.iter_mut().flatten().nth(place),
            Self::ByTime { start, per_s } => start.iter_mut().chain(per_s).nth(place),
        };
        *number.expect("a pattern has this number") += by;
        moved
    }
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
    /// The parameter of one of the pattern's [numbers](Pattern::numbers), by its place among them; `None` of a change per second.
    pub fn param(&self, place: usize) -> Option<&'static Param> {
        let spec: &'static Spec = self.spec;
        match &self.pattern {
            Pattern::Constant(_) => spec.param(place),
            Pattern::ByRun(runs) => spec.param(place % runs.first()?.len().max(1)),
            Pattern::ByTime { start, .. } if place >= start.len() => None,
            Pattern::ByTime { .. } => spec.param(place),
        }
    }

    /// Whether it has values of its own for each run.
    pub fn goes_by_run(&self) -> bool {
        matches!(self.pattern, Pattern::ByRun(_))
    }

    /// Whether its size changes in the course of each run.
    pub fn goes_by_time(&self) -> bool {
        matches!(self.pattern, Pattern::ByTime { .. })
    }

    /// An effect with the same values always.
    pub fn constant(spec: &'static Spec, values: impl Into<Vec<f64>>) -> Self {
        Self {
            spec,
            pattern: Pattern::Constant(values.into()),
        }
    }

    /// The values at the start of a run and their change per second; `index` is the place in the list of effects.
    ///
    /// # Errors
    /// A run beyond the list of a pattern by run.
    pub fn values(&self, index: usize, run: usize) -> Result<(&[f64], Option<&[f64]>), Error> {
        match &self.pattern {
            Pattern::Constant(values) => Ok((values, None)),
            Pattern::ByTime { start, per_s } => Ok((start, Some(per_s))),
            Pattern::ByRun(runs) => {
                let count = runs.len();
                runs.get(run)
                    .map(|values| (values.as_slice(), None))
                    .ok_or(Error::Invalid {
                        key: format!("effect.{index}.by"),
                        reason: format!(
                            "{} has values by run for {count} of them, and there are more; give as many values, or drive {count}",
                            self.spec.name,
                        ),
                    })
            }
        }
    }

    /// Nothing, if there is a value for every parameter and each is in its range. `index` is the place in the list
    /// of effects.
    ///
    /// # Errors
    /// The first value that is missing, out of range or not whole where only whole numbers mean something.
    pub fn check(&self, index: usize) -> Result<(), Error> {
        match &self.pattern {
            Pattern::Constant(values) => self.check_values(index, values),
            Pattern::ByRun(runs) => runs
                .iter()
                .try_for_each(|values| self.check_values(index, values)),
            Pattern::ByTime { start, per_s } => {
                self.check_values(index, start)?;
                self.check_count(index, per_s)?;
                self.params().zip(per_s).try_for_each(|(param, &slope)| {
                    check(&format!("effect.{index}.{}_per_s", param.name), slope, -1e6, 1e6)
                })
            }
        }
    }

    /// Whether what it does changes in the course of a run: where the run starts then tells in every lap.
    pub fn depends_on_time(&self) -> bool {
        let unlisted = |values: &Vec<f64>| *self.spec == UNLISTED && unlisted_depends_on_time(values);
        self.spec.drifts()
            || match &self.pattern {
                Pattern::Constant(values) => unlisted(values),
                Pattern::ByRun(runs) => runs.iter().any(unlisted),
                Pattern::ByTime { .. } => true,
            }
    }

    /// Whether it does the same in every run, wherever the run starts.
    pub fn same_in_every_run(&self) -> bool {
        !matches!(self.pattern, Pattern::ByRun(_)) && !self.depends_on_time()
    }

    /// The parameter of each value, for ever where the last is a list.
    pub(crate) fn params(&self) -> impl Iterator<Item = &'static Param> {
        let list = self.spec.list.iter().cycle();
        self.spec.params.iter().chain(list)
    }

    fn check_values(&self, index: usize, values: &[f64]) -> Result<(), Error> {
        self.check_count(index, values)?;
        self.params().zip(values).try_for_each(|(param, &value)| {
            let key = format!("effect.{index}.{}", param.name);
            check(&key, value, param.low, param.high)?;
            if param.whole && value.fract() != 0.0 {
                let reason = format!("{value} given, a whole number expected");
                return Err(Error::Invalid { key, reason });
            }
            Ok(())
        })
    }

    fn check_count(&self, index: usize, values: &[f64]) -> Result<(), Error> {
        let (needed, given) = (self.spec.params.len(), values.len());
        if given == needed || given > needed && self.spec.list.is_some() {
            return Ok(());
        }
        let reason = format!("{} needs {needed} values, not {given}", self.spec.name);
        Err(Error::Invalid {
            key: format!("effect.{index}"),
            reason,
        })
    }

    /// The place of the effect in the signal's way through the robot; an effect outside the registry comes last.
    pub(crate) fn order(&self) -> usize {
        EFFECTS
            .iter()
            .position(|spec| spec == self.spec)
            .unwrap_or(EFFECTS.len())
    }
}

/// An effect at work in one run.
#[derive(Debug)]
pub(crate) struct Active {
    pub(crate) values: Vec<f64>,
    start: Vec<f64>,
    per_s: Option<Vec<f64>>,
    params: Vec<&'static Param>,
    pub(crate) effect: Box<dyn Effect>,
}

impl Active {
    /// The effects of one run in the order in which they act.
    pub(crate) fn all(settings: &[Setting], run: usize) -> Result<Vec<Self>, Error> {
        let mut ordered: Vec<(usize, &Setting)> = settings.iter().enumerate().collect();
        ordered.sort_by_key(|(_, setting)| setting.order());
        ordered
            .into_iter()
            .map(|(index, setting)| Self::new(index, setting, run))
            .collect()
    }

    fn new(index: usize, setting: &Setting, run: usize) -> Result<Self, Error> {
        let (start, per_s) = setting.values(index, run)?;
        Ok(Self {
            values: start.to_vec(),
            start: start.to_vec(),
            per_s: per_s.map(<[f64]>::to_vec),
            params: setting.params().take(start.len()).collect(),
            effect: (setting.spec.build)(),
        })
    }

    /// Whether the values change in time.
    pub(crate) fn drifts(&self) -> bool {
        self.per_s.is_some()
    }

    /// Moves the values to a time since the run began; each stops at the end of its parameter's range.
    pub(crate) fn advance(&mut self, time_s: f64) {
        let Some(per_s) = &self.per_s else { return };
        for (i, param) in self.params.iter().enumerate() {
            let value = (self.start[i] + per_s[i] * time_s).clamp(param.low, param.high);
            self.values[i] = if param.whole { value.round() } else { value };
        }
    }
}
