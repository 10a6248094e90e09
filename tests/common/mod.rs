//! What the tests that render have in common.
#![allow(dead_code)]
use glam::{DVec3, UVec2, Vec4, dvec3};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use threadlight::CustomEnvironment;
use threadlight::low_level::memo::{Memo, Round};
use threadlight::low_level::pipeline::{DeviceScene, Rendering, Wanted};
use threadlight::low_level::prepare::{Prepared, prepare};
use threadlight::low_level::scene::{EnvironmentSource, MaterialSettings, MaterialSource, Scene, Source};
use threadlight::low_level::shading::texels_of_pixel;
use threadlight::low_level::vulkan::{Device, DeviceKind, Instance, Messages};

/// A device with validation on; `finish` fails the test if validation said anything, from first call to last.
pub struct Validated {
    pub device: Arc<Device>,
    /// [`memo_of_run`], if no other takes its place.
    pub memo: Memo,
    /// What the twin's memo keeps, where it shares nothing with other tests.
    of_twin: TempDir,
    /// Holds what the next renderer may have in common with it.
    last: Mutex<Option<DeviceScene>>,
    messages: Messages,
}

impl Validated {
    /// The device that THREADLIGHT_TEST_DEVICE names, or the best.
    pub fn new() -> Self {
        Self::on(std::env::var("THREADLIGHT_TEST_DEVICE").ok().as_deref())
    }

    /// The same, with a memo of its own in memory: for tests of what is made, and when.
    pub fn with_own_memo() -> Self {
        Self { memo: Memo::default(), ..Self::new() }
    }

    /// The device of this name or index.
    pub fn on(wanted: Option<&str>) -> Self {
        let instance = Instance::new(true).expect("an instance with validation");
        let device = Device::new(&instance, wanted).expect("a device");
        let of_twin = tempfile::tempdir().expect("a folder");
        Self { device, memo: memo_of_run(), of_twin, last: Mutex::default(), messages: instance.messages() }
    }

    /// Whether exp, log, sin and the like are good to the last bits, as on the CPU. Vulkan promises less ("Precision and Operation of
    /// SPIR-V Instructions"), and what evaluates BRDFs of narrow lobes multiplies that.
    pub fn has_exact_functions(&self) -> bool {
        self.device.description().driver.starts_with("llvmpipe")
    }

    /// Whether lookups weight texels by floats, as on the CPU. Vulkan promises as many bits as `subTexelPrecisionBits` and
    /// `mipmapPrecisionBits` say; GPUs have 8.
    pub fn has_exact_lookups(&self) -> bool {
        self.device.description().kind == DeviceKind::Cpu
    }

    /// For the CPU twin. A GPU blurs maps itself, so there the twin has a folder of its own: what the CPU blurs is compared with what the device
    /// does.
    pub fn memo_of_twin(&self) -> Memo {
        let of_run = folder_of_run().filter(|_| self.device.description().kind == DeviceKind::Cpu);
        Memo::new(Some(of_run.as_deref().unwrap_or(self.of_twin.path())))
    }

    pub fn render(&self, prepared: &Prepared, wanted: Wanted) -> Rendering {
        self.renderer(prepared).render(wanted, 1).expect("a rendering")
    }

    pub fn renderer(&self, prepared: &Prepared) -> DeviceScene {
        let renderer = DeviceScene::new(&self.device, prepared, &self.round()).expect("a renderer");
        *self.last.lock().expect("no test panics here") = Some(renderer.clone());
        renderer
    }

    pub fn round(&self) -> Round<'_> {
        self.memo.round(&())
    }

    pub fn finish(self) {
        let Self { device, messages, memo, last, .. } = self;
        drop((last, memo));
        // Background work that a closed viewer has left behind ends by itself.
        let left = Instant::now() + Duration::from_secs(20);
        while Arc::strong_count(&device) > 1 && Instant::now() < left {
            std::thread::sleep(Duration::from_millis(10));
        }
        assert_eq!(Arc::strong_count(&device), 1, "something still holds the device");
        drop(device);
        assert_eq!(messages.all(), Vec::<String>::new());
    }
}

/// Radiance and geometry.
pub const EVERYTHING: Wanted = Wanted { radiance: true, display: false, geometry: true };

/// The texels of the geometry cache that a pixel sees.
pub fn texels_of(prepared: &Prepared, rendering: &Rendering, pixel: UVec2) -> Vec<UVec2> {
    texels_of_pixel(&prepared.view, &rendering.geometry, pixel)
}

/// How far `found` is from `expected`, in the channel that is farthest. Fails where that is no number: maxima of vectors pass over those.
pub fn difference(found: impl Into<Vec4>, expected: Vec4) -> f32 {
    let found = found.into();
    let difference = (found - expected).abs();
    assert!(difference.is_finite(), "{found}, not {expected}");
    difference.max_element()
}

/// All pixels, row by row.
pub fn pixels(prepared: &Prepared) -> impl Iterator<Item = UVec2> + use<> {
    let (width, height) = (prepared.view.width, prepared.view.height);
    (0..height).flat_map(move |y| (0..width).map(move |x| UVec2::new(x, y)))
}

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

/// Where the tests of a run share threads, blurred maps and references: making them is most of the time of tests. `ci/test` names a folder that is
/// empty at the start, since an earlier version of the program may have made others.
pub fn folder_of_run() -> Option<PathBuf> {
    std::env::var_os("THREADLIGHT_TEST_CACHE").map(PathBuf::from)
}

/// A memo of that folder, or in memory only if there is none.
pub fn memo_of_run() -> Memo {
    Memo::new(folder_of_run().as_deref())
}

pub fn ready(scene: &Scene) -> Prepared {
    prepare(scene, &memo_of_run().round(&())).expect("a scene that can be prepared")
}

/// A material given by its model and parameters in TOML.
pub fn model(text: &str) -> MaterialSource {
    let mut parameters: threadlight::toml::Table = text.parse().expect("TOML");
    let model = parameters.remove("model").and_then(|model| model.as_str().map(str::to_owned)).expect("a model");
    MaterialSource::Model { model, parameters }
}

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

/// The folder of measured data beside the project, where there is one.
pub fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("THREADLIGHT_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A MERL file of a made-up material: diffuse and a lobe.
pub fn merl_like_table() -> Vec<u8> {
    merl_file(|theta_h, theta_d, _| {
        let fresnel = 0.04 + 0.96 * (1.0 - theta_d.cos()).powi(5);
        let lobe = 8.0 * fresnel * (-(theta_h.tan() / 0.15).powi(2)).exp();
        [0.12, 0.05, 0.02].map(|diffuse| diffuse + lobe)
    })
}

/// A MERL file of alumina-oxide as it was measured at phi_d = 90 degrees, held constant over phi_d; `None` without the data.
pub fn alumina_oxide() -> Option<Vec<u8>> {
    let slice = std::fs::read(data()?.join("merl/slices/alumina-oxide.slice")).ok()?;
    let values: Vec<f32> = slice.chunks_exact(4).map(|v| f32::from_le_bytes([v[0], v[1], v[2], v[3]])).collect();
    Some(merl_file(|theta_h, theta_d, _| {
        // Rows are theta_d in degrees, columns theta_h in its square-root bins.
        let row = theta_d.to_degrees() as usize;
        let column = (90.0 * (theta_h / std::f64::consts::FRAC_PI_2).sqrt()) as usize;
        [0, 1, 2].map(|channel| f64::from(values[3 * (90 * row + column) + channel]))
    }))
}

/// An RGL file of a made-up material, diffuse and a lobe, with a view that is brighter the more it grazes: not reciprocal.
pub fn rgl_like_file() -> Vec<u8> {
    const SIDE: u64 = 8;
    let angles = [0.0_f32, 0.8, 1.4];
    let mut rgb = Vec::new();
    for theta in angles {
        for diffuse in [0.2, 0.1, 0.05] {
            // u = 0 is the half vector along the normal; all azimuths are the same.
            let row = (0..SIDE).map(|u| (diffuse + 2.0 * (-(u as f32)).exp()) * (0.5 + theta));
            rgb.extend((0..SIDE).flat_map(|_| row.clone()));
        }
    }
    rgl_file(&[
        ("phi_i", &[1], &[0.0]),
        ("theta_i", &[3], &angles),
        ("ndf", &[2, 2], &[1.0; 4]),
        ("sigma", &[2, 2], &[1.0; 4]),
        ("vndf", &[1, 3, 2, 2], &[1.0; 12]),
        ("rgb", &[1, 3, 3, SIDE, SIDE], &rgb),
    ])
}

/// A file of MIT CSAIL's form of a made-up material: three angles of light and view, four azimuths, two turns of the material.
pub fn mit_like_file() -> Vec<u8> {
    let header = [3_i32, 3, 4, 2, 0, 0, 1, 0, 0, 1, 3, 0, 0, 0, 0, 0];
    let values = (0..3 * 3 * 3 * 4 * 2).map(|index| if index % 7 == 0 { -1.0 } else { 0.01 * (index % 11) as f32 });
    header.into_iter().flat_map(i32::to_le_bytes).chain(values.flat_map(f32::to_le_bytes)).collect()
}

/// An RGL file of these fields, each a name, dimensions and numbers; M is f cos theta_i.
pub fn rgl_file(fields: &[(&str, &[u64], &[f32])]) -> Vec<u8> {
    let header = |name: &str, shape: &[u64], kind: u8, offset: usize| {
        let mut bytes = [&(name.len() as u16).to_le_bytes(), name.as_bytes()].concat();
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(kind);
        bytes.extend((offset as u64).to_le_bytes());
        bytes.extend(shape.iter().flat_map(|size| size.to_le_bytes()));
        bytes
    };
    let mut offset = 18 + header("jacobian", &[1], 1, 0).len();
    offset += fields.iter().map(|(name, shape, _)| header(name, shape, 10, 0).len()).sum::<usize>();
    let mut bytes = [&b"tensor_file\0\x01\0"[..], &(fields.len() as u32 + 1).to_le_bytes()].concat();
    bytes.extend(header("jacobian", &[1], 1, offset));
    let mut values = vec![0_u8];
    for (name, shape, numbers) in fields {
        bytes.extend(header(name, shape, 10, offset + values.len()));
        values.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
    [bytes, values].concat()
}

/// A MERL file of a made-up material that is not the same on both sides of the plane of incidence, as noise makes measured ones.
pub fn lopsided_table() -> Vec<u8> {
    merl_file(|_, _, phi_d| [0.2, 0.1, 0.1 + 0.08 * (2.0 * phi_d).sin()])
}

/// A MERL file of a BRDF of theta_h, theta_d and phi_d (radians, bin centres), with -1 below the horizon as in the database.
fn merl_file(brdf: impl Fn(f64, f64, f64) -> [f64; 3]) -> Vec<u8> {
    let mut bytes: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|size| size.to_le_bytes()).collect();
    for (channel, scale) in [1.0, 1.15, 1.66].iter().enumerate() {
        for cell in 0..90 * 90 * 180 {
            let (theta_h, theta_d, phi_d) = (cell / (90 * 180), cell / 180 % 90, cell % 180);
            let theta_h = ((theta_h as f64 + 0.5) / 90.0).powi(2) * std::f64::consts::FRAC_PI_2;
            let (theta_d, phi_d) = ((theta_d as f64 + 0.5).to_radians(), (phi_d as f64 + 0.5).to_radians());
            let swing = theta_h.sin() * theta_d.sin() * phi_d.cos();
            let below = theta_h.cos() * theta_d.cos() - swing.abs() < 0.0;
            let stored = if below { -1.0 } else { brdf(theta_h, theta_d, phi_d)[channel] * 1500.0 / scale };
            bytes.extend_from_slice(&stored.to_le_bytes());
        }
    }
    bytes
}
