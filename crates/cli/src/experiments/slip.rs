//! Section IV-B.3, Fig. 13: what does the wheels' slip noise change?

use anyhow::Result;
use chart::{Figure, Side};
use pdm::Cluster;
use serde_json::{Value, json};

use super::comparison::{Comparison, Pair, Space};
use super::estimate::{Estimate, Tally};
use super::mean_lap::{Difference, spread_m};
use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::study::{Draw, Study, Variant};
use crate::figures::{self, MM, Shown, measured, simulated};
use crate::table::Table;

const VARIANTS: [Variant; 2] = [Variant::Standard, Variant::Slip100];
const NAMES: [&str; 2] = ["slip 10 %", "slip 100 %"];

/// The places of runs c and d among the clusters.
const RUNS: [usize; 2] = [0, 1];
/// The places of the simulations with 10 % and with 100 %.
const LITTLE: usize = 2;
const MUCH: usize = 3;

/// Both levels of slip noise beside runs c and d in one PDM, and their mean laps.
struct Slip {
    comparison: Comparison,
    /// Names of the two measured runs.
    runs: [String; 2],
    places: [usize; 2],
    /// Root mean square distance of the two simulated mean laps, by draw, m.
    means_m: Vec<f64>,
    /// The same for the mean over all draws, in which chance has averaged out, m.
    all_means_m: f64,
    /// Root mean square distance of laps from their mean, both levels pooled as in eq. 7, by draw, m.
    spreads_m: Vec<f64>,
    /// The same of the laps with 10 % alone, the stricter yardstick, m.
    little_spreads_m: Vec<f64>,
}

/// The experiment: runs c and d and one simulated run with each level of noise.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let slip = Slip::new(study)?;
    let blocks = vec![
        Block::Text(format!(
            "White noise of 10 % and of 100 % on the speed of each wheel, beside measured runs {} and {}. The paper \
             compares the means and, by eye, the shapes of the clusters; here the shape of a cluster is its ellipse of \
             one standard deviation in the first two modes.",
            slip.runs[0], slip.runs[1]
        )),
        Picture::block(
            "fig13_slip_pdm",
            "Fig. 13",
            "Two measured runs and the simulations with 10 % and 100 % slip noise in the first two modes.",
            slip.figure(),
        ),
        Block::Table(slip.shapes()),
        Block::Table(slip.pairs()),
        Block::Claims(slip.claims()),
    ];
    Ok(Outcome {
        section: Section {
            heading: "Wheel slip".into(),
            blocks,
        },
        csv: vec![("slip.csv", slip.csv())],
        json: vec![("slip", slip.json())],
    })
}

impl Slip {
    fn new(study: &Study) -> Result<Self> {
        let places = [study.run_named("c", 1), study.run_named("d", 0)];
        let comparison = Comparison::new(&study.clusters(&places, &VARIANTS))?;
        let cluster = |draw: &'_ Draw, variant: Variant| -> Cluster { draw.run(variant).cluster.clone() };
        let means_m = study.draws.iter().map(|draw| {
            Difference::new(
                &cluster(draw, Variant::Slip100),
                &cluster(draw, Variant::Standard),
            )
            .rms_m
        });
        let pooled = |draw: &Draw| {
            let [little, much] = VARIANTS.map(|variant| spread_m(&draw.run(variant).cluster));
            (0.5 * (little * little + much * much)).sqrt()
        };
        let all = |variant: Variant| -> Result<Cluster> {
            let laps = study
                .draws
                .iter()
                .flat_map(|draw| draw.run(variant).run.offsets_m())
                .collect::<Vec<_>>();
            Ok(Cluster::new(variant.name(), &laps)?)
        };
        let names = study.runs();
        Ok(Self {
            comparison,
            runs: places.map(|place| names[place].clone()),
            places,
            means_m: means_m.collect(),
            all_means_m: Difference::new(&all(Variant::Slip100)?, &all(Variant::Standard)?).rms_m,
            spreads_m: study.draws.iter().map(pooled).collect(),
            little_spreads_m: study
                .draws
                .iter()
                .map(|draw| spread_m(&draw.run(Variant::Standard).cluster))
                .collect(),
        })
    }

    fn names(&self) -> Vec<String> {
        self.runs
            .iter()
            .map(|run| format!("measured, run {run}"))
            .chain(NAMES.map(String::from))
            .collect()
    }

    /// The area of a cluster's ellipse, mm^2.
    fn area_mm2(&self, cluster: usize) -> Estimate {
        self.comparison
            .estimate(|draw| MM * MM * draw.ellipses[cluster].area())
    }

    /// How many times larger the ellipse of 100 % is.
    fn ratio(draw: &Space) -> f64 {
        draw.ellipses[MUCH].area() / draw.ellipses[LITTLE].area()
    }

    /// Means and shapes; means are those of the first draw, as each draw has modes of its own.
    fn shapes(&self) -> Table {
        let columns = [
            "cluster",
            "mean in modes 1, 2, mm",
            "long half axis, mm",
            "short half axis, mm",
            "area, mm²",
        ];
        let mut table = Table::new("Means and shapes of the clusters of Fig. 13", &columns);
        for (cluster, name) in self.names().into_iter().enumerate() {
            let [x, y] = self.comparison.draws[0].ellipses[cluster].centre;
            let axis = |i: usize| {
                let length = |draw: &Space| MM * draw.ellipses[cluster].semi_axes[i];
                self.comparison.estimate(length).text(1)
            };
            let mean = format!("{:.1}, {:.1}", MM * x, MM * y);
            let area = self.area_mm2(cluster).text(0);
            table.push([name, mean, axis(0), axis(1), area]);
        }
        table
    }

    /// How far apart the means and the shapes are.
    fn pairs(&self) -> Table {
        let [c, d] = &self.runs;
        let heads = [
            "cluster".to_owned(),
            format!("distance to run {c}"),
            format!("distance to run {d}"),
            format!("shape contrast to run {c}"),
            format!("shape contrast to run {d}"),
        ];
        let title = "Distances of the clusters of Fig. 13, and contrasts of their covariances";
        let mut table = Table::new(title, &heads.each_ref().map(String::as_str));
        for (cluster, name) in self.names().into_iter().enumerate() {
            let of_pair = |run: usize, number: &dyn Fn(&Pair) -> f64| match run == cluster {
                true => "-".to_owned(),
                false => self
                    .comparison
                    .estimate(|draw| number(draw.pair(cluster, run)))
                    .text(1),
            };
            let [near, far] = RUNS.map(|run| of_pair(run, &|pair| pair.distance));
            let [one, other] = RUNS.map(|run| of_pair(run, &|pair| pair.contrast));
            table.push([name, near, far, one, other]);
        }
        table
    }

    fn claims(&self) -> Vec<Claim> {
        let millimetres = |values_m: &[f64]| {
            let values: Vec<f64> = values_m.iter().map(|m| MM * m).collect();
            Estimate::of(&values).text(1)
        };
        let draws = 0..self.means_m.len();
        let small = Tally::of(
            draws
                .clone()
                .map(|draw| self.means_m[draw] < self.spreads_m[draw]),
        );
        let smaller = Tally::of(draws.map(|draw| self.means_m[draw] < self.little_spreads_m[draw]));
        vec![
            Claim::counted(
                "The slip noise has hardly any influence on the mean lap (less than the laps of both levels, pooled as in eq. 7, scatter about it)",
                "seen in Fig. 13",
                &format!(
                    "distance of the two clusters {}; mean laps {} mm rms apart ({:.1} over all draws together), laps {} \
                     mm rms from their mean, both levels pooled; but those of 10 % alone only {} mm, and less than that \
                     the mean laps are apart in {smaller}; less than the pooled scatter",
                    self.comparison.distance(LITTLE, MUCH).text(1),
                    millimetres(&self.means_m),
                    MM * self.all_means_m,
                    millimetres(&self.spreads_m),
                    millimetres(&self.little_spreads_m),
                ),
                small,
            ),
            Claim::counted(
                "The offset to the measured runs is still there with either noise (Hotelling's test at 5 %)",
                "seen in Fig. 13",
                &format!(
                    "to run {} {} and {}, to run {} {} and {}",
                    self.runs[0],
                    self.comparison.distance(0, LITTLE).text(1),
                    self.comparison.distance(0, MUCH).text(1),
                    self.runs[1],
                    self.comparison.distance(1, LITTLE).text(1),
                    self.comparison.distance(1, MUCH).text(1),
                ),
                self.comparison.tally(|draw| {
                    RUNS.iter()
                        .all(|&run| draw.differ(run, LITTLE) && draw.differ(run, MUCH))
                }),
            ),
            Claim::counted(
                "The noise changes the shape of the cluster: with 100 % it is larger",
                "seen in Fig. 13",
                &format!(
                    "area {} times that of 10 %",
                    self.comparison.estimate(Self::ratio).text(1)
                ),
                self.comparison.tally(|draw| Self::ratio(draw) > 1.0),
            ),
        ]
    }

    fn figure(&self) -> Figure {
        let style = |cluster: usize| match self.places.get(cluster) {
            Some(&place) => measured(place),
            None => simulated(cluster - 2),
        };
        let shown = |(cluster, (projection, label))| Shown {
            projection,
            label,
            style: style(cluster),
        };
        let clusters: Vec<Shown<'_>> = self
            .comparison
            .projections
            .iter()
            .zip(self.names())
            .enumerate()
            .map(shown)
            .collect();
        let panel = figures::plane("", &self.comparison.pdm, &clusters);
        let panel = chart::Panel {
            size_px: [520.0, 360.0],
            ..panel
        };
        let figure = figures::single(
            "Slip noise in the first two modes",
            "Laps with ellipses of two standard deviations.",
            panel,
        );
        Figure {
            legend: Side::Right,
            ..figure
        }
    }

    fn json(&self) -> Value {
        let cluster = |(cluster, name): (usize, String)| {
            let axis = |i: usize| {
                self.comparison
                    .estimate(|draw| draw.ellipses[cluster].semi_axes[i])
                    .json("value")
            };
            json!({
                "cluster": name,
                "mean_first_m": self.comparison.draws[0].ellipses[cluster].centre,
                "semi_axes_m": [axis(0), axis(1)],
                "area_m2": self.comparison.estimate(|draw| draw.ellipses[cluster].area()).json("value"),
                "distance": RUNS.map(|run| self.comparison.distance(cluster, run).json("distance")),
                "shape_contrast": RUNS.map(|run| self.comparison.estimate(|d| d.pair(cluster, run).contrast).json("value")),
            })
        };
        json!({
            "runs": self.runs,
            "clusters": self.names().into_iter().enumerate().map(cluster).collect::<Vec<_>>(),
            "distance": self.comparison.distance(LITTLE, MUCH).json("distance"),
            "mean_laps_apart_m": Estimate::of(&self.means_m).json("value"),
            "mean_laps_apart_all_draws_m": self.all_means_m,
            "scatter_m": Estimate::of(&self.spreads_m).json("value"),
            "area_ratio": self.comparison.estimate(Self::ratio).json("value"),
        })
    }

    fn csv(&self) -> String {
        let mut csv =
            String::from("cluster,long_axis_m,short_axis_m,area_m2,distance_first_run,distance_second_run\n");
        for (cluster, name) in self.names().into_iter().enumerate() {
            let mean = |number: &dyn Fn(&Space) -> f64| self.comparison.estimate(number).mean;
            let axis = |i: usize| mean(&|draw: &Space| draw.ellipses[cluster].semi_axes[i]);
            let area = mean(&|draw: &Space| draw.ellipses[cluster].area());
            let distance = |run: usize| self.comparison.distance(cluster, run).mean;
            let name = name.replace("measured, ", "");
            csv += &format!(
                "{name},{},{},{area},{},{}\n",
                axis(0),
                axis(1),
                distance(0),
                distance(1)
            );
        }
        csv
    }
}
