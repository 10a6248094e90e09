//! What is listed, said and compared, and what happens to files.
use super::*;
use threadlight::low_level::threads::{Threads, read};

#[test]
fn the_plan_lists_passes_and_what_was_culled() {
    let folder = workplace();
    let linear = printed(&mut render(&folder, &format!("{SMALL} --print-plan -o image.exr")));
    let (passes, rest) = linear.split_once("\nculled\n").expect("something is culled for an EXR");
    for pass in ["geometry_cache", "classify", "shade", "background", "read_radiance"] {
        assert!(passes.contains(&format!("  {pass}\n")), "{linear}");
    }
    assert!(rest.trim_start().starts_with("tone_map ") && rest.contains("aliasing"), "{linear}");
    // With nothing to write but the plan.
    let display = printed(&mut render(&folder, &format!("{SMALL} --print-plan --background none")));
    assert!(display.contains("  tone_map\n") && !display.contains("background"), "{display}");
}

#[test]
fn the_cpu_driver_answers_to_its_name() {
    let folder = workplace();
    if !printed(&mut threadlight(&folder, "devices")).contains("llvmpipe") {
        return println!("skipped: this machine has no lavapipe");
    }
    for device in ["lavapipe", "llvmpipe", "LLVMPIPE"] {
        printed(&mut threadlight(&folder, &format!("render {SMALL} --validate --device {device} -o {device}.png")));
        assert!(bytes(&folder, "lavapipe.png") == bytes(&folder, &format!("{device}.png")), "{device}");
    }
}

#[test]
fn a_machine_without_a_driver_is_told_what_to_install() {
    let folder = workplace();
    let absent = folder.path().join("absent.json");
    let mut command = threadlight(&folder, &format!("render {SMALL} -o image.png"));
    let output = command.env("VK_DRIVER_FILES", &absent).env("VK_ICD_FILENAMES", &absent).output().unwrap();
    let reason = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{reason}");
    assert!(reason.lines().count() == 1 && reason.contains("mesa-vulkan-drivers"), "{reason}");
    assert!(!folder.path().join("image.png").exists());
}

#[test]
fn threads_are_written_and_read_back_the_same() {
    let folder = workplace();
    for method in ["fitted", "paper"] {
        for name in ["a.threads", "b.threads"] {
            let flags = format!("threads gold --method {method} --count 4 --seed 3 --no-cache -o {name}");
            threadlight(&folder, &flags).assert().success();
        }
        assert!(bytes(&folder, "a.threads") == bytes(&folder, "b.threads"), "{method}");
        let threads = threadlight::low_level::threads::read(&folder.path().join("a.threads")).unwrap();
        assert_eq!((threads.kind().name(), threads.size()), (method, [91, 4]));
        match threads {
            Threads::Fitted(table) | Threads::Gaussian(table) => assert_eq!(table.material, "gold"),
            Threads::Paper(table) => assert_eq!((table.material.as_str(), table.seed), ("gold", 3)),
        }
    }
}

#[test]
fn what_can_be_named_is_listed() {
    let folder = workplace();
    let list = printed(&mut threadlight(&folder, "materials"));
    assert_eq!(list, printed(&mut threadlight(&folder, "materials list")));
    for name in [
        "metals",
        "blue-velvet",
        "he_torrance",
        "gold",
        "conductor",
        "lambert",
        "studio",
        "sphere",
        "paper",
        ".binary",
        ".hdr",
        ".obj",
    ] {
        assert!(list.contains(name), "{name} is not in\n{list}");
    }
}

/// What `materials evaluate` writes for `lines`: exit code, values, complaint.
fn evaluated(folder: &TempDir, flags: &str, lines: &str) -> (Option<i32>, Vec<f64>, String) {
    let mut command = threadlight(folder, &format!("materials evaluate {flags}"));
    let output = command.write_stdin(lines.to_owned()).output().unwrap();
    let values = String::from_utf8(output.stdout).unwrap();
    let values = values.split_whitespace().map(|value| value.parse().unwrap()).collect();
    (output.status.code(), values, String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_material_is_evaluated_at_angles_and_at_vectors() {
    let folder = workplace();
    let lambert = "model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]\n";
    fs::write(folder.path().join("l.toml"), lambert).unwrap();
    let (code, values, _) = evaluated(&folder, "l.toml", "# comment\n30 30 180\n\n95 0 0\n");
    let expected = [0.8, 0.5, 0.2].map(|reflectance| reflectance / std::f64::consts::PI);
    assert_eq!((code, values), (Some(0), [expected, [0.0; 3]].concat()));
    // The same pair of directions in both forms, for a BRDF that they matter to.
    let (_, by_angles, _) = evaluated(&folder, "gold", "90 0 0\n60 30 90\n");
    let s = 0.75f64.sqrt();
    let (_, by_vectors, _) = evaluated(&folder, "gold --directions", &format!("1 0 0 0 0 1\n0 {s} 0.5 0.5 0 {s}\n"));
    for (a, b) in by_angles[3..].iter().zip(&by_vectors[3..]) {
        assert!((a - b).abs() < 1e-9 * a, "{a} {b}");
    }
    for (flags, line) in
        [("gold", "1 2"), ("gold", "200 0 0"), ("gold --directions", "1 0 1 0 0 1"), ("gold", "nan 0 0")]
    {
        let (code, _, complaint) = evaluated(&folder, flags, line);
        assert!(
            code == Some(2) && complaint.lines().count() == 1 && complaint.contains("line 1"),
            "{line}: {complaint}"
        );
    }
}

#[test]
fn a_material_that_reflects_more_than_it_receives_is_taken_with_a_warning() {
    let folder = workplace();
    for (diffuse, warned) in [(0.9, true), (0.5, false)] {
        let phong = format!("model = 'phong'\ndiffuse = [0.1, {diffuse}, 0.1]\nspecular = 0.5\nexponent = 40\n");
        fs::write(folder.path().join("p.toml"), phong).unwrap();
        let (code, _, said) = evaluated(&folder, "p.toml", "30 30 180\n");
        assert_eq!(
            (code, said.contains("reflects more light than it receives")),
            (Some(0), warned),
            "{diffuse}: {said}"
        );
    }
}

#[test]
fn an_anisotropic_material_is_evaluated_from_any_azimuth_and_plotted_but_not_exported() {
    let folder = workplace();
    let (code, by_angles, _) = evaluated(&folder, "brushed-steel", "30 60 180 0\n30 60 180\n30 60 180 90\n");
    assert_eq!((code, &by_angles[..3]), (Some(0), &by_angles[3..6]));
    assert!((by_angles[0] / by_angles[6] - 1.0).abs() > 0.1, "{by_angles:?}");
    let s = 0.75f64.sqrt();
    let (_, by_vectors, _) = evaluated(&folder, "brushed-steel --directions", &format!("0 -0.5 {s} 0 {s} 0.5\n"));
    assert_eq!(by_vectors.len(), 3);
    for (a, b) in by_angles[6..].iter().zip(&by_vectors) {
        assert!((a - b).abs() < 1e-9 * a, "{a} {b}");
    }
    threadlight(&folder, "materials plot silk -o silk.svg").assert().success();
    assert!(String::from_utf8(bytes(&folder, "silk.svg")).unwrap().contains("azimuth 90"));
    let refused = threadlight(&folder, "materials export silk -o silk.binary").assert().code(2);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("anisotropic"));
}

#[test]
fn a_measured_anisotropic_file_is_evaluated_from_any_azimuth_and_plotted() {
    let folder = workplace();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rgl/half_turn_rgb.bsdf");
    let (code, values, _) = evaluated(&folder, file, "30 60 180 0\n30 60 180 90\n30 60 180 270\n");
    assert_eq!(code, Some(0));
    // Half a turn leaves it as it is.
    let ratio = |other: usize| values[other] / values[3];
    assert!((ratio(0) - 1.0).abs() > 0.01 && (ratio(6) - 1.0).abs() < 1e-9, "{values:?}");
    threadlight(&folder, &format!("materials plot {file} -o file.svg")).assert().success();
    assert!(String::from_utf8(bytes(&folder, "file.svg")).unwrap().contains("azimuth 90"));
}

#[test]
fn a_material_is_exported_and_plotted() {
    let folder = workplace();
    threadlight(&folder, "materials export clay -o clay.binary").assert().success();
    let (_, own, _) = evaluated(&folder, "clay", "20 50 70\n");
    let (_, exported, _) = evaluated(&folder, "clay.binary", "20 50 70\n");
    assert_eq!([own.len(), exported.len()], [3, 3]);
    for (a, b) in own.iter().zip(&exported) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
    threadlight(&folder, "materials plot clay -o clay.svg").assert().success();
    assert!(String::from_utf8(bytes(&folder, "clay.svg")).unwrap().contains("</svg>"));
    threadlight(&folder, "materials export clay -o clay.png").assert().code(2);
    // Endings count in any letter case.
    threadlight(&folder, "materials export clay -o upper.BINARY").assert().success();
    assert!(bytes(&folder, "upper.BINARY") == bytes(&folder, "clay.binary"));
    threadlight(&folder, "materials export clay -o exported.threads").assert().success();
    threadlight(&folder, "threads clay -o made.threads").assert().success();
    let [exported, made] =
        ["exported", "made"].map(|name| fs::read(folder.path().join(name).with_extension("threads")).unwrap());
    assert!(exported == made);
}

#[test]
fn threads_are_in_as_many_sets_as_pictures_have_subpixels() {
    let folder = workplace();
    let sets = |flags: &str| {
        threadlight(&folder, &format!("threads gold --count 4 {flags} -o gold.threads")).assert().success();
        let Threads::Fitted(table) = read(&folder.path().join("gold.threads")).unwrap() else { panic!("not fitted") };
        table.for_subpixels().sets
    };
    assert_eq!([sets("--subpixels 1"), sets("")], [1, 4]);
    threadlight(&folder, "threads gold --subpixels 5 -o gold.threads").assert().code(2);
}

#[test]
fn a_model_is_fitted_to_a_measured_file_and_what_is_written_is_a_material() {
    let folder = workplace();
    let lambert = "model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]\n";
    fs::write(folder.path().join("l.toml"), lambert).unwrap();
    threadlight(&folder, "materials export l.toml -o l.binary").assert().success();
    let said = printed(&mut threadlight(&folder, "materials fit l.binary --model lambert -o fitted.toml"));
    assert!(said.starts_with("lambert ") && said.contains("of that of black"), "{said}");
    let (_, own, _) = evaluated(&folder, "l.binary", "20 50 70\n");
    let (code, fitted, _) = evaluated(&folder, "fitted.toml", "20 50 70\n");
    assert_eq!((code, own.len(), fitted.len()), (Some(0), 3, 3));
    for (a, b) in own.iter().zip(&fitted) {
        assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
    }
    for (arguments, complaint) in [
        ("l.binary --model velvet -o v.toml", "possible values"),
        ("l.binary --model lambert -o v.binary", "end its name in .toml"),
        ("absent.binary --model lambert -o v.toml", "absent.binary"),
    ] {
        let refused = threadlight(&folder, &format!("materials fit {arguments}")).assert().code(2);
        let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(stderr.contains(complaint) && !folder.path().join("v.toml").exists(), "{arguments}: {stderr}");
    }
}

#[test]
fn every_subcommand_has_help() {
    let folder = workplace();
    let help = printed(&mut threadlight(&folder, "--help"));
    for subcommand in ["render", "view", "compare", "bench", "threads", "materials", "devices", "completions"] {
        // The program may be built without its window.
        if subcommand == "view" && cfg!(not(feature = "viewer")) {
            continue;
        }
        assert!(help.contains(&format!("\n  {subcommand} ")), "{help}");
        let help = printed(&mut threadlight(&folder, &format!("{subcommand} --help")));
        assert!(help.contains("Usage: threadlight ") && help.contains("--verbose"), "{help}");
    }
    let help = printed(&mut threadlight(&folder, "render --help"));
    for flag in [
        "--mesh",
        "--material",
        "--environment",
        "--method",
        "--tolerance",
        "--error",
        "--reference-on",
        "--threads",
        "--subpixels",
        "--size",
        "--exposure",
        "--gamma",
        "--background",
        "--rotation",
        "--seed",
        "--device",
        "--validate",
        "--repeat",
        "--stats",
        "--print-plan",
        "--no-cache",
        "--output",
        "Examples:",
    ] {
        assert!(help.contains(flag), "{flag} is not in\n{help}");
    }
    assert!(printed(&mut threadlight(&folder, "--version")).contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn shells_get_their_completions() {
    let folder = workplace();
    for shell in ["bash", "zsh", "fish"] {
        let script = printed(&mut threadlight(&folder, &format!("completions {shell}")));
        assert!(script.contains("print-plan") && script.contains("threadlight"), "{shell}");
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let folder = workplace();
    for arguments in ["completions bash", "materials", "devices", "--help"] {
        let (code, said) = unheard(&threadlight(&folder, arguments));
        assert!(code == Some(0) && said.is_empty(), "{arguments}: {said}");
    }
}

/// A workplace with two grey pictures, `a.png` and `b.png`.
fn workplace_with_two_greys() -> TempDir {
    let folder = workplace();
    for (name, value) in [("a.png", 51), ("b.png", 102)] {
        let rgba = vec![value; 24 * 16 * 4];
        threadlight::low_level::picture::write_png(&folder.path().join(name), 24, 16, &rgba, false).unwrap();
    }
    folder
}

#[test]
fn without_a_reader_files_are_written_and_verdicts_reached_all_the_same() {
    let folder = workplace_with_two_greys();
    let (code, said) = unheard(&threadlight(&folder, "compare a.png b.png --at-most 1e-4"));
    assert!(code == Some(1) && said.contains("the RMS is"), "{code:?} {said}");
    let device = device_flags().join(" ");
    let bench =
        "bench error --materials clay --environments map.hdr --methods fitted --counts 1 --size 24x18 --repeat 1";
    for (command, files) in [
        (
            render(&folder, &format!("{SMALL} --print-plan -o image.png --stats stats.json")),
            &["image.png", "stats.json"][..],
        ),
        (threadlight(&folder, "materials fit clay --model lambert -o fitted.toml"), &["fitted.toml"]),
        (threadlight(&folder, "bench fit --materials clay --counts 1 --json fit.json"), &["fit.json"]),
        (
            threadlight(&folder, &format!("{bench} {device} --json error.json --plot plots")),
            &["error.json", "plots/rms_over_threads.svg"],
        ),
    ] {
        let (code, said) = unheard(&command);
        assert!(code == Some(0), "{command:?} {said}");
        assert!(files.iter().all(|file| folder.path().join(file).exists()), "{command:?}");
    }
}

/// Exit code and complaints of `command` where standard output is a pipe that nobody reads.
fn unheard(command: &Command) -> (Option<i32>, String) {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let folder = command.get_current_dir().unwrap();
    let mut heard = program_with_cache(folder, own_cache(folder));
    let output = heard.args(command.get_args()).stdout(writer).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn pictures_replace_older_ones_whole_and_leave_nothing_beside_them() {
    let folder = workplace();
    fs::write(folder.path().join("image.png"), "older").unwrap();
    printed(&mut render(&folder, &format!("{SMALL} --no-cache --stats stats.json -o image.png")));
    assert_eq!(picture(&folder, "image.png").width, 96);
    let mut files: Vec<_> =
        fs::read_dir(Path::new(folder.path())).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["image.png", "map.hdr", "stats.json"]);
}

#[test]
fn pictures_are_compared_as_a_table_as_json_and_as_a_heat_map() {
    let folder = workplace_with_two_greys();
    let table = printed(&mut threadlight(&folder, "compare a.png b.png --difference where.png"));
    let lines: Vec<Vec<_>> = table.lines().map(|line| line.split_whitespace().take(2).collect()).collect();
    let names: Vec<_> = lines.iter().map(|line| line[0]).collect();
    assert_eq!(names, ["rms", "rms_linear", "max", "ssim", "flip", "nan", "pixels"]);
    assert_eq!((lines[0][1], lines[2][1], lines[6][1]), ("0.200000", "0.200000", "384"));

    let json: Value = serde_json::from_str(&printed(&mut threadlight(&folder, "compare a.png b.png --json"))).unwrap();
    let keys: Vec<_> = json.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(keys, ["flip", "max", "nan", "pixels", "rms", "rms_linear", "ssim"]);
    // Linear values of 0.2 and 0.4 for gamma 2.2.
    let expected = 0.4_f64.powf(2.2) - 0.2_f64.powf(2.2);
    assert!((json["rms_linear"].as_f64().unwrap() - expected).abs() < 1e-6);

    // As a test: equal enough, or not.
    printed(&mut threadlight(&folder, "compare a.png b.png --at-most 0.201"));
    for (pictures, reason) in
        [("a.png b.png", "the RMS is 2.000e-1, above 1.99e-1"), ("nan.exr a.png", "384 values are NaN")]
    {
        let header = threadlight::low_level::picture::ExrHeader::default();
        let nan = [[f32::NAN, 0.0, 0.0, 1.0]; 24 * 16];
        threadlight::low_level::picture::write_exr(&folder.path().join("nan.exr"), 24, 16, &nan, false, &header)
            .unwrap();
        let output = threadlight(&folder, &format!("compare {pictures} --at-most 0.199")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(reason) && !output.stdout.is_empty(), "{said}");
    }

    // Below the picture there is the scale.
    let map = picture(&folder, "where.png");
    assert_eq!((map.width, map.height), (24, 32));
    assert!((0..16).all(|row| at(&map, 3, row) == at(&map, 0, 0)) && at(&map, 23, 31) != at(&map, 0, 31));
}
