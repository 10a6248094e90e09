//! Scene files: all keys are read, written and checked.
use glam::{DVec3, Vec3};

use super::super::Background;
use super::*;
use crate::method::{Method, Pattern};

const FULL: &str = r#"
    [image]
    width = 320
    height = 200
    subpixels = 3
    exposure = 0.5
    gamma = 1
    background = "none"
    [camera]
    eye = [1.5, 1.0, 3]
    target = [0, 0.5, 0]
    up = [0, 1, 0]
    fov_y_deg = 40
    [environment]
    file = "maps/x.hdr"
    rotation_deg = -30.0
    intensity = 2
    [shading]
    method = "paper"
    threads = 64
    seed = 7
    pattern = "fixed"
    [[material]]
    name = "measured"
    file = "x.binary"
    [[material]]
    name = "metal"
    model = "conductor"
    distribution = "ggx"
    alpha = 0.1
    eta = [0.2, 0.9, 1.1]
    k = [3.9, 2.4, 2.1]
    [[material]]
    name = "named"
    builtin = "gold"
    [[object]]
    mesh = "/absolute/y.obj"
    material = "metal"
    translate = [0.1, 0, 0]
    rotate_deg = [0, 90, 0]
    scale = 0.5
    [[object]]
    builtin = "sphere"
"#;

fn error(text: &str) -> String {
    let error = Scene::parse(text, Path::new("")).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn a_name_alone_is_that_of_a_builtin_material() {
    let parse = |text: &str| Scene::parse(text, Path::new("")).unwrap();
    assert_eq!(parse("[[material]]\nname = 'silver'"), parse("[[material]]\nname = 'silver'\nbuiltin = 'silver'"));
    let path = "[[material]]\nname = 'silver'\nfile = 'x.binary'";
    assert!(matches!(parse(path).materials[0].source, MaterialSource::File(_)), "what is given goes first");
}

#[test]
fn every_key_is_read_and_paths_start_at_the_file() {
    let scene = Scene::parse(FULL, Path::new("/base")).unwrap();
    let expected = ImageSettings {
        width: 320,
        height: 200,
        subpixels: 3,
        exposure: 0.5,
        gamma: 1.0,
        background: Background::None,
    };
    assert_eq!(scene.image, expected);
    let expected =
        Camera { eye: DVec3::new(1.5, 1.0, 3.0), target: DVec3::new(0.0, 0.5, 0.0), up: DVec3::Y, fov_y_deg: 40.0 };
    assert_eq!(scene.camera, Some(expected));
    let expected =
        EnvironmentSettings { source: Source::File("/base/maps/x.hdr".into()), rotation_deg: -30.0, intensity: 2.0 };
    assert_eq!(scene.environment, expected);
    assert_eq!(
        scene.shading,
        ShadingSettings { method: Method::Paper, threads: Some(64), seed: 7, pattern: Pattern::Fixed }
    );
    assert_eq!(scene.materials[0].source, MaterialSource::File("/base/x.binary".into()));
    let MaterialSource::Model { model, parameters } = &scene.materials[1].source else { panic!("not a model") };
    assert_eq!((model.as_str(), parameters["alpha"].as_float(), parameters.len()), ("conductor", Some(0.1), 4));
    assert_eq!(scene.materials[2].source, MaterialSource::Builtin("gold".into()));
    assert_eq!(scene.objects[0].mesh, Source::File("/absolute/y.obj".into()));
    assert_eq!((scene.objects[0].translate, scene.objects[0].scale), (Vec3::new(0.1, 0.0, 0.0), 0.5));
    assert_eq!(scene.objects[1], ObjectSettings::new(Source::Builtin("sphere".into()), "measured"));
}

#[test]
fn an_empty_file_is_the_default_scene() {
    let scene = Scene::parse("", Path::new("")).unwrap();
    assert_eq!(scene, Scene::default());
    assert_eq!(
        (scene.image.width, scene.image.height, scene.shading.threads, scene.image.subpixels),
        (640, 480, None, 2)
    );
}

#[test]
fn what_is_saved_reads_back_the_same() {
    let mut odd = Scene::default();
    odd.image = ImageSettings { exposure: 0.1 + 0.2, gamma: f64::from(f32::MIN_POSITIVE), ..odd.image };
    odd.environment.rotation_deg = -1e-300;
    odd.environment.intensity = f64::from(f32::MAX);
    odd.shading = ShadingSettings { seed: u64::MAX, ..odd.shading };
    odd.camera = Some(Camera::framing(DVec3::new(1.0 / 3.0, 1e9, -1e-9), 0.7, 1.1));
    odd.objects[0].tangent = Some(TangentRule::Uv);
    odd.objects[0].translate = Vec3::new(f32::MAX, f32::MIN_POSITIVE, 1.0 / 3.0);
    odd.objects[0].rotate_deg = Vec3::new(0.1, -0.2, 1e-30);
    odd.materials[0].name = "\"quoted\"\n[image]\twith = '\u{e9}'".into();
    odd.objects[0].material.clone_from(&odd.materials[0].name);
    odd.materials[0].source = MaterialSource::Model {
        model: "lambert".into(),
        parameters: "reflectance = [0.1, 1, 0.30000000000000004]".parse().unwrap(),
    };
    for scene in [Scene::default(), odd, Scene::parse(FULL, Path::new("/base")).unwrap()] {
        for (folder, base) in
            [(None, "/elsewhere"), (Some("/base"), "/base"), (Some("/"), "/"), (Some("/other"), "/there")]
        {
            let text = scene.to_toml(folder.map(Path::new)).unwrap();
            assert_eq!(Scene::parse(&text, Path::new(base)).unwrap(), scene, "{text}");
        }
    }
}

#[test]
fn files_beside_a_saved_scene_are_named_relative_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.toml");
    let mut scene = Scene::default();
    scene.environment.source = Source::File(folder.path().join("maps/x.hdr"));
    scene.objects[0].mesh = Source::File("/elsewhere/y.obj".into());
    let base = folder.path().join("bases/z.binary");
    let coat = "coat = { alpha = 0.1, ior = 1.5 }";
    let text = format!("base = {{ model = 'layered', base = {base:?}, {coat} }}\n{coat}");
    scene.materials[0].source = MaterialSource::Model { model: "layered".into(), parameters: text.parse().unwrap() };
    scene.save(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    for name in ["\"maps/x.hdr\"", "\"/elsewhere/y.obj\"", "\"bases/z.binary\""] {
        assert!(text.contains(name), "{name}: {text}");
    }
    assert_eq!(Scene::load(&path).unwrap(), scene);
    assert!(scene.files().contains(&base));
}

#[test]
fn what_toml_cannot_say_is_an_error_and_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.toml");
    std::fs::write(&path, "old").unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let name = std::ffi::OsStr::from_bytes(b"/maps/\xff.hdr");
        let mut scene = Scene::default();
        scene.environment.source = Source::File(name.into());
        assert!(scene.save(&path).unwrap_err().to_string().contains("UTF-8"));
    }
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    let nowhere = folder.path().join("absent/saved.toml");
    assert!(Scene::default().save(&nowhere).unwrap_err().to_string().contains("absent"));
}

#[test]
fn what_would_not_be_read_again_is_not_saved_and_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.toml");
    std::fs::write(&path, "old").unwrap();
    type Set = fn(&mut Scene);
    let model = |model: &str, parameters: &str| MaterialSource::Model {
        model: model.into(),
        parameters: parameters.parse().unwrap(),
    };
    let mut misspelt = Scene::default();
    misspelt.materials[0].source = model("lambert", "reflectence = 0.5");
    let changed = [
        ("exposure", (|scene| scene.image.exposure = f64::NAN) as Set),
        ("width", |scene| (scene.image.width, scene.image.height) = (0, 0)),
        ("scale", |scene| scene.objects[0].scale = 0.0),
        ("scale", |scene| scene.objects[0].scale = f32::NAN),
        ("translate", |scene| scene.objects[0].translate.x = f32::NAN),
        ("rotate_deg", |scene| scene.objects[0].rotate_deg.x = f32::NAN),
        ("gold", |scene| scene.materials.clear()),
        // Left out, it would be read as a sphere.
        ("no objects", |scene| scene.objects.clear()),
        ("mars", |scene| scene.environment.source = Source::Builtin("mars".into())),
        ("cube", |scene| scene.objects[0].mesh = Source::Builtin("cube".into())),
        ("velvet", |scene| scene.materials[0].source = MaterialSource::Builtin("velvet".into())),
    ];
    let changed = changed.map(|(said, set)| {
        let mut scene = Scene::default();
        set(&mut scene);
        (said, scene)
    });
    for (said, scene) in changed.into_iter().chain([("reflectence", misspelt)]) {
        let error = scene.save(&path).unwrap_err().to_string();
        assert!(error.contains(said), "{said}: {error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    }
}

#[test]
fn files_of_another_kind_are_told_with_where_they_belong() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, said) in [
        ("brass.binary", "", "is a material, not a scene; give it with --material"),
        ("cloth.BSDF", "", "is a material, not a scene; give it with --material"),
        ("red.toml", "model = 'lambert'\nreflectance = 0.5", "is a material, not a scene; give it with --material"),
        ("teapot.obj", "o mesh", "is a mesh, not a scene; give it with --mesh"),
        ("sky.hdr", "", "is an environment, not a scene; give it with --environment"),
        ("sky.exr", "", "is an environment, not a scene; give it with --environment"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let error = Scene::load(&path).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(said), "{error}");
    }
}

#[test]
fn unknown_keys_are_errors_that_name_the_key_and_its_line() {
    for (text, key, line) in [
        ("[image]\nwidth = 3\nwidht = 4", "widht", "line 3"),
        ("[camera]\neye = [1, 2, 3]\nfov = 4", "fov", "line 3"),
        ("[environment]\n\nrotation = 4", "rotation", "line 3"),
        ("[shading]\nthread = 4", "thread", "line 2"),
        ("[[material]]\nname = 'm'\nfile = 'x'\nalpha = 4", "alpha", "line 1"),
        ("[[object]]\nbuiltin = 'sphere'\nsize = 4", "size", "line 3"),
        ("[scene]", "scene", "line 1"),
    ] {
        let error = error(text);
        assert!(error.contains(&format!("`{key}`")) && error.contains(line), "{error}");
    }
}

#[test]
fn bad_values_are_errors_that_name_the_key_and_its_line() {
    for (text, key, line) in [
        ("[image]\nwidth = 0", "width", "line 2"),
        ("[image]\nheight = -1", "height", "line 2"),
        ("[image]\nheight = 100000", "height", "line 2"),
        ("[image]\nwidth = 3.5", "width", "line 2"),
        ("[image]\nwidth = '3'", "width", "line 2"),
        ("[image]\nsubpixels = 5", "subpixels", "line 2"),
        ("[image]\nexposure = -0.1", "exposure", "line 2"),
        ("[image]\nexposure = inf", "exposure", "line 2"),
        ("[image]\ngamma = 0", "gamma", "line 2"),
        ("[image]\nbackground = 'black'", "environment", "line 2"),
        ("[camera]\neye = [0, 0, 0]", "target", "line 1"),
        ("[camera]\neye = [0, 0]", "eye", "line 2"),
        ("[camera]\neye = [0, 1, 0]", "up", "line 1"),
        ("[camera]\neye = [0, 0, 1]\nfov_y_deg = 180", "fov_y_deg", "line 1"),
        ("[camera]\nfov_y_deg = 30", "eye", "line 1"),
        ("[environment]\nintensity = nan", "intensity", "line 2"),
        ("[environment]\nrotation_deg = inf", "rotation_deg", "line 2"),
        ("[environment]\nfile = 'x'\nbuiltin = 'y'", "builtin", "line 1"),
        ("[shading]\nthreads = 0", "threads", "line 2"),
        ("[[object]]\nbuiltin = 'sphere'\ntangent = 'up'", "`uv`", "line 3"),
        (
            "[[object]]\nbuiltin = 'sphere'\ntangent = { around = [0, 1, 0], along = [0, 1, 0] }",
            "give `around` or `along`",
            "line 3",
        ),
        ("[[object]]\nbuiltin = 'sphere'\ntangent = {}", "give `around` or `along`", "line 3"),
        ("[image]\nexposure = 1e39", "1e39 must be a finite number from 0 to 3.4e38", "line 2"),
        ("[[object]]\nbuiltin = 'sphere'\ntangent = { along = [0, 0, 0] }", "tangent", "line 3"),
        ("[shading]\nthreads = 10001", "threads", "line 2"),
        ("[shading]\nseed = -1", "seed", "line 2"),
        ("[[material]]\nname = 'm'", "model", "line 1"),
        ("[[material]]\nname = 'm'", "one of gold, ", "line 1"),
        ("[[material]]\nname = 'gold'\nalpha = 0.3", "alpha", "line 1"),
        ("[[material]]\nname = 'm'\nfile = 'x'\nmodel = 'y'", "model", "line 1"),
        ("[[material]]\nfile = 'x'", "name", "line 1"),
        ("[[material]]\nname = 3\nfile = 'x'", "name", "line 1"),
        ("[[material]]\nname = 'm'\nfile = 'x'\n[[material]]\nname = 'm'\nfile = 'x'", "name", "line 4"),
        ("[[object]]\nmaterial = 'gold'", "mesh", "line 1"),
        ("[[object]]\nbuiltin = 'sphere'\nscale = 0", "scale", "line 3"),
        ("[[object]]\nbuiltin = 'sphere'\nscale = nan", "scale", "line 3"),
        ("[[object]]\nbuiltin = 'sphere'\ntranslate = [0, inf, 0]", "translate", "line 3"),
        ("[image]\nwidth = ", "width", "line 2"),
        ("[image\nwidth = 3", "image", "line 1"),
    ] {
        let error = error(text);
        assert!(error.contains(key) && error.contains(line), "{text:?}: {error}");
    }
    let error = error("[[material]]\nname = 'red'\nfile = 'x'\n[[object]]\nbuiltin = 'sphere'\nmaterial = 'blue'");
    assert!(error.contains("\"blue\"") && error.contains("red") && error.contains("line 4"), "{error}");
}

#[test]
fn models_are_checked_though_no_object_has_them_but_files_are_not_read() {
    let with = |parameters: &str| format!("[[material]]\nname = 'gold'\n[[material]]\nname = 'm'\n{parameters}");
    for (parameters, said) in [
        ("model = 'lambert'\nreflectence = 0.5", "reflectance: is missing; rename `reflectence`"),
        ("model = 'lambert'\nreflectance = 0.5\nshine = 1", "shine: is not a parameter"),
        ("model = 'lambert'\nreflectance = 2", "reflectance: is 2"),
        ("model = 'wood'", "model `wood`"),
        ("model = 'merl'", "model `merl`"),
        ("model = 'layered'\nbase = 'x.binary'\ncoat = { alpha = 0.1, iro = 1.5 }", "coat.ior: is missing"),
        ("model = 'layered'\nbase = 'velvet'\ncoat = { alpha = 0.1, ior = 1.5 }", "velvet"),
    ] {
        let error = error(&with(parameters));
        assert!(error.contains("line 3") && error.contains("material \"m\": "), "{error}");
        assert!(error.contains(said), "{error}");
    }
    let text = with("model = 'layered'\nbase = 'absent.binary'\ncoat = { alpha = 0.1, ior = 1.5 }");
    assert_eq!(Scene::parse(&text, Path::new("")).unwrap().materials.len(), 2);
}

#[test]
fn wrong_brackets_and_lists_in_the_place_of_tables_are_told_with_the_right_ones() {
    for (text, line, said) in [
        ("[material]\nname = 'gold'", "line 1 (`[material]`)", "write [[material]]"),
        ("[image]\nwidth = 8\n[object]\nbuiltin = 'sphere'", "line 3 (`[object]`)", "write [[object]]"),
        ("\n[[camera]]\neye = [0, 0, 4]", "line 2 (`[[camera]]`)", "write [camera]"),
        ("[[image]]\nwidth = 8", "line 1", "write [image]"),
        ("[[environment]]\nintensity = 1", "line 1", "write [environment]"),
        ("[[shading]]\nseed = 1", "line 1", "write [shading]"),
        // In the order of the fields.
        ("image = [8, 8, 1, 1.0, 2.2, 'none']", "line 1", "write [image]"),
        ("camera = [[0, 0, 4], [0, 0, 0], [0, 1, 0], 30]", "line 1", "write [camera]"),
        ("object = [['x.obj']]", "line 1", "a list of tables: write [[object]]"),
        ("material = 'gold'", "line 1", "write [[material]]"),
        ("image = 3", "line 1", "write [image]"),
    ] {
        let error = error(text);
        assert!(error.contains(line) && error.contains(said), "{text:?}: {error}");
    }
    let inline = "image = { width = 8 }\nobject = [{ builtin = 'sphere' }]";
    assert_eq!(Scene::parse(inline, Path::new("")).unwrap().image.width, 8);
}

#[test]
fn errors_of_files_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.toml");
    std::fs::write(&path, "[image]\nwidth = 0").unwrap();
    assert!(Scene::load(&path).unwrap_err().to_string().contains("bad.toml"));
    std::fs::write(&path, b"\xff\xfe").unwrap();
    assert!(Scene::load(&path).unwrap_err().to_string().contains("bad.toml"));
    assert!(Scene::load(&folder.path().join("none.toml")).unwrap_err().to_string().contains("none.toml"));
    std::fs::write(&path, "[environment]\nfile = 'x.hdr'").unwrap();
    assert_eq!(Scene::load(&path).unwrap().environment.source, Source::File(folder.path().join("x.hdr")));
}

#[test]
fn vectors_have_three_numbers() {
    for (text, count) in [
        ("[camera]\neye = [0, 0, 5, 6]", 4),
        ("[camera]\neye = [0, 0, 5]\nup = [0, 1]", 2),
        ("[[object]]\nbuiltin = 'sphere'\ntranslate = [1, 2, 3, 4]", 4),
        ("[[object]]\nbuiltin = 'sphere'\ntangent = { around = [0, 1, 0, 5] }", 4),
    ] {
        let error = error(text);
        assert!(error.contains(&format!("invalid length {count}, expected three numbers")), "{text}: {error}");
    }
}
