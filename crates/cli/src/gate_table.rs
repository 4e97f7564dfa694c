//! Gate tables: laps that were sampled already, one row per lap.

use std::path::{Path, PathBuf};

use anyhow::Result;
use pdm::Cluster;

use crate::dataset::CsvFile;
use crate::output::Input;

/// Laps as rows of numbers: K x N.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GateTable {
    /// The file's name without its ending.
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    /// N names, whatever the file calls its coordinates.
    pub(crate) header: Vec<String>,
    /// K laps, at least one, of N finite numbers each.
    pub(crate) rows: Vec<Vec<f64>>,
    /// For the manifest.
    pub(crate) input: Input,
}

impl GateTable {
    /// The gate table in a `.csv` or `.csv.gz`.
    ///
    /// # Errors
    /// It cannot be read, has no header or no rows, rows of different length, or a field that is
    /// not a finite number; with file, line and column.
    pub(crate) fn load(path: &Path) -> Result<Self> {
        let mut file = CsvFile::open(path)?;
        if file.starts_with_numbers() && !counts_up(&file.header) {
            return Err(file.header_error(
                "these look like the numbers of a lap; a line with the names of the columns must \
                 come first: words, or numbers that count up by 1",
            ));
        }
        let columns = file.header.len();
        let mut rows = Vec::new();
        while let Some(row) = file.next_row()? {
            let lap = (0..columns).map(|column| row.required(column));
            rows.push(lap.collect::<Result<Vec<_>>>()?);
        }
        if rows.is_empty() {
            return Err(file.error("no rows under the header; one for each lap is needed"));
        }
        Ok(Self {
            name: CsvFile::stem(path),
            path: path.to_owned(),
            header: file.header,
            rows,
            input: file.input,
        })
    }
}

/// The text of a gate table, which gives back the same bits: K rows of N positions as they were sampled.
pub(crate) fn to_csv(cluster: &Cluster) -> String {
    let header = (0..cluster.dimension()).map(|gate| format!("gate_{gate}"));
    let mut csv = header.collect::<Vec<_>>().join(",") + "\n";
    for lap in cluster.laps().row_iter() {
        let numbers = lap.iter().map(f64::to_string);
        csv += &(numbers.collect::<Vec<_>>().join(",") + "\n");
    }
    csv
}

/// The names of the clusters as files may be called, all different, on a disk that knows no capitals too.
pub(crate) fn file_names(clusters: &[Cluster]) -> Vec<String> {
    let safe = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) {
            c
        } else {
            '_'
        }
    };
    let mut names: Vec<String> = Vec::with_capacity(clusters.len());
    for cluster in clusters {
        let plain: String = cluster.name().chars().map(safe).collect();
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let mut free = std::iter::once(plain.clone()).chain(numbered);
        let same = |a: &String, b: &String| a.to_lowercase() == b.to_lowercase();
        names.extend(free.find(|name| !names.iter().any(|other| same(other, name))));
    }
    names
}

/// Whether columns are named by whole numbers one after the other, those of the gates.
fn counts_up(header: &[String]) -> bool {
    let numbers: Option<Vec<i64>> = header.iter().map(|name| name.parse().ok()).collect();
    numbers.is_some_and(|numbers| {
        numbers
            .windows(2)
            .all(|pair| pair[1].checked_sub(pair[0]) == Some(1))
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use tempfile::TempDir;

    use super::*;

    fn load(text: &str) -> Result<GateTable, String> {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("laps.of.mine.csv");
        fs::write(&path, text).unwrap();
        let around = format!("{}/", folder.path().display());
        GateTable::load(&path).map_err(|error| format!("{error:#}").replace(&around, ""))
    }

    #[test]
    fn a_table_is_its_laps() {
        let table = load("0,1,2\n0.5,-1,1e-3\n1,2,3\n").unwrap();
        assert_eq!(table.name, "laps.of.mine");
        assert_eq!(table.header, ["0", "1", "2"]);
        assert_eq!(table.rows, [[0.5, -1.0, 1e-3], [1.0, 2.0, 3.0]]);
    }

    #[test]
    fn a_cluster_comes_back_bit_by_bit() {
        let laps = [vec![0.1, -1.0 / 3.0, 1e-300], vec![f64::MIN_POSITIVE, -0.0, 5.0]];
        let csv = to_csv(&Cluster::new("a", &laps).unwrap());
        assert!(csv.starts_with("gate_0,gate_1,gate_2\n0.1,"));
        let rows = load(&csv).unwrap().rows;
        assert_eq!(rows, laps);
        assert!(rows[1][1].is_sign_negative());
    }

    #[test]
    fn clusters_have_files_of_their_own() {
        let cluster = |name: &str| Cluster::new(name, &[vec![0.0]]).unwrap();
        let clusters = ["set/a", "set_a", "../set, é/b", "set a"].map(cluster);
        assert_eq!(
            file_names(&clusters),
            ["set_a", "set_a_2", ".._set__é_b", "set_a_3"]
        );
    }

    #[test]
    fn faults_name_line_and_column() {
        for (text, expected) in [
            (
                "a,b\n",
                "laps.of.mine.csv: no rows under the header; one for each lap is needed",
            ),
            (
                "0.1,0.2\n0.3,0.4\n",
                "laps.of.mine.csv:1: these look like the numbers of a lap; a line with the names of the columns must \
                 come first: words, or numbers that count up by 1",
            ),
            (
                "-12,35,40\n-10,31,44\n",
                "laps.of.mine.csv:1: these look like the numbers of a lap; a line with the names of the columns must \
                 come first: words, or numbers that count up by 1",
            ),
            (
                "a,b\n1,\n",
                "laps.of.mine.csv:2: b: is empty; a number is needed here",
            ),
            (
                "a,b\n1,2\n1,x\n",
                "laps.of.mine.csv:3: b: `x` is not a finite number; one is needed here",
            ),
            (
                "a,b\n1,2,3\n",
                "laps.of.mine.csv:2: 3 fields under a header of 2; give every row as many, empty where a value is \
                 missing",
            ),
        ] {
            assert_eq!(load(text).unwrap_err(), expected);
        }
    }
}
