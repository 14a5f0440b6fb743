//! `rayfold cost`, and the figures in docs/cost.md.

use serde_json::Value;
use snapbox::str;

use crate::Folder;

#[test]
fn an_estimate_for_people() {
    Folder::new().rayfold("cost --frames 50 --ms 180").assert().code(0).stderr_eq("").stdout_eq(str![[r#"
50 frames of 512x512, 180 ms each with 1,769 MB on x86_64
Prices of us-east-1 on 2026-03-14, in USD, free allowances left out

Making it, once
  Lambda: rendering                 15.548 GB-s       0.0003
  Lambda: assembling                 4.093 GB-s       0.0001
  S3: puts and lists                        303       0.0015
  S3: gets                                  250       0.0001
  Downloading the GIF once             0.001 GB       0.0001
  What costs less than 0.0001                         0.0001
  Together                                            0.0021

Keeping it, each month
  S3: frames and GIF                   0.003 GB       0.0001
  S3: lists of the sweep                  5,904       0.0295
  S3: gets of the sweep                   5,760       0.0023
  Together                                            0.0319

The stack, each month, however many animations
  Alarms                                     24       2.4000
  Dashboard                                   1       3.0000
  Schedule of the sweep                   2,880       0.0029
  Lambda: sweep invocations               2,880       0.0006
  Lambda: sweeping                   4,230 GB-s       0.0705
  S3: lists of the sweep                  5,760       0.0288
  Reading the failure queue             648,000       0.2592
  Together                                            5.7620

Total
  The first month                                     5.7959
  Each month after                                    5.7938

"#]]);
}

#[test]
fn an_estimate_for_programs_says_the_same() {
    let folder = Folder::new();
    let report = json(&folder, "cost --frames 50 --ms 180 --format json");
    let text = out(&folder, "cost --frames 50 --ms 180");
    for section in report["sections"].as_array().unwrap() {
        let sum: f64 =
            section["lines"].as_array().unwrap().iter().map(|line| line["usd"].as_f64().unwrap()).sum();
        assert!((sum - section["usd"].as_f64().unwrap()).abs() < 1e-12);
        assert!(text.contains(&format!("{sum:>12.4}")), "{sum} is not in\n{text}");
    }
    assert_eq!(report["workload"]["frames"], 50);
}

#[test]
fn twice_the_frames_twice_the_rendering() {
    let folder = Folder::new();
    let rendering = |flags: &str| {
        let report = json(&folder, &format!("cost --ms 180 --format json {flags}"));
        let lines = report["sections"][0]["lines"].as_array().unwrap().clone();
        let line = lines.into_iter().find(|line| line["item"] == "Lambda: rendering").unwrap();
        line["usd"].as_f64().unwrap()
    };
    let one = rendering("--frames 50");
    assert!((rendering("--frames 100") - 2.0 * one).abs() < 1e-12);
    assert!((rendering("--frames 50 --memory 3538") - 2.0 * one).abs() < 1e-12);
    assert!(rendering("--frames 50 --architecture arm64") < 0.81 * one);
}

#[test]
fn a_folder_with_a_model_and_two_outputs_costs_what_they_need() {
    let folder = Folder::new();
    let model = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    folder.write("spin/corner.obj", model);
    folder.write("spin/unused.obj", model);
    folder.write("spin/a.txt", "Screen 16 12\nMesh \"corner.obj\"\nFrames 1 3\nTrace\n");
    folder.write("spin/animation.json", r#"{"outputs": ["gif", "webp"]}"#);
    let output = folder.rayfold("cost spin --format json").assert().code(0).get_output().stdout.clone();
    let report: Value = serde_json::from_slice(&output).unwrap();
    let work = &report["workload"];
    assert_eq!(work["outputs"], serde_json::json!(["gif", "webp"]));
    assert_eq!((&work["files"], work["files_mb"].as_f64()), (&1.into(), Some(model.len() as f64 / 1e6)));
}

#[test]
fn prices_of_ones_own() {
    let folder = Folder::new();
    let built_in =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../infra/prices.json")).unwrap();
    folder.write(
        "prices.json",
        built_in.replace("us-east-1", "the-moon").replace("\"request\": 0.0000002", "\"request\": 1"),
    );
    let text = out(&folder, "cost --frames 50 --ms 180 --prices prices.json");
    assert!(text.contains("Prices of the-moon on") && text.contains("51.0000"), "{text}");

    folder.write("prices.json", built_in.replace("\"gb_second_arm64\"", "\"gb_second_risc\""));
    folder
        .rayfold("cost --frames 50 --ms 180 --prices prices.json")
        .assert()
        .code(1)
        .stdout_eq("")
        .stderr_eq(str![[r#"
error: prices.json holds no prices: unknown field `gb_second_risc`, expected one of `request`, `gb_second_x86_64`, `gb_second_arm64` at line 18 column 20

"#]]);
    folder.rayfold("cost --frames 50 --ms 180 --prices none.json").assert().code(1).stdout_eq("").stderr_eq(
        str![[r#"
error: cannot read none.json: No such file or directory

"#]],
    );
}

#[test]
fn nonsense_is_wrong_usage() {
    let folder = Folder::new();
    for flags in [
        "",
        "--frames 1",
        "--ms 1",
        "scenes --frames 1 --ms 1",
        "scenes --size 4x3",
        "--frames 0 --ms 1",
        "--frames 1 --ms 0",
        "--frames 1 --ms -3",
        "--frames 1 --ms nan",
        "--frames 1 --ms 1 --size 0x5",
    ] {
        folder.rayfold(&format!("cost {flags}")).assert().code(2).stdout_eq("");
    }
}

/// Runs each `$ rayfold cost ...` of the page, and compares the output with the text below it.
#[test]
fn the_page_gives_what_the_program_says() {
    let folder = Folder::new();
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/cost.md")).unwrap();
    let examples: Vec<(&str, &str)> = page
        .split("```console\n$ rayfold ")
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap().split_once('\n').unwrap())
        .collect();
    assert_eq!(examples.len(), 4, "50 x 512 x 512, 1,000 x 1080p, 10,000 x 720p, and these on Arm");
    for (command, expected) in examples {
        assert_eq!(out(&folder, command), expected, "$ rayfold {command}");
    }
}

fn out(folder: &Folder, command: &str) -> String {
    let output = folder.rayfold(command).assert().code(0).stderr_eq("").get_output().stdout.clone();
    String::from_utf8(output).unwrap()
}

fn json(folder: &Folder, command: &str) -> Value {
    serde_json::from_str(&out(folder, command)).unwrap()
}
