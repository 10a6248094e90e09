//! Scene files.
use crate::{noise, refuses, workplace};
use std::fs;

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
        ("[material]\nname = 'gold'", "write [[material]]"),
        ("image = [8, 8, 1, 1.0, 2.2, 'none']", "write [image]"),
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
        ("[[material]]\nname = 'velvet'", "blue-velvet"),
        ("[camera]\neye = [0, 0, 0]", "target"),
        ("[camera]\neye = [0, 0, 4]\nfov_y_deg = 180", "fov_y_deg"),
        ("[camera]\neye = [0, 0, 4]\nfov_y_deg = 1e-300", "at least 1e-4"),
        ("[camera]\neye = [0, 0, 1e200]", "`eye` must be within 1e15"),
    ] {
        println!("{text}");
        fs::write(folder.path().join("bad.toml"), text).unwrap();
        refuses(&folder, "render bad.toml -o out/image.png", &[key]);
    }
    fs::write(folder.path().join("bad.toml"), "[image]\nwidth = 0").unwrap();
    refuses(&folder, "render bad.toml -o out/image.png", &["bad.toml", "line 2", "1 to 16384"]);
    // What a file names wrongly is told with the file and what there is.
    for (text, words) in [
        ("[environment]\nbuiltin = 'studoi'", &["bad.toml", "line 1", "studio"][..]),
        ("[[object]]\nbuiltin = 'spher'", &["bad.toml", "line 1", "sphere"]),
        ("[[material]]\nname = 'm'\nbuiltin = 'golld'", &["bad.toml", "line 1", "gold"]),
        ("[shading]\nmethod = 'fited'", &["bad.toml", "fitted"]),
        (
            "[[material]]\nname = 'm'\nmodel = 'lambert'\nreflectence = 1",
            &["bad.toml: line 1 (`[[material]]`): material \"m\": ", "rename `reflectence`"],
        ),
        (
            "[[material]]\nname = 'gold'\n[[material]]\nname = 'm'\nmodel = 'lambert'\nreflectence = 1",
            &["bad.toml: line 3", "rename `reflectence`"],
        ),
        ("[shading]\nthreads = 1025", &["bad.toml: threads: are 1025"]),
    ] {
        fs::write(folder.path().join("bad.toml"), text).unwrap();
        refuses(&folder, "render bad.toml -o out/image.png", words);
    }
    fs::write(folder.path().join("brass.binary"), noise(256)).unwrap();
    refuses(
        &folder,
        "render brass.binary -o out/image.png",
        &["brass.binary: is a material, not a scene", "--material"],
    );
    fs::write(folder.path().join("teapot.obj"), "o mesh").unwrap();
    refuses(&folder, "render teapot.obj -o out/image.png", &["teapot.obj: is a mesh, not a scene", "--mesh"]);
    fs::write(folder.path().join("noise.toml"), noise(256)).unwrap();
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    for name in ["noise.toml", "folder.toml", "missing.toml"] {
        refuses(&folder, &format!("render {name} -o out/image.png"), &[name]);
    }
}
