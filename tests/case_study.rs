//! The last part of `lapwing reproduce`: what the model lacks in the measured laps.

use serde_json::Value;

use crate::support::Scratch;

/// Signatures that are kept from one call of the tests to the next.
const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/signatures");

/// Laps of a robot whose wheels differ, and laps of the other controller as the declared model drives them.
fn measure(scratch: &Scratch) {
    scratch.write(
        "uneven.toml",
        "[[effect]]\nkind = \"wheel-asymmetry\"\nratio = 1.04\n",
    );
    scratch.write("turning.toml", "controller.kind = \"rule-based\"\n");
    for (name, laps) in [("uneven", "6"), ("turning", "4")] {
        let model = format!("{name}.toml");
        scratch.done([
            "drive", &model, "--name", name, "--runs", "2", "--laps", laps, "--out", name, "--quiet",
        ]);
    }
}

#[test]
fn reproduce_ends_with_what_the_model_lacks() {
    let scratch = Scratch::new();
    measure(&scratch);
    let reproduce = [
        "reproduce",
        "--measured",
        "uneven",
        "--measured",
        "turning",
        "--seeds",
        "2",
        "--cache",
        CACHE,
        "--out",
        "report",
    ];
    let ran = scratch.done(reproduce);
    assert!(ran.stdout.contains("What the model lacks"), "{}", ran.stdout);

    let tables: Value = serde_json::from_str(&scratch.read("report/tables.json")).unwrap();
    let trace = &tables["trace"];
    let found = &trace["braitenberg"];
    assert_eq!(found["effects"][0]["name"], "wheel-asymmetry", "{found:#}");
    assert!(
        trace["rule_based"]["verdict"].is_string(),
        "{:#}",
        trace["rule_based"]
    );
    for (table, rows) in [
        ("table_ii", vec!["improved", "original"]),
        ("table_iii", vec!["0.001", "0.005", "0.01", "0.05"]),
    ] {
        for (place, row) in rows.into_iter().enumerate() {
            let [before, after] = [&tables[table], &trace[format!("{table}_after")]]
                .map(|table| table[row]["a"]["distance"].as_f64().unwrap());
            assert!(before != after, "{table} {row}: {before} before, {after} after");
            assert_eq!(trace["changes"][table][place]["simulation"], row);
        }
    }
    assert_eq!(trace["changes"]["table_ii"][0]["change"], "closer", "{trace:#}");
    let causes = trace["causes"].as_array().unwrap();
    let cause = |effect: &str| {
        let stands = |cause: &&Value| {
            let effects = cause["effects"].as_array().unwrap();
            effects.iter().any(|name| name == effect)
        };
        causes.iter().find(stands).unwrap()
    };
    assert_eq!(cause("slip-memory")["present"], true, "{causes:#?}");
    for cause in causes {
        assert!(matches!(cause["present"], Value::Bool(_) | Value::Null));
        assert!(
            cause["evidence"].as_str().unwrap().contains("braitenberg: "),
            "{cause}"
        );
    }
    assert_ne!(cause("cone-of-view")["present"], true, "{causes:#?}");

    let report = scratch.read("report/report.html");
    let last = report.rsplit("<section ").next().unwrap();
    for part in [
        ". What the model lacks</h2>",
        "<h3>Braitenberg robot</h3>",
        "<h3>Rule-based robot</h3>",
        "improved sensor, after",
        "error 50 mm, after",
        "a cone of view instead of a ray",
        "nothing is concluded about its robot",
    ] {
        assert!(last.contains(part), "the last section has no `{part}`");
    }
    let map = scratch.read("report/figures/trace_braitenberg_residual_map.svg");
    assert!(map.contains("<svg"), "{map}");
    let after = scratch.read("report/braitenberg.after.toml");
    assert!(after.contains("wheel-asymmetry"), "{after}");
}
