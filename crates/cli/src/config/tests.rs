use std::fs;
use std::path::Path;

use proptest::prelude::*;
use tempfile::TempDir;

use super::*;
use crate::testing::{DIGITS, LETTERS, one_of, word};

/// The model of a file with this text, and `--set`s.
fn load(text: &str, sets: &[&str]) -> (TempDir, anyhow::Result<ModelFile>) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("model.toml");
    fs::write(&path, text).unwrap();
    let sets: Vec<_> = sets.iter().map(|set| (*set).to_owned()).collect();
    let model = ModelFile::load(ModelSource::Path(&path), &sets);
    (folder, model)
}

/// The message, without the folder.
fn message(text: &str, sets: &[&str]) -> String {
    let (folder, model) = load(text, sets);
    let message = format!("{:#}", model.unwrap_err());
    message.replace(&format!("{}/", folder.path().display()), "")
}

fn config(text: &str, sets: &[&str]) -> Config {
    load(text, sets).1.unwrap().config
}

#[test]
fn the_shipped_model_is_the_declared_one() {
    let shipped = Config::shipped();
    assert_eq!(shipped.world, "roduit2007");
    assert_eq!(shipped.wall.max_error_m, 0.005);
    assert_eq!(shipped.robot.axle_m, 0.053);
    assert_eq!(shipped.sensor.kind, SensorKind::Improved);
    assert_eq!(shipped.sensor.improved.exponent, 1.57281692);
    assert_eq!(shipped.sensor.original.table, [[0.0, 3800.0], [0.1, 300.0]]);
    assert_eq!(shipped.controller.gain_per_count, 0.0005);
    assert_eq!(shipped.run.patience_laps, 10.0);
    assert_eq!(shipped.effect, []);
    // Left and right sensors mirror each other.
    for (right, left) in shipped
        .sensor
        .mounts
        .iter()
        .zip(shipped.sensor.mounts.iter().rev())
    {
        assert_eq!((right.x_m, right.y_m), (left.x_m, -left.y_m));
        assert_eq!(right.angle_rad, -left.angle_rad);
    }
}

#[test]
fn an_empty_file_is_the_shipped_model() {
    assert_eq!(config("", &[]), Config::shipped());
    let shipped = ModelFile::load(ModelSource::Embedded, &[]).unwrap();
    assert_eq!(shipped.config, Config::shipped());
    assert!(!shipped.names("slip.level"));
}

#[test]
fn a_file_overrides_key_by_key_and_the_command_line_overrides_it() {
    let text = "[slip]\nlevel = 1\n[sensor]\nimproved.noise_counts = 0\nmounts = [\n\
                {x_m=0,y_m=0,angle_rad=0},{x_m=0,y_m=0,angle_rad=0},{x_m=0,y_m=0,angle_rad=0},\
                {x_m=0,y_m=0,angle_rad=0},{x_m=0,y_m=0,angle_rad=0},{x_m=0,y_m=0,angle_rad=0},\
                {x_m=0,y_m=0,angle_rad=0},{x_m=1,y_m=0,angle_rad=0}]\n";
    let mut expected = Config::shipped();
    expected.slip.level = 0.5;
    expected.sensor.improved.noise_counts = 0.0;
    expected.sensor.mounts = [Mount {
        x_m: 0.0,
        y_m: 0.0,
        angle_rad: 0.0,
    }; 8];
    expected.sensor.mounts[7].x_m = 2.0;
    expected.run.direction = Direction::CounterClockwise;
    let sets = [
        "slip.level=0.5",
        "sensor.mounts.7.x_m=2",
        "run.direction=counter-clockwise",
    ];
    assert_eq!(config(text, &sets), expected);
}

#[test]
fn values_on_the_command_line_are_toml_or_bare_strings() {
    for set in [
        "sensor.kind=original",
        "sensor.kind = \"original\"",
        "sensor={kind='original'}",
    ] {
        assert_eq!(config("", &[set]).sensor.kind, SensorKind::Original, "{set}");
    }
    let set = "sensor.original.table=[[0, 1], [0.05, 0.5], [0.1, 0]]";
    assert_eq!(config("", &[set]).sensor.original.table.len(), 3);
}

#[test]
fn effects_keep_their_order_and_parameters() {
    let text = "[[effect]]\nkind = \"reading-gain\"\nby = \"run\"\ngain = [1, 1.5]\n\
                [[effect]]\nkind = \"wall-bump\"\nwall = \"outer\"\nheight_m = 0.01\n";
    let effects = config(text, &["effect.0.gain=[1.1, 1.2]", "effect.1.position=0.5"]).effect;
    assert_eq!(effects[0].kind, "reading-gain");
    assert_eq!(effects[0].by, Some(Pattern::Run));
    assert_eq!(effects[0].parameters, toml::toml! { gain = [1.1, 1.2] });
    assert_eq!(effects[1].by, None);
    assert_eq!(
        effects[1].parameters,
        toml::toml! { wall = "outer"
        height_m = 0.01
        position = 0.5 }
    );
}

#[test]
fn unknown_keys_name_the_nearest() {
    for (text, sets, expected) in [
        (
            "",
            "controller.gian_per_count=1",
            "--set controller.gian_per_count=1: unknown key `controller.gian_per_count`; \
             nearest known: controller.gain_per_count",
        ),
        (
            "[slip]\n\nlevle = 0.1\n",
            "",
            "model.toml:3: unknown key `slip.levle`; nearest known: slip.level",
        ),
        (
            "[contoller]\nkind = \"braitenberg\"\n",
            "",
            "model.toml:1: unknown key `contoller`; nearest known: controller",
        ),
        (
            "gain_per_count = 1\n",
            "",
            "model.toml:1: unknown key `gain_per_count`; nearest known: controller.gain_per_count",
        ),
        (
            "",
            "controller.gian=1",
            "--set controller.gian=1: unknown key `controller.gian`; nearest known: \
             controller.gain_per_count",
        ),
        (
            "",
            "slip.level.deep=1",
            "--set slip.level.deep=1: unknown key `slip.level.deep`: `slip.level` holds a \
             value, not keys",
        ),
        (
            "",
            "effect.0.gain=1",
            "--set effect.0.gain=1: `effect.0` is not there: `effect` has length 0, counted \
             from 0",
        ),
        (
            "",
            "slip.level",
            "--set slip.level: a key and a value are needed, as KEY=VALUE",
        ),
    ] {
        let sets: Vec<_> = [sets].into_iter().filter(|set| !set.is_empty()).collect();
        assert_eq!(message(text, &sets), expected);
    }
}

#[test]
fn values_of_the_wrong_type_say_what_is_needed() {
    for (text, expected) in [
        (
            "slip.level = \"high\"",
            "slip.level = \"high\", but a number is needed",
        ),
        ("slip.level = nan", "slip.level = nan is not a finite number"),
        (
            "wall.max_error_m = -inf",
            "wall.max_error_m = -inf is not a finite number",
        ),
        ("wall = 3", "wall = 3, but a table is needed"),
        (
            "run.gates = 100.0",
            "run.gates = 100.0, but a whole number of at least 0 is needed",
        ),
        (
            "run.gates = -1",
            "run.gates = -1, but a whole number of at least 0 is needed",
        ),
        ("world = 1", "world = 1, but a string is needed"),
        (
            "sensor.kind = \"improve\"",
            "unknown `sensor.kind` = \"improve\"; known: improved, original",
        ),
        ("sensor.mounts = []", "`sensor.mounts` has length 0; 8 is needed"),
        (
            "sensor.original.table = [[1]]",
            "`sensor.original.table.0` has length 1; 2 is needed",
        ),
        (
            "[[effect]]\nby = \"run\"",
            "`effect.0` needs `kind`, a name that `lapwing effects` lists",
        ),
        (
            "[[effect]]\nkind = 3",
            "effect.0.kind = 3, but a string is needed",
        ),
        (
            "effect = [{ kind = \"a\", by = \"lap\" }]",
            "unknown `effect.0.by` = \"lap\"; known: run, time",
        ),
        (
            "effect = [{ kind = \"a\", gain = [1, inf] }]",
            "effect.0.gain.1 = inf is not a finite number",
        ),
        (
            "effect = 1",
            "effect = 1, but an array of tables, written [[effect]], is needed",
        ),
    ] {
        let message = message(text, &[]);
        let (place, problem) = message.split_once(": ").unwrap();
        assert_eq!(problem, expected);
        let line = if text.contains("]\nkind") { 2 } else { 1 };
        assert_eq!(place, format!("model.toml:{line}"), "{message}");
    }
}

#[test]
fn broken_files_name_file_and_line() {
    assert_eq!(
        message("[slip]\nlevel = = 1\n", &[]).split(": ").next(),
        Some("model.toml:2")
    );
    assert!(message("[slip]\nlevel = 1\nlevel = 2\n", &[]).starts_with("model.toml:3: duplicate"));
    assert!(message("slip.level = 1e999", &[]).starts_with("model.toml:1: "));
    let missing = ModelFile::load(ModelSource::Path(Path::new("no/model.toml")), &[]);
    let missing = format!("{:#}", missing.unwrap_err());
    assert!(missing.starts_with("cannot read no/model.toml: "), "{missing}");
    let bytes = Document::parse("m.toml", b"a = 1\nb = \"\xff\"\n".to_vec());
    let bytes = bytes.unwrap_err().to_string();
    assert_eq!(bytes, "m.toml:2: not UTF-8 text; save the file as UTF-8");
}

#[test]
fn later_errors_find_the_line_of_their_key() {
    let (_folder, model) = load(
        "\n[slip]\n# much\nlevel = 1.4\n\n[wall]\n",
        &["camera.noise_m=-1"],
    );
    let model = model.unwrap();
    assert_eq!(model.line_of("slip.level"), Some(4));
    assert_eq!(model.line_of("camera.noise_m"), None);
    assert!(model.names("slip.level") && model.names("camera.noise_m"));
    assert!(!model.names("robot.wheel_speed_limit_m_s"));
    let located = |key, message| {
        let error = model.located(key, message).to_string();
        error.rsplit('/').next().unwrap_or_default().to_owned()
    };
    assert_eq!(
        located("slip.level", "slip.level = 1.4 is outside [0, 1]"),
        "model.toml:4: slip.level = 1.4 is outside [0, 1]"
    );
    assert_eq!(located("camera.noise_m", "no"), "--set camera.noise_m=-1: no");
    assert_eq!(located("wall.max_error_m", "no"), "model.toml:6: no");
    assert_eq!(located("robot.axle_m", "no"), "model.toml: no");
}

#[test]
fn declared_keys_are_laid_over() {
    let declared = toml::toml! { controller.gain_per_count = 0.001
    "run.direction" = "counter-clockwise" };
    let config = Config::shipped().apply_declared(&declared).unwrap();
    assert_eq!(config.controller.gain_per_count, 0.001);
    assert_eq!(config.run.direction, Direction::CounterClockwise);
    assert_eq!(config.controller.speed_m_s, 0.05);
    let typo = toml::toml! { controller.gian = 1 };
    assert!(Config::shipped().apply_declared(&typo).is_err());
}

#[test]
fn worlds_are_found_beside_then_shipped() {
    let (folder, model) = load("world = \"mine.toml\"\n", &[]);
    let model = model.unwrap();
    let missing = format!("{:#}", model.world(None).unwrap_err());
    assert!(missing.contains("model.toml:1: unknown world `mine.toml`: there is no file"));
    assert!(
        missing.ends_with("mine.toml; shipped worlds: roduit2007"),
        "{missing}"
    );
    fs::write(folder.path().join("mine.toml"), "name = \"mine\"").unwrap();
    assert_eq!(model.world(None).unwrap().text, "name = \"mine\"");
    let shipped = world_source("roduit2007", model.path.as_deref(), None).unwrap();
    assert_eq!((shipped.path, shipped.text.as_str()), (None, WORLDS[0].1));
    let given = folder.path().join("mine.toml");
    let given = world_source("roduit2007", None, Some(&given)).unwrap();
    assert_eq!(given.text, "name = \"mine\"");
    let none = world_source("roduit2007", None, Some(Path::new("no.toml"))).unwrap_err();
    assert!(format!("{none:#}").starts_with("cannot read no.toml: "));
}

prop_compose! {
    fn any_config()(
        numbers in proptest::array::uniform8(-1e6..1e6_f64),
        tiny in proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO,
        rays in 0..1000_usize,
        table in proptest::collection::vec(proptest::array::uniform2(0.0..1e4_f64), 0..4),
        words in (0..2_usize, 0..2_usize, 0..2_usize, 0..3_usize),
        world in prop_oneof![word(proptest::char::range(' ', '~'), 0..=12), word(any::<char>(), 0..=6)],
        effects in proptest::collection::vec(any_effect(), 0..3),
    ) -> Config {
        let mut config = Config::shipped();
        config.world = world;
        config.slip.level = tiny;
        config.wall.max_error_m = numbers[0];
        config.robot.axle_m = numbers[1].round();
        for (mount, number) in config.sensor.mounts.iter_mut().zip(numbers) {
            mount.angle_rad = number;
        }
        config.sensor.rays = rays;
        config.sensor.original.table = table;
        config.sensor.kind = [SensorKind::Improved, SensorKind::Original][words.0];
        config.sensor.combine = [Combine::Responses, Combine::Distances][words.1];
        config.controller.kind = [ControllerKind::Braitenberg, ControllerKind::RuleBased][words.2];
        config.run.direction = [Direction::World, Direction::Clockwise, Direction::CounterClockwise][words.3];
        config.effect = effects;
        config
    }
}

fn any_effect() -> impl Strategy<Value = Effect> {
    let number = -1e3..1e3_f64;
    let value = prop_oneof![
        number.clone().prop_map(Value::Float),
        any::<i64>().prop_map(Value::Integer),
        word(one_of(&[LETTERS]), 0..=4).prop_map(Value::String),
        proptest::collection::vec(number.prop_map(Value::Float), 0..4).prop_map(Value::Array),
    ];
    let by = proptest::option::of(prop_oneof![Just(Pattern::Run), Just(Pattern::Time)]);
    // A capital keeps parameters apart from `kind` and `by`.
    let name = (
        proptest::char::range('A', 'Z'),
        word(one_of(&[LETTERS, "_-"]), 0..=5),
    );
    let name = name.prop_map(|(first, rest)| format!("{first}{rest}"));
    let parameters = proptest::collection::btree_map(name, value, 0..4);
    (word(one_of(&[LETTERS, "_-"]), 1..=8), by, parameters).prop_map(|(kind, by, parameters)| Effect {
        kind,
        by,
        parameters: parameters.into_iter().collect(),
    })
}

proptest! {
    #[test]
    fn what_is_written_loads_back_to_the_same(config in any_config()) {
        let text = config.to_toml();
        let loaded = load(&text, &[]).1.map(|model| model.config);
        prop_assert_eq!(loaded.map_err(|error| format!("{error:#}\n{text}")), Ok(config));
    }

    #[test]
    fn no_text_makes_it_panic(text in word(any::<char>(), 0..=40), key in word(one_of(&[LETTERS, DIGITS, "."]), 0..=12)) {
        let _ = load(&text, &[]).1;
        let _ = Config::shipped().with(&key, &text);
    }
}
