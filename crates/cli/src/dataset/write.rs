//! Data sets as they are written: numbers are rounded here and nowhere else.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::Serialize;
use toml::Table;

use super::read::LOG_COLUMNS;
use super::{DESCRIPTION, Rows};
use crate::config::ControllerKind;
use crate::interrupt;
use crate::output::unwritable;

const T_DECIMALS: usize = 3;
const POSITION_DECIMALS: usize = 4;
const READING_DECIMALS: usize = 1;
const SPEED_DECIMALS: usize = 5;

/// A data set of laps to be written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DataSetToWrite<'a> {
    pub(crate) name: &'a str,
    pub(crate) world: &'a str,
    pub(crate) controller: ControllerKind,
    pub(crate) laps: usize,
    pub(crate) note: &'a str,
    /// Keys of the model that were set otherwise, nested.
    pub(crate) declared: &'a Table,
    pub(crate) runs: &'a [(String, &'a Rows)],
}

/// Writes `dataset.toml` and `run_<name>.csv` for each run into a folder that is there.
///
/// # Errors
/// Columns of a run that differ in length; a file that cannot be written; Ctrl-C.
pub(crate) fn write_dataset(dir: &Path, set: &DataSetToWrite<'_>) -> Result<()> {
    write(&dir.join(DESCRIPTION), [dataset_toml(set).into_bytes()])?;
    set.runs.iter().try_for_each(|(name, rows)| {
        let text = run_csv(rows).with_context(|| format!("run {name}"))?;
        write(&dir.join(format!("run_{name}.csv")), text)
    })
}

fn write(path: &Path, parts: impl IntoIterator<Item = Vec<u8>>) -> Result<()> {
    let cannot = |error| unwritable(path, &error);
    let mut file = File::create(path).map_err(cannot)?;
    for part in parts {
        interrupt::check()?;
        file.write_all(&part).map_err(cannot)?;
    }
    Ok(())
}

/// The text of `dataset.toml`.
fn dataset_toml(set: &DataSetToWrite<'_>) -> String {
    #[derive(Serialize)]
    struct Description<'a> {
        name: &'a str,
        world: &'a str,
        controller: &'a str,
        runs: Vec<&'a str>,
        laps: usize,
        note: &'a str,
        #[serde(skip_serializing_if = "Table::is_empty")]
        declared: &'a Table,
    }
    toml::to_string(&Description {
        name: set.name,
        world: set.world,
        controller: set.controller.name(),
        runs: set.runs.iter().map(|(name, _)| name.as_str()).collect(),
        laps: set.laps,
        note: set.note,
        declared: set.declared,
    })
    .expect("strings, a number and a table have a form in TOML")
}

/// The text of `run_<name>.csv` in parts of so many rows that each is written in no time: t with 3 decimals, x and y 4,
/// readings 1, speeds 5.
///
/// # Errors
/// Columns that differ in length.
pub(super) fn run_csv(rows: &Rows) -> Result<impl Iterator<Item = Vec<u8>>> {
    const PART: usize = 10_000;
    let count = rows.t_s.len();
    let lengths = [rows.position_m.len()].into_iter().chain(
        rows.log
            .iter()
            .flat_map(|log| [log.readings.len(), log.left_m_s.len(), log.right_m_s.len()]),
    );
    ensure!(
        lengths.into_iter().all(|length| length == count),
        "the columns of a run differ in length"
    );
    let log = LOG_COLUMNS.iter().filter(|_| rows.log.is_some());
    let header = log.fold("t_s,x_m,y_m".to_owned(), |header, name| header + "," + name) + "\n";
    let part = move |first: usize| {
        let part = first..count.min(first + PART);
        let mut text = Vec::with_capacity(part.len() * if rows.log.is_some() { 96 } else { 24 });
        part.for_each(|index| push_row(&mut text, rows, index));
        text
    };
    let parts = (0..count).step_by(PART).map(part);
    Ok(std::iter::once(header.into_bytes()).chain(parts))
}

fn push_row(text: &mut Vec<u8>, rows: &Rows, index: usize) {
    push_number(text, rows.t_s[index], T_DECIMALS);
    let position_m = rows.position_m[index].unwrap_or([f64::NAN; 2]);
    let mut field = |value: f64, decimals: usize| {
        text.push(b',');
        push_number(text, value, decimals);
    };
    position_m
        .into_iter()
        .for_each(|value| field(value, POSITION_DECIMALS));
    if let Some(log) = &rows.log {
        log.readings[index]
            .into_iter()
            .for_each(|value| field(value, READING_DECIMALS));
        field(log.left_m_s[index], SPEED_DECIMALS);
        field(log.right_m_s[index], SPEED_DECIMALS);
    }
    text.push(b'\n');
}

/// Nothing for NaN, which stands for a missing value; never `-0`.
///
/// Whole numbers of the last decimal are four times faster to write than `{:.n}`.
fn push_number(text: &mut Vec<u8>, value: f64, decimals: usize) {
    if value.is_nan() {
        return;
    }
    let scaled = (value * 10_f64.powi(decimals as i32)).round();
    if scaled.abs() >= 2_f64.powi(53) {
        text.extend_from_slice(format!("{value:.decimals$}").as_bytes());
        return;
    }
    if scaled < 0.0 {
        text.push(b'-');
    }
    let mut rest = scaled.abs() as u64;
    let mut digits = [b'0'; 24];
    let mut start = digits.len();
    while rest > 0 || digits.len() - start < decimals + 2 {
        start -= 1;
        if digits.len() - 1 - start == decimals {
            digits[start] = b'.';
        } else {
            digits[start] = b'0' + (rest % 10) as u8;
            rest /= 10;
        }
    }
    text.extend_from_slice(&digits[start..]);
}

/// The name of run `index`, from 0: a to z, then aa, ab, ...
pub(crate) fn run_name(index: usize) -> String {
    let letter = char::from(b'a' + (index % 26) as u8);
    match index / 26 {
        0 => letter.to_string(),
        rest => run_name(rest - 1) + &letter.to_string(),
    }
}
