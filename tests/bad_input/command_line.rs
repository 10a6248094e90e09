//! Flags and arguments that say nothing, or nothing that can be done.
use crate::common::{own_cache, program_with_cache};
use crate::{refuses, render, workplace};

#[test]
fn numbers_out_of_range_name_the_flag_and_the_range() {
    let folder = workplace();
    for (flag, value, range) in [
        ("--threads", "0", "1..=10000"),
        ("--threads", "10001", "1..=10000"),
        ("--threads", "-1", "1..=10000"),
        ("--threads", "99999999999999999999", "--threads"),
        ("--threads", "many", "--threads"),
        ("--size", "0x0", "1 to 16384"),
        ("--size", "640", "640x480"),
        ("--size", "640x", "640x480"),
        ("--size", "16385x1", "1 to 16384"),
        ("--size", "-1x5", "640x480"),
        ("--subpixels", "0", "1..=4"),
        ("--subpixels", "5", "1..=4"),
        ("--exposure", "NaN", "finite"),
        ("--exposure", "inf", "finite"),
        ("--exposure", "-1", "from 0"),
        ("--gamma", "0", "above 0"),
        ("--gamma", "nan", "finite"),
        ("--rotation", "inf", "finite"),
        ("--seed", "-1", "--seed"),
        ("--repeat", "0", "0 is not in 1"),
        ("--error", "0", "positive"),
        ("--error", "nan", "positive"),
        ("--tolerance", "0", "positive"),
        ("--tolerance", "nan", "positive"),
    ] {
        refuses(&folder, &format!("render -o out/image.png {flag} {value}"), &[flag, value, range]);
    }
    for (method, count, range) in [
        ("fitted", "0", "1 to 128"),
        ("fitted", "129", "1 to 128"),
        ("paper", "0", "1 to 1024"),
        ("paper", "1025", "1 to 1024"),
    ] {
        let flags = format!("threads gold --method {method} --count {count} -o out/gold.threads");
        refuses(&folder, &flags, &["--count", count, method, range]);
    }
    refuses(&folder, "threads gold --count many -o out/gold.threads", &["--count", "many"]);
    refuses(&folder, "threads gold --method uniform -o out/gold.threads", &["uniform", "fitted", "paper"]);
    // More than a method can have.
    refuses(&folder, "render --method paper --threads 1025 -o out/image.png", &["threads", "1025", "1024", "paper"]);
    refuses(&folder, "render --threads 129 -o out/image.png", &["threads", "129", "128", "fitted"]);
    let many = "render --method uniform --threads 9000 --subpixels 4 -o out/image.png";
    refuses(&folder, many, &["threads", "9000", "4062", "sub-pixels"]);
    // More sub-pixels than an image of the device holds, or more pixels than its shaders list, though each flag is within its range. It is said
    // before a material is asked for.
    let large = |size: &str| format!("render --material unobtainium {size} -o out/image.png");
    refuses(&folder, &large("--size 16384x1 --subpixels 4"), &["65536 x 4", "a smaller size or fewer sub-pixels"]);
    refuses(&folder, &large("--size 16384x16384 --subpixels 1"), &["16384 x 16384", "a smaller size"]);
}

#[test]
fn unknown_names_are_told_with_the_known_ones() {
    let folder = workplace();
    refuses(&folder, &render("--material unobtainium"), &["unobtainium", "gold"]);
    refuses(&folder, &render("--environment mars"), &["mars", "studio", ".hdr"]);
    refuses(&folder, &render("--mesh cube"), &["cube", "sphere", ".obj"]);
    refuses(&folder, &render("--method magic"), &["magic", "paper"]);
    // Those that the command takes.
    for command in ["view", "bench shaders"] {
        let list = "[possible values: fitted, paper, gaussian, split_sum, uniform, cosine, importance, filtered, environment, ris, mis]";
        refuses(&folder, &format!("{command} --method reference"), &["--method", list]);
    }
    refuses(&folder, &render("--tolerance 1e-3"), &["--tolerance", "fitted"]);
    refuses(&folder, &render("--error 0.1"), &["--error", "--threads"]);
    refuses(&folder, "render --error 0.1 --method reference -o out/image.png", &["--error", "reference"]);
    refuses(&folder, &render("--reference-on gpu"), &["--reference-on", "fitted"]);
    refuses(&folder, &render("--method reference --reference-on tpu"), &["--reference-on", "tpu", "cpu, gpu"]);
    refuses(&folder, &render("--method reference --print-plan"), &["--print-plan", "reference"]);
    refuses(&folder, &render("--device abacus"), &["device \"abacus\": ", "name one of"]);
    refuses(&folder, &render("--background black"), &["--background", "black", "environment, none"]);
    refuses(&folder, "threads unobtainium -o out/a.threads", &["unobtainium", "gold"]);
    refuses(&folder, "completions abacus", &["abacus", "bash"]);
    refuses(&folder, "rendre", &["rendre", "render"]);
    refuses(&folder, &render("--treads 4"), &["--treads", "--threads"]);
    refuses(&folder, "threads gold -1", &["unexpected argument '-1' found; see --help"]);
}

#[cfg(unix)]
#[test]
fn a_name_that_is_no_text_is_told() {
    use std::os::unix::ffi::OsStrExt;
    let folder = workplace();
    let mut command = program_with_cache(&folder, own_cache(&folder));
    command.args(["render", "-o", "image.png", "--mesh"]).arg(std::ffi::OsStr::from_bytes(b"dragon\xff.obj"));
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("\"dragon\\xFF.obj\": is not UTF-8; "), "{said}");
}

#[test]
fn a_command_that_would_write_nothing_is_refused() {
    let folder = workplace();
    refuses(&folder, "render", &["-o"]);
    refuses(&folder, "threads gold", &["-o"]);
    refuses(&folder, "threads", &["<MATERIAL>"]);
    refuses(&folder, "render -o", &["--output"]);
}
