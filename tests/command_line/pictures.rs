//! `render`: pictures, their statistics, what is kept for the next one.
use super::*;

#[test]
fn the_built_in_scene_renders_without_validation_messages_and_with_sane_statistics() {
    let folder = workplace();
    let said = printed(&mut render_by_own_cache(
        &folder,
        "--size 96x72 --threads 8 --repeat 3 --stats stats.json -o image.png",
    ));
    assert!(said.is_empty(), "{said}");

    let image = picture(&folder, "image.png");
    assert_eq!((image.width, image.height, image.alpha), (96, 72, false));
    // Gold in the middle: more red than blue.
    let [red, _, blue, _] = at(&image, 48, 36);
    assert!(red > 1.2 * blue, "{red} {blue}");

    let stats = stats(&folder, "stats.json");
    let number = |key: &str| stats[key].as_f64().unwrap_or_else(|| panic!("{key}: {}", stats[key]));
    let text = |key: &str| stats[key].as_str().unwrap_or_else(|| panic!("{key}: {}", stats[key]));
    assert!(!text("device").is_empty());
    assert_eq!((text("method"), text("thread_cache")), ("fitted", "miss"));
    for (key, value) in
        [("threads", 8.0), ("subpixels", 2.0), ("width", 96.0), ("height", 72.0), ("validation_messages", 0.0)]
    {
        assert_eq!(number(key), value, "{key}");
    }
    // The default camera sees the unit sphere from 3.93735 away: an ellipse of nearly that part of the image.
    let distance: f64 = (1.5_f64.powi(2) + 1.0 + 3.5_f64.powi(2)).sqrt();
    let radius_px = 72.0 * 2.0 / 2.0 / (18_f64.to_radians().tan() * (distance * distance - 1.0).sqrt());
    let covered = number("covered_subpixels");
    let circle = std::f64::consts::PI * radius_px * radius_px;
    assert!((covered / circle - 1.0).abs() < 0.02, "{covered} {circle}");
    // Interior pixels share one sum over eight threads; each other covered sub-pixel has two of its own. Both have the cosine part. Some
    // interior pixels are too curved for the lobe: their four sub-pixels have two threads each, too.
    let (interior, edge, lookups) = (number("interior_pixels"), number("edge_pixels"), number("lookups"));
    let expected = (8.0 + 1.0) * interior + (2.0 + 1.0) * (covered - 4.0 * interior);
    let curved = (lookups - expected) / (4.0 * (2.0 + 1.0) - (8.0 + 1.0));
    assert!(
        curved.fract() == 0.0 && (0.0..0.5 * interior).contains(&curved),
        "{lookups} lookups, {interior} interior, {covered} sub-pixels covered"
    );
    assert!(interior > 0.0 && edge > 0.0 && covered > 4.0 * interior && covered <= 4.0 * (interior + edge));

    let passes = stats["passes"].as_array().unwrap();
    let names: Vec<_> = passes.iter().map(|pass| pass["name"].as_str().unwrap()).collect();
    for name in ["geometry_cache", "classify", "shade", "background", "tone_map"] {
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
    let gpu_ms = |pass: &Value| pass["gpu_ms"].as_f64().unwrap();
    assert!(passes.iter().all(|pass| gpu_ms(pass) >= 0.0));
    assert!(passes.iter().map(gpu_ms).sum::<f64>() > 0.0);
    assert!(number("frame_ms") > 0.0 && number("thread_generation_ms") > 0.0);
    // At least radiance and geometry cache, at most what such a picture could ever need.
    let memory = number("device_memory_bytes");
    assert!(memory > 96.0 * 72.0 * (16.0 + 4.0 * 8.0) && memory < 1e9, "{memory}");
}

#[test]
fn the_same_command_gives_the_same_picture_with_any_state_of_the_cache() {
    let folder = workplace();
    for method in ["fitted", "paper"] {
        let _ = fs::remove_dir_all(own_cache(&folder));
        for (name, flags) in [("none", "--no-cache"), ("cold", ""), ("warm", "")] {
            for kind in ["png", "exr"] {
                printed(&mut render_by_own_cache(
                    &folder,
                    &format!("{SMALL} --method {method} {flags} -o {name}.{kind}"),
                ));
            }
            assert_eq!(own_cache(&folder).exists(), name != "none", "{method}, {name}");
        }
        for name in ["warm", "none"] {
            assert!(bytes(&folder, "cold.png") == bytes(&folder, &format!("{name}.png")), "{method}, {name}");
            let (cold, other) = (picture(&folder, "cold.exr"), picture(&folder, &format!("{name}.exr")));
            assert!(cold.rgba.iter().flatten().all(|value| value.is_finite()));
            assert!(cold.rgba == other.rgba, "{method}, {name}");
        }
    }
    printed(&mut render_by_own_cache(&folder, &format!("{SMALL} --method paper --seed 7 -o seed.exr")));
    assert!(picture(&folder, "cold.exr").rgba != picture(&folder, "seed.exr").rgba, "the seed has no effect");
}

#[test]
fn threads_and_pyramids_are_cached_and_damage_is_repaired() {
    let folder = workplace();
    let run = |name: &str| {
        let flags = format!("{SMALL} --method fitted --stats {name}.json -o {name}.png");
        render_by_own_cache(&folder, &flags).output().unwrap()
    };
    let state = |name: &str| stats(&folder, &format!("{name}.json"))["thread_cache"].as_str().unwrap().to_owned();
    run("first");
    run("second");
    assert_eq!((state("first").as_str(), state("second").as_str()), ("miss", "hit"));

    // Cut the threads and overwrite the pyramid and the pipelines.
    let files: Vec<_> = fs::read_dir(own_cache(&folder)).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(files.len() >= 3, "{files:?}");
    for file in &files {
        let content = fs::read(file).unwrap();
        let threads = file.extension().is_some_and(|extension| extension == "threads");
        fs::write(file, if threads { content[..content.len() / 2].to_vec() } else { vec![0x5a; content.len()] })
            .unwrap();
    }
    let output = run("damaged");
    let warning = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && warning.contains("WARN"), "{warning}");
    assert!([".threads", ".pyramid", ".moments"].iter().all(|name| warning.contains(name)), "{warning}");
    run("repaired");
    assert_eq!((state("damaged").as_str(), state("repaired").as_str()), ("miss", "hit"));
    for name in ["second", "damaged", "repaired"] {
        assert!(bytes(&folder, "first.png") == bytes(&folder, &format!("{name}.png")), "{name}");
    }
}

#[test]
fn the_exr_header_tells_how_the_picture_was_made() {
    let folder = workplace();
    printed(&mut render(&folder, &format!("{SMALL} --material silver --stats stats.json -o image.exr")));
    let (attributes, stats) = (picture(&folder, "image.exr").attributes, stats(&folder, "stats.json"));
    for (name, value) in [
        ("method", "fitted"),
        ("threads", "8"),
        ("material", "silver"),
        ("environment", "map.hdr"),
        ("device", stats["device"].as_str().unwrap()),
        ("threadlight_version", env!("CARGO_PKG_VERSION")),
    ] {
        assert_eq!(attributes[name], value, "{name}");
    }
    let seconds: f64 = attributes["seconds"].parse().unwrap();
    assert!((seconds * 1e3 - stats["frame_ms"].as_f64().unwrap()).abs() < 1e-6 * seconds * 1e3);
}

#[test]
fn without_a_background_the_picture_is_transparent_past_the_objects() {
    let folder = workplace();
    for name in ["image.png", "image.exr"] {
        printed(&mut render(&folder, &format!("{SMALL} --background none -o {name}")));
        let image = picture(&folder, name);
        assert!(image.alpha);
        assert_eq!(at(&image, 0, 0), [0.0; 4], "{name}");
        assert_eq!(at(&image, 48, 36)[3], 1.0, "{name}");
        // The silhouette is anti-aliased in quarters.
        let partial = image.rgba.iter().filter(|pixel| pixel[3] > 0.0 && pixel[3] < 1.0).count();
        assert!(partial > 20, "{name}: {partial}");
    }
}

/// A red sphere on the left and a green one on the right, in white light.
const TWO_SPHERES: &str = r#"
[image]
width = 64
height = 32
background = "none"
[camera]
eye = [0, 0, 10]
target = [0, 0, 0]
fov_y_deg = 25
[environment]
builtin = "white"
[shading]
threads = 9
[[material]]
name = "red"
model = "lambert"
reflectance = [0.5, 0, 0]
[[material]]
name = "green"
file = "materials/green.toml"
[[object]]
mesh = "meshes/square.obj"
material = "red"
translate = [-2, 0, 0]
[[object]]
builtin = "sphere"
material = "green"
translate = [2, 0, 0]
scale = 1.5
"#;

/// Writes the scene above and the files it names into a folder of their own below `folder`.
fn write_two_spheres(folder: &TempDir) {
    let place = |name: &str| folder.path().join("scene").join(name);
    for (name, text) in [
        ("scene.toml", TWO_SPHERES),
        ("materials/green.toml", "model = \"lambert\"\nreflectance = [0, 0.5, 0]\n"),
        ("meshes/square.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n"),
    ] {
        fs::create_dir_all(place(name).parent().unwrap()).unwrap();
        fs::write(place(name), text).unwrap();
    }
}

#[test]
fn a_scene_file_with_two_objects_and_two_materials_renders() {
    let folder = workplace();
    write_two_spheres(&folder);
    printed(&mut render(&folder, "scene/scene.toml -o image.exr --stats stats.json"));
    let image = picture(&folder, "image.exr");
    assert_eq!((image.width, image.height), (64, 32));
    assert_eq!(image.attributes["material"], "red, green");
    assert_eq!(image.attributes["threads"], "9");
    // A Lambertian surface in a white furnace shows its reflectance; 9 of the paper's threads come near it.
    let (left, right) = (at(&image, 17, 16), at(&image, 46, 16));
    for (pixel, channel) in [(left, 0), (right, 1)] {
        assert!((pixel[channel] - 0.5).abs() < 0.1, "{pixel:?}");
        assert_eq!((pixel[1 - channel], pixel[2], pixel[3]), (0.0, 0.0, 1.0));
    }
    assert_eq!(at(&image, 32, 16), [0.0; 4]);
}

#[test]
fn a_saved_scene_renders_to_the_same_bits() {
    let folder = workplace();
    write_two_spheres(&folder);
    // What the flags say, said by a scene that was saved, in the same folder and in another.
    let flags = "--size 96x72 --threads 8 --environment map.hdr --material copper --method filtered --pattern fixed --rotation 33.3 --exposure 0.7 --gamma 1.9 --subpixels 3 --seed 5";
    printed(&mut render(&folder, &format!("{flags} -o flags.exr")));
    printed(&mut render(&folder, &format!("{flags} -o flags.png")));
    let mut scene = Scene::default();
    let source = MaterialSource::Builtin("copper".into());
    scene.use_material("copper", source);
    scene.environment.source = Source::File(folder.path().join("map.hdr"));
    scene.environment.rotation_deg = 33.3;
    scene.image = ImageSettings { width: 96, height: 72, subpixels: 3, exposure: 0.7, gamma: 1.9, ..scene.image };
    scene.shading = ShadingSettings { method: Method::Filtered, threads: Some(8), pattern: Pattern::Fixed, seed: 5 };
    let two_spheres = Scene::load(&folder.path().join("scene/scene.toml")).unwrap();
    printed(&mut render(&folder, "scene/scene.toml -o two.exr"));
    fs::create_dir(folder.path().join("elsewhere")).unwrap();
    for place in ["", "elsewhere/"] {
        for (scene, picture_before) in [(&scene, "flags.exr"), (&two_spheres, "two.exr")] {
            let saved = format!("{place}saved.toml");
            scene.save(&folder.path().join(&saved)).unwrap();
            assert_eq!(Scene::load(&folder.path().join(&saved)).unwrap(), *scene);
            printed(&mut render(&folder, &format!("{saved} -o saved.exr")));
            let [before, after] = [picture_before, "saved.exr"].map(|name| picture(&folder, name).rgba);
            assert!(before == after, "{picture_before} and {saved}");
        }
    }
    scene.save(&folder.path().join("saved.toml")).unwrap();
    printed(&mut render(&folder, "saved.toml -o saved.png"));
    assert_eq!(bytes(&folder, "flags.png"), bytes(&folder, "saved.png"));
}

#[test]
fn flags_override_the_scene_file() {
    let folder = workplace();
    write_two_spheres(&folder);
    let flags = "--size 40x20 --threads 8 --subpixels 1 --material clay --environment map.hdr --background environment";
    printed(&mut render(&folder, &format!("scene/scene.toml {flags} -o image.exr --stats stats.json")));
    let (image, stats) = (picture(&folder, "image.exr"), stats(&folder, "stats.json"));
    assert_eq!((image.width, image.height, image.alpha), (40, 20, false));
    assert_eq!((image.attributes["material"].as_str(), image.attributes["environment"].as_str()), ("clay", "map.hdr"));
    assert_eq!((stats["threads"].as_u64(), stats["subpixels"].as_u64()), (Some(8), Some(1)));
    // Both objects are still there, and a mesh takes the place of both.
    let covered = stats["covered_subpixels"].as_u64().unwrap();
    printed(&mut render(&folder, &format!("scene/scene.toml {flags} --mesh sphere -o one.exr --stats stats.json")));
    assert!(self::stats(&folder, "stats.json")["covered_subpixels"].as_u64().unwrap() < covered);

    // Display: a doubled exposure doubles linear values, which the gamma then bends.
    printed(&mut render(&folder, "scene/scene.toml --gamma 1 --exposure 1 -o dark.png"));
    printed(&mut render(&folder, "scene/scene.toml --gamma 2 --exposure 0.5 -o bent.png"));
    let (dark, bent) = (at(&picture(&folder, "dark.png"), 17, 16)[0], at(&picture(&folder, "bent.png"), 17, 16)[0]);
    assert!(((0.5 * dark).sqrt() - bent).abs() < 0.005, "{dark} {bent}");
}

#[test]
fn the_environment_turns_with_the_rotation() {
    let folder = workplace();
    for (name, flags) in [("0", ""), ("360", "--rotation 360"), ("90", "--rotation 90"), ("minus", "--rotation -270")] {
        printed(&mut render(&folder, &format!("{SMALL} {flags} -o {name}.exr")));
    }
    let difference = |a: &str, b: &str| {
        let (a, b) = (picture(&folder, &format!("{a}.exr")), picture(&folder, &format!("{b}.exr")));
        let values = a.rgba.iter().flatten().zip(b.rgba.iter().flatten());
        values.map(|(a, b)| (a - b).abs()).sum::<f32>() / a.rgba.len() as f32
    };
    assert!(difference("0", "360") < 1e-3 && difference("90", "minus") < 1e-3);
    assert!(difference("0", "90") > 0.05, "{}", difference("0", "90"));
}

#[test]
fn the_reference_tells_its_error_and_comes_from_the_cache_the_second_time() {
    let folder = workplace();
    let reference = "--size 24x18 --environment map.hdr --method reference --tolerance 5e-3";
    printed(&mut render_by_own_cache(&folder, &format!("{reference} --stats first.json -o first.exr")));
    printed(&mut render_by_own_cache(&folder, &format!("{reference} --stats second.json -o second.exr")));
    printed(&mut render_by_own_cache(&folder, &format!("{reference} --no-cache --stats third.json -o third.exr")));
    printed(&mut render_by_own_cache(&folder, &format!("{reference} -o image.png")));
    for (name, cache) in [("first", "miss"), ("second", "hit"), ("third", "miss")] {
        let stats = stats(&folder, &format!("{name}.json"));
        assert_eq!(stats["reference_cache"], cache);
        assert_eq!((&stats["method"], &stats["tolerance"]), (&Value::from("reference"), &Value::from(5e-3)));
        let estimate = stats["error_estimate"].as_f64().unwrap();
        assert!(estimate > 0.0 && estimate < 5e-3 && stats["lookups"].as_u64() > Some(0), "{stats}");
        assert_eq!(stats["validation_messages"], 0);
    }
    let [first, second, third] = ["first", "second", "third"].map(|name| picture(&folder, &format!("{name}.exr")));
    assert!(first.rgba == second.rgba && first.rgba == third.rgba);
    assert!(first.attributes["error_estimate"].parse::<f64>().unwrap() < 5e-3);
    assert!(!first.alpha);

    // Another question is another answer: nothing comes from the cache.
    for (index, change) in ["--rotation 10", "--material clay", "--exposure 2", "--subpixels 1"].iter().enumerate() {
        printed(&mut render_by_own_cache(&folder, &format!("{reference} {change} --stats {index}.json")));
        assert_eq!(stats(&folder, &format!("{index}.json"))["reference_cache"], "miss", "{change}");
    }
    // A damaged file is noticed and replaced.
    for entry in fs::read_dir(own_cache(&folder)).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.to_string_lossy().ends_with(".reference.exr") {
            fs::write(&entry, &fs::read(&entry).unwrap()[..300]).unwrap();
        }
    }
    render_by_own_cache(&folder, &format!("{reference} --stats again.json -o again.exr")).assert().success();
    assert_eq!(stats(&folder, "again.json")["reference_cache"], "miss");
    assert!(picture(&folder, "again.exr").rgba == first.rgba);

    // The same surface and background as other methods show, roughly.
    printed(&mut render_by_own_cache(&folder, "--size 24x18 --environment map.hdr --threads 8 -o paper.exr"));
    let (paper, display) = (picture(&folder, "paper.exr"), picture(&folder, "image.png"));
    let mut differences = [0.0; 2];
    for (pixel, (truth, paper)) in first.rgba.iter().zip(&paper.rgba).enumerate() {
        for channel in 0..3 {
            let background = usize::from(pixel / 24 == 0);
            differences[background] = (truth[channel] - paper[channel]).abs().max(differences[background]);
            let shown = truth[channel].clamp(0.0, 1.0).powf(1.0 / 2.2);
            assert!((shown - display.rgba[pixel][channel]).abs() < 0.003, "{pixel}");
        }
    }
    assert!(differences[0] < 0.2 && differences[1] < 2e-3, "{differences:?}");
}

#[test]
fn what_a_method_knows_nothing_of_is_ignored_with_a_warning() {
    let folder = workplace();
    let small = "--size 8x6 --environment map.hdr --material clay -o image.exr";
    let warnings = |flags: &str| {
        let output = render(&folder, &format!("{small} {flags}")).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let ignored = warnings("--method cosine --threads 2 --pattern fixed");
    assert!(ignored.contains("--pattern is ignored: method \"cosine\"") && ignored.lines().count() == 1, "{ignored}");
    let ignored = warnings("--method reference --tolerance 0.1 --threads 2 --seed 3 --repeat 2");
    for flag in ["--threads", "--seed", "--repeat"] {
        assert!(ignored.contains(&format!("{flag} is ignored: method \"reference\"")), "{ignored}");
    }
    for method in ["fitted", "gaussian", "split_sum"] {
        let ignored = warnings(&format!("--method {method} --threads 1 --seed 3"));
        let warning = format!("--seed is ignored: method \"{method}\"");
        assert!(ignored.contains(&warning) && ignored.lines().count() == 1, "{ignored}");
    }
    assert_eq!(warnings("--method filtered --threads 2 --seed 3 --repeat 2 --pattern fixed"), "");
}
