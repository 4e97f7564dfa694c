//! What is hidden in each data set: `labels.csv`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// A data set and its truth.
#[derive(Debug, Clone)]
pub(crate) struct Set {
    pub(crate) label: Label,
    pub(crate) folder: PathBuf,
}

/// What was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    /// Laps that the camera saw.
    L1,
    /// Laps with the robot's log.
    L2,
}

impl Level {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::L1 => "L1",
            Self::L2 => "L2",
        }
    }
}

/// Who drove.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Controller {
    Braitenberg,
    RuleBased,
}

impl Controller {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Braitenberg => "braitenberg",
            Self::RuleBased => "rule-based",
        }
    }
}

/// How many effects are hidden, and whether they have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Null,
    Single,
    Outside,
    Pair,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Single => "single",
            Self::Outside => "outside",
            Self::Pair => "pair",
        }
    }
}

/// A parameter's true value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Truth {
    Number(f64),
    ByRun(Vec<f64>),
    Word(String),
}

/// The truth of one data set.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Label {
    pub(crate) name: String,
    pub(crate) level: Level,
    pub(crate) kind: Kind,
    pub(crate) controller: Controller,
    pub(crate) effects: Vec<String>,
    /// Whether the effect's size goes by run.
    pub(crate) by_run: bool,
    pub(crate) stages: Vec<String>,
    /// Of all effects, in their order.
    pub(crate) parameters: Vec<(String, Truth)>,
}

const COLUMNS: [&str; 7] = [
    "name",
    "level",
    "kind",
    "controller",
    "effects",
    "stages",
    "parameters",
];
const BY_RUN: &str = " (by run)";

/// The data sets of a folder.
///
/// # Errors
/// A missing file or column, a word that is not known.
pub(crate) fn read(folder: &Path) -> Result<Vec<Set>> {
    let path = folder.join("labels.csv");
    let shown = path.display();
    let mut reader = csv::Reader::from_path(&path).with_context(|| format!("{shown}: cannot read it"))?;
    let header = reader.headers()?.clone();
    let mut places = [0; COLUMNS.len()];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = (header.iter().position(|name| name == column))
            .with_context(|| format!("{shown}: no column `{column}`"))?;
    }
    let mut sets = Vec::new();
    for record in reader.records() {
        let record = record?;
        let fields = places.map(|place| record.get(place).unwrap_or_default());
        let label = Label::parse(fields).with_context(|| format!("{shown}: set {}", fields[0]))?;
        sets.push(Set {
            folder: folder.join(&label.name),
            label,
        });
    }
    Ok(sets)
}

/// Writes the labels of data sets into a folder.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write<'a>(folder: &Path, labels: impl Iterator<Item = &'a Label>) -> Result<()> {
    let mut writer = csv::Writer::from_path(folder.join("labels.csv"))?;
    writer.write_record(COLUMNS)?;
    for label in labels {
        writer.write_record(label.fields())?;
    }
    Ok(writer.flush()?)
}

impl Label {
    fn parse(fields: [&str; COLUMNS.len()]) -> Result<Self> {
        let [name, level, kind, controller, effects, stages, parameters] = fields;
        let words = |text: &str| -> Vec<String> {
            let words = text.split('+').map(str::trim);
            words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
        };
        Ok(Self {
            name: name.to_owned(),
            level: match level {
                "L1" => Level::L1,
                "L2" => Level::L2,
                _ => bail!("unknown level `{level}`; known: L1, L2"),
            },
            kind: match kind {
                "null" => Kind::Null,
                "single" => Kind::Single,
                "outside" => Kind::Outside,
                "pair" => Kind::Pair,
                _ => bail!("unknown kind `{kind}`; known: null, single, outside, pair"),
            },
            controller: match controller {
                "braitenberg" => Controller::Braitenberg,
                "rule-based" => Controller::RuleBased,
                _ => bail!("unknown controller `{controller}`; known: braitenberg, rule-based"),
            },
            effects: words(&effects.replace(BY_RUN, "")),
            by_run: effects.contains(BY_RUN),
            stages: words(stages),
            parameters: parameters
                .split(';')
                .filter(|text| !text.trim().is_empty())
                .map(parameter)
                .collect::<Result<_>>()?,
        })
    }

    fn fields(&self) -> [String; COLUMNS.len()] {
        [
            self.name.clone(),
            self.level.name().to_owned(),
            self.kind.name().to_owned(),
            self.controller.name().to_owned(),
            self.title(),
            self.stages.join("+"),
            self.sizes(),
        ]
    }

    /// The names of the effects.
    pub(crate) fn title(&self) -> String {
        self.effects.join("+") + if self.by_run { BY_RUN } else { "" }
    }

    /// The parameters as they stand in the file.
    pub(crate) fn sizes(&self) -> String {
        let text = |(name, truth): &(String, Truth)| match truth {
            Truth::Number(value) => format!("{name}={value}"),
            Truth::Word(word) => format!("{name}={word}"),
            Truth::ByRun(values) => {
                let values: Vec<String> = values.iter().map(f64::to_string).collect();
                format!("{name}=[{}]", values.join(" "))
            }
        };
        self.parameters.iter().map(text).collect::<Vec<_>>().join("; ")
    }
}

/// One `name=value`.
fn parameter(text: &str) -> Result<(String, Truth)> {
    let (name, value) = text
        .split_once('=')
        .with_context(|| format!("parameter `{text}` has no `=`"))?;
    let value = value.trim();
    let truth = match value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        Some(list) => {
            let numbers = list
                .split([' ', ','])
                .filter(|word| !word.is_empty())
                .map(str::parse);
            Truth::ByRun(numbers.collect::<Result<_, _>>()?)
        }
        None => value
            .parse()
            .map_or_else(|_| Truth::Word(value.to_owned()), Truth::Number),
    };
    Ok((name.trim().to_owned(), truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_go_by_run_are_told_from_names() {
        let row = [
            "p047",
            "L1",
            "single",
            "braitenberg",
            "reading-gain (by run)",
            "sense",
            "gain=[1.04446 0.843943]",
        ];
        let label = Label::parse(row).unwrap();
        assert_eq!(label.effects, ["reading-gain"]);
        assert!(label.by_run);
        assert_eq!(
            label.parameters,
            [("gain".to_owned(), Truth::ByRun(vec![1.04446, 0.843943]))]
        );
        assert_eq!(label.fields(), row, "it is written as it was read");
    }

    #[test]
    fn a_pair_has_two_names_and_the_parameters_of_both() {
        let row = [
            "p1",
            "L1",
            "pair",
            "rule-based",
            "wall-bump+slip-level",
            "world+act",
            "height_m=-0.01; wall=inner; factor=2",
        ];
        let label = Label::parse(row).unwrap();
        assert_eq!(label.effects, ["wall-bump", "slip-level"]);
        assert_eq!(label.stages, ["world", "act"]);
        assert_eq!(label.parameters[1].1, Truth::Word("inner".into()));
        assert_eq!(label.fields(), row);
    }

    #[test]
    fn an_effect_free_set_has_no_names() {
        let label = Label::parse(["p0", "L2", "null", "rule-based", "", "", ""]).unwrap();
        assert!(label.effects.is_empty() && label.stages.is_empty() && label.parameters.is_empty());
        assert!(Label::parse(["p0", "L3", "null", "rule-based", "", "", ""]).is_err());
    }
}
