//! A TOML file that remembers where its keys stand.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use toml::Table;
use toml::de::{DeTable, DeValue};

/// The bytes of a file.
///
/// # Errors
/// Names the file and why it cannot be read.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

/// A TOML text with its table, and the line of each of its keys.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Document {
    /// What messages call it, as a rule its path.
    pub(crate) label: String,
    pub(crate) text: String,
    pub(crate) table: Table,
    lines: BTreeMap<String, usize>,
}

impl Document {
    /// The document of a text.
    ///
    /// # Errors
    /// Text that is not UTF-8 or not TOML, with label and line.
    pub(crate) fn parse(label: impl Into<String>, bytes: Vec<u8>) -> Result<Self> {
        let label = label.into();
        let text = String::from_utf8(bytes).map_err(|error| {
            let start = error.utf8_error().valid_up_to();
            let line = line_at(error.as_bytes(), start);
            anyhow!("{label}:{line}: not UTF-8 text; save the file as UTF-8")
        })?;
        let located = |error: toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start);
            let line = line_at(text.as_bytes(), start);
            anyhow!("{label}:{line}: {}", error.message().replace('\n', "; "))
        };
        let mut lines = BTreeMap::new();
        let spans = DeTable::parse(&text).map_err(located)?;
        collect_table(&text, "", spans.get_ref(), &mut lines);
        let table = toml::from_str(&text).map_err(located)?;
        Ok(Self {
            label,
            table,
            lines,
            text,
        })
    }

    /// The line of a dotted key (with indices of arrays), from 1, if it stands in this text.
    pub(crate) fn line_of(&self, key: &str) -> Option<usize> {
        self.lines.get(key).copied()
    }

    /// `FILE:LINE` of a key or of the innermost table around it; the file alone if it has neither.
    pub(crate) fn place(&self, key: &str) -> String {
        let mut key = key;
        loop {
            if let Some(line) = self.line_of(key) {
                return format!("{}:{line}", self.label);
            }
            match key.rsplit_once('.') {
                Some((parent, _)) => key = parent,
                None => return self.label.clone(),
            }
        }
    }

    /// The message with the place of the key that it is about.
    pub(crate) fn error(&self, key: &str, message: impl std::fmt::Display) -> anyhow::Error {
        anyhow!("{}: {message}", self.place(key))
    }
}

fn line_at(text: &[u8], start: usize) -> usize {
    let before = text.get(..start).unwrap_or(text);
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

type Lines = BTreeMap<String, usize>;

fn collect_table(text: &str, key: &str, table: &DeTable<'_>, lines: &mut Lines) {
    for (name, value) in table {
        let separator = if key.is_empty() { "" } else { "." };
        let key = format!("{key}{separator}{}", name.get_ref());
        let line = line_at(text.as_bytes(), name.span().start);
        lines.insert(key.clone(), line);
        collect_value(text, &key, value.get_ref(), lines);
    }
}

fn collect_value(text: &str, key: &str, value: &DeValue<'_>, lines: &mut Lines) {
    match value {
        DeValue::Table(table) => collect_table(text, key, table, lines),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                let key = format!("{key}.{index}");
                lines.insert(key.clone(), line_at(text.as_bytes(), item.span().start));
                collect_value(text, &key, item.get_ref(), lines);
            }
        }
        _ => {}
    }
}
