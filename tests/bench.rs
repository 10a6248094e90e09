//! `threadlight bench` as its user meets it: what it prints and writes.
//!
//! Runs on the device that THREADLIGHT_TEST_DEVICE names, or else on the one that the program prefers.
mod common;

use common::{device_flags, own_cache, program, program_with_cache, radv};
use serde_json::Value;
use std::fs;
use std::process::Command;
use tempfile::TempDir;

/// What makes measurements quick.
const SMALL: &str = "--environments white --counts 1,4 --size 24x18";
const QUICK_TRUTH: &str = "--reference-tolerance 1e-2";

/// `threadlight bench` in `folder`, without a device.
fn command(folder: &TempDir, arguments: &str) -> Command {
    let mut command = program(folder);
    command.arg("bench").args(arguments.split(' '));
    command
}

/// What that prints, on the device to test on; it must succeed and have nothing to complain about.
fn bench(folder: &TempDir, arguments: &str) -> String {
    let output = command(folder, arguments).args(device_flags()).output().unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && complaints.is_empty(), "{complaints}");
    String::from_utf8(output.stdout).unwrap()
}

fn json(folder: &TempDir, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap()
}

/// Names of the files in a folder, sorted.
fn files(folder: &TempDir, name: &str) -> Vec<String> {
    let entries = fs::read_dir(folder.path().join(name)).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn speed_prints_tables_and_writes_json_and_plots() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        format!("speed --materials clay {SMALL} --methods paper --threads 4 --repeat 1 --json speed.json --plot plots");
    let said = bench(&folder, &arguments);
    for text in
        ["paper, clay, white, sphere: 24 x 18 pixels", "floor", "ns/lookup", "geometry_cache", "triangles", "ratio"]
    {
        assert!(said.contains(text), "{said}");
    }
    let timings = json(&folder, "speed.json");
    assert_eq!(keys(&timings), ["frames", "growths"]);
    let (frames, growths) = (timings["frames"].as_array().unwrap(), timings["growths"].as_array().unwrap());
    assert_eq!((frames.len(), growths.len()), (2, 12));
    let documented = [
        "covered_pixels",
        "floor_ms",
        "frame_ms",
        "gpu_ms",
        "height",
        "lookups",
        "material",
        "method",
        "ns_per_lookup",
        "passes",
        "scene",
        "environment",
        "subpixels",
        "threads",
        "triangles",
        "width",
    ];
    assert_eq!(keys(&frames[0]).len(), documented.len());
    assert!(documented.iter().all(|key| frames[0].get(key).is_some() && growths[0].get(key).is_some()));
    assert!(growths[0]["ratio"].is_null() && growths[1]["ratio"].as_f64().unwrap() > 0.0);
    let plots = ["frame_over_threads.svg", "paper_cost_over_growth.svg"];
    assert_eq!(files(&folder, "plots"), plots);
}

#[test]
fn shaders_are_compiled_for_a_gpu_that_is_not_there_and_spill_nothing() {
    let Some(driver) = radv() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut command = program_with_cache(&folder, own_cache(&folder));
    command.envs([("RADV_FORCE_FAMILY", "navi21"), ("VK_DRIVER_FILES", driver), ("VK_ICD_FILENAMES", driver)]);
    let arguments = "bench shaders --method fitted --threads 4 --material clay --environment white --json shaders.json";
    let output = command.args(arguments.split(' ')).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(
        ["NAVI21", "VGPRs", "geometry_cache_vert", "geometry_cache_frag", "shade_fitted"]
            .iter()
            .all(|text| said.contains(text)),
        "{said}"
    );
    let costs = json(&folder, "shaders.json");
    let costs = costs.as_array().unwrap();
    assert_eq!(keys(&costs[0]).len(), 5);
    let figure = |cost: &Value, name: &str| -> f64 {
        let figures = cost["statistics"].as_array().unwrap();
        figures.iter().find(|figure| figure[0] == name).unwrap()[1].as_f64().unwrap()
    };
    for cost in costs {
        assert!(figure(cost, "VGPRs") > 0.0 && figure(cost, "Spilled VGPRs") == 0.0, "{cost}");
    }
    let fitted: Vec<_> = costs.iter().filter(|cost| cost["shader"] == "shade_fitted").collect();
    // What the scene does not need is left out, and from the shader of pixels at edges what sub-pixels of others share.
    let [interior, edge, any] = fitted[..] else { panic!("{} shaders", fitted.len()) };
    assert_eq!([&interior["compiled_for"], &edge["compiled_for"], &any["compiled_for"]], ["scene", "scene", "any"]);
    let instructions = [edge, interior, any].map(|cost| figure(cost, "Instructions"));
    assert!(instructions.is_sorted_by(|fewer, more| fewer < more), "{instructions:?}");
}

#[test]
fn a_gallery_has_all_materials_and_the_methods_on_one() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = format!(
        "gallery --materials clay --threads 4 --compare clay {SMALL} --methods paper,uniform {QUICK_TRUTH} --plot out --json rows.json"
    );
    let said = bench(&folder, &arguments);
    assert!(said.starts_with("clay\n  RMS"), "{said}");
    assert_eq!(files(&folder, "out"), ["clay_white_sphere.png", "clay_white_sphere_side_by_side.png", "materials.png"]);
    let rows = json(&folder, "rows.json");
    assert_eq!(rows.as_array().unwrap().len(), 4);
    let methods = image::open(folder.path().join("out/clay_white_sphere.png")).unwrap();
    // Three rows of pictures, each 24 x 18, and text.
    assert!(methods.width() > 2 * 24 && methods.height() > 3 * 18, "{} x {}", methods.width(), methods.height());
}

#[test]
fn a_report_is_one_page_that_needs_no_other_file() {
    let folder = tempfile::tempdir().unwrap();
    let small = format!("{SMALL} --methods uniform {QUICK_TRUTH}");
    bench(&folder, &format!("error --materials clay,white-plastic {small} --json rows.json --plot plots"));
    assert_eq!(files(&folder, "plots").len(), 6);
    for from in ["", " --from rows.json"] {
        let said = bench(&folder, &format!("report now --materials clay {small} --threads 4 --repeat 1{from}"));
        assert_eq!(said, "now/report.html\n");
        assert_eq!(files(&folder, "now"), ["report.html"]);
        let page = fs::read_to_string(folder.path().join("now/report.html")).unwrap();
        for text in
            ["(table 1)", "(tables 2 to 4)", "(figure 12)", "(figures 10 and 11)", "(figure 13)", "processor", "driver"]
        {
            assert!(page.contains(text), "no {text}");
        }
        assert_eq!(page.contains("white-plastic</summary>"), !from.is_empty());
        assert_eq!(page.matches("<img").count(), page.matches("src=\"data:image/png;base64,").count());
        assert!(page.matches("<img").count() == 2 && page.matches("<svg").count() >= 4);
        assert!(!page.contains("href=") && !page.contains("<script") && !page.contains("NaN"), "the page needs others");
    }
}

#[test]
fn the_parts_of_a_sweep_together_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = format!(
        "error --materials clay,white-plastic --environments white,sky --counts 1,4 --size 24x18 --methods paper,uniform --repeat 1 {QUICK_TRUTH}"
    );
    // Tables that hold no times.
    let without_times = |text: &str| -> Vec<String> {
        let is_kept = |line: &&str| !line.starts_with("The reference");
        let mut is_time = false;
        let kept = text.lines().filter(is_kept).filter(|line| {
            if line.split("  ").any(|cell| cell.trim() == "1") {
                is_time = line.contains(" ms ") || line.contains("time,");
            }
            !is_time
        });
        kept.map(str::to_owned).collect()
    };
    let rows = |name: &str| {
        let mut rows = json(&folder, name);
        for row in rows.as_array_mut().unwrap() {
            let row = row.as_object_mut().unwrap();
            assert!(["gpu_ms", "shade_ms", "frame_ms"].iter().all(|&time| row.remove(time).is_some()));
        }
        rows
    };
    let whole = without_times(&bench(&folder, &format!("{sweep} --json whole.json --plot whole")));
    for part in 1..=3 {
        bench(&folder, &format!("{sweep} --shard {part}/3 --json {part}.json"));
    }
    let merge = "report --from 1.json 2.json 3.json --json merged.json --plot merged";
    // Without a device: nothing is measured.
    let output = command(&folder, merge).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let merged = without_times(&String::from_utf8(output.stdout).unwrap());
    assert!(whole.len() > 30, "{whole:#?}");
    assert_eq!(merged, whole);
    assert_eq!(rows("merged.json"), rows("whole.json"));
    assert_eq!(rows("1.json").as_array().unwrap().len() + 12, rows("whole.json").as_array().unwrap().len());
    assert_eq!(files(&folder, "merged"), files(&folder, "whole"));
    let output = command(&folder, "report --from 1.json 3.json").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("lack 2/3 of"), "{said}");
}

#[test]
fn together_compares_a_picture_of_all_materials_with_each_alone() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        "together --materials clay,gold,red-plastic --environments white,sky --threads 4 --size 48x36 --repeat 2";
    let said = bench(&folder, &format!("{arguments} --json together.json"));
    for text in
        ["3 materials, white, 48 x 36 pixels, 4 threads", "3 materials, sky", "mean of each alone", "red-plastic"]
    {
        assert!(said.contains(text), "{said}");
    }
    let rows = json(&folder, "together.json");
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 2);
    for row in rows {
        let number = |of: &Value, key: &str| of[key].as_f64().unwrap();
        let alone = row["alone"].as_array().unwrap();
        let names: Vec<_> = alone.iter().map(|alone| alone["material"].as_str().unwrap()).collect();
        assert_eq!(names, ["clay", "gold", "red-plastic"]);
        let mean = alone.iter().map(|alone| number(alone, "shade_ms")).sum::<f64>() / 3.0;
        assert!((number(row, "ratio") * mean / number(row, "shade_ms") - 1.0).abs() < 1e-9, "{row}");
        assert!(number(row, "device_memory_bytes") > 0.0 && number(row, "classify_ms") > 0.0);
        // Clay is one lookup, and the others are more: a third of the spheres is of each.
        let lookups = |of: &Value| number(of, "lookups");
        assert!(lookups(&alone[0]) < lookups(row) && lookups(row) < lookups(&alone[1]), "{row}");
        assert!(number(row, "covered_pixels") > 300.0, "{row}");
    }
}

#[test]
fn fit_prints_time_beside_error_and_writes_json() {
    let folder = tempfile::tempdir().unwrap();
    // A scene file stands for its materials.
    let scene = "[[material]]\nname = 'mud'\nmodel = 'lambert'\nreflectance = 0.2\n[[material]]\nname = 'gold'\n";
    std::fs::write(folder.path().join("two.toml"), scene).unwrap();
    let output = command(&folder, "fit --materials two.toml --counts 1,16 --json fit.json").output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}");
    for text in ["1 threads", "16 threads", "mud", "gold", "median", "worst", "others"] {
        assert!(said.contains(text), "{said}");
    }
    let fits = json(&folder, "fit.json");
    let fits = fits.as_array().unwrap();
    assert_eq!(fits.len(), 4);
    for fit in fits {
        assert_eq!(keys(fit), ["fit_ms", "fitted_error", "material", "threads", "validation_error"]);
        assert!(fit["fit_ms"].as_f64().unwrap() > 0.0);
    }
    // Sixteen threads of gold answer other lights nearly as well as their own, and better than one.
    let of_gold = |field: &str| [2, 3].map(|row: usize| fits[row][field].as_f64().unwrap());
    let ([_, own], [one, many]) = (of_gold("fitted_error"), of_gold("validation_error"));
    assert!(many < 0.5 * one && many < 2.0 * own, "{own} {one} {many}");
}

#[test]
fn help_shows_lists_as_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let output = command(&folder, "fit --help").output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && said.contains("[default: 16,64]"), "{said}");
}

#[test]
fn live_measures_the_drafts_of_a_dragged_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let drag = "live --environment white --size 24x18 --threads 4 --drag gold.alpha --from 0.3 --to 0.4 --steps 4";
    let said = bench(&folder, &format!("{drag} --json live.json"));
    for text in ["alpha of gold, 4 steps", "draft", "finished", "ratio", "change"] {
        assert!(said.contains(text), "{said}");
    }
    let steps = json(&folder, "live.json");
    let steps = steps.as_array().unwrap();
    let values: Vec<_> = steps.iter().map(|step| step["value"].as_f64().unwrap()).collect();
    assert_eq!(values.len(), 6);
    assert!((values[2] - 0.4).abs() < 1e-12 && values[3] < 0.4 && (values[5] - 0.3).abs() < 1e-12, "{values:?}");
    for step in steps {
        let number = |key: &str| step[key].as_f64().unwrap();
        // In white light nothing but the albedo counts, which drafts have to a part in a hundred.
        assert!(number("draft_rms") < 0.01 && number("finished_rms") < 0.003, "{step}");
        assert!(number("draft_ms") > 0.0 && number("draft_ms") < number("fit_ms"), "{step}");
    }
}

#[test]
fn hard_cases_are_shaded_as_on_the_cpu() {
    let folder = tempfile::tempdir().unwrap();
    // Two meshes, one after the other in the same file.
    let text = bench(&folder, "stress --only angles --only slivers --json rows.json");
    assert!(text.contains("normals at all angles to the view") && !text.contains("broken"), "{text}");
    let rows = json(&folder, "rows.json");
    let methods: Vec<_> = rows.as_array().unwrap().iter().map(|row| row["method"].as_str().unwrap()).collect();
    assert_eq!(methods, ["fitted", "paper", "gaussian", "fitted", "paper", "gaussian"]);
    assert!(rows[0]["covered"] != rows[3]["covered"], "{rows}");
    let fields = ["bright", "case", "covered", "method", "most", "not_finite", "rms", "wrongly_shown"];
    assert_eq!(keys(&rows[0]), fields);
    assert!(rows[0]["covered"].as_u64() > Some(1000), "{rows}");
    let errs_little = |row: &Value| row["rms"].as_f64().is_some_and(|rms| rms < 2e-3);
    assert!(rows.as_array().unwrap().iter().all(errs_little), "{rows}");
}

#[test]
fn coarser_fractions_err_more_and_each_rounding_little() {
    let folder = tempfile::tempdir().unwrap();
    bench(&folder, "rounding --materials gold --environments studio --counts 2 --size 24x18 --json rows.json");
    let rows = json(&folder, "rows.json");
    let rms = |rounding: &str| {
        let row = rows.as_array().unwrap().iter().find(|row| row["rounding"] == rounding);
        row.expect("a row")["rms"].as_f64().expect("a number")
    };
    let coarse = rms("fractions of 4 and 4 bits");
    assert!(rms("fractions of 8 and 8 bits") < coarse && coarse < 1e-2, "{rows}");
    for small in ["light in half floats", "normals a step off", "threads a step off", "the device"] {
        assert!((1e-9..1e-3).contains(&rms(small)), "{small}: {rows}");
    }
    assert!(rms("sums backwards") < 1e-6, "{rows}");
}
