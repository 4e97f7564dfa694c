//! A table of distances, simulations by measured runs, with the paper's beside ours.

use chart::{Axis, Direction, Figure, Fill, Interval, Mark, Marker, Panel, Shape, Style, palette};
use serde_json::{Map, Value};

use super::estimate::Estimate;
use super::published;
use crate::figures;
use crate::table::Table;

/// One simulation.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// In `tables.json` and the CSV.
    pub(crate) key: String,
    pub(crate) name: String,
    /// What the paper prints.
    pub(crate) paper: Option<published::Row>,
    /// The distance to each run.
    pub(crate) here: Vec<Estimate>,
}

/// The distance between a measured run and a simulation, each by its place; `None` where no lap was simulated.
pub(crate) type DistanceOf<'a> = dyn Fn(usize, usize) -> Option<Estimate> + 'a;

/// Distances of simulations to measured runs.
#[derive(Debug, Clone)]
pub(crate) struct Distances {
    pub(crate) title: String,
    /// The measured runs.
    pub(crate) runs: Vec<String>,
    pub(crate) rows: Vec<Row>,
}

impl Distances {
    /// Simulations by key, name and the paper's line; those without a distance to every run (eq. 8) are left out.
    pub(super) fn beside_paper(
        title: &str,
        runs: Vec<String>,
        simulations: impl IntoIterator<Item = (String, &'static str, published::Row)>,
        distance: &DistanceOf<'_>,
    ) -> Self {
        let row = |(place, (key, name, paper)): (usize, (String, &str, published::Row))| {
            let here = (0..runs.len())
                .map(|run| distance(run, place))
                .collect::<Option<_>>()?;
            Some(Row {
                key,
                name: name.into(),
                paper: Some(paper),
                here,
            })
        };
        Self {
            title: title.into(),
            rows: simulations.into_iter().enumerate().filter_map(row).collect(),
            runs,
        }
    }

    /// The paper's line and ours for each simulation.
    pub(crate) fn table(&self) -> Table {
        self.beside(&self.title, "here", &[])
    }

    /// The paper's line, ours under a name, and those that others have of the same simulation under theirs.
    pub(crate) fn beside(&self, title: &str, name: &str, others: &[(&str, &Self)]) -> Table {
        let heads: Vec<String> = self.runs.iter().map(|run| format!("run {run}")).collect();
        let columns: Vec<&str> = ["distance to"]
            .into_iter()
            .chain(heads.iter().map(String::as_str))
            .collect();
        let mut table = Table::new(title, &columns);
        for row in &self.rows {
            let mut line = |name: &str, cells: Vec<String>| {
                let head = format!("{}, {name}", row.name);
                table.push([head].into_iter().chain(cells));
            };
            if let Some(paper) = row.paper {
                let cell = |run: &String| paper.of_run(run).map_or("-".into(), |d| format!("{d:.1}"));
                line("paper", self.runs.iter().map(cell).collect());
            }
            for (name, distances) in [(name, self)].iter().chain(others) {
                let same = distances.rows.iter().find(|other| other.key == row.key);
                let cells =
                    (0..self.runs.len()).map(|run| same.map_or("-".into(), |row| row.here[run].text(1)));
                line(name, cells.collect());
            }
        }
        table
    }

    /// One line per simulation and run.
    pub(crate) fn csv(&self) -> String {
        let mut csv = String::from("simulation,run,paper,distance,low,high,first\n");
        for row in &self.rows {
            for (
                run,
                Estimate {
                    mean,
                    low,
                    high,
                    first,
                },
            ) in self.runs.iter().zip(&row.here)
            {
                let paper = row
                    .paper
                    .and_then(|paper| paper.of_run(run))
                    .map_or(String::new(), |d| d.to_string());
                csv += &format!("{},{run},{paper},{mean},{low},{high},{first}\n", row.key);
            }
        }
        csv
    }

    /// `{"<simulation>": {"<run>": {"distance", "low", "high", "first", "paper"}}}`.
    pub(crate) fn json(&self) -> Value {
        let row = |row: &Row| {
            let cells = self.runs.iter().zip(&row.here).map(|(run, estimate)| {
                let mut cell = estimate.json("distance");
                if let Some(paper) = row.paper.and_then(|paper| paper.of_run(run)) {
                    cell["paper"] = paper.into();
                }
                (run.clone(), cell)
            });
            (row.key.clone(), Value::Object(cells.collect()))
        };
        Value::Object(self.rows.iter().map(row).collect::<Map<_, _>>())
    }

    /// Ours with their intervals, the paper's as open diamonds.
    pub(crate) fn figure(&self) -> Figure {
        let spread = 0.5 / self.rows.len() as f64;
        let mut marks = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let place = |run: usize| run as f64 + (i as f64 - (self.rows.len() - 1) as f64 / 2.0) * spread;
            let ours = Style {
                fill: Fill::Solid,
                ..Style::color(palette(i))
            };
            let points = row
                .here
                .iter()
                .enumerate()
                .map(|(run, e)| [place(run), e.mean])
                .collect();
            let interval = |(run, e): (usize, &Estimate)| Interval {
                at: place(run),
                low: e.low,
                high: e.high,
            };
            let intervals = row.here.iter().enumerate().map(interval).collect();
            let bars = Shape::ErrorBars {
                intervals,
                direction: Direction::Vertical,
            };
            marks.push(Mark::new(
                &row.name,
                Style {
                    width_px: 1.2,
                    ..ours
                },
                bars,
            ));
            marks.push(Mark::new(&row.name, ours, Shape::Points(points)));
            let printed = self.runs.iter().enumerate();
            let printed = printed
                .filter_map(|(run, name)| Some([place(run), row.paper?.of_run(name)?]))
                .collect();
            let style = Style {
                marker: Marker::Diamond,
                fill: Fill::Open,
                size_px: 9.0,
                ..ours
            };
            marks.push(Mark::new(
                format!("{}, paper", row.name),
                style,
                Shape::Points(printed),
            ));
        }
        let panel = Panel {
            x: Axis::categories("", self.runs.iter().map(|run| format!("run {run}"))),
            y: Axis::log("distance (eq. 8)"),
            marks,
            ..Panel::default()
        };
        figures::single(
            &self.title,
            "Distances with the interval of the middle 95 % of the draws.",
            panel,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_numbers_stand_beside_ours() {
        let row = Row {
            key: "improved".into(),
            name: "improved sensor".into(),
            paper: Some(published::IMPROVED),
            here: vec![Estimate::of(&[1.0, 3.0]), Estimate::of(&[4.0])],
        };
        let runs = vec!["d".to_owned(), "x".to_owned()]; // the paper has no run x
        let distances = Distances {
            title: "T".into(),
            runs,
            rows: vec![row],
        };
        let table = distances.table();
        assert_eq!(table.rows[0], ["improved sensor, paper", "0.5", "-"]);
        assert_eq!(table.rows[1][2], "4.0");
        let beside = distances.beside("T", "before", &[("after", &distances)]);
        let heads: Vec<&str> = beside.rows.iter().map(|row| row[0].as_str()).collect();
        assert_eq!(
            heads,
            ["paper", "before", "after"].map(|line| format!("improved sensor, {line}"))
        );
        assert_eq!(distances.json()["improved"]["d"]["paper"], 0.5);
        assert_eq!(distances.json()["improved"]["x"]["distance"], 4.0);
        assert!(distances.csv().ends_with("improved,x,,4,4,4,4\n"));
        assert!(distances.figure().to_svg().is_ok());
    }
}
