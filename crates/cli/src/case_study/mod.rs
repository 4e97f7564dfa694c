//! The last part of `lapwing reproduce`: what the declared model lacks in the measured laps, and what it is worth.

mod causes;

use anyhow::{Result, bail};
use serde_json::{Value, json};

use crate::config::{ControllerKind, ModelFile, ModelSource};
use crate::dataset::DataSet;
use crate::experiments::{BeforeAfter, Block, Section, Study, runs_per_draw, tables};
use crate::interrupt::{self, Interrupted};
use crate::session::Session;
use crate::trace::{Cache, Trace, digest, document, summary};
use causes::Finding;

/// What the model lacks by the laps of both controllers.
#[derive(Debug)]
pub(crate) struct CaseStudy {
    /// Of the Braitenberg and of the rule-based controller.
    traced: [Traced; 2],
    /// Tables II and III with the effects of the Braitenberg robot, or why they are not made.
    tables: Result<[BeforeAfter; 2], String>,
    causes: Vec<Finding>,
    /// Whether all laps are those that come with the program.
    shipped: bool,
}

/// The laps of one controller, traced.
#[derive(Debug)]
struct Traced {
    controller: ControllerKind,
    /// The trace, or why there is none.
    trace: Result<Box<Trace>, String>,
}

impl CaseStudy {
    /// Traces the measured laps of both controllers, then makes Tables II and III with what was found.
    ///
    /// # Errors
    /// An interrupt: what cannot be traced is told in the section.
    pub(crate) fn new(session: &Session, study: &Study, cache: &Cache) -> Result<Self> {
        let sets = [&study.measured.braitenberg.set, &study.measured.rule_based.set];
        let traced = [
            Traced::new(session, ControllerKind::Braitenberg, sets[0], cache)?,
            Traced::new(session, ControllerKind::RuleBased, sets[1], cache)?,
        ];
        Ok(Self {
            tables: unless_interrupted(again(session, study, &traced[0]))?,
            causes: causes::find(&traced.each_ref().map(|traced| (traced.name(), traced.found()))),
            shipped: sets.into_iter().all(DataSet::is_shipped),
            traced,
        })
    }

    /// The last section of the report.
    pub(crate) fn section(&self) -> Section {
        let mut blocks = vec![Block::Text(self.lead())];
        for traced in &self.traced {
            blocks.push(Block::Heading(format!("{} robot", traced.title())));
            blocks.extend(traced.blocks());
        }
        blocks.push(Block::Heading("Tables II and III before and after".into()));
        match &self.tables {
            Err(why) => blocks.push(Block::Text(format!("The tables are not made again: {why}."))),
            Ok(tables) => {
                blocks.push(Block::Text(EFFECTS_ADDED.into()));
                for table in tables {
                    blocks.push(Block::Table(table.table()));
                    blocks.push(Block::Text(table.sentence()));
                }
            }
        }
        blocks.push(Block::Heading("The causes that the paper names".into()));
        blocks.push(Block::Text(CAUSES.into()));
        blocks.push(Block::Table(causes::table(
            &self.causes,
            self.traced.each_ref().map(Traced::title),
        )));
        blocks.push(Block::Text(self.caveat().into()));
        Section {
            heading: "What the model lacks".into(),
            blocks,
        }
    }

    fn lead(&self) -> String {
        format!(
            "The paper measures how far a simulation is from the robot and leaves open why. Here the measured laps of each \
             controller are traced to the effects that the declared model lacks, as by `lapwing trace`; what is found is \
             added to the model, and the tables of the paper are made again. {}",
            self.caveat()
        )
    }

    /// What must not be concluded.
    fn caveat(&self) -> &'static str {
        if self.shipped {
            "The measured laps are generated: nothing is concluded about the paper's robot."
        } else {
            "The measured laps are not the paper's: nothing is concluded about its robot."
        }
    }

    /// `trace` of `tables.json`.
    pub(crate) fn json(&self) -> Value {
        let of = |which: usize| match &self.tables {
            Ok(tables) => (tables[which].after.json(), tables[which].changes_json()),
            Err(_) => (Value::Null, Value::Null),
        };
        let [(table_ii, changes_ii), (table_iii, changes_iii)] = [of(0), of(1)];
        json!({
            "braitenberg": self.traced[0].json(), "rule_based": self.traced[1].json(),
            "table_ii_after": table_ii, "table_iii_after": table_iii,
            "changes": { "table_ii": changes_ii, "table_iii": changes_iii },
            "not_made": self.tables.as_ref().err(),
            "causes": self.causes.iter().map(Finding::json).collect::<Vec<_>>(),
        })
    }

    /// Further files: the models with the effects, and the tables.
    pub(crate) fn files(&self) -> Vec<(String, String)> {
        let models = self.traced.iter().filter_map(|traced| {
            let trace = traced.found()?;
            Some((
                format!("{}.after.toml", traced.name()),
                trace.after_config().to_toml(),
            ))
        });
        let names = ["table_ii_after.csv", "table_iii_after.csv"];
        let tables = self.tables.iter().flatten().zip(names);
        models
            .chain(tables.map(|(table, name)| (name.to_owned(), table.after.csv())))
            .collect()
    }

    /// What is printed.
    pub(crate) fn text(&self) -> String {
        let mut text = String::from("What the model lacks\n");
        for traced in &self.traced {
            text += &format!("{} robot: {}\n", traced.title(), traced.summary());
        }
        match &self.tables {
            Err(why) => text += &format!("Tables II and III are not made again: {why}.\n"),
            Ok(tables) => {
                for table in tables {
                    text += &format!("\n{}{}\n", table.table().to_text(), table.sentence());
                }
            }
        }
        text += "\nThe causes that section IV-C names\n";
        text.extend(self.causes.iter().map(Finding::text));
        text + self.caveat() + "\n"
    }
}

const EFFECTS_ADDED: &str = "The simulations of Tables II and III once more, with the effects of the Braitenberg robot's \
    trace added to the model; all else, the random numbers included, is as before. Where an effect goes by run, each \
    measured run is compared with simulations that have its value. A distance of eq. 8 is in units of the clusters' \
    scatter, so an effect that widens the simulated cluster shrinks it too; the error of the mean lap above does not \
    depend on that.";

const CAUSES: &str = "Section IV-C names what the paper's simulation leaves out. Each of these causes stands here with the \
    effects that lapwing knows for it and with what the traces say: it is in the answer, with its size and 95 % interval; \
    or it was tried, and how far its score (log-likelihood gained less the price of the fitted numbers) stays behind the \
    answer's; or nothing departs from the model, and it is not seen; or the search did not come to it (not tried), which says \
    nothing about it.";

/// Tables II and III with what the trace of the Braitenberg robot claims.
fn again(session: &Session, study: &Study, traced: &Traced) -> Result<[BeforeAfter; 2]> {
    let Some(trace) = traced.found() else {
        bail!("the laps of the Braitenberg robot are not traced");
    };
    let effects = trace.answer.settings();
    if effects.is_empty() {
        bail!("no effect is claimed for the Braitenberg robot, so nothing is added to the model");
    }
    let total = study.draws.len() * runs_per_draw(study, &effects);
    let progress = session.progress("driving with the effects", total as u64);
    tables(study, session.seed(), &effects, &progress)
}

/// A result whose error is a reason to tell, unless it is an interrupt.
fn unless_interrupted<T>(result: Result<T>) -> Result<Result<T, String>> {
    interrupt::check()?;
    match result {
        Err(error) if error.is::<Interrupted>() => Err(error),
        other => Ok(other.map_err(|error| format!("{error:#}"))),
    }
}

impl Traced {
    fn new(session: &Session, controller: ControllerKind, set: &DataSet, cache: &Cache) -> Result<Self> {
        let trace = || -> Result<Box<Trace>> {
            let kind = format!("controller.kind={}", controller.name());
            let file = ModelFile::load(ModelSource::Embedded, &[kind])?;
            let world = set.world_source(None)?.path;
            let trace = Trace::new(session, &file, world.as_deref(), vec![set.clone()], None, cache)?;
            Ok(Box::new(trace))
        };
        Ok(Self {
            controller,
            trace: unless_interrupted(trace())?,
        })
    }

    fn found(&self) -> Option<&Trace> {
        self.trace.as_deref().ok()
    }

    /// In files and keys.
    fn name(&self) -> &'static str {
        match self.controller {
            ControllerKind::Braitenberg => "braitenberg",
            ControllerKind::RuleBased => "rule_based",
        }
    }

    /// In sentences.
    fn title(&self) -> &'static str {
        match self.controller {
            ControllerKind::Braitenberg => "Braitenberg",
            ControllerKind::RuleBased => "Rule-based",
        }
    }

    fn summary(&self) -> String {
        match &self.trace {
            Ok(trace) => summary(trace),
            Err(why) => format!("these laps cannot be traced: {why}."),
        }
    }

    /// The diagnosis; its figures are named after the controller, since there are two of each.
    fn blocks(&self) -> Vec<Block> {
        let trace = match &self.trace {
            Ok(trace) => trace,
            Err(why) => return vec![Block::Text(format!("These laps cannot be traced: {why}."))],
        };
        let mut blocks = digest(trace);
        let letter = match self.controller {
            ControllerKind::Braitenberg => "T",
            ControllerKind::RuleBased => "U",
        };
        let pictures = blocks.iter_mut().filter_map(|block| match block {
            Block::Picture(picture) => Some(picture),
            _ => None,
        });
        for (place, picture) in (1..).zip(pictures) {
            picture.file = format!("trace_{}_{}", self.name(), picture.file);
            picture.number = format!("Fig. {letter}{place}");
        }
        blocks
    }

    fn json(&self) -> Value {
        match &self.trace {
            Ok(trace) => document(trace),
            Err(why) => json!({ "not_traced": why }),
        }
    }
}
