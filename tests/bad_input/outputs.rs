//! Files that cannot be written, and those from before.
use crate::{refuses, render, workplace};
use std::fs;

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
        ("-o out/image.png/", "it is a folder"),
        ("-o out/image.png --stats ./out/image.png", "./out/image.png: is to be written twice"),
    ] {
        refuses(&folder, &format!("render --threads 1 {flags}"), &[name]);
    }
    refuses(&folder, "threads gold -o absent/gold.threads", &["absent/gold.threads"]);
    refuses(&folder, "threads gold -o out/gold.threads --plot absent/gold.png", &["absent/gold.png"]);
    refuses(&folder, "threads gold -o out/gold.png", &["out/gold.png", "--plot"]);
    refuses(&folder, "threads gold -o out/gold.binary", &["out/gold.binary", "end its name in .threads"]);
    // Nothing was computed in vain.
    assert!(!folder.path().join("cache").exists());
}

#[test]
fn what_a_command_reads_it_does_not_write() {
    let folder = workplace();
    fs::write(folder.path().join("scene.toml"), "[environment]\nfile = 'light.exr'\n").unwrap();
    for name in ["light.exr", "a.png", "b.png", "a.toml", "a.binary"] {
        fs::write(folder.path().join(name), "precious").unwrap();
    }
    fs::write(
        folder.path().join("coat.toml"),
        "model = 'layered'\nbase = 'base.png'\ncoat = { alpha = 0.1, ior = 1.5 }\n",
    )
    .unwrap();
    for (arguments, name) in [
        ("render --environment light.exr -o ./light.exr", "./light.exr"),
        ("render scene.toml -o light.exr", "light.exr"),
        ("render scene.toml -o out/image.png --stats scene.toml", "scene.toml"),
        ("view scene.toml --stats scene.toml", "scene.toml"),
        ("compare a.png b.png --difference out/../b.png", "out/../b.png"),
        ("materials fit a.toml --model ggx -o a.toml", "a.toml"),
        ("materials export a.binary -o ./a.binary", "./a.binary"),
        ("materials plot a.svg -o a.svg", "a.svg"),
        ("threads coat.toml --plot base.png", "base.png"),
        ("bench fit --materials gold,coat.toml --json coat.toml", "coat.toml"),
        ("bench together --materials coat.toml --json base.png", "base.png"),
        ("bench error --materials scene.toml --json scene.toml", "scene.toml"),
        ("bench speed --environments light.exr --json light.exr", "light.exr"),
        ("bench rounding --scene scene.toml --json light.exr", "light.exr"),
        ("bench gallery --plot out --compare coat.toml --json coat.toml", "coat.toml"),
        ("bench shaders scene.toml --json scene.toml", "scene.toml"),
    ] {
        refuses(&folder, arguments, &[&format!("{name}: is also read, and would be lost")]);
    }
}

#[test]
fn a_picture_from_before_survives_a_refusal() {
    let folder = workplace();
    fs::write(folder.path().join("out/image.png"), "precious").unwrap();
    refuses(&folder, &render("--mesh missing.obj"), &["missing.obj"]);
    assert_eq!(fs::read(folder.path().join("out/image.png")).unwrap(), b"precious");
}
