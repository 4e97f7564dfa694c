use std::fs;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::*;

fn work(level: f64) -> Work {
    Work::new("sweep", &json!({ "slip": level }))
}

fn manifest() -> Manifest {
    Manifest {
        command_line: vec!["lapwing".into(), "sweep".into()],
        seed: 1,
        configuration: json!({ "slip": 0.1 }),
        inputs: vec![Input::of("model.toml", b"abc")],
        duration_s: 1.23456,
    }
}

fn names(dir: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn refusal(dir: &Path, resume: bool) -> String {
    let error = OutDir::create(dir, &work(0.1), &[], resume).unwrap_err();
    format!("{error:#}")
}

#[test]
fn a_folder_appears_whole() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("deep/out");
    let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    out.write("figures/a.svg", "<svg/>").unwrap();
    out.write("half.json", "{}").unwrap();
    out.remove("half.json").unwrap();
    out.remove("never.json").unwrap();
    assert!(!dir.exists());
    assert!(out.path().join("figures/a.svg").exists());
    out.finish(&manifest()).unwrap();
    assert_eq!(names(&home.path().join("deep")), ["out"]);
    assert_eq!(names(&dir), ["figures", "manifest.json"]);
    let text = fs::read(dir.join("manifest.json")).unwrap();
    let written: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(
        written,
        json!({
            "program": "lapwing",
            "version": env!("CARGO_PKG_VERSION"),
            "command_line": ["lapwing", "sweep"],
            "seed": 1,
            "configuration": { "slip": 0.1 },
            "files": ["figures/a.svg"],
            "inputs": [{
                "path": "model.toml",
                "sha256": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
            }],
            "duration_s": 1.235,
        })
    );
}

#[test]
fn ours_and_empty_folders_are_replaced() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    fs::create_dir(&dir).unwrap();
    for file in ["first", "second"] {
        let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
        out.write(file, file).unwrap();
        out.finish(&manifest()).unwrap();
        let mut expected = [file, "manifest.json"];
        expected.sort();
        assert_eq!(names(&dir), expected);
        assert_eq!(names(home.path()), ["out"]);
    }
}

#[test]
fn anything_else_is_refused_and_left_alone() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    fs::write(&dir, "mine").unwrap();
    assert!(refusal(&dir, false).contains("out is there and is not a folder; name another"));
    fs::remove_file(&dir).unwrap();
    fs::create_dir(&dir).unwrap();
    for foreign in ["{}", "no json", "{\"program\": \"other\", \"version\": \"1\"}"] {
        fs::write(dir.join("manifest.json"), foreign).unwrap();
        assert!(refusal(&dir, false).contains("holds no manifest.json of lapwing"));
        assert_eq!(names(&dir), ["manifest.json"]);
        assert_eq!(names(home.path()), ["out"]);
    }
    assert!(refusal(Path::new("/"), false).contains("cannot be an output folder"));
    assert!(refusal(Path::new(".."), false).contains("cannot be an output folder"));
}

#[test]
fn an_empty_partial_folder_is_what_a_killed_run_left() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    fs::create_dir(home.path().join("out.partial")).unwrap();
    let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    out.write("deep/a.txt", "a").unwrap();
    drop(out);
    assert!(names(home.path()).is_empty());
}

#[test]
fn a_foreign_partial_folder_is_refused() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    fs::create_dir(home.path().join("out.partial")).unwrap();
    fs::write(home.path().join("out.partial/mine.txt"), "mine").unwrap();
    for resume in [false, true] {
        let error = refusal(&dir, resume);
        assert!(error.ends_with("out.partial is there and was not made by lapwing; move it away"));
    }
}

#[test]
fn dropped_work_leaves_nothing_unless_kept() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    out.write("a", "1").unwrap();
    drop(out);
    assert!(names(home.path()).is_empty());
    let mut out = OutDir::create(&dir, &work(0.1), &[], true).unwrap();
    assert!(!out.resumed());
    out.keep_partial();
    out.write("a", "1").unwrap();
    drop(out);
    assert_eq!(names(home.path()), ["out.partial"]);
    let resumed = OutDir::create(&dir, &work(0.1), &[], true).unwrap();
    assert!(resumed.resumed());
    assert_eq!(resumed.read("a").unwrap().as_deref(), Some(&b"1"[..]));
    assert_eq!(resumed.read("b").unwrap(), None);
    resumed.finish(&manifest()).unwrap();
    assert_eq!(names(&dir), ["a", "manifest.json"]);
}

#[test]
fn other_work_is_not_resumed_but_removed_when_begun_anew() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    let begin = |work: &Work| {
        let mut out = OutDir::create(&dir, work, &[], false).unwrap();
        out.keep_partial();
        out.write("a", "1").unwrap();
    };
    begin(&work(0.2));
    let error = refusal(&dir, true);
    assert!(error.contains("was begun with another configuration, seed or input; run without"));
    begin(&Work::new("reproduce", &json!({})));
    assert!(refusal(&dir, true).contains("was begun by `lapwing reproduce`; run without"));
    assert!(
        home.path().join("out.partial/a").exists(),
        "a refusal removes nothing"
    );
    let anew = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    assert_eq!(anew.read("a").unwrap(), None);
}

#[test]
fn two_runs_do_not_share_a_folder() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("out");
    let first = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    for resume in [false, true] {
        assert!(refusal(&dir, resume).contains("is in use by another run of lapwing"));
    }
    first.finish(&manifest()).unwrap();
}

#[test]
fn a_run_killed_while_replacing_loses_nothing() {
    let home = TempDir::new().unwrap();
    let (dir, aside) = (home.path().join("out"), home.path().join("out.replaced"));
    OutDir::create(&dir, &work(0.1), &[], false)
        .unwrap()
        .finish(&manifest())
        .unwrap();
    fs::rename(&dir, &aside).unwrap();
    drop(OutDir::create(&dir, &work(0.1), &[], false).unwrap());
    assert_eq!(names(home.path()), ["out"]);
}

#[test]
fn names_stay_inside() {
    let home = TempDir::new().unwrap();
    let out = OutDir::create(&home.path().join("out"), &work(0.1), &[], false).unwrap();
    for name in ["../a", "/a", "", "a/../../b"] {
        let error = out.write(name, "").unwrap_err().to_string();
        assert_eq!(
            error,
            format!("`{name}` is not a file name inside the output folder")
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_names_file_and_cause_and_leaves_nothing() {
    let home = TempDir::new().unwrap();
    let out = OutDir::create(&home.path().join("out"), &work(0.1), &[], false).unwrap();
    std::os::unix::fs::symlink("/dev/full", out.path().join("a.csv.tmp")).unwrap();
    let error = format!("{:#}", out.write("a.csv", "1").unwrap_err());
    assert!(error.starts_with("cannot write ") && error.contains("out.partial/a.csv: No space left"));
    assert_eq!(out.read("a.csv").unwrap(), None);
    drop(out);
    assert!(names(home.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn a_place_that_cannot_be_written_is_named() {
    let home = TempDir::new().unwrap();
    fs::write(home.path().join("file"), "").unwrap();
    let error = refusal(&home.path().join("file/out"), false);
    assert!(
        error.starts_with("cannot create ") && error.contains("file/out.partial: "),
        "{error}"
    );
}

#[test]
fn the_hash_of_work_is_that_of_its_configuration() {
    assert_eq!(work(0.1), work(0.1));
    assert_ne!(work(0.1), work(0.2));
}

#[test]
fn a_folder_that_holds_an_input_is_not_replaced() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("laps");
    let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
    out.write("more/run_a.csv", "t_s").unwrap();
    out.finish(&manifest()).unwrap();
    let data = dir.join("more/run_a.csv");
    let inputs = [
        Input::of("an embedded file", b""),
        Input::of(data.to_str().unwrap(), b"t_s"),
    ];
    // With or without a way round.
    for dir in [dir.clone(), dir.join("../laps")] {
        let refused = OutDir::create(&dir, &work(0.1), &inputs, false).unwrap_err();
        assert!(format!("{refused}").contains("run_a.csv lies in"), "{refused}");
    }
    assert_eq!(fs::read_to_string(&data).unwrap(), "t_s");
    // A folder within that of the inputs takes nothing from them.
    drop(OutDir::create(&dir.join("report"), &work(0.1), &inputs, false).unwrap());
}

#[test]
fn a_folder_with_a_file_of_its_users_is_not_replaced() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("report");
    let write = || {
        let out = OutDir::create(&dir, &work(0.1), &[], false).unwrap();
        out.write("figures/a.svg", "<svg/>").unwrap();
        out.finish(&manifest()).unwrap();
    };
    write();
    write();
    let note = dir.join("figures/note.txt");
    fs::write(&note, "mine").unwrap();
    let refused = refusal(&dir, false);
    assert!(
        refused.contains("holds figures/note.txt, which lapwing did not write"),
        "{refused}"
    );
    assert_eq!(fs::read_to_string(&note).unwrap(), "mine");
    fs::remove_file(&note).unwrap();
    write();
}

#[cfg(unix)]
#[test]
fn behind_a_link_its_target_is_replaced() {
    let home = TempDir::new().unwrap();
    let (dir, link) = (home.path().join("report"), home.path().join("link"));
    let write = |dir: &Path, text: &str| {
        let out = OutDir::create(dir, &work(0.1), &[], false).unwrap();
        out.write("a.txt", text).unwrap();
        out.finish(&manifest()).unwrap();
    };
    write(&dir, "earlier");
    std::os::unix::fs::symlink(&dir, &link).unwrap();
    write(&link, "later");
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(fs::read_to_string(dir.join("a.txt")).unwrap(), "later");
}
