//! What `drive` says and draws of its runs.

use crate::support::Scratch;

#[test]
fn a_drive_says_what_compare_will_call_it() {
    let scratch = Scratch::new();
    let args = [
        "drive",
        "roduit2007",
        "--runs",
        "2",
        "--laps",
        "3",
        "--out",
        "slippery",
    ];
    let said = scratch.done(args).stdout;
    let (_, name) = said.trim_end().rsplit_once("written to slippery, as ").unwrap();
    let compared = scratch.done(["compare", "slippery"]).stdout;
    assert!(compared.contains(&format!("{name}/a  ")), "{said}{compared}");
    let said = scratch.done(args.iter().chain(&["--name", "mine"])).stdout;
    assert!(said.ends_with("\nwritten to slippery, as mine\n"), "{said}");
}
