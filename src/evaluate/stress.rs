//! Hard cases: whether what a device shades is finite, and what the CPU's form of the same method shades: `threadlight bench stress`.
//!
//! Materials, light and views at the ends of what they may be. The device is compared with the CPU given the same surfaces, so that what
//! is found is of shading alone.
use std::sync::Arc;

use glam::{DVec3, UVec2, Vec4};
use rayon::prelude::*;
use serde::Serialize;

use super::tables::{Section, Table};
use crate::environment::{Environment, RepairCounts};
use crate::error::Result;
use crate::memo::{Key, Keyed, Memo};
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::prepare;
use crate::progress::Observer;
use crate::scene::{Background, Camera, MaterialSource, Scene, Source};
use crate::shading::CpuShader;
use crate::vulkan::Device;

/// What differences may be: RMS over the covered pixels, each relative to the largest of its radiance, the picture's mean, and a millionth
/// of the light's maximum, in which all rounds.
pub const MOST_RMS: f64 = 2e-3;
/// Methods that are tried.
const METHODS: [&str; 2] = ["fitted", "paper"];
const THREADS: u32 = 8;
const SIZE: (u32, u32) = (64, 48);

/// What became of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Stressed {
    /// What is hard.
    pub case: String,
    /// By which method.
    pub method: &'static str,
    /// Pixels that see a surface.
    pub covered: usize,
    /// Pixels with a value that is NaN or infinite.
    pub not_finite: usize,
    /// Of the finite ones, as [`MOST_RMS`] has it.
    pub rms: f64,
    /// The largest such difference of a pixel.
    pub most: f64,
}

impl Stressed {
    /// Whether a bound is broken.
    pub fn is_broken(&self) -> bool {
        self.not_finite > 0 || self.rms.is_nan() || self.rms > MOST_RMS
    }
}

/// A scene and, where no built-in is meant, its light.
struct Case {
    name: String,
    scene: Scene,
    light: Option<Environment>,
}

/// Runs all cases on `device`; `found` has what was seen until an error or an interruption.
///
/// # Errors
/// Whatever Vulkan refuses; cancelled.
pub fn run(device: &Arc<Device>, memo: &Memo, observer: &dyn Observer, found: &mut Vec<Stressed>) -> Result<()> {
    let cases = cases();
    let total = cases.len() * METHODS.len();
    for case in &cases {
        for method in METHODS {
            observer.check()?;
            found.push(stress(device, memo, case, method)?);
            observer.progress(found.len(), total);
        }
    }
    Ok(())
}

fn stress(device: &Arc<Device>, memo: &Memo, case: &Case, method: &'static str) -> Result<Stressed> {
    let mut scene = case.scene.clone();
    scene.shading.method = method.to_owned();
    let round = memo.round(&());
    let mut prepared = prepare(&scene, &round)?;
    if let Some(light) = &case.light {
        prepared.environment = Keyed::new(Key::of_digest(light.fingerprint()), light.clone());
    }
    let wanted = Wanted { radiance: true, geometry: true, ..Wanted::default() };
    let rendering = DeviceScene::new(device, &prepared, &round)?.render(wanted, 1)?;
    let twin = CpuShader::new(&prepared, &round)?;
    let (width, subpixels) = (prepared.view.width, prepared.view.subpixels);
    let expected = |pixel: usize| {
        let pixel = UVec2::new(pixel as u32 % width, pixel as u32 / width);
        let texel = |j: u32| {
            let at = pixel * subpixels + UVec2::new(j % subpixels, j / subpixels);
            UVec2::from(rendering.geometry[(at.y * width * subpixels + at.x) as usize])
        };
        twin.shade(pixel, &(0..subpixels * subpixels).map(texel).collect::<Vec<_>>())
    };
    let expected: Vec<Vec4> = (0..rendering.radiance.len()).into_par_iter().map(expected).collect();
    let least = 1e-6 * prepared.view.intensity * prepared.environment.max_radiance();
    Ok(compare(&case.name, method, &rendering.radiance, &expected, least))
}

/// What was `found` beside what was `expected`: radiance times coverage, and coverage. `least` is a radiance that is as good as none.
fn compare(case: &str, method: &'static str, found: &[[f32; 4]], expected: &[Vec4], least: f64) -> Stressed {
    let pairs = found.iter().map(|found| Vec4::from(*found)).zip(expected.iter().copied());
    let pairs: Vec<_> = pairs.filter(|(found, expected)| found.w.max(expected.w) > 0.0 || !found.is_finite()).collect();
    let largest = |of: Vec4| f64::from(of.truncate().max_element());
    let mean = pairs.iter().map(|(_, expected)| largest(*expected)).sum::<f64>() / pairs.len().max(1) as f64;
    let (mut not_finite, mut squares, mut most) = (0, 0.0, 0.0_f64);
    for (found, expected) in &pairs {
        if !found.is_finite() {
            not_finite += 1;
            continue;
        }
        let scale = largest(*expected).max(mean).max(least);
        let difference = (found.as_dvec4() - expected.as_dvec4()).truncate().abs().max_element();
        // Where all is black, black is expected.
        let relative = if difference == 0.0 { 0.0 } else { difference / scale };
        squares += relative * relative;
        most = most.max(relative);
    }
    let rms = (squares / (pairs.len() - not_finite).max(1) as f64).sqrt();
    Stressed { case: case.to_owned(), method, covered: pairs.len(), not_finite, rms, most }
}

/// All cases, each a built-in scene but for what its name says.
fn cases() -> Vec<Case> {
    let materials = [
        (
            "alpha 1e-3",
            "model = 'conductor'\ndistribution = 'ggx'\nalpha = 1e-3\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]",
        ),
        (
            "alpha 1",
            "model = 'conductor'\ndistribution = 'ggx'\nalpha = 1.0\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]",
        ),
        (
            "eta 1, k 0",
            "model = 'conductor'\ndistribution = 'beckmann'\nalpha = 0.3\neta = [1.0, 1.0, 1.0]\nk = [0.0, 0.0, 0.0]",
        ),
        (
            "eta 20, k 20",
            "model = 'conductor'\ndistribution = 'beckmann'\nalpha = 0.3\neta = [20.0, 20.0, 20.0]\nk = [20.0, 20.0, 20.0]",
        ),
        ("ior 1", "model = 'plastic'\ndistribution = 'beckmann'\nalpha = 0.2\nior = 1.0\ndiffuse = [0.3, 0.1, 0.0]"),
        ("exponent 0", "model = 'blinn_phong'\ndiffuse = [0.0, 0.0, 0.0]\nspecular = [0.9, 0.5, 0.1]\nexponent = 0.0"),
        (
            "exponent 1e5",
            "model = 'blinn_phong'\ndiffuse = [0.1, 0.2, 0.3]\nspecular = [0.4, 0.4, 0.4]\nexponent = 1e5",
        ),
        ("black", "model = 'lambert'\nreflectance = [0.0, 0.0, 0.0]"),
    ];
    let mut cases: Vec<_> = materials.map(|(name, model)| of_material(name, model)).into();
    let constant = |value: f32| move |_: usize, _: usize| value;
    let spot = |column, row| move |x: usize, y: usize| if (x, y) == (column, row) { 1e6 } else { 0.25 };
    cases.extend([
        lit("no light", 64, 32, constant(0.0)),
        lit("light of 1e-30", 64, 32, constant(1e-30)),
        lit("light of 1e30", 64, 32, constant(1e30)),
        lit("map of 1 x 1", 1, 1, constant(1.0)),
        lit("map of 3 x 2", 3, 2, |x, y| (x + 3 * y) as f32),
        lit("1e6 at the pole", 64, 32, spot(11, 0)),
        lit("1e6 at the seam", 64, 32, spot(63, 12)),
        lit("1e6 at the horizon", 64, 32, spot(20, 16)),
        // Around the direction (1, 1, 1): 125 degrees of longitude and 55 from the pole.
        lit("1e6 in a corner of the cube", 64, 32, spot(24, 9)),
        lit("a thousand lamps", 128, 64, |x, y| if (x * 37 + y * 101) % 8 == 0 { 300.0 } else { 0.1 }),
    ]);
    let view = |name: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = base();
        change(&mut scene);
        Case { name: name.to_owned(), scene, light: None }
    };
    let from = |eye: DVec3, fov_y_deg: f64| Some(Camera { eye, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg });
    cases.extend([
        view("size 1e-9", &|scene| scene.objects[0].scale = 1e-9),
        view("size 4e8", &|scene| scene.objects[0].scale = 4e8),
        view("field of view 0.01", &|scene| scene.camera = from(DVec3::new(0.0, 0.0, 5.0), 0.01)),
        view("field of view 179", &|scene| scene.camera = from(DVec3::new(0.0, 0.0, 1.01), 179.0)),
        view("picture of 1 x 1", &|scene| (scene.image.width, scene.image.height) = (1, 1)),
        view("intensity 0", &|scene| scene.environment.intensity = 0.0),
    ]);
    cases
}

/// The built-in scene, small and without a background.
fn base() -> Scene {
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = SIZE;
    scene.image.background = Background::None;
    scene.environment.source = Source::Builtin("sky".to_owned());
    scene.shading.threads = Some(THREADS);
    scene
}

/// A material by its model and parameters in TOML, under the built-in sky.
fn of_material(name: &str, model: &str) -> Case {
    let mut parameters: toml::Table = model.parse().expect("TOML");
    let model = parameters.remove("model").and_then(|model| model.as_str().map(str::to_owned)).expect("a model");
    let mut scene = base();
    scene.use_material("m", MaterialSource::Model { model, parameters });
    Case { name: name.to_owned(), scene, light: None }
}

/// Gold under a map of grey pixels.
fn lit(name: &str, width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Case {
    let texels = (0..width * height).map(|i| [value(i % width, i / width); 3]).collect();
    let light = Environment::new(name.to_owned(), width, height, texels, RepairCounts::default());
    Case { name: name.to_owned(), scene: base(), light: Some(light) }
}

/// The table that `bench stress` prints.
pub fn tables(found: &[Stressed]) -> Section {
    let of_method = |method: &'static str| {
        let row = |case: &Stressed| {
            let verdict = if case.is_broken() { "broken" } else { "" };
            let cells = [case.covered.to_string(), case.not_finite.to_string(), format!("{:.1e}", case.rms)];
            (case.case.clone(), [&cells[..], &[format!("{:.1e}", case.most), verdict.to_owned()]].concat())
        };
        let head = ["pixels", "not finite", "RMS", "most", ""].map(str::to_owned).to_vec();
        let rows = found.iter().filter(|case| case.method == method).map(row).collect();
        Table { title: method.to_owned(), head, rows }
    };
    let title = format!("Device and CPU, relative to radiance; at most {MOST_RMS:.0e} RMS is allowed:");
    Section { title, tables: METHODS.map(of_method).into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_or_not_as_expected_breaks_a_bound() {
        let expected = vec![Vec4::new(1.0, 0.5, 0.2, 1.0); 100];
        let right: Vec<[f32; 4]> = expected.iter().map(|pixel| pixel.to_array()).collect();
        assert!(!compare("right", "fitted", &right, &expected, 0.0).is_broken());
        for (pixel, value) in [(3, f32::NAN), (4, f32::INFINITY), (5, 1.1)] {
            let mut found = right.clone();
            found[pixel][0] = value;
            let stressed = compare("planted", "fitted", &found, &expected, 0.0);
            assert!(stressed.is_broken(), "{stressed:?}");
            assert_eq!(stressed.not_finite, usize::from(!value.is_finite()));
        }
        // Black on black is right, light on black is not.
        let (black, dark) = (vec![Vec4::W; 4], [[0.0, 0.0, 0.0, 1.0]; 4]);
        assert!(!compare("black", "fitted", &dark, &black, 0.0).is_broken());
        assert!(compare("black", "fitted", &[[1e-9, 0.0, 0.0, 1.0]; 4], &black, 0.0).is_broken());
    }
}
