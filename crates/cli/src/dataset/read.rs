//! `run_<name>.csv`: times, positions and, where it was kept, the robot's log.

use std::path::Path;

use anyhow::Result;

use super::csv_file::{CsvFile, Row};
use super::{Log, Rows};
use crate::output::Input;

/// Columns of the log, in the order of [`Log`].
pub(crate) const LOG_COLUMNS: [&str; 10] = [
    "ps0",
    "ps1",
    "ps2",
    "ps3",
    "ps4",
    "ps5",
    "ps6",
    "ps7",
    "left_m_s",
    "right_m_s",
];

/// Where the columns stand.
#[derive(Debug)]
struct Columns {
    t_s: usize,
    position_m: [usize; 2],
    log: Option<[usize; 10]>,
}

/// A run's rows and their lines in the file; columns that are not ours are passed over.
///
/// # Errors
/// A required column is missing, a field is not a number, times do not rise, no rows.
pub(super) fn run(path: &Path, bytes: &[u8]) -> Result<(Rows, Vec<usize>, Input)> {
    let mut file = CsvFile::new(path, bytes)?;
    let columns = Columns::find(&file)?;
    let mut rows = Rows {
        log: columns.log.map(|_| Log::default()),
        ..Rows::default()
    };
    let mut lines = Vec::new();
    while let Some(row) = file.next_row()? {
        lines.push(row.line);
        rows.push(&columns, row)?;
    }
    if rows.t_s.is_empty() {
        return Err(file.error("no rows under the header; a run needs one for each control step"));
    }
    Ok((rows, lines, file.input))
}

impl Columns {
    fn find(file: &CsvFile) -> Result<Self> {
        file.check_names()?;
        let column = |name: &str| {
            let known = file.header.join(", ");
            file.column(name)
                .ok_or_else(|| file.header_error(format!("column {name} is missing; there are: {known}")))
        };
        Ok(Self {
            t_s: column("t_s")?,
            position_m: [column("x_m")?, column("y_m")?],
            log: Self::find_log(file)?,
        })
    }

    /// All of the log's columns or none: half a log is more likely a mistake than meant.
    fn find_log(file: &CsvFile) -> Result<Option<[usize; 10]>> {
        let found = LOG_COLUMNS.map(|name| file.column(name));
        if found.iter().all(Option::is_none) {
            return Ok(None);
        }
        let missing: Vec<_> = LOG_COLUMNS
            .into_iter()
            .zip(found)
            .filter_map(|(name, column)| column.is_none().then_some(name))
            .collect();
        if missing.is_empty() {
            return Ok(Some(found.map(|column| column.expect("none is missing"))));
        }
        let missing = missing.join(", ");
        Err(file.header_error(format!(
            "of the robot's log {missing} is missing; a log has ps0 to ps7, left_m_s and right_m_s, \
             so add that or remove the others"
        )))
    }
}

impl Rows {
    fn push(&mut self, columns: &Columns, row: Row<'_>) -> Result<()> {
        let t_s = row.required(columns.t_s)?;
        if let Some(before) = self.t_s.last().filter(|&&before| t_s <= before) {
            return Err(row.field_error(
                columns.t_s,
                format!("{t_s} does not come after {before} of the row before; times must rise"),
            ));
        }
        self.t_s.push(t_s);
        let [x_m, y_m] = columns.position_m;
        let position_m = row.number(x_m)?.zip(row.number(y_m)?);
        self.position_m.push(position_m.map(|(x, y)| [x, y]));
        match (&mut self.log, &columns.log) {
            (Some(log), Some(columns)) => log.push(columns, row),
            _ => Ok(()),
        }
    }
}

impl Log {
    fn push(&mut self, columns: &[usize; 10], row: Row<'_>) -> Result<()> {
        let mut fields = [f64::NAN; 10];
        for (field, &column) in fields.iter_mut().zip(columns) {
            *field = row.number(column)?.unwrap_or(f64::NAN);
        }
        let [readings @ .., left_m_s, right_m_s] = fields;
        self.readings.push(readings);
        self.left_m_s.push(left_m_s);
        self.right_m_s.push(right_m_s);
        Ok(())
    }
}
