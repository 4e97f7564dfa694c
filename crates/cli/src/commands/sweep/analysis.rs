//! One seed's Point Distribution Model and the distances in it.

use anyhow::{Context, Result};
use pdm::{Cluster, Hotelling, Modes, Pdm, Projection};

use super::Sweep;
use super::unit::Unit;
use crate::laps::mean_and_deviation;

/// Distances are taken in so many modes, as in the paper's tables.
pub(super) const MODES: usize = 2;

/// What one seed gave.
pub(super) struct SeedResult {
    pub(super) seed: u64,
    /// Fraction of the variance in each mode.
    pub(super) explained: Vec<f64>,
    /// Grid point by grid point, each against every measured run.
    pub(super) rows: Vec<Row>,
    /// Of each measured run the mean distance from the others in the same model, or why there is none.
    pub(super) among_measured: Vec<Result<f64, String>>,
    /// What a user must know of laps that are not there.
    pub(super) remarks: Vec<String>,
}

/// One grid point against one measured run.
pub(super) struct Row {
    pub(super) point: usize,
    /// Index of the measured run.
    pub(super) run: usize,
    /// Eqs. 8 and 9, or why there is no such number.
    pub(super) test: Result<Hotelling, String>,
    /// Simulated laps used.
    pub(super) laps: usize,
    /// Simulated runs that timed out.
    pub(super) timed_out: usize,
}

/// The laps of one seed as clusters; a point without laps has none.
pub(super) struct Clusters {
    pub(super) points: Vec<Option<Cluster>>,
    pub(super) measured: Vec<Cluster>,
    pub(super) pdm: Pdm,
}

impl Clusters {
    pub(super) fn new(sweep: &Sweep, units: &[Unit]) -> Result<Self> {
        let cluster = |(point, unit): (&super::grid::Point, &Unit)| {
            let laps = &unit.offsets_m;
            (!laps.is_empty())
                .then(|| Cluster::new(&point.name, laps))
                .transpose()
        };
        let points: Vec<Option<Cluster>> = sweep
            .grid
            .points
            .iter()
            .zip(units)
            .map(cluster)
            .collect::<Result<_, _>>()?;
        let measured = sweep.measured.clusters()?;
        let pdm = Pdm::fit(measured.iter().chain(points.iter().flatten()))?;
        Ok(Self {
            points,
            measured,
            pdm,
        })
    }

    /// A cluster in the modes that are compared.
    pub(super) fn project(&self, cluster: &Cluster) -> Result<Projection> {
        Ok(self.pdm.project(cluster, Modes::First(MODES))?)
    }
}

/// Every grid point against every measured run, in one model of them all.
pub(super) fn compare(sweep: &Sweep, seed: usize, units: &[Unit]) -> Result<SeedResult> {
    let number = sweep.seeds[seed];
    let clusters = Clusters::new(sweep, units).with_context(|| format!("seed {number}"))?;
    let measured: Vec<Projection> = clusters
        .measured
        .iter()
        .map(|cluster| clusters.project(cluster))
        .collect::<Result<_>>()?;
    let mut rows = Vec::with_capacity(units.len() * measured.len());
    for (point, (unit, cluster)) in units.iter().zip(&clusters.points).enumerate() {
        let simulated = cluster
            .as_ref()
            .map(|cluster| clusters.project(cluster))
            .transpose()?;
        for (run, measured) in measured.iter().enumerate() {
            let test = match &simulated {
                Some(simulated) => pdm::hotelling(simulated, measured).map_err(|error| error.to_string()),
                None => Err("no lap was closed".to_owned()),
            };
            rows.push(Row {
                point,
                run,
                test,
                laps: unit.offsets_m.len(),
                timed_out: unit.timed_out(),
            });
        }
    }
    let among_measured = (0..measured.len())
        .map(|run| from_the_others(&measured, run))
        .collect();
    let remark = |text: &String| format!("seed {number}: {text}");
    let remarks = units
        .iter()
        .flat_map(|unit| &unit.runs)
        .flat_map(|run| &run.remarks)
        .map(remark)
        .collect();
    Ok(SeedResult {
        seed: number,
        explained: clusters.pdm.explained(),
        rows,
        among_measured,
        remarks,
    })
}

/// The mean distance of one measured run from the others: what a simulation as good as the robot itself would have.
fn from_the_others(measured: &[Projection], run: usize) -> Result<f64, String> {
    let others = measured.iter().enumerate().filter(|(other, _)| *other != run);
    let distances: Vec<f64> = others
        .map(|(_, other)| pdm::distance(&measured[run], other).map_err(|error| error.to_string()))
        .collect::<Result<_, _>>()?;
    if distances.is_empty() {
        return Err("there is no other measured run".to_owned());
    }
    Ok(mean_and_deviation(&distances).0)
}
