//! Data sets of our own making, in the proportions of the practice sets.
//!
//! They come from the simulator that the answers come from, so they judge the method and not the simulator.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::Value as Json;
use sim::{Stream, Streams};
use toml::{Table, Value};

use crate::classes::are_one;
use crate::further;
use crate::labels::{self, Controller, Kind, Label, Level, Set, Truth};
use crate::program::{Drive, Lapwing};
use crate::recipes::{BY_RUN, RECIPES, Recipe};
use crate::robot::{self, Recording};
use crate::undeclared;

const RUNS: usize = 4;

/// Attempts to draw a robot that finishes its laps, each with smaller sizes.
const ATTEMPTS: i32 = 12;
const SHRINK: f64 = 0.8;

/// What a set is to be. It depends on the seed and on the set's number alone, so that more sets add to those that are there.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plan {
    kind: Kind,
    by_run: bool,
    level: Level,
    controller: Controller,
    /// How many sets of this kind came before.
    nth: usize,
}

/// A sequence of sets to be drawn.
#[derive(Debug)]
pub(crate) struct Sequence {
    /// Its sets are in the folder `NAME-SEED`.
    pub(crate) name: &'static str,
    /// With what its sets' names begin.
    initial: char,
    /// The effects of no list in it.
    kinds: &'static [undeclared::Kind],
    plans: fn(usize) -> Vec<Plan>,
}

/// In the proportions of the practice sets.
pub(crate) static FRESH: Sequence = Sequence {
    name: "fresh",
    initial: 'f',
    kinds: &undeclared::KINDS,
    plans,
};

/// Effects of no list of further kinds.
pub(crate) static FURTHER: Sequence = Sequence {
    name: "further",
    initial: 'u',
    kinds: &further::KINDS,
    plans: further_plans,
};

/// The first `count` sets of a seed that are wanted; those that are not on disk are driven.
///
/// # Errors
/// A model that the program refuses, a file that cannot be written.
pub(crate) fn sets(
    lapwing: &Lapwing,
    sequence: &Sequence,
    seed: u64,
    count: u64,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Vec<Set>> {
    let folder = lapwing.out.join(format!("{}-{seed}", sequence.name));
    let mut deck = Deck::new(seed);
    fs::create_dir_all(&folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    let mut sets = Vec::new();
    for (number, plan) in (sequence.plans)(count as usize).into_iter().enumerate() {
        let recipes = deck.take(plan);
        let name = format!("{}{seed}-{number:03}", sequence.initial);
        if !wanted(&name) {
            continue;
        }
        let place = folder.join(&name);
        let known = labels::read(&place)
            .ok()
            .and_then(|mut kept| kept.pop())
            .map(|kept| kept.label);
        let label = match known {
            Some(label) => label,
            None => {
                let streams = Streams {
                    seed,
                    run: number as u64,
                };
                let kind = &sequence.kinds[plan.nth % sequence.kinds.len()];
                made(lapwing, streams, plan, &recipes, kind, &name, &place)?
            }
        };
        sets.push(Set { label, folder: place });
    }
    if sets.len() as u64 == count {
        labels::write(&folder, sets.iter().map(|set| &set.label))?;
    }
    Ok(sets)
}

/// Kinds by a sequence that fills every share evenly from the start; levels and controllers by turns within each kind.
fn plans(count: usize) -> Vec<Plan> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    /// Upper ends of the shares.
    const SHARES: [(f64, Kind, bool); 5] = [
        (0.10, Kind::Null, false),
        (0.80, Kind::Single, false),
        (0.88, Kind::Pair, false),
        (0.91, Kind::Single, true),
        (1.0, Kind::Outside, false),
    ];
    let mut seen = [0; SHARES.len()];
    let plan = |number: usize| {
        let u = (0.3 + GOLDEN * number as f64).fract();
        let share = SHARES.iter().position(|share| u < share.0).unwrap_or(0);
        let (_, kind, by_run) = SHARES[share];
        let nth = seen[share];
        seen[share] += 1;
        // As in the practice sets, pairs and sizes that go by run are seen by the camera alone.
        let logged = nth % 4 == 3 && kind != Kind::Pair && !by_run;
        Plan {
            kind,
            by_run,
            level: if logged { Level::L2 } else { Level::L1 },
            controller: if (nth + nth / 4) % 4 == 1 {
                Controller::RuleBased
            } else {
                Controller::Braitenberg
            },
            nth,
        }
    };
    (0..count).map(plan).collect()
}

/// Every kind of effect of no list by laps of both robots, then by logs, in turn.
fn further_plans(count: usize) -> Vec<Plan> {
    let plan = |number: usize| {
        let (round, place) = (number / further::KINDS.len(), number % further::KINDS.len());
        Plan {
            kind: Kind::Outside,
            by_run: false,
            level: if round % 3 == 2 { Level::L2 } else { Level::L1 },
            controller: if (round + place) % 2 == 1 {
                Controller::RuleBased
            } else {
                Controller::Braitenberg
            },
            nth: number,
        }
    };
    (0..count).map(plan).collect()
}

/// Every recipe once, shuffled; then again.
struct Deck {
    cards: Vec<Recipe>,
    stream: Stream,
}

impl Deck {
    fn new(seed: u64) -> Self {
        let stream = Streams { seed, run: u64::MAX }.open("battery deck");
        let cards = Vec::new();
        Self { cards, stream }
    }

    /// The next recipe that can act.
    fn next(&mut self, controller: Controller, others: &[Recipe]) -> Recipe {
        // The rule-based controller never commands so slowly.
        let acts = |recipe: &Recipe| controller == Controller::Braitenberg || recipe.name != "dead-band";
        // As in the practice sets, two effects are in two stages, and are seen by the camera alone: it must know them for two.
        let stage = |recipe: &Recipe| sim::find(recipe.name).map(|spec| spec.stage).ok();
        let one = |a: &Recipe, b: &Recipe| are_one(Level::L1, controller, a.name, b.name);
        let other = |recipe: &Recipe| {
            (others.iter()).all(|other| stage(other) != stage(recipe) && !one(other, recipe))
        };
        loop {
            if let Some(at) = self
                .cards
                .iter()
                .rposition(|recipe| acts(recipe) && other(recipe))
            {
                return self.cards.remove(at);
            }
            let mut fresh = RECIPES.to_vec();
            for last in (1..fresh.len()).rev() {
                fresh.swap(last, self.stream.index(last + 1));
            }
            self.cards.splice(0..0, fresh);
        }
    }

    fn take(&mut self, plan: Plan) -> Vec<Recipe> {
        let count = match plan.kind {
            Kind::Null | Kind::Outside => 0,
            Kind::Single if plan.by_run => return vec![BY_RUN[plan.nth % BY_RUN.len()]],
            Kind::Single => 1,
            Kind::Pair => 2,
        };
        let mut taken = Vec::new();
        for _ in 0..count {
            taken.push(self.next(plan.controller, &taken));
        }
        taken
    }
}

/// Drives one set, with ever smaller effects until the robot finishes its laps.
fn made(
    lapwing: &Lapwing,
    streams: Streams,
    plan: Plan,
    recipes: &[Recipe],
    kind: &undeclared::Kind,
    name: &str,
    place: &Path,
) -> Result<Label> {
    let mut stream = streams.open("battery set");
    let laps = if plan.level == Level::L1 { 20 } else { 5 };
    for attempt in 0..ATTEMPTS {
        let shrink = SHRINK.powi(attempt);
        // Far from the seeds that a user's drives and fits have.
        let drive_seed = (1 << 32) + (streams.seed << 20) + (streams.run << 4) + attempt as u64;
        let mut label = Label {
            name: name.to_owned(),
            level: plan.level,
            kind: plan.kind,
            controller: plan.controller,
            effects: Vec::new(),
            by_run: plan.by_run,
            stages: Vec::new(),
            parameters: Vec::new(),
        };
        let finished = if plan.kind == Kind::Outside {
            let scene = robot::scene()?;
            let draw = undeclared::Draw {
                circuit: scene.circuit(),
                stream: &mut stream,
                shrink,
            };
            let cause = undeclared::Cause::draw(kind, draw);
            label.effects.push(cause.setting.spec.name.to_owned());
            label.stages.push(cause.setting.spec.stage.name().to_owned());
            label.parameters = cause.parameters();
            let recording = Recording {
                laps,
                seed: drive_seed,
            };
            robot::record(&scene, &cause.setting, &label, recording, place)?
        } else {
            let tables: Vec<Table> = (recipes.iter())
                .map(|recipe| match plan.by_run {
                    true => recipe.draw_by_run(&mut stream, RUNS),
                    false => recipe.draw(&mut stream, shrink),
                })
                .collect();
            for table in &tables {
                describe(table, &mut label)?;
            }
            let model = lapwing.model_file(plan.controller, tables, name)?;
            let drive = Drive {
                runs: RUNS,
                laps,
                log: plan.level == Level::L2,
                seed: drive_seed,
            };
            finished(&lapwing.drive(&model, drive, place)?)
        };
        if finished {
            labels::write(place, std::iter::once(&label))?;
            return Ok(label);
        }
    }
    bail!("{name}: the robot never finishes its laps");
}

/// Puts an effect's table into the label.
fn describe(table: &Table, label: &mut Label) -> Result<()> {
    let name = (table.get("kind").and_then(Value::as_str)).context("an effect has a name")?;
    label.effects.push(name.to_owned());
    label.stages.push(sim::find(name)?.stage.name().to_owned());
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|n| n as f64));
    for (key, value) in table
        .iter()
        .filter(|(key, _)| !["kind", "by"].contains(&key.as_str()))
    {
        let truth = match value {
            Value::Array(list) => Truth::ByRun(list.iter().filter_map(number).collect()),
            Value::String(word) => Truth::Word(word.clone()),
            other => Truth::Number(number(other).context("a size is a number")?),
        };
        label.parameters.push((key.clone(), truth));
    }
    Ok(())
}

/// Whether every run has all its laps.
fn finished(summary: &Json) -> bool {
    let runs = summary["runs"].as_array();
    let whole = |run: &Json| run["laps"] == run["wanted"] && run["timed_out"] == false;
    runs.is_some_and(|runs| runs.iter().all(whole))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proportions_are_those_asked_for_and_more_sets_change_nothing() {
        let all = plans(200);
        assert_eq!(&all[..60], &plans(60)[..]);
        let count = |test: &dyn Fn(&Plan) -> bool| all.iter().filter(|plan| test(plan)).count();
        let shares = [
            (count(&|plan| plan.kind == Kind::Null), 20),
            (count(&|plan| plan.kind == Kind::Single && !plan.by_run), 140),
            (count(&|plan| plan.kind == Kind::Pair), 16),
            (count(&|plan| plan.by_run), 6),
            (count(&|plan| plan.kind == Kind::Outside), 18),
        ];
        for (found, expected) in shares {
            assert!(usize::abs_diff(found, expected) <= 1, "{shares:?}");
        }
        let logged = count(&|plan| plan.level == Level::L2);
        let rule_based = count(&|plan| plan.controller == Controller::RuleBased);
        assert!((40..=50).contains(&logged), "{logged} of 200 with a log");
        assert!((45..=55).contains(&rule_based), "{rule_based} of 200 rule-based");
    }

    #[test]
    fn every_further_kind_is_seen_by_laps_of_both_robots_and_by_a_log() {
        let kinds = further::KINDS.len();
        let all = further_plans(3 * kinds);
        for kind in 0..kinds {
            let own: Vec<&Plan> = all.iter().filter(|plan| plan.nth % kinds == kind).collect();
            let levels: Vec<Level> = own.iter().map(|plan| plan.level).collect();
            assert_eq!(levels, [Level::L1, Level::L1, Level::L2]);
            assert_ne!(own[0].controller, own[1].controller);
        }
    }

    #[test]
    fn a_deck_holds_every_recipe_once() {
        let mut deck = Deck::new(3);
        let mut names: Vec<&str> = (0..RECIPES.len())
            .map(|_| deck.next(Controller::Braitenberg, &[]).name)
            .collect();
        names.sort_unstable();
        let mut all: Vec<&str> = RECIPES.iter().map(|recipe| recipe.name).collect();
        all.sort_unstable();
        assert_eq!(names, all);
    }

    #[test]
    fn pairs_are_two_effects_to_the_data() {
        for seed in 0..20 {
            let mut deck = Deck::new(seed);
            for plan in plans(200).into_iter().filter(|plan| plan.kind == Kind::Pair) {
                let pair = deck.take(plan);
                let [a, b] = [pair[0].name, pair[1].name];
                assert!(!are_one(plan.level, plan.controller, a, b), "{a} + {b}");
            }
        }
    }
}
