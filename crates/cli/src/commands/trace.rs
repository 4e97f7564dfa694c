//! `lapwing trace`: what the model lacks.

use anyhow::{Result, bail};
use serde_json::json;

use crate::args;
use crate::dataset::{DataSet, RunFile};
use crate::experiments::Section;
use crate::output::{OutDir, Work};
use crate::report::Report;
use crate::session::Session;
use crate::setup;
use crate::trace::{Cache, Trace, document, gates_csv, sections, starts_csv};

pub(crate) fn run(session: &Session, args: &args::Trace) -> Result<()> {
    let file = setup::model_file(&args.model)?;
    let sets: Vec<DataSet> = (args.measured.iter())
        .map(|path| DataSet::load(path))
        .collect::<Result<_>>()?;
    let held_out = args.held_out.as_deref().map(DataSet::load).transpose()?;
    each_once(session, sets.iter().chain(&held_out))?;
    let mut inputs = vec![file.input.clone()];
    inputs.extend(sets.iter().flat_map(|set| set.inputs.clone()));
    inputs.extend(held_out.iter().flat_map(|set| set.inputs.clone()));
    let configuration = json!({
        "model": file.config, "seed": session.seed(), "measured": args.measured, "held_out": args.held_out, "inputs": inputs,
    });
    let folder = OutDir::create(&args.out, &Work::new("trace", &configuration), &inputs, false)?;
    let cache = Cache::new(&args.signatures);
    let world = args.model.settings.world.as_deref();
    let trace = Trace::new(session, &file, world, sets, held_out, &cache)?;
    let document = document(&trace);
    let sections = sections(&trace)?;
    folder.write("trace.json", format!("{document:#}\n"))?;
    folder.write("model.after.toml", trace.after_config().to_toml())?;
    for picture in sections.iter().flat_map(Section::pictures) {
        folder.write(&format!("figures/{}.svg", picture.file), picture.figure.to_svg()?)?;
        folder.write(&format!("figures/{}.csv", picture.file), picture.figure.to_csv())?;
    }
    folder.write("gates.csv", gates_csv(&trace))?;
    folder.write("starts.csv", starts_csv(&trace))?;
    let tables = sections
        .iter()
        .flat_map(|section| section.tables().map(move |table| (section, table)));
    for (number, (section, table)) in tables.enumerate() {
        let heading = section.heading.to_lowercase().replace(' ', "_");
        folder.write(&format!("tables/{:02}_{heading}.csv", number + 1), table.to_csv())?;
    }
    let text = trace.text(&sections);
    let names: Vec<&str> = (trace.recordings.iter())
        .map(|recording| recording.measured.set.name.as_str())
        .collect();
    let title = format!("What the model lacks: {}", names.join(", "));
    folder.write(
        "report.html",
        Report {
            title,
            lead: Vec::new(),
            sections,
        }
        .to_html()?,
    )?;
    folder.finish(&session.manifest(configuration, inputs))?;
    if args.json {
        return session.print_json(&document);
    }
    session.print(&format!(
        "{text}\nreport: {}\n",
        args.out.join("report.html").display()
    ))
}

/// Whether every run is given once, however its file is packed: twice it would count for two, and held out it would be no test.
fn each_once<'a>(session: &Session, sets: impl Iterator<Item = &'a DataSet>) -> Result<()> {
    let mut known: Vec<&RunFile> = Vec::new();
    for run in sets.flat_map(|set| &set.runs) {
        if let Some(other) = known.iter().find(|other| other.rows.begins_as(&run.rows)) {
            let (shown, other_shown) = (run.path.display(), other.path.display());
            if other.rows.t_s.len() == run.rows.t_s.len() {
                bail!(
                    "{shown}: the same run as {other_shown}; give each run once: what is held out must not be fitted, and what is \
                     given twice counts twice"
                );
            }
            session.remark(&format!(
                "{shown} begins as {other_shown} does, to the last digit: the one tells nothing new as far as the other goes"
            ));
        }
        known.push(run);
    }
    Ok(())
}
