//! A CSV file, compressed or not, with the place of each field for messages.

use std::io::{Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use csv::ByteRecord;

use crate::config::read;
use crate::output::Input;

/// A CSV file in memory: its header and its rows as text.
#[derive(Debug)]
pub(crate) struct CsvFile {
    label: String,
    /// Trimmed, in the order of the file.
    pub(crate) header: Vec<String>,
    text: Arc<[u8]>,
    reader: csv::Reader<Cursor<Arc<[u8]>>>,
    row: ByteRecord,
    /// Bytes up to the row, and the lines that end in them.
    counted: (usize, usize),
    /// For the manifest.
    pub(crate) input: Input,
}

/// The fields of one row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a> {
    label: &'a str,
    header: &'a [String],
    record: &'a ByteRecord,
    /// Its line in the file.
    pub(crate) line: usize,
}

impl CsvFile {
    /// The file with its header read.
    ///
    /// # Errors
    /// It cannot be read, is not what its `.gz` promises, is empty, or repeats a column.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        Self::new(path, &read(path)?)
    }

    /// The file of these bytes with its header read; `path` is what messages call it.
    ///
    /// # Errors
    /// It is not what its `.gz` promises, is empty, or repeats a column.
    pub(crate) fn new(path: &Path, bytes: &[u8]) -> Result<Self> {
        let label = path.display().to_string();
        let input = Input::of(label.clone(), bytes);
        let text: Arc<[u8]> = if path.extension().is_some_and(|ending| ending == "gz") {
            unpacked(bytes)
                .with_context(|| format!("{label} cannot be unpacked as gzip"))?
                .into()
        } else {
            bytes.into()
        };
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .has_headers(false)
            .from_reader(Cursor::new(text.clone()));
        let mut row = ByteRecord::new();
        let found = reader.read_byte_record(&mut row);
        if !found.with_context(|| format!("cannot read {label}"))? {
            bail!("{label} is empty; a line with the names of the columns must come first");
        }
        let header = header(&row).with_context(|| format!("{label}:1"))?;
        Ok(Self {
            label,
            header,
            text,
            reader,
            row,
            counted: (0, 0),
            input,
        })
    }

    /// The file's name without `.csv` or `.csv.gz`.
    pub(crate) fn stem(path: &Path) -> String {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        name.strip_suffix(".csv").unwrap_or(name).to_owned()
    }

    /// Whether the first line is a row of numbers.
    pub(crate) fn starts_with_numbers(&self) -> bool {
        self.header.iter().all(|name| name.parse::<f64>().is_ok())
    }

    /// Nothing, if the first line names the columns.
    ///
    /// # Errors
    /// It is a row of numbers.
    pub(crate) fn check_names(&self) -> Result<()> {
        if self.starts_with_numbers() {
            return Err(
                self.header_error("a row of numbers; a line with the names of the columns must come first")
            );
        }
        Ok(())
    }

    /// The index of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// The next row, `None` after the last.
    ///
    /// # Errors
    /// A row with more or fewer fields than the header.
    pub(crate) fn next_row(&mut self) -> Result<Option<Row<'_>>> {
        let found = self.reader.read_byte_record(&mut self.row);
        if !found.with_context(|| format!("cannot read {}", self.label))? {
            return Ok(None);
        }
        self.count_lines();
        let row = Row {
            label: &self.label,
            header: &self.header,
            record: &self.row,
            line: 1 + self.counted.1,
        };
        let (fields, columns) = (row.record.len(), row.header.len());
        if fields != columns {
            let mend = "give every row as many, empty where a value is missing";
            return Err(row.error(format!("{fields} fields under a header of {columns}; {mend}")));
        }
        Ok(Some(row))
    }

    /// Counts the lines before the row. The reader's own count stands at the empty lines that it passes over before a row.
    fn count_lines(&mut self) {
        let byte = self.row.position().map_or(0, csv::Position::byte);
        let start = usize::try_from(byte).unwrap_or(usize::MAX).min(self.text.len());
        let empty = self.text[start..]
            .iter()
            .take_while(|byte| b"\r\n".contains(byte));
        let end = start + empty.count();
        let (bytes, lines) = self.counted;
        let ends = self.text[bytes..end].iter().filter(|&&byte| byte == b'\n');
        self.counted = (end, lines + ends.count());
    }

    /// The message with the file and the line of its header.
    pub(crate) fn header_error(&self, message: impl std::fmt::Display) -> anyhow::Error {
        anyhow!("{}:1: {message}", self.label)
    }

    /// The message with the file.
    pub(crate) fn error(&self, message: impl std::fmt::Display) -> anyhow::Error {
        anyhow!("{}: {message}", self.label)
    }
}

impl Row<'_> {
    /// The finite number in a column, `None` for an empty field.
    ///
    /// # Errors
    /// Anything else, with file, line and column.
    pub(crate) fn number(&self, column: usize) -> Result<Option<f64>> {
        let mend = "leave the field empty if it is missing";
        self.parsed(column)
            .map_err(|field| self.not_finite(column, &field, mend))
    }

    /// The number in a column that may not be empty.
    ///
    /// # Errors
    /// An empty field or anything but a finite number, with file, line and column.
    pub(crate) fn required(&self, column: usize) -> Result<f64> {
        self.parsed(column)
            .map_err(|field| self.not_finite(column, &field, "one is needed here"))?
            .ok_or_else(|| self.field_error(column, "is empty; a number is needed here"))
    }

    /// The finite number in a column, `None` for an empty field, or the field that is no such number.
    fn parsed(&self, column: usize) -> Result<Option<f64>, String> {
        let field = self.record.get(column).unwrap_or_default().trim_ascii();
        if field.is_empty() {
            return Ok(None);
        }
        let text = std::str::from_utf8(field).unwrap_or_default();
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(String::from_utf8_lossy(field).into_owned()),
        }
    }

    fn not_finite(&self, column: usize, field: &str, mend: &str) -> anyhow::Error {
        self.field_error(column, format!("`{field}` is not a finite number; {mend}"))
    }

    /// The message with file, line and column.
    pub(crate) fn field_error(&self, column: usize, message: impl std::fmt::Display) -> anyhow::Error {
        let name = self.header.get(column).map_or("", String::as_str);
        self.error(format!("{name}: {message}"))
    }

    /// The message with file and line.
    pub(crate) fn error(&self, message: impl std::fmt::Display) -> anyhow::Error {
        anyhow!("{}:{}: {message}", self.label, self.line)
    }
}

fn unpacked(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut text = Vec::with_capacity(bytes.len() * 4);
    flate2::read::MultiGzDecoder::new(bytes).read_to_end(&mut text)?;
    Ok(text)
}

fn header(row: &ByteRecord) -> Result<Vec<String>> {
    if row.as_slice().contains(&0) {
        bail!("the text is UTF-16, or no text at all; save it as UTF-8");
    }
    let names: Vec<String> = row
        .iter()
        .map(|name| String::from_utf8_lossy(name).trim().to_owned())
        .collect();
    if let [only] = names.as_slice()
        && only.contains([';', '\t'])
    {
        bail!("`{only}` is one column; separate columns by commas");
    }
    let repeated = |(index, name): &(usize, &String)| names[..*index].contains(*name);
    match names.iter().enumerate().find(repeated) {
        Some((_, name)) if !name.is_empty() => bail!("column {name} is there twice; remove one"),
        _ => Ok(names),
    }
}
