//! `lapwing world`: check a world, cut its walls.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use chart::{Axis, Color, Dash, Figure, Mark, Panel, Shape, Style};
use serde_json::{Value, json};
use sim::{Circuit, Scene};
use track::{Course, Side};

use crate::args::World;
use crate::config::{Config, WorldSource, world_source};
use crate::figures::{MM, gates, joints, map, single, start, walls};
use crate::output::{OutDir, Work};
use crate::session::Session;
use crate::setup;
use crate::table::{Table, four_digits};

pub(crate) fn run(session: &Session, args: &World) -> Result<()> {
    match args {
        World::Check { world, json, out } => check(session, &source(world)?, *json, out.as_deref()),
        World::Segments {
            world,
            max_error,
            json,
            out,
        } => segments(session, &source(world)?, max_error, *json, out.as_deref()),
    }
}

/// A file if there is one, else the shipped world of that name.
fn source(world: &Path) -> Result<WorldSource> {
    if world.is_file() {
        return world_source("", None, Some(world));
    }
    world_source(&world.to_string_lossy(), None, None)
}

fn check(session: &Session, source: &WorldSource, json: bool, out: Option<&Path>) -> Result<()> {
    let (config, course) = (Config::shipped(), setup::course(source)?);
    let model = setup::model(&config, &course)?;
    let label = || source.label.clone();
    model.check_fits(&course).with_context(label)?;
    let circuit = Arc::new(Circuit::new(course, config.run.gates).with_context(label)?);
    Scene::new(Arc::clone(&circuit), &model, None).with_context(label)?; // the walls can be cut
    let course = &circuit.course;
    let corridor = course.corridor_m();
    let sight_m = model.machine.robot.body_radius_m + model.machine.range_m;
    if corridor.narrowest_m > 2.0 * sight_m {
        session.remark(&format!(
            "{}: in the middle of the corridor no wall is near enough to be seen: it is {} m wide at least, and the sensors \
             see {} m; lengths are in m",
            source.label,
            four_digits(corridor.narrowest_m),
            model.machine.range_m
        ));
    }
    if let Some(out) = out {
        let folder = OutDir::create(
            out,
            &Work::new("world check", &source.text),
            std::slice::from_ref(&source.input),
            false,
        )?;
        let [gate_0, driven] = start(&circuit);
        let marks = vec![walls(course), joints(course), gates(&circuit), gate_0, driven];
        folder.write(
            "course.svg",
            single(
                "The course",
                "Walls, joints and gates; where laps begin, and the way they are driven.",
                map("", marks),
            )
            .to_svg()?,
        )?;
        folder.finish(&session.manifest(json!({ "world": source.label }), vec![source.input.clone()]))?;
    }
    let wall = |side: Side| {
        let wall = course.wall(side);
        json!({ "name": wall.name(), "length_m": wall.length_m(), "splines": wall.splines().len() })
    };
    let document = json!({
        "world": course.name,
        "arena_m": course.arena_m,
        "direction": course.direction.name(),
        "walls": [wall(Side::Outer), wall(Side::Inner)],
        "corridor_m": { "narrowest": corridor.narrowest_m, "widest": corridor.widest_m,
            "narrowest_at": [corridor.narrowest_at.x, corridor.narrowest_at.y] },
        "gates": circuit.gates.len(),
        "midline_m": circuit.gates.midline_length_m(),
        "gate_spacing_m": circuit.gates.spacing_m(),
    });
    if json {
        session.print_json(&document)
    } else {
        session.print(&check_text(&document))
    }
}

fn check_text(document: &Value) -> String {
    let millimetres = |value: &Value| format!("{:.1} mm", MM * value.as_f64().unwrap_or(f64::NAN));
    let metres = |value: &Value| format!("{:.4} m", value.as_f64().unwrap_or(f64::NAN));
    let mut table = Table::new(
        format!("{}: sound", document["world"].as_str().unwrap_or("")),
        &["what", "value"],
    );
    for wall in document["walls"].as_array().into_iter().flatten() {
        let name = wall["name"].as_str().unwrap_or("");
        table.push([
            format!("{name} wall"),
            format!("{}, {} b-splines", metres(&wall["length_m"]), wall["splines"]),
        ]);
    }
    let corridor = &document["corridor_m"];
    table.push([
        "driven".to_owned(),
        document["direction"].as_str().unwrap_or("").to_owned(),
    ]);
    table.push([
        "narrowest corridor".to_owned(),
        millimetres(&corridor["narrowest"]),
    ]);
    table.push(["widest corridor".to_owned(), millimetres(&corridor["widest"])]);
    table.push(["midline".to_owned(), metres(&document["midline_m"])]);
    let spacing = millimetres(&document["gate_spacing_m"]);
    table.push([
        "gates".to_owned(),
        format!("{}, {spacing} apart", document["gates"]),
    ]);
    table.to_text()
}

fn segments(
    session: &Session,
    source: &WorldSource,
    max_errors_m: &[f64],
    json: bool,
    out: Option<&Path>,
) -> Result<()> {
    let course = setup::course(source)?;
    let approximations: Vec<Value> = max_errors_m
        .iter()
        .map(|&error| approximation(&course, error))
        .collect::<Result<_>>()?;
    let document = json!({ "world": course.name, "approximations": approximations });
    if let Some(out) = out {
        let configuration = json!({ "world": source.label, "max_error_m": max_errors_m });
        let folder = OutDir::create(
            out,
            &Work::new("world segments", &configuration),
            std::slice::from_ref(&source.input),
            false,
        )?;
        folder.write("segments.json", format!("{document:#}\n"))?;
        folder.write("segments.svg", segments_figure(&course, max_errors_m)?.to_svg()?)?;
        folder.finish(&session.manifest(configuration, vec![source.input.clone()]))?;
    }
    if json {
        return session.print_json(&document);
    }
    let mut table = Table::new(
        &course.name,
        &[
            "max error, mm",
            "segments",
            "outer",
            "inner",
            "measured error, mm",
        ],
    );
    for a in &approximations {
        let mm = |value: &Value| MM * value.as_f64().unwrap_or(f64::NAN);
        table.push([
            format!("{}", mm(&a["max_error_m"])),
            a["segments"].to_string(),
            a["per_wall"]["outer"].to_string(),
            a["per_wall"]["inner"].to_string(),
            format!("{:.4}", mm(&a["measured_error_m"])),
        ]);
    }
    session.print(&table.to_text())
}

fn approximation(course: &Course, max_error_m: f64) -> Result<Value> {
    let chain = |side: Side| {
        course
            .wall(side)
            .flatten(max_error_m)
            .map(|chain| (course.wall(side), chain))
    };
    let both = chain(Side::Outer).and_then(|outer| Ok((outer, chain(Side::Inner)?)));
    let (outer, inner) = both.with_context(|| format!("--max-error {max_error_m}"))?;
    let measured = |(wall, chain): &(&track::Wall, track::Chain)| chain.measured_error_m(wall);
    let (n_outer, n_inner) = (outer.1.vertices.len(), inner.1.vertices.len());
    Ok(json!({
        "max_error_m": max_error_m,
        "segments": n_outer + n_inner,
        "per_wall": { "outer": n_outer, "inner": n_inner },
        "measured_error_m": measured(&outer).max(measured(&inner)),
    }))
}

/// The number of segments against the maximal error, with the law N ~ error^(-1/2).
pub(crate) fn segments_figure(course: &Course, marked_m: &[f64]) -> Result<Figure> {
    let count = |error_m: f64| -> Result<[f64; 2]> {
        let n = course.outer.flatten(error_m)?.vertices.len() + course.inner.flatten(error_m)?.vertices.len();
        Ok([MM * error_m, n as f64])
    };
    let ladder: Vec<[f64; 2]> = (0..=30)
        .map(|i| count(1e-4 * 10_f64.powf(f64::from(i) * 0.1)))
        .collect::<Result<_>>()?;
    // The law through the finest cut, where it holds best.
    let law: Vec<[f64; 2]> = ladder
        .iter()
        .map(|[e, _]| [*e, ladder[0][1] * (ladder[0][0] / e).sqrt()])
        .collect();
    let marked: Vec<[f64; 2]> = marked_m.iter().map(|&e| count(e)).collect::<Result<_>>()?;
    let panel = Panel {
        x: Axis::log("maximal error, mm"),
        y: Axis::log("segments"),
        marks: vec![
            Mark::new(
                "error^(-1/2)",
                Style {
                    dash: Dash::Dashed,
                    ..Style::color(Color::GREY)
                },
                Shape::Line(law),
            ),
            Mark::new("both walls", Style::series(0), Shape::Line(ladder)),
            Mark::new(
                "asked for",
                Style::color(Color::VERMILLION),
                Shape::Points(marked),
            ),
        ],
        ..Panel::default()
    };
    Ok(single(
        "Segments against wall error",
        "The number of straight segments grows as error^(-1/2).",
        panel,
    ))
}
