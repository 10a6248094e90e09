//! Bad input: a reason on one line that names what is at fault, exit code 2, no panic and nothing written.
mod common;

use assert_cmd::Command;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Cells of a MERL table, and the bytes of its three planes.
const MERL_CELLS: usize = 90 * 90 * 180;

/// A folder of hostile files, with an empty folder `out` in it for what must not be written.
fn workplace() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    folder
}

/// Runs threadlight with `arguments` (separated by spaces) in `folder` and checks how it refuses: `names` are in the reason.
fn refuses(folder: &TempDir, arguments: &str, names: &[&str]) {
    let before = listing(folder.path());
    let output = Command::new(env!("CARGO_BIN_EXE_threadlight"))
        .current_dir(folder)
        .env("THREADLIGHT_CACHE", folder.path().join("cache"))
        .env_remove("RUST_LOG")
        .args(arguments.split(' '))
        .output()
        .unwrap();
    let said = format!("threadlight {arguments}\n{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty(), "{said}");
    let reason = String::from_utf8(output.stderr).unwrap();
    assert!(reason.starts_with("threadlight: ") && reason.ends_with('\n'), "{said}");
    assert_eq!(reason.lines().count(), 1, "{said}");
    assert!(!reason.contains("panicked"), "{said}");
    for name in names {
        assert!(reason.contains(name), "{said}does not name {name}");
    }
    assert_eq!(listing(folder.path()), before, "{said}");
}

/// Every file in `folder` and below, but for the cache, with its size.
fn listing(folder: &Path) -> Vec<(String, u64)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap).filter(|entry| entry.file_name() != "cache") {
        files.push((entry.path().display().to_string(), entry.metadata().unwrap().len()));
        if entry.path().is_dir() {
            files.extend(listing(&entry.path()));
        }
    }
    files.sort();
    files
}

/// `render` with `flags` and a picture to write.
fn render(flags: &str) -> String {
    format!("render --size 8x6 --threads 2 -o out/image.png {flags}")
}

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
        ("--subpixels", "0", "1..=4"),
        ("--subpixels", "5", "1..=4"),
        ("--exposure", "NaN", "finite"),
        ("--exposure", "inf", "finite"),
        ("--exposure", "-1", "not negative"),
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
    // More sub-pixels than an image of the device holds, though each flag is within its range.
    refuses(&folder, "render --threads 2 --size 16384x1 --subpixels 4 -o out/image.png", &["65536 x 4", "--size"]);
}

#[test]
fn unknown_names_are_told_with_the_known_ones() {
    let folder = workplace();
    refuses(&folder, &render("--material unobtainium"), &["unobtainium", "gold"]);
    refuses(&folder, &render("--environment mars"), &["mars", "studio", ".hdr"]);
    refuses(&folder, &render("--mesh cube"), &["cube", "sphere", ".obj"]);
    refuses(&folder, &render("--method magic"), &["magic", "paper"]);
    refuses(&folder, &render("--tolerance 1e-3"), &["--tolerance", "fitted"]);
    refuses(&folder, &render("--error 0.1"), &["--error", "--threads"]);
    refuses(&folder, "render --error 0.1 --method reference -o out/image.png", &["--error", "reference"]);
    refuses(&folder, &render("--reference-on gpu"), &["--reference-on", "fitted"]);
    refuses(&folder, &render("--method reference --reference-on tpu"), &["--reference-on", "tpu", "cpu, gpu"]);
    refuses(&folder, &render("--method reference --print-plan"), &["--print-plan", "reference"]);
    refuses(&folder, &render("--device abacus"), &["--device abacus", "name one of"]);
    refuses(&folder, &render("--background black"), &["--background", "black", "environment, none"]);
    refuses(&folder, "threads unobtainium -o out/a.threads", &["unobtainium", "gold"]);
    refuses(&folder, "completions abacus", &["abacus", "bash"]);
    refuses(&folder, "rendre", &["rendre", "render"]);
    refuses(&folder, &render("--treads 4"), &["--treads", "--threads"]);
}

#[test]
fn a_command_that_would_write_nothing_is_refused() {
    let folder = workplace();
    refuses(&folder, "render", &["-o"]);
    refuses(&folder, "threads gold", &["-o"]);
    refuses(&folder, "threads", &["<MATERIAL>"]);
    refuses(&folder, "render -o", &["--output"]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_any_work() {
    let folder = workplace();
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (flags, name) in [
        ("-o absent/image.png", "absent/image.png"),
        ("-o folder.png", "folder.png"),
        ("-o file/image.png", "file/image.png"),
        ("-o out/image.jpg", "image.jpg"),
        ("-o out/image", "out/image"),
        ("-o out/image.png --stats absent/stats.json", "absent/stats.json"),
        ("-o out/image.png --stats folder.png", "folder.png"),
    ] {
        refuses(&folder, &format!("render --threads 1 {flags}"), &[name]);
    }
    refuses(&folder, "threads gold -o absent/gold.threads", &["absent/gold.threads"]);
    refuses(&folder, "threads gold -o out/gold.threads --plot absent/gold.png", &["absent/gold.png"]);
    // Nothing was computed in vain.
    assert!(!folder.path().join("cache").exists());
}

#[test]
fn a_picture_from_before_survives_a_refusal() {
    let folder = workplace();
    fs::write(folder.path().join("out/image.png"), "precious").unwrap();
    refuses(&folder, &render("--mesh missing.obj"), &["missing.obj"]);
    assert_eq!(fs::read(folder.path().join("out/image.png")).unwrap(), b"precious");
}

#[test]
fn hostile_meshes_are_refused() {
    let folder = workplace();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
    for (name, text) in [
        ("empty.obj", String::new()),
        ("no_faces.obj", triangle.into()),
        ("line.obj", format!("{triangle}l 1 2 3\nf 1 2\n")),
        ("flat.obj", format!("{triangle}f 1 1 2\n")),
        ("beyond.obj", format!("{triangle}f 1 2 4\n")),
        ("zero.obj", format!("{triangle}f 1 2 0\n")),
        ("behind.obj", format!("{triangle}f 1 2 -4\n")),
        ("absurd.obj", format!("{triangle}f 1 2 -9223372036854775808\n")),
        ("endless.obj", format!("{triangle}f 1 2 99999999999999999999\n")),
        ("normal.obj", format!("{triangle}f 1//1 2//1 3//2\n")),
        ("absurd_normal.obj", format!("{triangle}f 1//1 2//1 3//9223372036854775807\n")),
        ("nan.obj", format!("{triangle}v 1 nan 0\nf 1 2 4\n")),
        ("infinite.obj", format!("{triangle}v 1 1e99 0\nf 1 2 4\n")),
        ("short.obj", format!("{triangle}v 1 2\nf 1 2 3\n")),
        ("words.obj", format!("{triangle}v one two three\nf 1 2 3\n")),
        ("huge.obj", "v 1e38 1e38 0\nv -1e38 0 3e38\nv 0 1e38 1e38\nf 1 2 3\n".into()),
        ("mesh.ply", "ply\n".into()),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        refuses(&folder, &render(&format!("--mesh {name}")), &[name]);
    }
    fs::create_dir(folder.path().join("folder.obj")).unwrap();
    fs::write(folder.path().join("noise.obj"), noise(4096)).unwrap();
    for name in ["folder.obj", "missing.obj", "noise.obj"] {
        refuses(&folder, &render(&format!("--mesh {name}")), &[name]);
    }
}

#[test]
fn hostile_measured_materials_are_refused() {
    let folder = workplace();
    let header = |dims: [i32; 3]| dims.map(i32::to_le_bytes).concat();
    let whole = |value: f64| [header([90, 90, 180]), value.to_le_bytes().repeat(3 * MERL_CELLS)].concat();
    let zeros = whole(0.0);
    let mut nan = zeros.clone();
    nan.splice(zeros.len() - 8.., f64::NAN.to_le_bytes());
    let mut infinite = whole(0.5);
    infinite.splice(20..28, f64::INFINITY.to_le_bytes());
    for (name, bytes, reason) in [
        ("missing", None, "cannot be read"),
        ("empty", Some(&b""[..]), "too short"),
        ("header", Some(&zeros[..11]), "too short"),
        ("cut", Some(&zeros[..zeros.len() - 1]), "bytes"),
        ("half", Some(&zeros[..zeros.len() / 2]), "bytes"),
        ("long", Some(&[&zeros[..], b"x"].concat()), "bytes"),
        ("dims", Some(&header([90, 90, 360])), "90 x 90 x 360"),
        ("negative_dims", Some(&header([-90, -90, 180])), "-90 x -90 x 180"),
        ("large_dims", Some(&header([i32::MAX; 3])), "2147483647"),
        ("zero", Some(&zeros), "zero"),
        ("negative", Some(&whole(-1.0)), "invalid"),
        ("nan", Some(&nan), "NaN"),
        ("infinite", Some(&infinite), "inf"),
    ] {
        let name = format!("{name}.binary");
        if let Some(bytes) = bytes {
            fs::write(folder.path().join(&name), bytes).unwrap();
        }
        refuses(&folder, &render(&format!("--material {name}")), &[&name, reason]);
    }
    refuses(&folder, "threads zero.binary --count 2 -o out/zero.threads", &["zero.binary"]);
}

#[test]
fn hostile_rgl_files_are_refused() {
    let folder = workplace();
    let good = common::rgl_like_file();
    let shape: &[u64] = &[1, 3, 2, 2];
    let with = |vndf: &[f32]| {
        common::rgl_file(&[("phi_i", &[1], &[0.0]), ("theta_i", &[3], &[0.0, 0.8, 1.4]), ("vndf", shape, vndf)])
    };
    let huge = common::rgl_file(&[("phi_i", &[u64::MAX], &[0.0])]);
    for (name, bytes, reason) in [
        ("missing", None, "cannot be read"),
        ("empty", Some(&b""[..]), "no tensor file"),
        ("header", Some(&good[..30]), "ends within its list"),
        ("cut", Some(&good[..good.len() - 1]), "ends before its field rgb"),
        ("huge", Some(&huge), "ends before its field phi_i"),
        ("zero", Some(&with(&[0.0; 12])), "nothing but zeros"),
        ("nan", Some(&with(&[f32::NAN; 12])), "NaN"),
        ("azimuths", Some(&common::rgl_file(&[("phi_i", &[2], &[0.0; 2])])), "phi_i that does not ascend"),
        ("noise", Some(&noise(4096)), "no tensor file"),
    ] {
        let name = format!("{name}.bsdf");
        if let Some(bytes) = bytes {
            fs::write(folder.path().join(&name), bytes).unwrap();
        }
        refuses(&folder, &render(&format!("--material {name}")), &[&name, reason]);
    }
}

#[test]
fn methods_that_evaluate_the_brdf_in_a_shader_refuse_measured_anisotropy() {
    let folder = workplace();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rgl/half_turn_rgb.bsdf");
    for method in ["importance", "paper"] {
        refuses(
            &folder,
            &render(&format!("--material {file} --method {method}")),
            &["`rgl`: is anisotropic", "fitted"],
        );
    }
}

#[test]
fn hostile_goniometric_files_are_refused() {
    let folder = workplace();
    for (name, bytes, reason) in [
        ("empty.bin", vec![], "1990656"),
        ("cut.bin", vec![0; 3 * 8 * 288 * 288 - 1], "1990656"),
        ("zero.bin", vec![0; 3 * 8 * 288 * 288], "nothing but zero"),
        ("nan.bin", vec![0xff; 3 * 8 * 288 * 288], "NaN in plane 0"),
        ("empty.dat", vec![], "too short"),
        ("zero.dat", vec![0; 64], "parameterisation 0"),
        ("noise.dat", noise(4096), "parameterisation"),
        ("cut.dat", common::mit_like_file()[..100].to_vec(), "bytes behind its header"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        refuses(&folder, &render(&format!("--material {name}")), &[name, reason]);
    }
}

#[test]
fn hostile_material_descriptions_are_refused() {
    let folder = workplace();
    for (name, text, key) in [
        ("empty.toml", "", "model"),
        ("syntax.toml", "model = ", "TOML"),
        ("model.toml", "model = 'wood'", "wood"),
        ("number.toml", "model = 3", "model"),
        ("unknown.toml", "model = 'lambert'\nreflectance = 0.5\nshine = 1", "shine"),
        ("missing.toml", "model = 'lambert'", "reflectance"),
        ("range.toml", "model = 'lambert'\nreflectance = [0.5, 0.5, 1.5]", "reflectance"),
        ("nan.toml", "model = 'lambert'\nreflectance = nan", "reflectance"),
        ("rgb.toml", "model = 'lambert'\nreflectance = [0.5, 0.5]", "reflectance"),
        ("kind.toml", "model = 'conductor'\ndistribution = 'phong'\nalpha = 0.1\neta = 1\nk = 1", "distribution"),
        ("alpha.toml", "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0\neta = 1\nk = 1", "alpha"),
        ("material.jpg", "", "material.jpg"),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        refuses(&folder, &render(&format!("--material {name}")), &[name, key]);
    }
    fs::write(folder.path().join("noise.toml"), noise(256)).unwrap();
    refuses(&folder, &render("--material noise.toml"), &["noise.toml"]);
}

#[test]
fn hostile_environments_are_refused() {
    let folder = workplace();
    let hdr = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    let exr = |names: &[&str]| {
        use exr::prelude::*;
        let channels = names.iter().map(|&name| AnyChannel::new(name, FlatSamples::F32(vec![1.0; 8]))).collect();
        let channels = AnyChannels::sort(channels);
        let layer = Layer::new((4, 2), LayerAttributes::default(), Encoding::default(), channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    let colour = exr(&["R", "G", "B"]);
    for (name, bytes, reason) in [
        ("empty.hdr", vec![], "Radiance"),
        ("text.hdr", b"hello\n".to_vec(), "Radiance"),
        ("cut.hdr", [hdr("-Y 4 +X 8"), vec![128; 4 * 31]].concat(), "Radiance"),
        ("huge.hdr", hdr("-Y 1000000 +X 1000000"), "2^28"),
        ("none.hdr", hdr("-Y 0 +X 0"), "none.hdr"),
        // A header of some bytes must not ask for gigabytes.
        ("claims.hdr", hdr("-Y 16384 +X 16384"), "more than 16 pixels for each"),
        ("break.hdr", hdr("-Y 1\rX 1"), "break.hdr"),
        ("empty.exr", vec![], "EXR"),
        ("cut.exr", colour[..colour.len() - 9].to_vec(), "EXR"),
        ("head.exr", colour[..60].to_vec(), "EXR"),
        ("depth.exr", exr(&["Z"]), "R, G, B"),
        ("red.exr", exr(&["R", "A"]), "R, G, B"),
        ("map.jpg", b"hello".to_vec(), ".hdr"),
        ("noise.hdr", noise(4096), "Radiance"),
        ("claims.exr", claiming(&colour, 16000), "more than 1024 pixels for each"),
        ("tiles.exr", with_large_tiles(), "more than 1024 pixels for each"),
        ("noise.exr", noise(4096), "EXR"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        refuses(&folder, &render(&format!("--environment {name}")), &[name, reason]);
    }
    for name in ["folder.hdr", "folder.exr"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        refuses(&folder, &render(&format!("--environment {name}")), &[name]);
    }
    for name in ["missing.hdr", "missing.exr"] {
        refuses(&folder, &render(&format!("--environment {name}")), &[name]);
    }
}

#[test]
fn hostile_scene_files_are_refused() {
    let folder = workplace();
    for (text, key) in [
        ("[image\nwidth = 8", "line 1"),
        ("[image]\nwidth = ", "line 2"),
        ("[image]\nwidth = 0", "width"),
        ("[image]\nwidht = 8", "widht"),
        ("[image]\nsubpixels = 5", "subpixels"),
        ("[image]\nexposure = nan", "exposure"),
        ("[image]\nexposure = 1e39", "exposure"),
        ("[environment]\nbuiltin = \"\"\"\na\rb\"\"\"", "a"),
        ("[shading]\nmethod = \"\"\"\nmagic\nspell\"\"\"", "magic"),
        ("[image]\ngamma = 0", "gamma"),
        ("[image]\nbackground = 'black'", "black"),
        ("[shading]\nthreads = 0", "threads"),
        ("[shading]\nthreads = 1025", "threads"),
        ("[shading]\nmethod = 'magic'", "magic"),
        ("[shading]\npattern = 'dots'", "per-pixel"),
        ("[scene]", "scene"),
        ("[environment]\nbuiltin = 'mars'", "mars"),
        ("[environment]\nintensity = -1", "intensity"),
        ("[environment]\nintensity = 1e39", "intensity"),
        ("[environment]\nfile = 'missing.hdr'", "missing.hdr"),
        ("[[object]]\nbuiltin = 'cube'", "cube"),
        ("[[object]]\nmesh = 'missing.obj'", "missing.obj"),
        ("[[object]]\nbuiltin = 'sphere'\nmaterial = 'velvet'", "velvet"),
        ("[[object]]\nbuiltin = 'sphere'\nscale = 0", "scale"),
        ("[[object]]\nbuiltin = 'sphere'\nscale = 1e38", "sphere"),
        ("[[object]]\nbuiltin = 'sphere'\nscale = 1e-38", "sphere"),
        ("[[object]]\nbuiltin = 'sphere'\ntranslate = [1e38, 0, 0]", "sphere"),
        ("[[object]]\nbuiltin = 'sphere'\ntranslate = [5e8, 5e8, 5e8]\nscale = 1e-9", "camera"),
        ("[[material]]\nname = 'm'\nmodel = 'wood'\n[[object]]\nbuiltin = 'sphere'\nmaterial = 'm'", "wood"),
        ("[[material]]\nname = 'm'\nmodel = 'lambert'\n[[object]]\nbuiltin = 'sphere'", "reflectance"),
        ("[[material]]\nname = 'm'\nfile = 'missing.binary'\n[[object]]\nbuiltin = 'sphere'", "missing.binary"),
        ("[[material]]\nname = 'm'\nbuiltin = 'velvet'\n[[object]]\nbuiltin = 'sphere'", "velvet"),
        ("[camera]\neye = [0, 0, 0]", "target"),
        ("[camera]\neye = [0, 0, 4]\nfov_y_deg = 180", "fov_y_deg"),
    ] {
        println!("{text}");
        fs::write(folder.path().join("bad.toml"), text).unwrap();
        refuses(&folder, "render bad.toml -o out/image.png", &[key]);
    }
    fs::write(folder.path().join("bad.toml"), "[image]\nwidth = 0").unwrap();
    refuses(&folder, "render bad.toml -o out/image.png", &["bad.toml", "line 2", "1 to 16384"]);
    fs::write(folder.path().join("noise.toml"), noise(256)).unwrap();
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    for name in ["noise.toml", "folder.toml", "missing.toml"] {
        refuses(&folder, &format!("render {name} -o out/image.png"), &[name]);
    }
}

/// An EXR whose header says that it is this wide and high.
fn claiming(exr: &[u8], side: i32) -> Vec<u8> {
    let mut bytes = exr.to_vec();
    for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
        let name = exr.windows(window.len()).position(|bytes| bytes == window.as_bytes()).expect("a window");
        // After the size of the value, 4 bytes, its corners: 0, 0, and the last pixel.
        let last = name + window.len() + 4 + 8;
        bytes[last..last + 8].copy_from_slice(&[side - 1; 2].map(i32::to_le_bytes).concat());
    }
    bytes
}

/// An EXR of 4 x 2 pixels whose tiles say that they are 2 x 4 million.
fn with_large_tiles() -> Vec<u8> {
    use exr::prelude::*;
    let channel = |name| AnyChannel::new(name, FlatSamples::F32(vec![1.0; 8]));
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
    let encoding = Encoding { blocks: Blocks::Tiles(Vec2(2, 2)), ..Encoding::FAST_LOSSLESS };
    let mut bytes = std::io::Cursor::new(Vec::new());
    let layer = Layer::new((4, 2), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    let mut bytes = bytes.into_inner();
    let name = b"tiles\0tiledesc\0";
    let place = bytes.windows(name.len()).position(|window| window == name).expect("tiles");
    // After the size of the value and the width, 4 bytes each.
    bytes[place + name.len() + 8..][..4].copy_from_slice(&(1_u32 << 22).to_le_bytes());
    bytes
}

/// Bytes without meaning, always the same.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut next = || {
        // Knuth's MMIX generator; its high bits are the good ones.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}

/// A folder with pictures to compare: small.png, large.png, transparent.png, tiny.png and a broken one.
fn pictures() -> TempDir {
    let folder = workplace();
    let png = |name: &str, side: u32, alpha: bool| {
        let rgba = vec![100; (side * side * 4) as usize];
        threadlight::low_level::output::write_png(&folder.path().join(name), side, side, &rgba, alpha).unwrap();
    };
    png("small.png", 16, false);
    png("large.png", 32, false);
    png("tiny.png", 10, false);
    threadlight::low_level::output::write_png(&folder.path().join("nothing.png"), 16, 16, &[0; 16 * 16 * 4], true)
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
        ("--counts 4,0", &["--counts", "1..=1024"][..]),
        ("--counts 4,1025", &["--counts", "1..=1024"]),
        ("--counts 4,many", &["--counts", "many"]),
        ("--counts 4,4", &["--counts", "4 twice"]),
        ("--methods paper,magic", &["magic", "paper"]),
        ("--methods paper,paper", &["--methods", "twice"]),
        ("--materials unobtainium", &["unobtainium", "gold"]),
        ("--materials a/gold.toml,gold", &["--materials", "\"gold\" twice"]),
        ("--materials missing.binary", &["missing.binary"]),
        ("--environments mars", &["mars", "studio"]),
        ("--scene missing.toml", &["missing.toml"]),
        ("--scene missing.obj", &["missing.obj"]),
        ("--size 640", &["--size", "640x480"]),
        ("--shard 3", &["--shard", "2/8"]),
        ("--shard 3/2", &["--shard", "2/8"]),
        ("--shard 1/2", &["--shard", "at most 1"]),
        ("--reference-tolerance 0", &["--reference-tolerance", "above 0"]),
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
fn galleries_and_reports_that_cannot_be_made_are_refused() {
    let folder = pictures();
    fs::write(folder.path().join("empty.json"), "[]").unwrap();
    fs::write(folder.path().join("other.json"), "{\"rows\": 3}").unwrap();
    for (arguments, names) in [
        ("gallery", &["--plot"][..]),
        ("gallery --plot small.png", &["small.png"]),
        ("gallery --plot out --compare unobtainium --materials clay --size 16x12", &["unobtainium"]),
        ("gallery --plot out --compare gold,gold", &["--compare", "twice"]),
        ("gallery --plot out --materials missing.binary", &["missing.binary"]),
        ("report", &["<DIR>"]),
        ("report small.png", &["small.png"]),
        ("report absent/report", &["absent/report"]),
        ("report out --from missing.json", &["missing.json"]),
        ("report out --from small.png", &["small.png", "bench error --json"]),
        ("report out --from empty.json", &["empty.json", "no measurements"]),
        ("report out --from other.json", &["other.json", "no measurements"]),
        ("report out --environments mars", &["mars"]),
        ("report out --size 10x", &["--size"]),
    ] {
        refuses(&folder, &format!("bench {arguments}"), names);
    }
}
