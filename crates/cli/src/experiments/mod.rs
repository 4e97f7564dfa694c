//! The experiments of section IV of the paper, one file each: a function from the [`Study`] to an [`Outcome`].

mod combined;
mod comparison;
mod controllers;
mod course;
mod distances;
mod estimate;
mod mean_lap;
mod outcome;
mod published;
mod slip;
mod study;
mod table_ii;
mod table_iii;
mod with_effects;

pub(crate) use comparison::Comparison;
pub(crate) use estimate::Estimate;
pub(crate) use outcome::{Block, Claim, Outcome, Picture, Section};
pub(crate) use study::{Measurements, Study};
pub(crate) use with_effects::{BeforeAfter, runs_per_draw, tables};

/// An experiment of the paper.
pub(crate) type Experiment = fn(&Study) -> anyhow::Result<Outcome>;

/// All experiments, in the order of the paper.
pub(crate) const EXPERIMENTS: [Experiment; 6] = [
    course::outcome,
    controllers::outcome,
    table_ii::outcome,
    table_iii::outcome,
    slip::outcome,
    combined::outcome,
];
