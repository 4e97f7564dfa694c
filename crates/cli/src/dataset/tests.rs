use std::fs;
use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;
use tempfile::TempDir;

use super::write::run_csv;
use super::*;
use crate::output::sha256;
use crate::testing::{DIGITS, one_of, word};

const DATASET: &str = "name = \"case\"\nworld = \"roduit2007\"\ncontroller = \"braitenberg\"\n\
                       runs = [\"a\"]\nlaps = 3\nnote = \"by hand\"\n";
const RUN: &str = "t_s,x_m,y_m\n0.000,1.2125,0.6720\n0.064,,\n";

/// The text of a run's file.
fn text(rows: &Rows) -> String {
    let parts = run_csv(rows).unwrap();
    String::from_utf8(parts.flatten().collect()).unwrap()
}

/// A data set in a folder of its own: `dataset.toml` and `run_a.csv`.
fn folder(dataset: &str, run: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join(DESCRIPTION), dataset).unwrap();
    fs::write(folder.path().join("run_a.csv"), run).unwrap();
    folder
}

/// The message, without the folder.
fn message(dataset: &str, run: &str) -> String {
    let folder = folder(dataset, run);
    let error = DataSet::load(folder.path()).unwrap_err();
    format!("{error:#}").replace(&format!("{}/", folder.path().display()), "")
}

fn packed(text: &str) -> Vec<u8> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::default());
    packed.write_all(text.as_bytes()).unwrap();
    packed.finish().unwrap()
}

#[test]
fn a_data_set_is_read_whole() {
    let folder = folder(DATASET, RUN);
    let set = DataSet::load(folder.path()).unwrap();
    assert_eq!(
        (set.name.as_str(), set.laps, set.note.as_str()),
        ("case", 3, "by hand")
    );
    assert_eq!(set.controller, Some(ControllerKind::Braitenberg));
    assert_eq!(set.runs[0].rows.t_s, [0.0, 0.064]);
    assert_eq!(set.runs[0].rows.position_m, [Some([1.2125, 0.672]), None]);
    assert_eq!(set.runs[0].rows.log, None);
    let hashes: Vec<_> = set.inputs.iter().map(|input| input.sha256.as_str()).collect();
    assert_eq!(hashes, [sha256(DATASET.as_bytes()), sha256(RUN.as_bytes())]);
    assert_eq!(set, DataSet::load(&folder.path().join(DESCRIPTION)).unwrap());
    assert!(set.world_source(None).is_ok());
}

#[test]
fn packed_runs_and_logs_are_read_past_extra_columns() {
    let folder = folder(DATASET, "");
    fs::remove_file(folder.path().join("run_a.csv")).unwrap();
    let run = "left_m_s,who,right_m_s,ps7,ps6,ps5,ps4,ps3,ps2,ps1,ps0,y_m,x_m,t_s\r\n\
               0.05,\"me, too\",-0.05,7,6,5,4,3,2,1,,2,1,0\r\n\r\n";
    fs::write(folder.path().join("run_a.csv.gz"), packed(run)).unwrap();
    let set = DataSet::load(folder.path()).unwrap();
    let rows = &set.runs[0].rows;
    assert_eq!(rows.position_m, [Some([1.0, 2.0])]);
    let log = rows.log.as_ref().unwrap();
    assert!(log.readings[0][0].is_nan());
    assert_eq!(log.readings[0][1..], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!((log.left_m_s[0], log.right_m_s[0]), (0.05, -0.05));
}

#[test]
fn one_run_finds_its_description_or_does_without() {
    let folder = folder(&format!("\u{feff}{DATASET}declared.slip.level = 0.5\n"), RUN);
    let path = folder.path().join("run_a.csv");
    let set = load_run_csv(&path).unwrap();
    assert_eq!((set.name.as_str(), set.runs[0].name.as_str()), ("case", "a"));
    let config = set.declared_config(&Config::shipped()).unwrap();
    assert_eq!(config.slip.level, 0.5);
    fs::remove_file(folder.path().join(DESCRIPTION)).unwrap();
    let set = load_run_csv(&path).unwrap();
    assert_eq!(
        Some(set.name.as_str()),
        folder.path().file_name().unwrap().to_str()
    );
    assert_eq!((set.world.as_ref(), set.laps), (None, LAPS));
    let error = set.world_source(None).unwrap_err().to_string();
    assert!(error.ends_with("names the world of this run; name its file with --world"));
}

#[test]
fn faults_of_a_run_name_line_and_column() {
    for (run, expected) in [
        (
            "",
            "run_a.csv is empty; a line with the names of the columns must come first",
        ),
        (
            "t_s,x_m,y_m\n",
            "run_a.csv: no rows under the header; a run needs one for each control step",
        ),
        (
            "t_s,x_m\n0,1\n",
            "run_a.csv:1: column y_m is missing; there are: t_s, x_m",
        ),
        (
            "t_s,x_m,y_m,x_m\n",
            "run_a.csv:1: column x_m is there twice; remove one",
        ),
        (
            "t_s;x_m;y_m\n",
            "run_a.csv:1: `t_s;x_m;y_m` is one column; separate columns by commas",
        ),
        (
            "t_s,x_m,y_m\n0,1,2\n1,2\n",
            "run_a.csv:3: 2 fields under a header of 3; give every row as many, empty where a value is missing",
        ),
        (
            "t_s,x_m,y_m\n\n\n0,1,two\n",
            "run_a.csv:4: y_m: `two` is not a finite number; leave the field empty if it is missing",
        ),
        (
            "t_s,x_m,y_m\n0,NaN,2\n",
            "run_a.csv:2: x_m: `NaN` is not a finite number; leave the field empty if it is missing",
        ),
        (
            "t_s,x_m,y_m\r\n0,1,2\r\n1,1e999,2\r\n",
            "run_a.csv:3: x_m: `1e999` is not a finite number; leave the field empty if it is missing",
        ),
        (
            "\u{feff}t_s,x_m,y_m\n,1,2\n",
            "run_a.csv:2: t_s: is empty; a number is needed here",
        ),
        (
            "t_s,x_m,y_m\n0,1,2\n0.5,1,2\n0.5,1,2\n",
            "run_a.csv:4: t_s: 0.5 does not come after 0.5 of the row before; times must rise",
        ),
        (
            "t_s,x_m,y_m,ps0,left_m_s\n0,1,2,3,4\n",
            "run_a.csv:1: of the robot's log ps1, ps2, ps3, ps4, ps5, ps6, ps7, right_m_s is \
             missing; a log has ps0 to ps7, left_m_s and right_m_s, so add that or remove the others",
        ),
    ] {
        assert_eq!(message(DATASET, run), expected);
    }
}

#[test]
fn faults_of_the_description_name_line_and_key() {
    for (from, to, expected) in [
        (
            "name = \"case\"",
            "",
            "dataset.toml: `name` is missing; add it, a string",
        ),
        (
            "\"case\"",
            "7",
            "dataset.toml:1: `name`: 7 is not a string, as is needed",
        ),
        (
            "\"braitenberg\"",
            "\"braitenburg\"",
            "dataset.toml:3: `controller`: unknown controller `braitenburg`; nearest: braitenberg; \
             known: braitenberg, rule-based",
        ),
        (
            "laps = 3",
            "laps = 0",
            "dataset.toml:5: `laps`: 0 is not a whole number from 1",
        ),
        (
            "laps = 3",
            "lap = 3",
            "dataset.toml:5: unknown key `lap`; nearest known: laps",
        ),
        (
            "[\"a\"]",
            "[]",
            "dataset.toml:4: `runs`: the names of the runs are needed, as runs = [\"a\", \"b\"]",
        ),
        (
            "[\"a\"]",
            "[\"a\", \"a\"]",
            "dataset.toml:4: run `a` is named twice; remove one",
        ),
        (
            "[\"a\"]",
            "[\"a\",\n\"../b\"]",
            "dataset.toml:5: \"../b\" is no name of a run; the names of the runs are needed, as \
             runs = [\"a\", \"b\"]",
        ),
        (
            "[\"a\"]",
            "[\"a\", \"b\"]",
            "dataset.toml:4: run `b` has no file run_b.csv nor .csv.gz; add it, or take the run \
             out of `runs`",
        ),
        (
            "laps = 3",
            "[declared]\ncontroller.gian_per_count = 1",
            "dataset.toml:6: unknown key `controller.gian_per_count`; nearest known: \
             controller.gain_per_count",
        ),
        (
            "laps = 3",
            "from_start = \"no\"",
            "dataset.toml:5: `from_start`: \"no\" is neither true nor false",
        ),
        (
            "laps = 3",
            "kind = \"drive-log\"",
            "dataset.toml:5: `kind`: drive logs cannot be read here yet",
        ),
    ] {
        // `[declared]` takes what stands below it.
        let dataset = DATASET
            .replace(from, to)
            .replace("gian_per_count = 1\nnote = \"by hand\"", "gian_per_count = 1");
        assert_eq!(message(&dataset, RUN), expected);
    }
    let broken = message("name = \"case\"\nworld = = 1\n", RUN);
    assert!(broken.starts_with("dataset.toml:2: "), "{broken}");
}

#[test]
fn folders_and_packing_that_are_not_what_they_should_be() {
    let folder = folder(DATASET, RUN);
    let both = folder.path().join("run_a.csv.gz");
    fs::write(&both, "not gzip").unwrap();
    let error = DataSet::load(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("and as .csv.gz; remove one"), "{error}");
    fs::remove_file(folder.path().join("run_a.csv")).unwrap();
    let error = format!("{:#}", DataSet::load(folder.path()).unwrap_err());
    assert!(
        error.contains("run_a.csv.gz cannot be unpacked as gzip: "),
        "{error}"
    );
    fs::write(&both, &packed(RUN)[..30]).unwrap();
    let error = format!("{:#}", DataSet::load(folder.path()).unwrap_err());
    assert!(
        error.contains("run_a.csv.gz cannot be unpacked as gzip: "),
        "{error}"
    );
    let error = DataSet::load(&both).unwrap_err().to_string();
    assert!(error.ends_with("is not a folder; a data set is a folder with dataset.toml in it"));
}

#[test]
fn runs_are_named_like_columns_of_a_sheet() {
    for (index, name) in [
        (0, "a"),
        (25, "z"),
        (26, "aa"),
        (27, "ab"),
        (701, "zz"),
        (702, "aaa"),
    ] {
        assert_eq!(run_name(index), name);
    }
}

#[test]
fn numbers_are_rounded_when_written() {
    let rows = Rows {
        t_s: vec![0.0, 0.064, 1234.5678],
        position_m: vec![Some([1.21254999, -0.00004]), None, Some([-0.5, 12.0])],
        log: Some(Log {
            readings: vec![
                [0.04, 0.06, 4095.0, 99.96, 1.0, f64::NAN, 1e-9, 7.25],
                [1.0; 8],
                [2.0; 8],
            ],
            left_m_s: vec![0.05, -0.000004, 0.1288],
            right_m_s: vec![-0.123456, f64::NAN, 1e17],
        }),
    };
    assert_eq!(
        text(&rows),
        "t_s,x_m,y_m,ps0,ps1,ps2,ps3,ps4,ps5,ps6,ps7,left_m_s,right_m_s\n\
         0.000,1.2125,0.0000,0.0,0.1,4095.0,100.0,1.0,,0.0,7.3,0.05000,-0.12346\n\
         0.064,,,1.0,1.0,1.0,1.0,1.0,1.0,1.0,1.0,0.00000,\n\
         1234.568,-0.5000,12.0000,2.0,2.0,2.0,2.0,2.0,2.0,2.0,2.0,0.12880,100000000000000000.00000\n"
    );
    let ragged = Rows {
        t_s: vec![0.0],
        ..Rows::default()
    };
    assert!(run_csv(&ragged).is_err());
}

#[test]
fn what_is_written_is_read_back() {
    let rows = |count: u32| Rows {
        t_s: (0..count).map(|step| f64::from(step) * 0.064).collect(),
        position_m: (0..count)
            .map(|step| Some([f64::from(step) * 0.01, 0.5]))
            .collect(),
        log: None,
    };
    let [five, seven] = [5, 7].map(rows);
    let runs = [("a".to_owned(), &five), ("aa".to_owned(), &seven)];
    let set = DataSetToWrite {
        name: "of \"mine\"",
        world: "roduit2007",
        controller: ControllerKind::RuleBased,
        laps: 20,
        note: "two\nlines",
        declared: &toml::toml! { controller.gain_per_count = 0.001 },
        runs: &runs,
    };
    let folder = TempDir::new().unwrap();
    write_dataset(folder.path(), &set).unwrap();
    let read = DataSet::load(folder.path()).unwrap();
    assert_eq!((read.name.as_str(), read.note.as_str()), (set.name, set.note));
    assert_eq!(read.controller, Some(ControllerKind::RuleBased));
    assert_eq!(&read.declared, set.declared);
    for (read, (name, rows)) in read.runs.iter().zip(&runs) {
        assert_eq!((&read.name, &read.rows.position_m), (name, &rows.position_m));
    }
    let error = write_dataset(&folder.path().join("no"), &set).unwrap_err();
    assert!(format!("{error:#}").starts_with("cannot write "));
}

proptest! {
    #[test]
    fn writing_changes_nothing_but_the_last_decimal(
        values in proptest::collection::vec((-1e4..1e4_f64, -1e4..1e4_f64), 1..20),
    ) {
        let rows = Rows {
            t_s: (0..values.len()).map(|step| step as f64).collect(),
            position_m: values.iter().map(|&(x, y)| Some([x, y])).collect(),
            log: None,
        };
        let folder = folder(DATASET, &text(&rows));
        let read = DataSet::load(folder.path()).unwrap();
        for (read, written) in read.runs[0].rows.position_m.iter().zip(&rows.position_m) {
            let (read, written) = (read.unwrap(), written.unwrap());
            for axis in 0..2 {
                let error = (read[axis] - written[axis]).abs();
                prop_assert!(error <= 0.5001e-4, "{} became {}", written[axis], read[axis]);
            }
        }
    }

    #[test]
    fn no_text_makes_it_panic(
        dataset in word(any::<char>(), 0..=60),
        header in prop_oneof![Just(""), Just("t_s,x_m,y_m\n")],
        rows in word(one_of(&[DIGITS, ",.\n\"a"]), 0..=60),
    ) {
        let folder = folder(&dataset, &format!("{header}{rows}"));
        let _ = DataSet::load(folder.path());
        let _ = load_run_csv(&folder.path().join("run_a.csv"));
    }
}

#[test]
fn the_shipped_laps_are_there_without_a_folder() {
    for controller in [ControllerKind::RuleBased, ControllerKind::Braitenberg] {
        let set = DataSet::shipped(controller).unwrap();
        assert_eq!(set.controller, Some(controller));
        assert!(set.is_shipped());
        let runs: Vec<_> = set.runs.iter().map(|run| run.name.as_str()).collect();
        assert_eq!(
            (runs, set.laps, set.inputs.len()),
            (vec!["a", "b", "c", "d"], 20, 5)
        );
        assert!(set.runs.iter().all(|run| run.rows.t_s.len() > 20_000));
        assert_eq!(set.world_source(None).unwrap().path, None);
    }
}
