//! Pictures that cannot be compared, and measurements that cannot be made.
use crate::{refuses, workplace};
use std::fs;
use tempfile::TempDir;

/// A folder with pictures to compare: small.png, large.png, transparent.png, tiny.png and a broken one.
fn pictures() -> TempDir {
    let folder = workplace();
    let png = |name: &str, side: u32, alpha: bool| {
        let rgba = vec![100; (side * side * 4) as usize];
        threadlight::low_level::picture::write_png(&folder.path().join(name), side, side, &rgba, alpha).unwrap();
    };
    png("small.png", 16, false);
    png("large.png", 32, false);
    png("tiny.png", 10, false);
    threadlight::low_level::picture::write_png(&folder.path().join("nothing.png"), 16, 16, &[0; 16 * 16 * 4], true)
        .unwrap();
    fs::write(folder.path().join("broken.exr"), "no picture").unwrap();
    folder
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let folder = pictures();
    for (arguments, names) in [
        ("small.png", &["<B>"][..]),
        ("small.png missing.png", &["missing.png"]),
        ("small.png broken.exr", &["broken.exr"]),
        ("small.png out", &["out", ".exr"]),
        ("small.png large.png", &["small.png and large.png", "16 x 16 and 32 x 32"]),
        ("tiny.png tiny.png", &["10 x 10", "11 x 11"]),
        ("small.png small.png --mask-background", &["alpha", "--background none"]),
        ("nothing.png small.png --mask-background", &["no surface"]),
        ("small.png small.png --exposure 0", &["--exposure", "above 0"]),
        ("small.png small.png --gamma nan", &["--gamma", "above 0"]),
        ("small.png small.png --difference out/where.exr", &["where.exr", ".png"]),
        ("small.png small.png --difference absent/where.png", &["absent/where.png"]),
        ("small.png large.png --difference out/where.png", &["sizes differ"]),
    ] {
        refuses(&folder, &format!("compare {arguments}"), names);
    }
}

#[test]
fn sweeps_that_cannot_be_measured_are_refused() {
    let folder = pictures();
    for (arguments, names) in [
        ("--counts 4,0", &["--counts", "1..=10000"][..]),
        ("--counts 4,10001", &["--counts", "1..=10000"]),
        ("--counts 4,many", &["--counts", "many"]),
        ("--counts 4,4", &["--counts", "4 twice"]),
        ("--methods paper,magic", &["magic", "paper", "filtered_fixed", "importance_fixed"]),
        ("--methods paper,paper", &["--methods", "\"paper\" twice"]),
        ("--materials unobtainium", &["unobtainium", "gold"]),
        ("--materials a/gold.toml,gold", &["--materials", "\"gold\" twice"]),
        ("--materials missing.binary", &["missing.binary"]),
        ("--environments mars", &["mars", "studio"]),
        ("--scene missing.toml", &["missing.toml"]),
        ("--scene missing.obj", &["missing.obj"]),
        ("--size 640", &["--size", "640x480"]),
        ("--methods fitted --size 40x10", &["40 x 10", "11 x 11"]),
        ("--shard 3", &["--shard", "2/8"]),
        ("--shard 3/2", &["--shard", "2/8"]),
        ("--shard 1/2", &["--shard", "at most 1"]),
        ("--reference-tolerance 0", &["--reference-tolerance", "positive number up to 1"]),
        ("--json absent/errors.json", &["absent/errors.json"]),
        ("--plot small.png", &["small.png"]),
        ("--plot absent/plots", &["absent/plots"]),
    ] {
        refuses(&folder, &format!("bench error {arguments}"), names);
    }
}

#[test]
fn measurements_of_time_that_cannot_be_made_are_refused() {
    let folder = pictures();
    for (arguments, names) in [
        ("--threads 0", &["--threads", "1..=1024"][..]),
        ("--repeat 0", &["--repeat", "1.."]),
        ("--counts 16,16", &["--counts", "16 twice"]),
        ("--methods reference", &["--methods reference"]),
        ("--scene missing.obj", &["missing.obj"]),
        ("--environments mars", &["mars", "studio"]),
        ("--materials clay,unobtainium", &["unobtainium", "gold"]),
        ("--json absent/speed.json", &["absent/speed.json"]),
        ("--plot small.png", &["small.png"]),
        ("--device unheard-of", &["unheard-of"]),
    ] {
        refuses(&folder, &format!("bench speed {arguments}"), names);
    }
}

#[test]
fn drags_that_cannot_be_measured_are_refused() {
    let folder = pictures();
    for (arguments, names) in [
        ("--drag alpha", &["--drag", "gold.alpha"][..]),
        ("--drag gold.alpha.x", &["gold", "alpha.x: is not a parameter"]),
        ("--drag silver.alpha", &["silver", "gold"]),
        ("--drag gold.beta", &["gold", "beta: is not a parameter"]),
        ("--drag gold.alpha --method paper", &["paper", "[possible values: fitted]"]),
        ("--drag gold.alpha --size 8x8", &["8 x 8", "11 x 11"]),
        ("--drag gold.alpha --reference-tolerance 0", &["--reference-tolerance", "positive"]),
    ] {
        refuses(&folder, &format!("bench live --from 0.1 --to 0.2 {arguments}"), names);
    }
}

/// What `bench error --json` writes of a material of a file.
const ROWS: &str = r#"[{"method": "paper", "threads": 4, "material": "my-nickel", "environment": "sky", "scene": "sphere", "rms": 0.1,
    "rms_linear": 0.1, "ssim": 0.9, "flip": 0.1, "max": 0.3, "nan": 0, "gpu_ms": 1, "frame_ms": 1, "lookups": 1,
    "covered_pixels": 1, "shade_ms": 1,
    "settings": {"width": 80, "height": 60, "subpixels": 2, "seed": 0, "repeat": 3, "whole_picture": false}}]"#;

#[test]
fn flags_of_measurements_are_refused_where_nothing_is_measured() {
    let folder = pictures();
    fs::write(folder.path().join("rows.json"), ROWS).unwrap();
    for flag in [
        "--materials clay",
        "--environments studio",
        "--methods paper",
        "--counts 4",
        "--scene sphere",
        "--size 24x18",
        "--subpixels 2",
        "--seed 0",
        "--device 0",
        "--no-cache",
        "--threads 64",
        "--reference-tolerance 1e-2",
        "--reference-on cpu",
        "--repeat 3",
    ] {
        let name = flag.split(' ').next().unwrap();
        let arguments = format!("bench report --from rows.json {flag}");
        refuses(&folder, &arguments, &[&format!("{name}: is of no use"), "without DIR"]);
    }
}

#[test]
fn galleries_and_reports_that_cannot_be_made_are_refused() {
    let folder = pictures();
    fs::write(folder.path().join("empty.json"), "[]").unwrap();
    fs::write(folder.path().join("other.json"), "{\"rows\": 3}").unwrap();
    fs::write(folder.path().join("rows.json"), ROWS).unwrap();
    fs::write(folder.path().join("below.json"), ROWS.replacen("0.1", "-0.1", 1)).unwrap();
    for (arguments, names) in [
        ("gallery", &["--plot"][..]),
        ("gallery --plot small.png", &["small.png"]),
        ("gallery --plot out --compare unobtainium --materials clay --size 16x12", &["unobtainium"]),
        ("gallery --plot out --compare gold,gold", &["--compare", "twice"]),
        ("gallery --plot out --materials missing.binary", &["missing.binary"]),
        (
            "gallery --plot out --materials-only --materials clay --methods ris --threads 1024 --subpixels 4 --size 16x12",
            &["threads: are 1024", "\"ris\""],
        ),
        ("gallery --plot out --materials-only --json out/errors.json", &["--materials-only", "--json"]),
        ("stress --only nosuchcase", &["--only \"nosuchcase\"", "\"slivers\"", "--all"]),
        ("stress --only slivers --only nosuchcase --all", &["nosuchcase", "\"map of 8192 x 4096\""]),
        ("error --plot out/a.png", &["out/a.png: is named like a file", "name a folder"]),
        ("report out/report.html", &["out/report.html: is named like a file"]),
        ("report", &["<DIR>"]),
        ("report small.png", &["small.png"]),
        ("report absent/report", &["absent/report"]),
        ("report out --from missing.json", &["missing.json"]),
        ("report out --from small.png", &["small.png", "bench error --json"]),
        ("report out --from empty.json", &["empty.json", "no measurements"]),
        ("report out --from other.json", &["other.json", "no measurements"]),
        ("report out --from below.json", &["below.json", "a negative number in row 0"]),
        ("report out --from rows.json", &["rows.json", "my-nickel", "--materials"]),
        ("report out --environments mars", &["mars"]),
        ("report out --size 10x", &["--size"]),
    ] {
        refuses(&folder, &format!("bench {arguments}"), names);
    }
}
