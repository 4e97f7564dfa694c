//! What an experiment hands over: a section of the report, files, and its part of `tables.json`.

use chart::Figure;
use serde_json::{Value, json};

use super::estimate::Tally;
use crate::table::Table;

/// What came of an experiment.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    pub(crate) section: Section,
    /// Name and text of each CSV.
    pub(crate) csv: Vec<(&'static str, String)>,
    /// Keys of `tables.json` with their values.
    pub(crate) json: Vec<(&'static str, Value)>,
}

/// A section of the report.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    pub(crate) heading: String,
    pub(crate) blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Debug, Clone)]
pub(crate) enum Block {
    /// Begins a part of the section.
    Heading(String),
    Text(String),
    /// As it stands, in a fixed pitch.
    Code(String),
    Table(Table),
    Picture(Box<Picture>),
    Claims(Vec<Claim>),
    /// A figure that stays in a file of its own, because a clock measured it and the page must not depend on that.
    Linked {
        /// Its path from the page.
        path: String,
        caption: String,
    },
}

/// A numbered figure.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    /// Its file's name without the ending.
    pub(crate) file: String,
    /// `Fig. 10`: the paper's numbers, letters for figures that the paper does not have.
    pub(crate) number: String,
    pub(crate) caption: String,
    pub(crate) figure: Figure,
}

impl Picture {
    /// The figure as a block; its first sentence is the picture's title too.
    pub(crate) fn block(
        file: impl Into<String>,
        number: impl Into<String>,
        caption: impl Into<String>,
        figure: Figure,
    ) -> Block {
        Block::Picture(Box::new(Self {
            file: file.into(),
            number: number.into(),
            caption: caption.into(),
            figure,
        }))
    }
}

/// A sentence of section IV and whether it holds here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Claim {
    pub(crate) claim: String,
    /// The paper's numbers for it.
    pub(crate) paper: String,
    /// Ours.
    pub(crate) here: String,
    pub(crate) holds: bool,
}

impl Claim {
    pub(crate) fn new(
        claim: impl Into<String>,
        paper: impl Into<String>,
        here: impl Into<String>,
        holds: bool,
    ) -> Self {
        Self {
            claim: claim.into(),
            paper: paper.into(),
            here: here.into(),
            holds,
        }
    }

    /// A claim that holds if it does in at least 95 % of the draws.
    pub(crate) fn counted(
        claim: impl Into<String>,
        paper: impl Into<String>,
        here: &str,
        tally: Tally,
    ) -> Self {
        Self::new(claim, paper, format!("{here}; so in {tally}"), tally.holds())
    }

    pub(crate) fn json(&self) -> Value {
        json!({ "claim": self.claim, "paper": self.paper, "here": self.here, "holds": self.holds })
    }

    /// The verdict in words.
    pub(crate) fn verdict(&self) -> &'static str {
        if self.holds { "holds" } else { "does not hold" }
    }
}

impl Section {
    /// The claims of the section.
    pub(crate) fn claims(&self) -> impl Iterator<Item = &Claim> {
        self.blocks
            .iter()
            .filter_map(|block| {
                if let Block::Claims(claims) = block {
                    Some(claims)
                } else {
                    None
                }
            })
            .flatten()
    }

    /// The tables of the section.
    pub(crate) fn tables(&self) -> impl Iterator<Item = &Table> {
        self.blocks.iter().filter_map(|block| {
            if let Block::Table(table) = block {
                Some(table)
            } else {
                None
            }
        })
    }

    /// The figures of the section.
    pub(crate) fn pictures(&self) -> impl Iterator<Item = &Picture> {
        self.blocks.iter().filter_map(|block| {
            if let Block::Picture(picture) = block {
                Some(&**picture)
            } else {
                None
            }
        })
    }
}
