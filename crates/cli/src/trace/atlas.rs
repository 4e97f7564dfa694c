//! What the declared model leads one to expect of a recording.

use anyhow::Result;
use diagnose::{Atlas, Extent, Simulate};
use sim::Setting;

use super::cache::Cache;
use super::recording::{Recording, Seeds};
use crate::interrupt;
use crate::session::Session;

/// What the declared model and its other cuts simulate for one recording.
fn with_simulations<R>(
    recording: &Recording,
    seed: u64,
    use_them: impl FnOnce(&Simulate<'_>, &[&Simulate<'_>]) -> R,
) -> R {
    let of = |setup| {
        move |effects: &[Setting], set: u64, extent: Extent| {
            let seeds = Seeds { session: seed, set };
            recording.simulate_anywhere(setup, effects, seeds, extent)
        }
    };
    let declared = of(&recording.setup);
    let cuts: Vec<_> = recording.cuts.iter().map(of).collect();
    let cuts: Vec<&Simulate<'_>> = cuts.iter().map(|cut| cut as &Simulate<'_>).collect();
    use_them(&declared, &cuts)
}

/// What an atlas is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To name what laps lack.
    Name,
    /// To judge laps by: it knows no effect.
    Judge,
}

impl Purpose {
    /// Data sets simulated for it at most with so many other cuts of the walls.
    fn sets(self, cuts: usize) -> u64 {
        match self {
            Self::Name => Atlas::sets(cuts),
            Self::Judge => Atlas::null_sets(cuts),
        }
    }
}

/// The atlas of some recordings together, and of one alone the key of what the cache holds of it.
pub(super) fn atlas(
    session: &Session,
    recordings: &[&Recording],
    purpose: Purpose,
    cache: &Cache,
) -> Result<(Atlas, Option<String>)> {
    let physics_step_s = recordings[0].setup.model.run.physics_step_s();
    let of = |recording: &&Recording| atlas_of(session, recording, (purpose, physics_step_s), cache);
    let parts = recordings.iter().map(of).collect::<Result<Vec<_>>>()?;
    let (parts, mut keys): (Vec<Atlas>, Vec<String>) = parts.into_iter().unzip();
    let atlas = Atlas::join(parts).expect("at least one data set is measured");
    Ok((atlas, keys.pop().filter(|_| keys.is_empty())))
}

/// A recording's atlas, from the cache or made now, and its key there; delays in it come in steps that all recordings share.
fn atlas_of(
    session: &Session,
    recording: &Recording,
    (purpose, physics_step_s): (Purpose, f64),
    cache: &Cache,
) -> Result<(Atlas, String)> {
    let Recording { config, world, .. } = recording;
    let shape = recording.shape();
    let alike = recording.expects_the_same_of_runs();
    let mut key = format!(
        "{}\n{purpose:?}\n{}\n{world}\n{shape:?}\n{}",
        Atlas::RECIPE,
        config.to_toml(),
        session.seed()
    );
    if let Some(unit_m) = recording.written_m {
        key += &format!("\npositions in {unit_m} m");
    }
    if !alike {
        key += &format!("\n{:?}", recording.places(&[]));
    }
    if let Some(begin) = recording.beginnings.unknown() {
        key += &format!("\n{begin}");
    }
    if physics_step_s != recording.setup.model.run.physics_step_s() {
        key += &format!("\ndelays in {physics_step_s} s");
    }
    if let Some(atlas) = cache.get(&key, physics_step_s) {
        return Ok((atlas, key));
    }
    let doing = match purpose {
        Purpose::Name => "simulating what each effect would do",
        Purpose::Judge => "simulating the declared model",
    };
    let progress = session.progress(doing, purpose.sets(recording.cuts.len()));
    let tick = || progress.tick(1);
    let atlas = with_simulations(recording, session.seed(), |declared, cuts| match purpose {
        Purpose::Name => Atlas::new(declared, cuts, alike, physics_step_s, &tick),
        Purpose::Judge => Atlas::without_effects(declared, cuts, alike, &tick),
    });
    drop(progress);
    interrupt::check()?;
    let atlas = atlas?;
    if let Some(folder) = cache.put(&key, &atlas).err() {
        session.remark(&format!(
            "{}: signatures cannot be kept here and are simulated anew next time; choose another folder with --cache",
            folder.display()
        ));
    }
    Ok((atlas, key))
}
