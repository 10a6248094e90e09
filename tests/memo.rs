//! What a frame asks of the memo is made once: each change makes what it needs and nothing else, and what is no longer needed is let go.
mod common;
use common::{Validated, sphere};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use threadlight::Method;
use threadlight::low_level::brdf::{BaseProfile, Brdf, Custom, CustomBrdf};
use threadlight::low_level::memo::{Key, Keyed, Memo};
use threadlight::low_level::pipeline::{DeviceScene, Wanted};
use threadlight::low_level::prepare::{Prepared, key_of, prepare, prepare_draft};
use threadlight::low_level::progress::Observer;
use threadlight::low_level::scene::{
    Background, Camera, MaterialSettings, MaterialSource, ObjectSettings, Scene, Source, TangentRule,
};
use threadlight::low_level::threads::{FittedTable, Threads, fitted::PackedKernel};

fn small() -> Scene {
    sphere(MaterialSource::Builtin("clay".into()), "white", 4, (32, 24))
}

/// Asks for all that a frame of `scene` needs; gives what had to be made for it, by name.
fn ask(gpu: &Validated, scene: &Scene) -> (DeviceScene, Vec<&'static str>) {
    let round = gpu.round();
    let prepared = prepare(scene, &round).expect("a scene that can be prepared");
    let renderer = DeviceScene::new(&gpu.device, &prepared, &round).expect("a renderer");
    (renderer, round.made())
}

#[test]
fn each_change_makes_what_it_needs_and_nothing_else() {
    let gpu = Validated::with_own_memo();
    let mut before = small();
    // Of a material with a lobe, which has kernels.
    before.materials[0].source = MaterialSource::Builtin("red-plastic".into());
    let (renderer, made) = ask(&gpu, &before);
    assert!(
        ["mesh", "material", "threads", "environment", "shaders"].iter().all(|step| made.contains(step)),
        "{made:?}"
    );
    type Change = fn(&mut Scene);
    let silver = MaterialSource::Builtin("silver".into());
    let changes: [(&str, Change, &[&str]); 15] = [
        ("nothing", |_| (), &[]),
        ("exposure", |scene| scene.image.exposure = 2.0, &[]),
        ("gamma", |scene| scene.image.gamma = 1.8, &[]),
        ("size", |scene| scene.image.width = 48, &[]),
        ("turn of the light", |scene| scene.environment.rotation_deg = 10.0, &[]),
        ("intensity", |scene| scene.environment.intensity = 2.0, &[]),
        ("camera", |scene| scene.camera = Some(Camera::framing(glam::DVec3::ZERO, 2.0, 1.0)), &[]),
        ("no background", |scene| scene.image.background = Background::None, &["shaders"]),
        ("place of an object", |scene| scene.objects[0].scale = 2.0, &[]),
        // They are made in as many sets.
        ("sub-pixels", |scene| scene.image.subpixels = 1, &["threads", "upload of materials", "shaders"]),
        ("as many threads as there are", |scene| scene.shading.threads = Some(4), &[]),
        ("threads", |scene| scene.shading.threads = Some(2), &["threads", "upload of materials"]),
        (
            "method",
            |scene| scene.shading.method = Method::Uniform,
            &["upload of materials", "upload of the environment", "shaders"],
        ),
        (
            "environment",
            |scene| scene.environment.source = Source::Builtin("sky".into()),
            // White is a single pixel, than which every kernel is sharper; in the sky none is.
            &[
                "environment",
                "light by cosines",
                "irradiance",
                "upload of materials",
                "upload of irradiance",
                "upload of the environment",
                "shaders",
                "upload of the background",
            ],
        ),
        (
            "material",
            |scene| scene.materials[0].source = MaterialSource::Builtin("gold".into()),
            // Gold has Lambert's base: a sum of the same light.
            &["material", "lobe", "threads", "irradiance", "upload of materials", "upload of irradiance"],
        ),
    ];
    for (name, change, expected) in changes {
        let mut after = before.clone();
        change(&mut after);
        let (_, made) = ask(&gpu, &after);
        assert_eq!(made, expected, "{name}");
        // Models that shaders evaluate are compiled in: fitted threads evaluate none without small sources.
        let keys = [&before, &after].map(|scene| key_of(scene, &gpu.memo).unwrap());
        assert!(expected.is_empty() || keys[0] != keys[1], "{name}");
    }
    let mut unused = before.clone();
    unused.materials.push(threadlight::low_level::scene::MaterialSettings { name: "unused".into(), source: silver });
    assert_eq!(ask(&gpu, &unused).1, Vec::<&str>::new());
    assert_eq!(key_of(&unused, &gpu.memo).unwrap(), key_of(&before, &gpu.memo).unwrap());
    drop(renderer);
    gpu.finish();
}

#[test]
fn what_a_renderer_is_made_of_is_in_the_key_of_a_scene_and_what_frames_are_given_is_not() {
    let memo = Memo::default();
    let key = |change: &dyn Fn(&mut Scene)| {
        let mut scene = small();
        scene.shading.method = Method::Paper;
        let other = MaterialSettings { name: "other".into(), source: MaterialSource::Builtin("gold".into()) };
        scene.materials.push(other);
        scene.objects.push(ObjectSettings::new(Source::Builtin("sphere".into()), "other"));
        change(&mut scene);
        key_of(&scene, &memo).unwrap()
    };
    let before = key(&|_| ());
    let material = small().materials[0].name.clone();
    type Change<'c> = (&'static str, &'c dyn Fn(&mut Scene));
    let changes: [Change; 5] = [
        ("seed", &|scene| scene.shading.seed = 7),
        ("scale", &|scene| scene.objects[0].scale = 2.0),
        ("tangent", &|scene| scene.objects[0].tangent = Some(TangentRule::Along(glam::Vec3::X))),
        ("material of an object", &|scene| scene.objects[1].material = material.clone()),
        ("objects", &|scene| scene.objects.truncate(1)),
    ];
    for (name, change) in changes {
        assert_ne!(key(change), before, "{name}");
    }
    let framed = key(&|scene| {
        scene.camera = Some(Camera::framing(glam::DVec3::ZERO, 2.0, 1.0));
        (scene.image.width, scene.image.exposure, scene.image.gamma) = (48, 2.0, 1.8);
        (scene.environment.rotation_deg, scene.environment.intensity) = (10.0, 2.0);
    });
    assert_eq!(framed, before);
}

#[test]
fn light_that_brings_lamps_brings_the_brdfs_that_they_are_shaded_by() {
    let gpu = Validated::with_own_memo();
    let folder = tempfile::tempdir().unwrap();
    let map = |name: &str, lamp: f32| {
        let path = folder.path().join(name);
        let texels: Vec<_> = (0..32 * 16).map(|i| [if i == 200 { lamp } else { 1.0 }; 4]).collect();
        threadlight::low_level::picture::write_exr(&path, 32, 16, &texels, false, &Default::default()).unwrap();
        Source::File(path)
    };
    let mut scene = small();
    // Shaders look this one up in a table.
    scene.materials[0].source = common::model("model = 'oren_nayar'\nreflectance = 0.5\nsigma_deg = 30.0");
    scene.environment.source = map("soft.exr", 1.0);
    let (soft, _) = ask(&gpu, &scene);
    scene.environment.source = map("lamp.exr", 500.0);
    let (_, made) = ask(&gpu, &scene);
    assert!(made.contains(&"upload of materials"), "{made:?}");
    drop(soft);
    gpu.finish();
}

#[test]
fn a_lobe_that_mirrors_lamps_brings_what_they_are_blurred_to() {
    let gpu = Validated::with_own_memo();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamp.exr");
    let is_lamp = |i: usize| (60..63).contains(&(i % 128)) && (20..23).contains(&(i / 128));
    let texels: Vec<_> = (0..128 * 64).map(|i| [if is_lamp(i) { 500.0 } else { 1.0 }; 4]).collect();
    threadlight::low_level::picture::write_exr(&path, 128, 64, &texels, false, &Default::default()).unwrap();
    let mut scene = small();
    scene.environment.source = Source::File(path);
    scene.materials[0].source = common::model("model = 'lambert'\nreflectance = 0.5");
    let (diffuse, _) = ask(&gpu, &scene);
    scene.materials[0].source = common::model("model = 'conductor'\ndistribution = 'ggx'\nmetal = 'Al'\nalpha = 0.2");
    let (_, made) = ask(&gpu, &scene);
    assert!(made.contains(&"upload of the environment"), "{made:?}");
    drop(diffuse);
    gpu.finish();
}

#[test]
fn a_rotation_of_the_material_fits_nothing() {
    let gpu = Validated::with_own_memo();
    let turned = |rotation_deg: f64| {
        let roughness = format!("alpha_x = 0.1\nalpha_y = 0.3\nrotation_deg = {rotation_deg}");
        let mut scene = small();
        scene.materials[0].source =
            common::model(&format!("model = 'conductor'\ndistribution = 'ggx'\nmetal = 'Al'\n{roughness}"));
        scene.shading.threads = Some(1);
        scene
    };
    let (renderer, made) = ask(&gpu, &turned(0.0));
    assert!(made.contains(&"threads"), "{made:?}");
    for rotation_deg in [30.0, -90.0] {
        assert_eq!(ask(&gpu, &turned(rotation_deg)).1, ["material"], "{rotation_deg}");
        let keys = [0.0, rotation_deg].map(|degrees| key_of(&turned(degrees), &gpu.memo).unwrap());
        assert_ne!(keys[0], keys[1], "what is shown is another");
    }
    drop(renderer);
    gpu.finish();
}

#[test]
fn drafts_of_a_drag_share_light_and_shaders() {
    let gpu = Validated::with_own_memo();
    let of_alpha = |alpha: f64| {
        let metal = common::model(&format!("model = 'conductor'\ndistribution = 'ggx'\nmetal = 'Al'\nalpha = {alpha}"));
        sphere(metal, "sun", 2, (32, 24))
    };
    let (shown, _) = ask(&gpu, &of_alpha(0.6));
    let round = gpu.round();
    let before = prepare(&of_alpha(0.6), &round).unwrap();
    let first = Prepared { is_draft: true, ..before.clone() };
    let ready = DeviceScene::new(&gpu.device, &first, &round).unwrap();
    // From a lobe that is wider than the sun and the finest kernels to one that mirrors both.
    for alpha in [0.5, 0.002] {
        let round = gpu.round();
        let draft = prepare_draft(&of_alpha(alpha), &before, &round).unwrap().expect("a draft");
        DeviceScene::new(&gpu.device, &draft, &round).unwrap();
        assert_eq!(round.made(), ["material", "lobe", "draft", "upload of materials"], "{alpha}");
    }
    drop((ready, round));
    let (_, made) = ask(&gpu, &of_alpha(0.002));
    assert!(["upload of the environment", "shaders"].iter().all(|step| made.contains(step)), "{made:?}");
    drop(shown);
    gpu.finish();
}

/// Diffuse, and counts how often it is evaluated.
struct Counted(Arc<AtomicUsize>);

impl CustomBrdf for Counted {
    fn name(&self) -> &str {
        "counted"
    }

    fn key(&self) -> Vec<u8> {
        Vec::new()
    }

    fn evaluate(&self, _: glam::DVec3, _: glam::DVec3) -> glam::DVec3 {
        self.0.fetch_add(1, Ordering::Relaxed);
        glam::DVec3::splat(0.2)
    }
}

#[test]
fn a_brdf_that_stays_is_not_evaluated_again() {
    let gpu = Validated::with_own_memo();
    let count = Arc::new(AtomicUsize::new(0));
    let mut scene = small();
    scene.materials[0].source = MaterialSource::Custom(Custom::new(Counted(count.clone())));
    scene.materials.push(MaterialSettings { name: "other".into(), source: MaterialSource::Builtin("clay".into()) });
    scene.objects.push(ObjectSettings::new(Source::Builtin("sphere".into()), "other"));
    let (mut renderer, _) = ask(&gpu, &scene);
    let evaluations = count.load(Ordering::Relaxed);
    assert!(evaluations > 0);
    let changes: [fn(&mut Scene); 3] = [
        |scene| scene.materials[1].source = MaterialSource::Builtin("gold".into()),
        |scene| scene.image.exposure = 2.0,
        |scene| scene.environment.source = Source::Builtin("sky".into()),
    ];
    for change in changes {
        change(&mut scene);
        (renderer, _) = ask(&gpu, &scene);
    }
    assert_eq!(count.load(Ordering::Relaxed), evaluations);
    drop(renderer);
    gpu.finish();
}

#[test]
fn files_count_by_content() {
    let gpu = Validated::with_own_memo();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("material.toml");
    let write = |reflectance: f64| {
        std::fs::write(&path, format!("model = \"lambert\"\nreflectance = [{reflectance}, 0.5, 0.5]\n")).unwrap();
    };
    write(0.25);
    let mut scene = small();
    scene.materials[0].source = MaterialSource::File(path.clone());
    let mut other_name = scene.clone();
    let copy = folder.path().join("copy.toml");
    std::fs::copy(&path, &copy).unwrap();
    other_name.materials[0].source = MaterialSource::File(copy);

    let (renderer, _) = ask(&gpu, &scene);
    let picture =
        |renderer: &DeviceScene| renderer.render(Wanted { radiance: true, ..Wanted::default() }, 1).unwrap().radiance;
    let first = picture(&renderer);
    assert_eq!(
        ask(&gpu, &other_name).1,
        Vec::<&str>::new(),
        "a file of another name and the same contents is the same"
    );
    write(0.75);
    assert_eq!(ask(&gpu, &scene).1, Vec::<&str>::new(), "what nobody has named again is as it was");
    gpu.memo.look_again(&path);
    let (edited, made) = ask(&gpu, &scene);
    assert_eq!(made, ["material", "lobe", "threads", "upload of materials"]);
    assert_ne!(picture(&edited), first);
    drop((renderer, edited));
    gpu.finish();
}

#[test]
fn what_a_seed_does_not_change_is_not_made_again() {
    let gpu = Validated::with_own_memo();
    for (method, made) in
        [(Method::Fitted, &[][..]), (Method::Gaussian, &[]), (Method::Paper, &["threads", "upload of materials"])]
    {
        let mut scene = small();
        scene.shading.method = method;
        let (first, _) = ask(&gpu, &scene);
        scene.shading.seed = 7;
        assert_eq!(ask(&gpu, &scene).1, made, "{method}");
        drop(first);
    }
    gpu.finish();
}

#[test]
fn a_mesh_file_and_a_builtin_of_its_name_are_two() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sphere.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let mut scene = small();
    let material = scene.materials[0].name.clone();
    scene.objects = vec![
        ObjectSettings::new(Source::Builtin("sphere".into()), &material),
        ObjectSettings::new(Source::File(path), &material),
    ];
    let memo = Memo::default();
    let prepared = prepare(&scene, &memo.round(&())).unwrap();
    let triangles: Vec<_> = prepared.meshes.iter().map(|named| named.mesh.indices.len() / 3).collect();
    assert!(triangles.len() == 2 && triangles[0] > 1000 && triangles[1] == 1, "{triangles:?}");
}

/// 16 threads, of pixels as of sub-pixels: 91 rows of one azimuth, or 19 of a lobe that is brushed.
fn made_up_threads(is_isotropic: bool) -> Threads {
    let azimuths = if is_isotropic { 1 } else { 19 };
    let table = |sets: usize, of_subpixels| FittedTable {
        rows: 91,
        azimuths,
        count: 16,
        sets,
        material: "made up".to_owned(),
        rim_power: 1.0,
        base: BaseProfile::EVEN,
        albedo: vec![[0.5; 3]; 91 * azimuths],
        relative_error: vec![1e-3; 91 * azimuths],
        // Of level 2.
        kernels: vec![PackedKernel([0, 0x2800_4000, 0x2800_2800]); 16 * 91 * azimuths],
        of_subpixels,
    };
    Threads::Fitted(if is_isotropic { table(1, Some(Box::new(table(4, None)))) } else { table(2, None) })
}

#[test]
fn thirty_materials_take_less_than_200_mb_on_the_device() {
    let gpu = Validated::with_own_memo();
    let mut scene = small();
    (scene.image.width, scene.image.height) = (640, 480);
    scene.environment.source = Source::Builtin("studio".into());
    scene.shading.method = Method::Cosine;
    // The library's last ones: most of its models are among them, those that shaders look up in tables too.
    let names: Vec<_> = Brdf::builtin_names().collect();
    let names = &names[names.len() - 30..];
    scene.materials = names
        .iter()
        .map(|&name| MaterialSettings { name: name.into(), source: MaterialSource::Builtin(name.into()) })
        .collect();
    let object = |(i, name): (usize, &&str)| ObjectSettings {
        translate: glam::vec3(2.2 * (i % 6) as f32, 2.2 * (i / 6) as f32, 0.0),
        ..ObjectSettings::new(Source::Builtin("sphere".into()), name)
    };
    scene.objects = names.iter().enumerate().map(object).collect();
    // As large as fitted threads are, without the time that fitting 30 materials takes.
    let round = gpu.round();
    let mut prepared = prepare(&scene, &round).unwrap();
    prepared.method = Method::Fitted;
    for (index, material) in prepared.materials.iter_mut().enumerate() {
        let key = Key::builder("made up").number(index as u64).build();
        material.threads = Some(Keyed::new(key, made_up_threads(material.lobe.is_isotropic)));
    }
    let renderer = DeviceScene::new(&gpu.device, &prepared, &round).unwrap();
    let rendering = renderer.render(Wanted { display: true, ..Wanted::default() }, 1).unwrap();
    println!("{:.1} MB", 1e-6 * rendering.device_memory_bytes as f64);
    assert!((1_000_000..200_000_000).contains(&rendering.device_memory_bytes), "{}", rendering.device_memory_bytes);
    drop((renderer, round));
    gpu.finish();
}

/// Notes what is begun, and how far it comes.
#[derive(Default)]
struct Notes(Mutex<Vec<(String, usize)>>);

impl Observer for Notes {
    fn begin(&self, what: &str) {
        self.0.lock().unwrap().push((what.to_owned(), 0));
    }
    fn progress(&self, _: usize, total: usize) {
        if let Some(last) = self.0.lock().unwrap().last_mut() {
            last.1 = total;
        }
    }
    fn cancelled(&self) -> bool {
        false
    }
}

#[test]
fn every_slow_step_says_what_it_is_and_how_far_it_is() {
    let gpu = Validated::with_own_memo();
    let notes = Notes::default();
    let folder = tempfile::tempdir().unwrap();
    let ask = |folder: &Path, notes: &dyn Observer| {
        let memo = Memo::new(Some(folder));
        let round = memo.round(notes);
        let mut scene = small();
        scene.environment.source = Source::Builtin("studio".into());
        let prepared = prepare(&scene, &round).unwrap();
        DeviceScene::new(&gpu.device, &prepared, &round).unwrap();
    };
    ask(folder.path(), &notes);
    let notes = notes.0.into_inner().unwrap();
    let parts = |what: &str| notes.iter().filter(|(name, _)| name == what).map(|(_, total)| *total).max();
    assert!(parts("threads") >= Some(90) && parts("environment") > Some(10), "{notes:?}");
    // What is on disk the second time is not begun again.
    let again = Notes::default();
    ask(folder.path(), &again);
    assert!(again.0.into_inner().unwrap().iter().all(|(name, _)| name != "threads"));
    gpu.finish();
}
