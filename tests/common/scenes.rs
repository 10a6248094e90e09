//! Scenes, materials and maps that tests render, and how a scene is prepared.
use super::folder_of_run;
use glam::{DVec3, dvec3};
use std::f64::consts::{PI, TAU};
use threadlight::CustomEnvironment;
use threadlight::low_level::memo::Memo;
use threadlight::low_level::prepare::{Prepared, prepare};
use threadlight::low_level::scene::{EnvironmentSource, MaterialSettings, MaterialSource, Scene, Source};

/// The built-in sphere of one material in a built-in environment.
pub fn sphere(material: MaterialSource, environment: &str, threads: u32, (width, height): (u32, u32)) -> Scene {
    let mut scene =
        Scene { materials: vec![MaterialSettings { name: "m".to_owned(), source: material }], ..Scene::default() };
    scene.objects[0].material = "m".to_owned();
    scene.environment.source = Source::Builtin(environment.to_owned());
    scene.shading.threads = Some(threads);
    (scene.image.width, scene.image.height) = (width, height);
    scene
}

/// A grey map of what is seen in each direction.
pub fn map([width, height]: [usize; 2], radiance: impl Fn(DVec3) -> f64) -> EnvironmentSource {
    let pixel = |i: usize| {
        let phi = TAU * ((i % width) as f64 + 0.5) / width as f64;
        let theta = PI * ((i / width) as f64 + 0.5) / height as f64;
        [radiance(dvec3(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())) as f32; 3]
    };
    CustomEnvironment::new("map", width, height, (0..width * height).map(pixel).collect()).unwrap().into()
}

/// A memo of the folder of a run, or in memory only if there is none.
pub fn memo_of_run() -> Memo {
    Memo::new(folder_of_run().as_deref())
}

pub fn ready(scene: &Scene) -> Prepared {
    prepare(scene, &memo_of_run().round(&())).expect("a scene that can be prepared")
}

/// A material given by its model and parameters in TOML.
pub fn model(text: &str) -> MaterialSource {
    let mut parameters: toml::Table = text.parse().expect("TOML");
    let model = parameters.remove("model").and_then(|model| model.as_str().map(str::to_owned)).expect("a model");
    MaterialSource::Model { model, parameters }
}

/// A surface so rough that it is matt along its normal, and a mirror at grazing views.
pub const MATT_ALONG_ITS_NORMAL: &str =
    "model = 'he_torrance'\ndiffuse = 0\nsigma_um = 0.3\ntau_um = 2.5\nspecular_alpha = 0.018\nmetal = 'Al'";

/// Lambert, conductors of two widths, plastic.
pub fn analytic_materials() -> Vec<(&'static str, MaterialSource)> {
    vec![
        ("lambert", model("model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]")),
        (
            "conductor 0.1",
            model(
                "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0.1\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]",
            ),
        ),
        (
            "conductor 0.5",
            model(
                "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0.5\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]",
            ),
        ),
        (
            "plastic",
            model("model = 'plastic'\ndistribution = 'beckmann'\nalpha = 0.2\nior = 1.5\ndiffuse = [0.3, 0.08, 0.04]"),
        ),
    ]
}
