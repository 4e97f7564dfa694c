//! Effects that the program does not know, written here: it sees nothing of them but files.

use serde_json::Value;
use sim::{
    Controller, Effect, Machine, Moment, Param, Pattern, Readings, Setting, Spec, Stage, Vec2, WheelSpeeds,
};

use crate::ground;
use crate::support::Scratch;
use crate::tracing::{
    GAINS, Robot, explained_in_logs, holds, names, never_a_listed_name, says, share_signatures, trace,
    without_name,
};

/// A listed effect, written anew under another name.
pub(crate) static LIMP: Spec = Spec {
    name: "limp",
    stage: Stage::Act,
    summary: "the left wheel is larger than the right one",
    params: &[Param::new("factor", "", 1.0, 0.5, 2.0)],
    list: None,
    build: || Box::new(Limp),
};

/// How much larger the left wheel is in these tests.
pub(crate) const LIMPING: f64 = 1.02;

#[derive(Debug)]
struct Limp;

impl Effect for Limp {
    fn ground(&mut self, values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        WheelSpeeds {
            left_m_s: wheels.left_m_s * values[0],
            ..wheels
        }
    }
}

/// A carpet on which wheels roll farther along its grain than across it: twice in each turn of the robot.
static GRAIN: Spec = Spec {
    name: "grain",
    stage: Stage::Act,
    summary: "wheels are faster along one direction of the floor, both ways",
    params: &[Param::new("share", "", 0.0, -0.5, 0.5)],
    list: None,
    build: || Box::new(Grain),
};

#[derive(Debug)]
struct Grain;

impl Effect for Grain {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let along = (2.0 * (now.pose.heading_rad() - 0.5)).cos();
        wheels.map(|speed| speed * (1.0 + values[0] * along))
    }
}

/// A wet place on the floor.
static PUDDLE: Spec = Spec {
    name: "puddle",
    stage: Stage::Act,
    summary: "the left wheel slips about one place of the floor",
    params: &[Param::new("share", "", 0.0, 0.0, 0.9)],
    list: None,
    build: || Box::new(Puddle),
};

/// The middle of the wet place, m.
const PUDDLE_M: [f64; 2] = [1.0, 0.9];

#[derive(Debug)]
struct Puddle;

impl Effect for Puddle {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        const RADIUS_M: f64 = 0.12;
        let away = (now.pose.position - Vec2::new(PUDDLE_M[0], PUDDLE_M[1])).length() / RADIUS_M;
        WheelSpeeds {
            left_m_s: wheels.left_m_s * (1.0 - values[0] * (-0.5 * away * away).exp()),
            ..wheels
        }
    }
}

/// A rug, with straight edges.
static RUG: Spec = Spec {
    name: "rug",
    stage: Stage::Act,
    summary: "wheels are slower on a rectangle of the floor",
    params: &[Param::new("share", "", 0.0, 0.0, 0.9)],
    list: None,
    build: || Box::new(Rug),
};

/// The middle of the rug, on the track, and half of its sides, m.
const RUG_M: ([f64; 2], [f64; 2]) = ([1.0, 0.9], [0.15, 0.12]);

#[derive(Debug)]
struct Rug;

impl Effect for Rug {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let (middle, sides) = (Vec2::new(RUG_M.0[0], RUG_M.0[1]), RUG_M.1);
        let off = now.pose.position - middle;
        let is_on_it = off.x.abs() < sides[0] && off.y.abs() < sides[1];
        wheels.map(|speed| speed * if is_on_it { 1.0 - values[0] } else { 1.0 })
    }
}

/// Sensors that warm up: their readings grow for some minutes after the start.
static WARMING: Spec = Spec {
    name: "warming",
    stage: Stage::Sense,
    summary: "readings settle after the start",
    params: &[
        Param::new("share", "", 0.0, -0.9, 0.9),
        // In which they come to 1 - 1/e of their final heat.
        Param::place("time_s", "s", 1.0, 1e5),
    ],
    list: None,
    build: || Box::new(Warming),
};

/// Some minutes.
const WARMING_S: f64 = 150.0;

#[derive(Debug)]
struct Warming;

impl Effect for Warming {
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        let warm = 1.0 - (-now.time_s / values[1]).exp();
        readings.iter_mut().for_each(|r| *r *= 1.0 + values[0] * warm);
    }
}

/// A wheel whose axle is not in its middle.
static LOBED: Spec = Spec {
    name: "lobed",
    stage: Stage::Act,
    summary: "the right wheel rolls faster on one side of itself",
    params: &[Param::new("share", "", 0.0, -0.9, 0.9)],
    list: None,
    build: || Box::new(Lobed { turned_rad: 1.0 }),
};

#[derive(Debug)]
struct Lobed {
    turned_rad: f64,
}

impl Effect for Lobed {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        const RADIUS_M: f64 = 0.0205;
        let right_m_s = wheels.right_m_s * (1.0 + values[0] * self.turned_rad.cos());
        self.turned_rad += wheels.right_m_s * now.step_s / RADIUS_M;
        WheelSpeeds { right_m_s, ..wheels }
    }
}

/// A camera that does not look straight down: a share more, for each metre that the robot is off the middle to the right.
static TILTED: Spec = Spec {
    name: "tilted",
    stage: Stage::Observe,
    summary: "what is nearer to the camera is seen farther from the middle",
    params: &[Param::new("per_m", "1/m", 0.0, -1.0, 1.0)],
    list: None,
    build: || Box::new(Tilted),
};

#[derive(Debug)]
struct Tilted;

impl Effect for Tilted {
    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        let arm = position - now.arena_middle;
        position + arm * (values[0] * arm.x)
    }
}

/// Motors that come up to speed slowly, and are as fast as any once they are.
static WEAK: Spec = Spec {
    name: "weak",
    stage: Stage::Act,
    summary: "a wheel's speed grows and falls by so much a second at most",
    params: &[Param::new("m_s2", "m/s^2", 10.0, 0.0, 10.0)],
    list: None,
    build: || Box::<Weak>::default(),
};

#[derive(Debug, Default)]
struct Weak(WheelSpeeds);

impl Effect for Weak {
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let most = values[0] * now.step_s;
        let towards = |target: f64, before: f64| before + (target - before).clamp(-most, most);
        self.0 = WheelSpeeds {
            left_m_s: towards(wheels.left_m_s, self.0.left_m_s),
            right_m_s: towards(wheels.right_m_s, self.0.right_m_s),
        };
        self.0
    }
}

/// What a trace says of sensors that warm up, and of a wheel out of round.
const SETTLING: [&str; 4] = ["sense", "reading", "time", "settling"];
const OUT_OF_ROUND: [&str; 4] = ["act", "right wheel", "wheel angle", "harmonics"];

/// The robot whose left wheel is larger.
pub(crate) fn limping() -> Robot {
    Robot::with(Setting::constant(&LIMP, [LIMPING]))
}

/// What is said of the reactive robot by its laps alone.
fn by_laps(robot: &Robot) -> Value {
    by_laps_in(&Scratch::new(), robot)
}

fn by_laps_in(scratch: &Scratch, robot: &Robot) -> Value {
    share_signatures("braitenberg");
    robot.record(scratch, "set");
    trace(scratch, "braitenberg", "set", &[])
}

#[test]
fn a_listed_effect_under_another_name_is_named_from_laps() {
    let found = by_laps(&limping());
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
}

/// Once it drives it never needs more; its laps are those of the declared robot.
#[test]
fn motors_too_weak_to_start_at_once_are_known_by_how_runs_begin() {
    const M_S2: f64 = 0.2;
    let scratch = Scratch::new();
    let found = by_laps_in(&scratch, &Robot::with(Setting::constant(&WEAK, [M_S2])));
    says(&found, "explained", &["acceleration-limit"]);
    holds(&found["effects"][0], "m_s2", M_S2, 0.0);
    assert_eq!(
        found["residual"]["where"],
        serde_json::json!(["start"]),
        "{found:#}"
    );
    let [before, after, chance] =
        ["before", "after", "chance"].map(|key| found["error"]["start_of_runs"][0][key].as_f64().unwrap());
    // Late by an eighth of a second at 0.05 m/s.
    assert!(
        (0.002..0.005).contains(&before) && after < 3.0 * chance,
        "{}",
        found["error"]
    );
    // The figure and its numbers.
    assert!(scratch.path("out/figures/starts.svg").is_file());
    let table = scratch.read("out/starts.csv");
    let off_mm = |line: &str| {
        let [_, _, measured, simulated, _] = line.split(',').collect::<Vec<_>>().try_into().unwrap();
        measured.parse::<f64>().unwrap() - simulated.parse::<f64>().unwrap()
    };
    let off_mm: Vec<f64> = table.lines().skip(1).map(off_mm).collect();
    assert_eq!(off_mm.len(), 4, "{table}");
    let rms_mm = (off_mm.iter().map(|mm| mm * mm).sum::<f64>() / 4.0).sqrt();
    assert!((1e-3 * rms_mm - before).abs() < 2e-6, "{table}");
}

/// Laps that go on for ever hardly tell this from wheels that lag: these do not start at once.
#[test]
fn sensors_that_lag_are_no_lag_of_the_wheels() {
    let found = by_laps(&Robot::with(Setting::constant(
        sim::find("sensor-lag").unwrap(),
        [0.13],
    )));
    says(&found, "explained", &["sensor-lag"]);
    assert_eq!(
        found["effects"][0]["alternatives"],
        serde_json::json!([]),
        "{found:#}"
    );
}

#[test]
fn a_battery_that_sags_is_sized_wherever_the_runs_began() {
    const PER_S: f64 = 1.5e-4;
    let found = by_laps(&Robot::with(Setting::constant(
        sim::find("battery-sag").unwrap(),
        [PER_S],
    )));
    says(&found, "explained", &["battery-sag"]);
    holds(&found["effects"][0], "per_s", PER_S, 0.0);
}

#[test]
fn sensors_that_warm_up_have_no_name_and_settle() {
    const SHARE: f64 = 0.4;
    share_signatures("braitenberg");
    let scratch = Scratch::new();
    Robot::with(Setting::constant(&WARMING, [SHARE, WARMING_S])).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["unlisted"]);
    let coefficients = without_name(&found, SETTLING);
    let [end, more, time_s]: [f64; 3] = coefficients.try_into().unwrap();
    for at_s in [100.0, 200.0, 400.0] {
        let said = end + more * (-at_s / time_s).exp();
        let true_share = SHARE * (1.0 - (-at_s / WARMING_S).exp());
        assert!(
            (said - true_share).abs() < 0.15 * SHARE,
            "{at_s} s: {said}, {found:#}"
        );
    }
    let model = std::fs::read_to_string(scratch.path("out/model.after.toml")).unwrap();
    assert!(model.contains(&format!("{end}")), "{model}");
}

/// Of what they do is next to nothing left in the laps that count.
#[test]
fn sensors_that_warm_up_while_no_lap_counts_settle_too() {
    const SHARE: f64 = 0.15;
    const SOON_S: f64 = 52.0;
    let scratch = Scratch::new();
    share_signatures("rule-based");
    let robot = Robot {
        controller: ground::rule_based(),
        ..Robot::with(Setting::constant(&WARMING, [SHARE, SOON_S]))
    };
    robot.record(&scratch, "set");
    let found = trace(&scratch, "rule-based", "set", &[]);
    says(&found, "explained", &["unlisted"]);
    let coefficients = without_name(&found, SETTLING);
    let [end, more, time_s]: [f64; 3] = coefficients.try_into().unwrap();
    assert!((end - SHARE).abs() < 0.01, "{found:#}");
    let said = end + more * (-40.0 / time_s).exp();
    let true_share = SHARE * (1.0 - (-40.0 / SOON_S).exp());
    assert!((said - true_share).abs() < 0.04, "{said}, {found:#}");
    let error = found["effects"][0]["standard_errors"][1].as_f64().unwrap();
    assert!(0.05 * more.abs() < error && error < 0.3 * more.abs(), "{found:#}");
}

#[test]
fn a_marker_far_ahead_is_there_in_every_run() {
    const FORWARD_M: f64 = 0.0157;
    let marker = Setting::constant(sim::find("marker-offset").unwrap(), [FORWARD_M, 0.0, 0.0]);
    let found = by_laps(&Robot::with(marker));
    says(&found, "explained", &["marker-offset"]);
    assert!(found["effects"][0]["by"].is_null(), "{found:#}");
}

#[test]
fn a_rounding_of_readings_is_found_beside_a_gain_that_hides_its_size() {
    // Without a gain a rounding of 127 counts explains most.
    const COUNTS: f64 = 122.4;
    let mut robot = Robot::with(Setting::constant(sim::find("reading-step").unwrap(), [COUNTS]));
    robot
        .effects
        .push(Setting::constant(sim::find("controller-gain").unwrap(), [1.156]));
    let found = by_laps(&robot);
    assert_eq!(found["verdict"], "explained", "{found:#}");
    let (step, gain) = match names(&found).as_slice() {
        ["reading-step", gain] => (0, *gain),
        [gain, "reading-step"] => (1, *gain),
        _ => panic!("{found:#}"),
    };
    assert!(gain == "axle-length" || GAINS.contains(&gain), "{gain}");
    let counts = found["effects"][step]["parameters"][0]["value"].as_f64().unwrap();
    assert!((counts / COUNTS - 1.0).abs() < 0.01, "{counts}");
}

#[test]
fn a_rounding_is_found_beside_another_one() {
    const COUNTS: f64 = 54.01;
    const SPEED_M_S: f64 = 0.018657;
    let mut robot = Robot::with(Setting::constant(sim::find("speed-step").unwrap(), [SPEED_M_S]));
    robot
        .effects
        .push(Setting::constant(sim::find("reading-step").unwrap(), [COUNTS]));
    let found = by_laps(&robot);
    says(&found, "explained", &["speed-step", "reading-step"]);
    for (effect, truth) in [(0, SPEED_M_S), (1, COUNTS)] {
        let size = found["effects"][effect]["parameters"][0]["value"]
            .as_f64()
            .unwrap();
        assert!((size / truth - 1.0).abs() < 0.015, "{size}, not {truth}");
    }
}

#[test]
fn a_light_that_goes_over_the_runs_is_seen_beside_wheels_that_slip_much() {
    const SLIP: f64 = 3.0;
    const COUNTS: [f64; 4] = [43.7, 17.3, 11.4, 6.9];
    const AZIMUTH_RAD: f64 = 2.126;
    let mut robot = Robot::with(Setting::constant(sim::find("slip-level").unwrap(), [SLIP]));
    robot.effects.push(Setting {
        spec: sim::find("directional-light").unwrap(),
        pattern: Pattern::ByRun(COUNTS.map(|counts| vec![counts, AZIMUTH_RAD]).to_vec()),
    });
    let found = by_laps(&robot);
    assert_eq!(found["verdict"], "explained", "{found:#}");
    let effects = found["effects"].as_array().unwrap();
    let of = |name: &str| effects.iter().find(|effect| effect["name"] == name);
    let light = of("directional-light").unwrap_or_else(|| panic!("{found:#}"));
    let slip = of("slip-level").or_else(|| of("slip-memory"));
    assert!(effects.len() == 2 && slip.is_some(), "{found:#}");
    assert!(light["by"] == "run" && slip.unwrap()["by"].is_null(), "{found:#}");
    let counts = light["parameters"].as_array().unwrap().iter();
    let counts = counts
        .clone()
        .find(|parameter| parameter["name"] == "counts")
        .unwrap();
    for (run, truth) in COUNTS.iter().enumerate() {
        let said = counts["value"][run].as_f64().unwrap();
        assert!((said - truth).abs() < 12.0, "{counts}");
    }
}

#[test]
fn quieter_sensors_are_found_where_the_mean_lap_says_next_to_nothing() {
    const FACTOR: f64 = 0.4;
    let found = by_laps(&Robot::with(Setting::constant(
        sim::find("reading-noise").unwrap(),
        [FACTOR],
    )));
    assert_eq!(found["verdict"], "explained", "{found:#}");
    // A small offset does much the same.
    let candidates = found["candidates"].as_array().unwrap();
    let quieter = candidates.iter().find(|c| c["label"] == "reading-noise");
    let quieter = quieter.unwrap_or_else(|| panic!("{found:#}"));
    let behind = candidates[0]["score"].as_f64().unwrap() - quieter["score"].as_f64().unwrap();
    assert!(behind < 5.0, "{found:#}");
    let value = quieter["parameters"][0][0]["value"].as_f64().unwrap();
    assert!((value - FACTOR).abs() < 0.25, "{value}");
}

#[test]
fn a_listed_effect_under_another_name_is_named_from_logs() {
    let scratch = Scratch::new();
    limping().logged(&[3; 3]).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["wheel-asymmetry"]);
    holds(&found["effects"][0], "ratio", LIMPING, 1.0);
    assert_eq!(found["logs"]["decide"]["verdict"], "as declared", "{found:#}");
    assert_eq!(found["logs"]["confirmed_by_laps"], true, "{found:#}");
}

/// The answer to logs of a robot with one listed effect, which has to be that effect alone.
fn alone_in_logs(controller: Controller, laps: &[usize], name: &'static str, values: &[f64]) -> Value {
    let effect = Setting::constant(sim::find(name).unwrap(), values);
    let mut robot = Robot::with(effect);
    robot.controller = controller;
    explained_in_logs(&robot.logged(laps), &[name])["effects"][0].take()
}

#[test]
fn an_offset_that_cuts_most_readings_is_one_effect_in_logs() {
    let effect = alone_in_logs(ground::braitenberg(), &[3; 3], "ambient-offset", &[-73.0]);
    holds(&effect, "counts", -73.0, 0.0);
}

/// Most readings of the rule-based robot are 0 then, and no quieter for that.
#[test]
fn readings_that_are_cut_are_no_quieter_for_that() {
    let effect = alone_in_logs(ground::rule_based(), &[3; 3], "ambient-offset", &[-27.0]);
    holds(&effect, "counts", -27.0, 0.0);
}

#[test]
fn sensors_that_lag_have_their_time_in_logs() {
    let effect = alone_in_logs(ground::braitenberg(), &[6; 3], "sensor-lag", &[0.0752]);
    holds(&effect, "time_s", 0.0752, 0.0);
}

#[test]
fn readings_in_coarse_steps_are_nothing_else_in_logs() {
    // Of which few multiples occur.
    let effect = alone_in_logs(ground::braitenberg(), &[3; 3], "reading-step", &[146.27]);
    holds(&effect, "counts", 146.27, 0.0);
}

#[test]
fn a_wall_that_is_elsewhere_is_one_effect_in_logs() {
    let effect = alone_in_logs(ground::braitenberg(), &[3; 3], "inner-wall-offset", &[0.0039]);
    holds(&effect, "distance_m", 0.0039, 0.0);
}

/// Readings are first judged from where the robot would be without it; corners of walls elsewhere made up for what that spoils.
#[test]
fn a_marker_ahead_of_the_axle_has_its_distance_in_logs() {
    let effect = alone_in_logs(
        ground::braitenberg(),
        &[5; 4],
        "marker-offset",
        &[0.0109, 0.0, 0.0],
    );
    holds(&effect, "forward_m", 0.0109, 0.0);
}

/// A dent seems to be a patch as long as readings count that the dent takes out of range.
#[test]
fn a_dent_that_takes_a_wall_out_of_range_is_no_patch_in_logs() {
    let values = [1.0, 0.509, -0.0074, 0.0588];
    let effect = alone_in_logs(ground::braitenberg(), &[5; 4], "wall-bump", &values);
    holds(&effect, "height_m", values[2], 0.0);
}

/// Of the commands one in fifty is slower; a band half a millimetre per second wider would swallow twice as many.
#[test]
fn a_dead_band_just_below_most_commands_is_found_in_logs() {
    let effect = alone_in_logs(ground::braitenberg(), &[3; 3], "dead-band", &[0.0424]);
    holds(&effect, "speed_m_s", 0.0424, 0.0);
}

/// The mean lap says nothing of it, and all in all laps scatter as with more slip.
#[test]
fn a_wheel_out_of_round_is_known_by_how_laps_ripple() {
    const SHARE: f64 = 0.12;
    let found = by_laps(&Robot::with(Setting::constant(&LOBED, [SHARE])));
    says(&found, "explained", &["unlisted"]);
    let share = without_name(&found, OUT_OF_ROUND)[0];
    assert!((share - SHARE).abs() < 0.15 * SHARE, "{found:#}");
}

#[test]
fn sensors_that_warm_up_settle_in_logs() {
    const SHARE: f64 = 0.2;
    let scratch = Scratch::new();
    let robot = Robot::with(Setting::constant(&WARMING, [SHARE, WARMING_S]));
    robot.logged(&[4; 3]).record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["unlisted"]);
    let coefficients = without_name(&found, SETTLING);
    for (said, truth) in coefficients.into_iter().zip([SHARE, -SHARE, WARMING_S]) {
        assert!((said / truth - 1.0).abs() < 0.15, "{found:#}");
    }
}

/// Filtered, it looks like more slip: another phase in every run, and none in their mean.
#[test]
fn a_wheel_out_of_round_is_one_wheel_in_logs() {
    const SHARE: f64 = 0.08;
    let scratch = Scratch::new();
    let mut robot = Robot::with(Setting::constant(&LOBED, [SHARE]));
    robot.controller = ground::rule_based();
    robot.logged(&[3; 3]).record(&scratch, "set");
    let found = trace(&scratch, "rule-based", "set", &[]);
    says(&found, "explained", &["unlisted"]);
    let share = without_name(&found, OUT_OF_ROUND)[0];
    assert!((share - SHARE).abs() < 0.05 * SHARE, "{found:#}");
}

#[test]
fn a_tilted_camera_is_known_by_its_scale_over_the_floor() {
    const PER_M: f64 = 0.03;
    let found = by_laps(&Robot::with(Setting::constant(&TILTED, [PER_M])));
    says(&found, "explained", &["unlisted"]);
    let coefficients = without_name(&found, ["observe", "camera scale", "place", "polynomial"]);
    assert!((coefficients[1] - PER_M).abs() < 0.1 * PER_M, "{found:#}");
    assert!(
        coefficients[0] == 0.0 && coefficients[2].abs() < 0.1 * PER_M,
        "{found:#}"
    );
}

#[test]
fn a_rug_is_an_area_of_the_floor_on_which_wheels_are_slower() {
    const SHARE: f64 = 0.15;
    let found = by_laps(&Robot::with(Setting::constant(&RUG, [SHARE])));
    assert_ne!(found["verdict"], "unexplained", "{found:#}");
    let [share, x_m, y_m, radius_m, softness] =
        without_name(&found, ["act", "wheel speed", "place", "area"])[..]
    else {
        panic!("{found:#}");
    };
    let (middle, sides) = RUG_M;
    // Seen from the middle of the arena.
    assert!((0.7 + x_m - middle[0]).abs() < 0.05, "{found:#}");
    // How wide the rug is across the track no lap tells, nor how far beside it the middle of a round area lies, where it does most. On
    // the rug's own middle line it is as much slower, over the rug's length, as the rug is.
    let at = |along_m: f64| {
        let off_m = (along_m - 0.7 - x_m).hypot(middle[1] - 0.6 - y_m);
        share * (-0.5 * (off_m / radius_m).powf(2.0 / softness)).exp()
    };
    let sum: f64 = (0..1400).map(|mm| 0.001 * at(0.001 * f64::from(mm))).sum();
    let mean = sum / (2.0 * sides[0]);
    assert!((mean + SHARE).abs() < 0.1 * SHARE, "{mean}: {found:#}");
}

#[test]
fn a_carpet_with_a_grain_has_no_name_in_laps() {
    let found = by_laps(&Robot::with(Setting::constant(&GRAIN, [0.04])));
    never_a_listed_name(&found, "act");
}

#[test]
fn a_carpet_with_a_grain_has_no_name_in_logs() {
    let scratch = Scratch::new();
    let robot = Robot::with(Setting::constant(&GRAIN, [0.04])).logged(&[3; 3]);
    robot.record(&scratch, "set");
    never_a_listed_name(&trace(&scratch, "braitenberg", "set", &[]), "act");
}

#[test]
fn a_wet_place_on_the_floor_is_an_area_in_logs() {
    const SHARE: f64 = 0.2;
    let scratch = Scratch::new();
    let robot = Robot::with(Setting::constant(&PUDDLE, [SHARE])).logged(&[3; 3]);
    robot.record(&scratch, "set");
    let found = trace(&scratch, "braitenberg", "set", &[]);
    says(&found, "explained", &["unlisted"]);
    let [share, x_m, y_m, ..] = without_name(&found, ["act", "left wheel", "place", "area"])[..] else {
        panic!("{found:#}");
    };
    assert!((share + SHARE).abs() < 0.1 * SHARE, "{found:#}");
    let middle = Vec2::new(0.7 + x_m, 0.6 + y_m);
    assert!(
        (middle - Vec2::new(PUDDLE_M[0], PUDDLE_M[1])).length() < 0.03,
        "{found:#}"
    );
}
