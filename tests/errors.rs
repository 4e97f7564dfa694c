//! What the program says of bad input: file and line, what was expected, what to do; exit status 2, nothing left behind.

use std::fmt::Write as _;

use crate::support::{LAPWING, ROOT, Ran, Scratch, interrupt, measured, world_with};

/// The first and the last control point of the outer wall, and the joint of its first two splines.
const START: &str = "control_points = [[0.55675, 1.02435]";
const END: &str = "[0.55675, 1.02435]]";
const JOINT: &str = "[[1.29205, 0.69505], [1.29780, 0.50010]";

#[test]
fn worlds_that_are_no_course() {
    let scratch = Scratch::new();
    for (old, new, message) in [
        (
            END,
            "[0.55675, 1.00435]]",
            "world.toml:19: outer wall: spline 4 ends 0.020000 m away from where spline 1 starts; let spline 1 start at \
             [0.55675, 1.00435]",
        ),
        (
            START,
            "control_points = [[0,6, 1,0]",
            "world.toml:19: [0.0, 6.0, 1.0, 0.0] has length 4; 2 is needed",
        ),
        (
            JOINT,
            "[[1.29205, 0.69005], [1.29780, 0.50010]",
            "world.toml:21: outer wall: spline 1 ends 0.005000 m away from where spline 2 starts; let spline 2 start at \
             [1.29205, 0.69505]",
        ),
        (
            JOINT,
            "[[1.29205, 0.69505], [1.29580, 0.50010]",
            "world.toml:21: outer wall: the first derivative jumps by 0.002000 m from spline 1 to spline 2; move the \
             second control point of spline 2 to [1.29780, 0.50010]",
        ),
        (
            "[1.11130, 0.67640], [1.10170, 0.53220]",
            "[1.11130, 0.67640], [1.50170, 0.53220]",
            "world.toml:28: the walls cross or touch near [1.2925, 0.4323]; move them apart",
        ),
        (
            "[0.93440, 1.03480], [1.14410, 1.03780]",
            "[1.25440, 1.03480], [0.89410, 1.13780]",
            "world.toml:19: outer wall crosses itself near [1.0659, 1.0331], spline 1 and spline 1; move their control \
             points there apart",
        ),
        (
            START,
            "control_points = [[0.55675, nan]",
            "world.toml:19: y of control point 1 is NaN, not a finite number",
        ),
        (
            START,
            "control_points = [[-inf, 1.02435]",
            "world.toml:19: x of control point 1 is -inf, not a finite number",
        ),
        (
            "[1.4, 1.2]",
            "[inf, 1.2]",
            "world.toml:13: arena = [inf, 1.2] needs a width and a height above 0 m",
        ),
        (
            "[1.4, 1.2]",
            "[1.2, 1.2]",
            "world.toml:17: outer wall leaves the arena at [1.2024, 0.9680]; move it inside or enlarge the arena",
        ),
        (
            "\ndirection",
            "\ndirction",
            "world.toml:14: unknown field `dirction`, expected one of `name`, `arena`, `direction`, `wall`; nearest: \
             `direction`",
        ),
        (
            "\"inner\"",
            "\"middle\"",
            "world.toml:28: unknown wall `middle`; known: outer, inner",
        ),
        (
            "\"clockwise\"",
            "\"counter-clockwise\"",
            "world.toml:14: outer wall runs clockwise but direction is counter-clockwise; turn the order of its splines \
             and of their points round, or change direction",
        ),
        (
            "[1.4, 1.2]",
            "[1.4, 1.2",
            "world.toml:14: missing comma between array elements, expected `,`",
        ),
    ] {
        scratch.write("world.toml", world_with(old, new));
        scratch.refuses(&["world", "check", "world.toml", "--out", "o"], message);
        scratch.refuses(
            &["drive", "roduit2007", "--world", "world.toml", "--out", "o"],
            message,
        );
    }
    scratch.refuses(
        &["world", "check", "elsewhere.toml"],
        "unknown world `elsewhere.toml`: there is no file elsewhere.toml; shipped worlds: roduit2007",
    );
    scratch.refuses(
        &[
            "world",
            "segments",
            "roduit2007",
            "--max-error",
            "0.001,nan",
            "--out",
            "o",
        ],
        "--max-error NaN: maximal error NaN m is outside [1e-9, 10]",
    );
    scratch.refuses(
        &["world", "segments", "roduit2007", "--max-error", "-1"],
        "--max-error -1: maximal error -1 m is outside [1e-9, 10]",
    );
}

#[test]
fn corridors_too_narrow_for_the_robot() {
    let scratch = Scratch::new();
    let mend = "widen it there, or lower robot.body_radius_m or wall.thickness_m";
    // The whole course at 30 %.
    scratch.write("world.toml", scaled_world(0.3));
    let message = format!(
        "world.toml: the corridor is 0.0545 m wide at (0.171, 0.103), too narrow for a robot of 0.0740 m; {mend}"
    );
    scratch.refuses(&["world", "check", "world.toml", "--out", "o"], &message);
    scratch.refuses(
        &["drive", "roduit2007", "--world", "world.toml", "--out", "o"],
        &message,
    );
    // The inner wall bulges to where it nearly touches the other, and gates cross there too.
    let (straight, bulge) = (
        "[0.29490, 0.64060], [0.29490, 0.70190]",
        "[0.11, 0.64060], [0.11, 0.70190]",
    );
    scratch.write("world.toml", world_with(straight, bulge));
    let message = format!(
        "world.toml: the corridor is 0.0150 m wide at (0.111, 0.670), too narrow for a robot of 0.0740 m; {mend}"
    );
    scratch.refuses(&["world", "check", "world.toml", "--out", "o"], &message);
    scratch.write("model.toml", "[robot]\nbody_radius_m = 0.2\n");
    let message = format!(
        "the corridor is 0.1817 m wide at (0.570, 0.344), too narrow for a robot of 0.4000 m; {mend}"
    );
    scratch.refuses(
        &["drive", "model.toml", "--out", "o"],
        &format!("model.toml:2: {message}"),
    );
    let set = "robot.body_radius_m=0.2";
    scratch.refuses(
        &["drive", "roduit2007", "--set", set, "--out", "o"],
        &format!("--set {set}: {message}"),
    );
}

#[test]
fn a_corridor_too_wide_for_its_walls_to_be_seen_is_remarked() {
    let scratch = Scratch::new();
    let world = scaled_world(10.0).replace("arena = [1.4, 1.2]", "arena = [14, 12]");
    scratch.write("world.toml", world);
    let ran = scratch.done(["world", "check", "world.toml"]);
    assert_eq!(
        ran.stderr,
        "lapwing: world.toml: in the middle of the corridor no wall is near enough to be seen: it is 1.817 m wide at least, and \
         the sensors see 0.1 m; lengths are in m\n"
    );
    assert_eq!(scratch.done(["world", "check", "roduit2007"]).stderr, "");
}

/// The shipped world with every coordinate of its walls times a factor.
fn scaled_world(factor: f64) -> String {
    let text = world_with("", "");
    let mut scaled = String::new();
    for line in text.lines() {
        let Some(points) = line.strip_prefix("control_points = ") else {
            scaled += line;
            scaled += "\n";
            continue;
        };
        scaled += "control_points = [";
        for point in points.split('[').filter(|point| point.contains(']')) {
            let (x, y) = point.split(']').next().unwrap().split_once(',').unwrap();
            let [x, y] = [x, y].map(|number| factor * number.trim().parse::<f64>().unwrap());
            write!(scaled, "[{x:.6}, {y:.6}], ").unwrap();
        }
        scaled += "]\n";
    }
    scaled
}

#[test]
fn models_with_keys_or_values_that_are_not_there() {
    let scratch = Scratch::new();
    for (text, message) in [
        (
            "[slip]\n\nlevel = nan\n",
            "model.toml:3: slip.level = nan is not a finite number",
        ),
        (
            "[camera]\nnoise_m = -inf\n",
            "model.toml:2: camera.noise_m = -inf is not a finite number",
        ),
        (
            "[slip]\n\nlevel = 1.4\n",
            "model.toml:3: slip.level = 1.4 is outside [0, 1]",
        ),
        (
            "[controller]\nspeed_m_s = 0\n",
            "model.toml:2: controller.speed_m_s = 0 is outside [0.0001, 100]",
        ),
        (
            "[slip]\nlevle = 0.4\n",
            "model.toml:2: unknown key `slip.levle`; nearest known: slip.level",
        ),
        (
            "# slip\n[slp]\nlevel = 0.4\n",
            "model.toml:2: unknown key `slp`; nearest known: slip",
        ),
        (
            "[slip]\nlevel = \"high\"\n",
            "model.toml:2: slip.level = \"high\", but a number is needed",
        ),
        (
            "[controller]\nkind = \"rule\"\n",
            "model.toml:2: unknown `controller.kind` = \"rule\"; known: braitenberg, rule-based",
        ),
        (
            "[run]\ngates = 3\n",
            "model.toml:2: run.gates = 3: 3 gates are too few: the midline bends too much from one to the next; take more",
        ),
        (
            "[sensor]\nmounts = []\n",
            "model.toml:2: `sensor.mounts` has length 0; 8 is needed",
        ),
        (
            "[[effect]]\nkind = \"reading-gian\"\ngain = 1\n",
            "model.toml:2: effect.0.kind: unknown effect `reading-gian`; nearest known: reading-gain",
        ),
        (
            "[[effect]]\nkind = \"reading-gain\"\ngain = inf\n",
            "model.toml:3: effect.0.gain = inf is not a finite number",
        ),
        (
            "[[effect]]\nkind = \"one-sensor-gain\"\nsensor = 2\n",
            "model.toml:2: effect.0.kind: one-sensor-gain without `gain` does nothing",
        ),
        (
            "[[effect]]\nkind = \"reading-gain\"\ngain = \"big\"\n",
            "model.toml:3: effect.0.gain: \"big\" given, a number expected",
        ),
        (
            "[[effect]]\nkind = \"sensor-rotation\"\nangle_rad = 0.1\nangle_rad_per_s = 1e-4\n",
            "model.toml:4: effect.0.angle_rad_per_s: is a change in time, which needs by = \"time\"",
        ),
        (
            "[[effect]]\nkind = \"wheel-asymmetry\"\nby = \"run\"\nratio = []\n",
            "model.toml:3: effect.0.by: by run needs an array with a value for each run",
        ),
        (
            "[sensor]\nrays = 100000000\n",
            "model.toml:2: sensor.rays = 100000000 is outside [1, 10000]",
        ),
        (
            "world = \"elsewhere\"\n",
            "model.toml:1: unknown world `elsewhere`: there is no file elsewhere; shipped worlds: roduit2007",
        ),
        ("[slip\n", "model.toml:1: unclosed table, expected `]`"),
    ] {
        scratch.write("model.toml", text);
        scratch.refuses(&["drive", "model.toml", "--out", "o"], message);
    }
    scratch.write(
        "by_run.toml",
        "[[effect]]\nkind = \"reading-gain\"\nby = \"run\"\ngain = [1.1, 1.2]\n",
    );
    scratch.refuses(
        &["drive", "by_run.toml", "--runs", "3", "--out", "o"],
        "by_run.toml:3: effect.0.by: reading-gain has values by run for 2 of them, and there are more; give as many values, or drive 2",
    );
    for (set, message) in [
        ("slip.level=nan", "slip.level = nan is not a finite number"),
        ("slip.level=7", "slip.level = 7 is outside [0, 1]"),
        (
            "controller.gian_per_count=1",
            "unknown key `controller.gian_per_count`; nearest known: controller.gain_per_count",
        ),
        ("slip.level", "a key and a value are needed, as KEY=VALUE"),
    ] {
        let message = format!("--set {set}: {message}");
        scratch.refuses(&["drive", "roduit2007", "--set", set, "--out", "o"], &message);
    }
    scratch.refuses(
        &["drive", "elsewhere.toml", "--out", "o"],
        "cannot read elsewhere.toml: No such file or directory (os error 2)",
    );
}

const DATASET: &str =
    "name = \"set\"\nworld = \"roduit2007\"\ncontroller = \"braitenberg\"\nruns = [\"a\"]\n";
const FINITE: &str = "is not a finite number";
const NEEDED: &str = "is not a finite number; one is needed here";

/// `compare` of a data set with this description and this run against a good one.
fn refuses_data_set(scratch: &Scratch, description: &str, run: &str, message: &str) {
    scratch.write("set/dataset.toml", description);
    scratch.write("set/run_a.csv", run);
    scratch.refuses(
        &["compare", "set", &measured("case_braitenberg"), "--out", "o"],
        message,
    );
    let sweep = [
        "sweep",
        "roduit2007",
        "--vary",
        "slip.level=1",
        "--measured",
        "set",
        "--out",
        "o",
    ];
    scratch.refuses(&sweep, message);
    scratch.refuses(
        &["reproduce", "--measured", "set", "--out", "o", "--no-trace"],
        message,
    );
}

#[test]
fn runs_that_cannot_be_read() {
    let scratch = Scratch::new();
    let rectangle = "give every row as many, empty where a value is missing";
    let missing = "leave the field empty if it is missing";
    let blind = "0 whole laps, and the first is not analysed: at least two are needed, and four to trace; check the world, the driving \
                 direction (clockwise; [declared] run.direction in dataset.toml) and the unit of x_m and y_m";
    for (run, message) in [
        ("t_s,x_m\n0,1\n", "run_a.csv:1: column y_m is missing; there are: t_s, x_m".to_owned()),
        ("t_s;x_m;y_m\n0;1;1\n", "run_a.csv:1: `t_s;x_m;y_m` is one column; separate columns by commas".to_owned()),
        ("t\0_\0s\0", "run_a.csv:1: the text is UTF-16, or no text at all; save it as UTF-8".to_owned()),
        ("t_s,x_m,y_m\n0,1,2\n0.064,1\n", format!("run_a.csv:3: 2 fields under a header of 3; {rectangle}")),
        ("t_s,x_m,y_m\n0,1,abc\n", format!("run_a.csv:2: y_m: `abc` {FINITE}; {missing}")),
        ("t_s,x_m,y_m\n0,nan,1\n", format!("run_a.csv:2: x_m: `nan` {FINITE}; {missing}")),
        ("t_s,x_m,y_m\n\n0,1,1\n0.064,1e999,1\n", format!("run_a.csv:4: x_m: `1e999` {FINITE}; {missing}")),
        ("t_s,x_m,y_m\ninf,1,1\n", format!("run_a.csv:2: t_s: `inf` {NEEDED}")),
        ("t_s,x_m,y_m\n,1,1\n", "run_a.csv:2: t_s: is empty; a number is needed here".to_owned()),
        (
            "t_s,x_m,y_m\n1,1,1\n0.5,1,1\n",
            "run_a.csv:3: t_s: 0.5 does not come after 1 of the row before; times must rise".to_owned(),
        ),
        ("t_s,x_m,y_m\n", "run_a.csv: no rows under the header; a run needs one for each control step".to_owned()),
        ("0,1,2\n0.064,1,2\n", "run_a.csv:1: a row of numbers; a line with the names of the columns must come first".to_owned()),
        (
            "t_s,x_m,y_m\n0,,\n0.064,,\n",
            "run_a.csv: x_m and y_m are empty in every row: the camera did not see the robot at all".to_owned(),
        ),
        ("", "run_a.csv is empty; a line with the names of the columns must come first".to_owned()),
        ("t_s,x_m,y_m\n0,1,1\n0.064,1,1\n", format!("run_a.csv: {blind}")),
        (
            "t_s,x_m,y_m,ps0,ps1\n0,1,1,2,2\n",
            "run_a.csv:1: of the robot's log ps2, ps3, ps4, ps5, ps6, ps7, left_m_s, right_m_s is missing; a log has ps0 \
             to ps7, left_m_s and right_m_s, so add that or remove the others"
                .to_owned(),
        ),
    ] {
        refuses_data_set(&scratch, DATASET, run, &format!("set/{message}"));
    }
}

#[test]
fn data_sets_that_do_not_say_what_they_are() {
    let scratch = Scratch::new();
    let with = |line: &str| format!("{DATASET}{line}\n");
    for (description, message) in [
        (with("lasp = 20"), "5: unknown key `lasp`; nearest known: laps"),
        (with("laps = nan"), "5: `laps`: nan is not a whole number from 1"),
        (with("laps = 0"), "5: `laps`: 0 is not a whole number from 1"),
        (
            with("[declared]\ncontroller.gain_per_count = inf"),
            "6: controller.gain_per_count = inf is not a finite number",
        ),
        (
            with("[declared]\ncontroller.gian_per_count = 1"),
            "6: unknown key `controller.gian_per_count`; nearest known: controller.gain_per_count",
        ),
        (
            with("[declared]\nslip.level = 5"),
            "6: slip.level = 5 is outside [0, 1]",
        ),
        (
            with("[declared]\n\nworld = \"other\""),
            "7: [declared] world: `world` of the data set says that; remove it here",
        ),
        (
            with("[declared.controller]\nkind = \"rule-based\""),
            "6: [declared] controller.kind: `controller` of the data set says that; remove it here",
        ),
        (
            DATASET.replace("\"braitenberg\"", "\"breitenberg\""),
            "3: `controller`: unknown controller `breitenberg`; nearest: braitenberg; known: braitenberg, rule-based",
        ),
        (
            DATASET.replace("\"a\"", "\"b\""),
            "4: run `b` has no file set/run_b.csv nor .csv.gz; add it, or take the run out of `runs`",
        ),
        (
            DATASET.replace("roduit2007", "riduot2007"),
            " `world`: unknown world `riduot2007`: there is no file set/riduot2007; shipped worlds: roduit2007",
        ),
        (
            DATASET.replace("world", "wrold"),
            "2: unknown key `wrold`; nearest known: world",
        ),
        (
            DATASET.replace("world = \"roduit2007\"\n", ""),
            " `world` is missing; add it, a string",
        ),
    ] {
        let run = "t_s,x_m,y_m\n0,1,1\n0.064,1,1\n";
        refuses_data_set(
            &scratch,
            &description,
            run,
            &format!("set/dataset.toml:{message}"),
        );
    }
    scratch.refuses(
        &["compare", "nowhere", &measured("case_braitenberg")],
        "nowhere is not a folder; a data set is a folder with dataset.toml in it",
    );
}

#[test]
fn gate_tables_and_pairs_that_cannot_be_read() {
    let scratch = Scratch::new();
    let rectangle = "give every row as many, empty where a value is missing";
    for (text, message) in [
        ("a,b\n1,nan\n", format!("bad.csv:2: b: `nan` {NEEDED}")),
        ("a,b\n1,2\n-inf,2\n", format!("bad.csv:3: a: `-inf` {NEEDED}")),
        (
            "a,b\n1,2\n1\n",
            format!("bad.csv:3: 1 fields under a header of 2; {rectangle}"),
        ),
        (
            "a,b\n1,\n",
            "bad.csv:2: b: is empty; a number is needed here".to_owned(),
        ),
        (
            "",
            "bad.csv is empty; a line with the names of the columns must come first".to_owned(),
        ),
    ] {
        scratch.write("bad.csv", text);
        scratch.write("good.csv", "a,b\n1,2\n2,2\n0,1\n");
        scratch.refuses(
            &["compare", "--sampled", "good.csv", "bad.csv", "--out", "o"],
            &message,
        );
        scratch.refuses(&["fit-sensor", "bad.csv", "--out", "o"], &message);
    }
    scratch.write("bad.csv", "a,b\n0,4000\n-0.01,2000\n");
    scratch.refuses(
        &["fit-sensor", "bad.csv", "--out", "o"],
        "bad.csv:3: a: -0.01 m is no distance; it must not be negative",
    );
    scratch.refuses(
        &["fit-sensor", "good.csv", "--out", "o"],
        "good.csv: 3 pairs with positive readings at 3 distances do not determine a response: 5 pairs at 3 distances \
         are needed",
    );
    scratch.write("bad.csv", "a,b\n");
    scratch.refuses(
        &["compare", "--sampled", "good.csv", "bad.csv", "--out", "o"],
        "bad.csv: no rows under the header; one for each lap is needed",
    );
    scratch.write("bad.csv", "a,b,c\n1,2,3\n");
    scratch.refuses(
        &["compare", "--sampled", "good.csv", "bad.csv", "--out", "o"],
        "bad.csv has 3 columns and good.csv has 2: laps are compared coordinate by coordinate",
    );
}

#[test]
fn clusters_with_too_few_laps() {
    let scratch = Scratch::new();
    scratch.write("one.csv", "a,b\n1,2\n");
    scratch.write("other.csv", "a,b\n2,1\n");
    let mend = "give more laps or compare in fewer modes";
    scratch.refuses(
        &["compare", "--sampled", "one.csv", "other.csv", "--modes", "1", "--out", "o"],
        &format!("`one` has 1 lap, `other` has 1 lap: 1 modes or gates need at least 2 laps each and 4 together; {mend}"),
    );
    for (name, seed) in [("x", "1"), ("y", "2")] {
        scratch.done([
            "drive",
            "--name",
            name,
            "roduit2007",
            "--runs",
            "1",
            "--laps",
            "1",
            "--seed",
            seed,
            "--out",
            name,
        ]);
    }
    scratch.refuses(
        &["compare", "x", "y", "--modes", "1", "--out", "o"],
        &format!("`x/a` has 1 lap, `y/a` has 1 lap: 1 modes or gates need at least 2 laps each and 4 together; {mend}"),
    );
}

/// A simulated run without the rows near gates 15 to 35 in some laps, counted by the crossings of gate 0: the straight
/// line over that gap leaves the corridor.
fn cut(run: &str, laps: impl Fn(usize) -> bool) -> String {
    let gates = std::fs::read_to_string(format!("{ROOT}/worlds/roduit2007/gates.csv")).unwrap();
    let numbers = |line: &str| {
        line.split(',')
            .map(|field| field.parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    };
    let gates: Vec<Vec<f64>> = gates.lines().skip(1).map(numbers).collect();
    let (mut lap, mut before) = (0, 0);
    let mut kept = String::from("t_s,x_m,y_m\n");
    for line in run.lines().skip(1) {
        let row = numbers(line);
        let squared_m2 = |gate: &Vec<f64>| (gate[1] - row[1]).powi(2) + (gate[2] - row[2]).powi(2);
        let near = (0..gates.len())
            .min_by(|&a, &b| squared_m2(&gates[a]).total_cmp(&squared_m2(&gates[b])))
            .unwrap();
        lap += usize::from(near < 10 && before > 90);
        before = near;
        if !laps(lap) || !(15..=35).contains(&near) {
            kept += line;
            kept += "\n";
        }
    }
    kept
}

#[test]
fn laps_that_skip_a_gate_are_set_aside_and_named() {
    let scratch = Scratch::new();
    scratch.done([
        "drive",
        "--name",
        "set",
        "roduit2007",
        "--runs",
        "2",
        "--laps",
        "6",
        "--seed",
        "1",
        "--out",
        "set",
    ]);
    std::fs::remove_file(scratch.path("set/manifest.json")).unwrap();
    let run = scratch.read("set/run_a.csv");

    scratch.write("set/run_a.csv", cut(&run, |lap| lap == 3));
    let ran = scratch.done(["compare", "set", "--permutations", "0", "--json"]);
    assert_eq!(
        ran.stderr,
        "lapwing: set/run_a.csv:2808: from here on the robot is not seen for 14.5 s: lap 2 misses gate 16 and is set aside\n\
         lapwing: set/a: 5 of 6 laps\n"
    );
    let document: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(
        (&document["clusters"][0]["laps"], &document["clusters"][1]["laps"]),
        (&5.into(), &6.into())
    );

    scratch.write("set/run_a.csv", cut(&run, |lap| (1..7).contains(&lap)));
    let ran = scratch.run(["compare", "set", "--out", "o"]);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""));
    let expected = [
        (1500, 14.3),
        (2360, 14.5),
        (3219, 14.5),
        (4077, 14.5),
        (4938, 14.5),
    ]
    .iter()
    .zip(1..);
    let expected = expected.map(|((line, for_s), lap)| {
        format!(
            "lapwing: set/run_a.csv:{line}: from here on the robot is not seen for {for_s} s: lap {lap} misses gate 16 and \
             is set aside\n"
        )
    });
    let expected = expected.collect::<String>()
        + "lapwing: set/a: 1 of 6 laps\n\
           lapwing: `set/a` has 1 lap, `set/b` has 6 laps: 2 modes or gates need at least 2 laps each and 4 together; \
           give more laps or compare in fewer modes\n";
    assert_eq!(ran.stderr, expected);
    assert!(!scratch.path("o").exists() && !scratch.path("o.partial").exists());

    scratch.write("set/run_a.csv", cut(&run, |lap| lap > 0));
    scratch.refuses(
        &["compare", "set", "--out", "o"],
        "set/run_a.csv:1500: from here on the robot is not seen for 14.3 s: lap 1 misses gate 16 and is set aside, and none \
         is left: measure the run again, or take it out of `runs` in dataset.toml",
    );
}

#[test]
fn folders_that_are_not_ours_or_cannot_be_made() {
    let scratch = Scratch::new();
    scratch.write("theirs/thesis.tex", "precious");
    scratch.write("theirs.partial/notes", "precious too");
    scratch.write("file", "precious as well");
    std::fs::create_dir(scratch.path("empty")).unwrap();
    let set = measured("case_braitenberg");
    let commands: [&[&str]; 5] = [
        &["drive", "roduit2007"],
        &["compare", &set],
        &[
            "sweep",
            "roduit2007",
            "--vary",
            "slip.level=1",
            "--measured",
            &set,
        ],
        &["world", "check", "roduit2007"],
        &["reproduce", "--seeds", "2", "--no-trace"],
    ];
    for command in commands {
        for (out, message) in [
            (
                "theirs",
                "theirs is there and holds no manifest.json of lapwing, so it is not replaced; name another folder with \
                 --out, or move it away",
            ),
            (
                "file",
                "file is there and is not a folder; name another with --out, or move it away",
            ),
            (
                "file/o",
                "cannot create file/o.partial: Not a directory (os error 20); name a folder with --out that can be \
                 written to",
            ),
        ] {
            scratch.refuses(&[command, &["--out", out]].concat(), message);
        }
    }
    std::fs::remove_dir_all(scratch.path("theirs")).unwrap();
    scratch.refuses(
        &["drive", "roduit2007", "--out", "theirs"],
        "theirs.partial is there and was not made by lapwing; move it away",
    );
    // An empty folder and an earlier result of ours are replaced.
    for seed in ["1", "2"] {
        scratch.drive(1, 3, "empty", &["--seed", seed]);
    }
    assert!(scratch.read("empty/manifest.json").contains("\"seed\": 2"));
    // Not what a result is made from, nor what somebody else has put there.
    scratch.refuses(
        &["compare", "empty", &set, "--out", "empty"],
        "empty/dataset.toml lies in empty, which would be replaced; name another folder with --out",
    );
    scratch.write("empty/notes.txt", "mine");
    scratch.refuses(
        &["drive", "roduit2007", "--out", "empty"],
        "empty holds notes.txt, which lapwing did not write, so it is not replaced; move that file away, or name another folder \
         with --out",
    );
    assert_eq!(scratch.read("empty/notes.txt"), "mine");
}

/// A disk that fills up while a data set is written, played by a small file system where one can be mounted.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up() {
    let scratch = Scratch::new();
    std::fs::create_dir(scratch.path("disk")).unwrap();
    let script = "mount -t tmpfs -o size=100k tmpfs disk || exit 77; \
                  \"$0\" drive roduit2007 --runs 2 --log --out disk/o; status=$?; ls -A disk; exit $status";
    let unshared = std::process::Command::new("unshare")
        .args(["-rm", "sh", "-c", script, LAPWING])
        .current_dir(scratch.path(""))
        .output();
    let Some(ran) = unshared.ok().map(Ran::from).filter(|ran| ran.status == Some(2)) else {
        println!("skipped: no file system can be mounted here");
        return;
    };
    let message = "cannot write disk/o.partial/run_a.csv: No space left on device (os error 28); make room there, or name \
                   another folder with --out";
    assert_eq!(
        (ran.stderr, ran.stdout),
        (format!("lapwing: {message}\n"), String::new())
    );
}

/// The same by a limit on the size of a file, which needs no privilege.
#[cfg(unix)]
#[test]
fn a_file_that_may_not_grow() {
    let scratch = Scratch::new();
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"";
    for args in [
        ["drive", "roduit2007", "--runs", "1", "--laps", "2"].as_slice(),
        &["world", "check", "roduit2007"],
    ] {
        let output = std::process::Command::new("sh")
            .args(["-c", script, LAPWING])
            .args(args)
            .args(["--out", "o"])
            .current_dir(scratch.path(""))
            .output();
        let ran = Ran::from(output.unwrap());
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{}", ran.stderr);
        assert!(
            ran.stderr.starts_with("lapwing: cannot write o.partial/"),
            "{}",
            ran.stderr
        );
        let end = "File too large (os error 27); make room there, or name another folder with --out\n";
        assert!(ran.stderr.ends_with(end), "{}", ran.stderr);
        assert!(
            crate::support::files(&scratch.path("")).is_empty(),
            "{args:?} left something behind"
        );
    }
}

#[test]
fn names_that_no_table_could_show() {
    let scratch = Scratch::new();
    for (name, shown) in [
        ("", "\"\""),
        (" ", "\" \""),
        ("a\nb", "\"a\\nb\""),
        ("\u{1b}[2J", "\"\\u{1b}[2J\""),
    ] {
        scratch.refuses(
            &["drive", "roduit2007", "--name", name, "--out", "o"],
            &format!("--name {shown}: a name on one line is needed, of more than spaces and without control characters"),
        );
    }
}

/// Ctrl-C on a command that cannot resume, between runs and within one.
#[cfg(unix)]
#[test]
fn an_interrupted_drive_leaves_nothing() {
    for [runs, laps] in [["100000", "20"], ["1", "100000"]] {
        let scratch = Scratch::new();
        let mut child = scratch
            .command([
                "drive",
                "roduit2007",
                "--runs",
                runs,
                "--laps",
                laps,
                "--out",
                "o",
            ])
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        while !scratch.path("o.partial").exists() {
            assert_eq!(child.try_wait().unwrap(), None);
            std::thread::yield_now();
        }
        let ran = interrupt(child);
        assert_eq!(ran.stderr, "lapwing: interrupted: nothing was written\n");
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""));
        assert!(crate::support::files(&scratch.path("")).is_empty());
    }
}
