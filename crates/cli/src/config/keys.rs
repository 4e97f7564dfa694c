//! Keys and types of a model's table, checked against the shipped one, which has them all.

use std::sync::LazyLock;

use toml::{Table, Value};

use super::{Combine, ControllerKind, Direction, MODEL, Pattern, SensorKind};

/// What is wrong with a key; who knows the file adds the line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub(crate) struct Fault {
    /// Dotted, with indices of arrays: `effect.0.gain`.
    pub(crate) key: String,
    pub(crate) problem: String,
}

impl Fault {
    fn new(key: &str, problem: String) -> Self {
        Self {
            key: key.to_owned(),
            problem,
        }
    }
}

static SHIPPED: LazyLock<Value> = LazyLock::new(|| {
    let table = toml::from_str(MODEL).expect("the shipped model loads, which a test checks");
    Value::Table(table)
});

/// Tables and keys of the shipped model, dotted.
static KNOWN: LazyLock<Vec<String>> = LazyLock::new(|| {
    let mut known = vec!["effect".to_owned()];
    collect("", &SHIPPED, &mut known);
    known
});

fn collect(key: &str, value: &Value, known: &mut Vec<String>) {
    for (name, value) in value.as_table().into_iter().flatten() {
        let key = join(key, name);
        known.push(key.clone());
        collect(&key, value, known);
    }
}

/// Nothing, if the table has the shipped model's keys, with values of their types, all finite.
pub(super) fn check(table: &Table) -> Result<(), Fault> {
    check_table("", table, SHIPPED.as_table().expect("it was made a table"))
}

fn check_table(key: &str, table: &Table, like: &Table) -> Result<(), Fault> {
    table.iter().try_for_each(|(name, value)| {
        let key = join(key, name);
        match like.get(name) {
            _ if key == "effect" => check_effects(value),
            Some(like) => check_value(&key, value, like),
            None => Err(unknown(&key)),
        }
    })
}

fn check_value(key: &str, value: &Value, like: &Value) -> Result<(), Fault> {
    match (like, value) {
        (Value::Table(like), Value::Table(table)) => check_table(key, table, like),
        (Value::Array(like), Value::Array(items)) => check_array(key, items, like),
        (Value::Float(_), Value::Float(_)) => check_finite(key, value),
        (Value::Float(_), Value::Integer(_)) => Ok(()),
        (Value::Integer(_), Value::Integer(count)) if u32::try_from(*count).is_ok() => Ok(()),
        (Value::String(_), Value::String(word)) => check_word(key, word),
        _ => Err(wrong_type(key, value, needed(like))),
    }
}

/// All arrays of the model are as long as the shipped ones, but for the table of the response.
fn check_array(key: &str, items: &[Value], like: &[Value]) -> Result<(), Fault> {
    let (found, needed) = (items.len(), like.len());
    if found != needed && key != "sensor.original.table" {
        let problem = format!("`{key}` has length {found}; {needed} is needed");
        return Err(Fault::new(key, problem));
    }
    let item_like = like.first().expect("no array of the shipped model is empty");
    items.iter().enumerate().try_for_each(|(index, item)| {
        let key = join(key, &index.to_string());
        check_value(&key, item, item_like)?;
        match (item_like, item) {
            (Value::Table(like), Value::Table(item)) => complete(&key, item, like),
            _ => Ok(()),
        }
    })
}

/// Tables in arrays have nothing underneath them, so all their keys must be there.
fn complete(key: &str, table: &Table, like: &Table) -> Result<(), Fault> {
    match like.keys().find(|name| !table.contains_key(*name)) {
        Some(name) => Err(Fault::new(key, format!("`{key}` needs `{name}`"))),
        None => Ok(()),
    }
}

fn check_word(key: &str, word: &str) -> Result<(), Fault> {
    let known = match key {
        "sensor.kind" => SensorKind::NAMES,
        "sensor.combine" => Combine::NAMES,
        "controller.kind" => ControllerKind::NAMES,
        "run.direction" => Direction::NAMES,
        _ => return Ok(()),
    };
    check_choice(key, word, known)
}

fn check_choice(key: &str, word: &str, known: &[&str]) -> Result<(), Fault> {
    if known.contains(&word) {
        return Ok(());
    }
    let known = known.join(", ");
    let problem = format!("unknown `{key}` = \"{word}\"; known: {known}");
    Err(Fault::new(key, problem))
}

fn check_effects(value: &Value) -> Result<(), Fault> {
    let effects = value
        .as_array()
        .ok_or_else(|| wrong_type("effect", value, "an array of tables, written [[effect]],"))?;
    effects.iter().enumerate().try_for_each(|(index, effect)| {
        let key = join("effect", &index.to_string());
        match effect {
            Value::Table(effect) => check_effect(&key, effect),
            _ => Err(wrong_type(&key, effect, "a table")),
        }
    })
}

fn check_effect(key: &str, effect: &Table) -> Result<(), Fault> {
    if !effect.contains_key("kind") {
        let problem = format!("`{key}` needs `kind`, a name that `lapwing effects` lists");
        return Err(Fault::new(key, problem));
    }
    effect.iter().try_for_each(|(name, value)| {
        let key = join(key, name);
        match (name.as_str(), value) {
            ("kind", Value::String(_)) => Ok(()),
            ("by", Value::String(word)) => check_choice(&key, word, Pattern::NAMES),
            ("kind" | "by", _) => Err(wrong_type(&key, value, "a string")),
            _ => check_parameter(&key, value),
        }
    })
}

fn check_parameter(key: &str, value: &Value) -> Result<(), Fault> {
    match value {
        Value::Float(_) => check_finite(key, value),
        Value::Integer(_) | Value::String(_) => Ok(()),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .try_for_each(|(index, item)| check_parameter(&join(key, &index.to_string()), item)),
        _ => Err(wrong_type(key, value, "a number, a string or an array of them")),
    }
}

fn check_finite(key: &str, value: &Value) -> Result<(), Fault> {
    match value.as_float() {
        Some(number) if !number.is_finite() => {
            let problem = format!("{key} = {value} is not a finite number");
            Err(Fault::new(key, problem))
        }
        _ => Ok(()),
    }
}

fn wrong_type(key: &str, value: &Value, needed: &str) -> Fault {
    let found = match value {
        Value::Table(_) => format!("`{key}` is a table"),
        Value::Array(_) => format!("`{key}` is an array"),
        value => format!("{key} = {value}"),
    };
    Fault::new(key, format!("{found}, but {needed} is needed"))
}

fn needed(like: &Value) -> &'static str {
    match like {
        Value::Float(_) => "a number",
        Value::Integer(_) => "a whole number of at least 0",
        Value::Table(_) => "a table",
        Value::Array(_) => "an array",
        _ => "a string",
    }
}

fn unknown(key: &str) -> Fault {
    let nearest = nearest(key, KNOWN.iter().map(String::as_str)).join(", ");
    let problem = format!("unknown key `{key}`; nearest known: {nearest}");
    Fault::new(key, problem)
}

/// The known dotted keys that are most like a given one: at most three, all equally near.
///
/// Each misspelt letter counts one, and so does standing in the wrong table or leaving out the end
/// of the key, its unit for example.
pub(crate) fn nearest<'a>(key: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    let name = last(key);
    let mut ranked: Vec<_> = known
        .into_iter()
        .map(|candidate| {
            let whole = strsim::damerau_levenshtein(key, candidate);
            let end = 1 + strsim::damerau_levenshtein(&name, &last(candidate));
            let start: String = candidate.chars().take(key.chars().count()).collect();
            let start = 1 + strsim::damerau_levenshtein(key, &start);
            (whole.min(end).min(start), candidate)
        })
        .collect();
    ranked.sort();
    let best = ranked.first().map_or(0, |&(distance, _)| distance);
    ranked.retain(|&(distance, _)| distance == best);
    ranked.iter().take(3).map(|&(_, key)| key).collect()
}

/// A value as on the command line: TOML, or else a bare string.
pub(super) fn value(text: &str) -> Value {
    text.trim()
        .parse()
        .unwrap_or_else(|_| Value::String(text.trim().to_owned()))
}

/// The table with `value` laid over its dotted key: tables key by key, all else whole.
///
/// Unknown keys are entered all the same, for [`check`] to find.
pub(super) fn set(table: &mut Table, key: &str, value: Value) -> Result<(), Fault> {
    let mut parents: Vec<_> = key.split('.').collect();
    let name = parents.pop().unwrap_or_default();
    let mut at = String::new();
    let mut inner = Place::Table(table);
    for step in parents {
        let outer = join(&at, step);
        inner = match inner.slot(&at, step)? {
            Value::Table(table) => Place::Table(table),
            Value::Array(items) => Place::Array(items),
            _ => {
                let problem = format!("unknown key `{key}`: `{outer}` holds a value, not keys");
                return Err(Fault::new(key, problem));
            }
        };
        at = outer;
    }
    overlay(inner.slot(&at, name)?, value)
}

/// What a step of a dotted key is looked up in.
enum Place<'a> {
    Table(&'a mut Table),
    Array(&'a mut Vec<Value>),
}

impl<'a> Place<'a> {
    /// The value at `name` of the place at `at`; a table without it gets it.
    fn slot(self, at: &str, name: &str) -> Result<&'a mut Value, Fault> {
        match self {
            Place::Table(table) => Ok(table.entry(name).or_insert_with(|| Value::Table(Table::new()))),
            Place::Array(items) => {
                let count = items.len();
                let index = name.parse().unwrap_or(usize::MAX);
                items.get_mut(index).ok_or_else(|| {
                    let key = join(at, name);
                    let problem = format!("`{key}` is not there: `{at}` has length {count}, counted from 0");
                    Fault::new(&key, problem)
                })
            }
        }
    }
}

fn overlay(under: &mut Value, over: Value) -> Result<(), Fault> {
    match (under, over) {
        (Value::Table(under), Value::Table(over)) => over
            .into_iter()
            .try_for_each(|(key, value)| set(under, &key, value)),
        (under, over) => {
            *under = over;
            Ok(())
        }
    }
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() {
        name.to_owned()
    } else {
        format!("{key}.{name}")
    }
}
