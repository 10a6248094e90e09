//! What is hard to shade: the built-in scene, small, but for what the name of a case says.
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use crate::brdf::merl_bytes_of_stored;
use crate::environment::{Environment, RepairCounts};
use crate::error::{Error, Result};
use crate::scene::{
    Background, Camera, EXPOSURE, GAMMA, INTENSITY, MAX_SIZE_PX, MaterialSource, ObjectSettings, Scene, Source,
};

/// Threads, or samples, of each case.
pub const THREADS: u32 = 8;
/// Size of the pictures.
pub const SIZE_PX: (u32, u32) = (64, 48);

/// What is large, made when its turn comes.
type Made<T> = Box<dyn Fn() -> T>;

/// A scene and, where no built-in is meant, its light and the file that it names.
pub(super) struct Case {
    pub name: String,
    pub scene: Scene,
    pub light: Option<Made<Environment>>,
    file: Option<(PathBuf, Made<Vec<u8>>)>,
    /// Whether it takes more than a second or two.
    pub is_slow: bool,
}

impl Case {
    /// The built-in scene, changed.
    fn scene(name: &str, change: impl FnOnce(&mut Scene)) -> Self {
        let mut scene = Scene::default();
        (scene.image.width, scene.image.height) = SIZE_PX;
        scene.image.background = Background::None;
        scene.environment.source = Source::Builtin("sky".to_owned());
        scene.shading.threads = Some(THREADS);
        change(&mut scene);
        Self { name: name.to_owned(), scene, light: None, file: None, is_slow: false }
    }

    /// A material by its model and parameters in TOML.
    fn material(name: &str, model: &str) -> Self {
        let mut parameters: toml::Table = model.parse().expect("TOML");
        let model = parameters.remove("model").and_then(|model| model.as_str().map(str::to_owned)).expect("a model");
        Self::scene(name, |scene| scene.use_material("m", MaterialSource::Model { model, parameters }))
    }

    /// A measured table of these values, by angle of the half vector, difference angle and azimuth, in bins.
    fn table(folder: &Path, name: &str, value: impl Fn([usize; 3]) -> f64 + 'static) -> Self {
        let path = folder.join("table.binary");
        let bytes = move || merl_bytes_of_stored(|cell| [value(cell); 3]);
        let case = Self::scene(name, |scene| scene.use_material("m", MaterialSource::File(path.clone())));
        Self { file: Some((path, Box::new(bytes))), is_slow: true, ..case }
    }

    /// Gold under a map of grey pixels.
    fn lit(name: &str, [width, height]: [usize; 2], value: impl Fn(usize, usize) -> f32 + 'static) -> Self {
        let of = name.to_owned();
        let light = move || {
            let texels = (0..width * height).map(|i| [value(i % width, i / width); 3]).collect();
            Environment::new(of.clone(), width, height, texels, RepairCounts::default())
        };
        Self { light: Some(Box::new(light)), is_slow: width * height > 1 << 20, ..Self::scene(name, |_| ()) }
    }

    /// A mesh by the text of its file.
    fn mesh(folder: &Path, name: &str, text: impl Fn() -> String + 'static, change: impl FnOnce(&mut Scene)) -> Self {
        let path = folder.join("mesh.obj");
        let case = Self::scene(name, |scene| {
            scene.objects[0].mesh = Source::File(path.clone());
            change(scene);
        });
        Self { file: Some((path, Box::new(move || text().into_bytes()))), ..case }
    }

    /// Writes the file that the scene names, if it names one, and gives its path.
    pub fn write_file(&self) -> Result<Option<&Path>> {
        let Some((path, bytes)) = &self.file else { return Ok(None) };
        std::fs::write(path, bytes()).map_err(|cause| Error::unwritable(path, cause))?;
        Ok(Some(path))
    }
}

/// All of them. Files of theirs are in `folder`.
pub(super) fn cases(folder: &Path) -> Vec<Case> {
    [materials(), tables(folder), lights(), surfaces(folder), views()].into_iter().flatten().collect()
}

fn materials() -> Vec<Case> {
    let metal = "eta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]";
    let conductor = |distribution: &str, alpha: f64, metal: &str| {
        format!("model = 'conductor'\ndistribution = '{distribution}'\nalpha = {alpha}\n{metal}")
    };
    let lobe = |model: &str, exponent: &str| {
        format!("model = '{model}'\ndiffuse = [0.1, 0.2, 0.3]\nspecular = [0.4, 0.3, 0.1]\nexponent = {exponent}")
    };
    let plastic = |distribution: &str, alpha: f64, ior: f64| {
        format!(
            "model = 'plastic'\ndistribution = '{distribution}'\nalpha = {alpha}\nior = {ior}\ndiffuse = [0.3, 0.1, 0.0]"
        )
    };
    let cases = [
        ("GGX, alpha 1e-3", conductor("ggx", 1e-3, metal)),
        ("GGX, alpha 1", conductor("ggx", 1.0, metal)),
        ("Beckmann, alpha 1e-3", conductor("beckmann", 1e-3, metal)),
        ("Beckmann, alpha 1", conductor("beckmann", 1.0, metal)),
        ("eta 1, k 0", conductor("beckmann", 0.3, "eta = [1.0, 1.0, 1.0]\nk = [0.0, 0.0, 0.0]")),
        ("eta and k 20", conductor("ggx", 0.3, "eta = [20.0, 20.0, 20.0]\nk = [20.0, 20.0, 20.0]")),
        ("ior 1", plastic("beckmann", 0.2, 1.0)),
        ("ior 5, alpha 1e-3", plastic("ggx", 1e-3, 5.0)),
        ("Blinn-Phong, exponent 0", lobe("blinn_phong", "0.0")),
        ("Blinn-Phong, exponent 1e5", lobe("blinn_phong", "1e5")),
        ("Phong, exponent 0", lobe("phong", "0.0")),
        ("Phong, exponent 1e5", lobe("phong", "1e5")),
        ("Ashikhmin-Shirley, exponent 0", lobe("ashikhmin_shirley", "0.0")),
        ("Ashikhmin-Shirley, exponent 1e5", lobe("ashikhmin_shirley", "1e5")),
        ("Oren-Nayar, 60 degrees", "model = 'oren_nayar'\nreflectance = [1.0, 0.5, 0.0]\nsigma_deg = 60.0".to_owned()),
        ("black", "model = 'lambert'\nreflectance = [0.0, 0.0, 0.0]".to_owned()),
        ("white", "model = 'lambert'\nreflectance = [1.0, 1.0, 1.0]".to_owned()),
    ];
    cases.map(|(name, model)| Case::material(name, &model)).into()
}

fn tables(folder: &Path) -> Vec<Case> {
    // Files hold 1500 times f, about; pi f is the albedo.
    const WHITE: f64 = 1500.0 / std::f64::consts::PI;
    vec![
        Case::table(folder, "table: constant", |_| 0.5 * WHITE),
        Case::table(folder, "table: rows of zeros", |[_, theta_d, _]| if theta_d % 2 == 0 { 0.5 * WHITE } else { 0.0 }),
        Case::table(folder, "table: negative cells", |[h, d, p]| if (h + d + p) % 3 == 0 { -1.0 } else { 0.2 * WHITE }),
        Case::table(folder, "table: one hot cell", |cell| if cell == [10, 20, 90] { 1e7 } else { 0.1 * WHITE }),
        // In single precision, that is; files of zeros are refused.
        Case::table(folder, "table: denormal", |_| 1e-40 * WHITE),
    ]
}

fn lights() -> Vec<Case> {
    let map = [64, 32];
    // More than numbers of single precision hold.
    let at_most = |case: Case| {
        let mut scene = case.scene;
        scene.environment.intensity = *INTENSITY.end();
        Case { scene, ..case }
    };
    let constant = |value: f32| move |_: usize, _: usize| value;
    let spot = |column, row| move |x: usize, y: usize| if (x, y) == (column, row) { 1e6 } else { 0.25 };
    // Of the cube's corners, (1, 1, 1) and so on, the longitudes are 45 degrees and 90 more each, and 55 degrees from a pole.
    let corners = |x: usize, y: usize| if x % 16 == 8 && (y == 9 || y == 22) { 1e6 } else { 0.25 };
    vec![
        Case::lit("no light", map, constant(0.0)),
        Case::lit("light of 1e-30", map, constant(1e-30)),
        Case::lit("light of 1e30", map, constant(1e30)),
        at_most(Case::lit("light of 1e30, intensity 3e38", map, |x, y| if (x + y) % 9 == 0 { 1e30 } else { 0.0 })),
        Case::lit("1e6 at the pole", map, spot(11, 0)),
        Case::lit("1e6 at the lower pole", map, spot(40, 31)),
        Case::lit("1e6 at the seam", map, spot(63, 12)),
        Case::lit("1e6 at the horizon", map, spot(20, 16)),
        Case::lit("1e6 in a corner of the cube", map, spot(24, 9)),
        Case::lit("1e6 in all corners of the cube", map, corners),
        Case::lit("a thousand lamps", [128, 64], |x, y| if (x * 37 + y * 101) % 8 == 0 { 300.0 } else { 0.1 }),
        Case::lit("a wide lamp and a long one", [128, 64], |x, y| match (x, y) {
            (20..34, 12..22) | (60..100, 40..42) => 2e3,
            _ => 0.5,
        }),
        Case::lit("map of 1 x 1", [1, 1], constant(1.0)),
        Case::lit("map of 3 x 2", [3, 2], |x, y| (x + 3 * y) as f32),
        Case::lit("map of 8192 x 4096", [8192, 4096], |x, y| ((x * 7 + y * 13) % 17) as f32),
    ]
}

fn surfaces(folder: &Path) -> Vec<Case> {
    /// In degrees from the line of sight: views along the normal, at the horizon and beyond.
    const TILTS_DEG: [f64; 10] = [0.0, 1e-3, 45.0, 89.0, 89.9, 90.0, 90.1, 100.0, 135.0, 180.0];
    // Upright strips side by side, from x = -1 to 1, each of one normal.
    let strips = || {
        let mut text = String::new();
        for (strip, tilt_deg) in TILTS_DEG.into_iter().enumerate() {
            let (sin, cos) = tilt_deg.to_radians().sin_cos();
            text += &format!("vn {sin} 0 {cos}\n");
            for (side, y) in [(0, -1), (1, -1), (1, 1), (0, 1)] {
                text += &format!("v {} {y} 0\n", (strip + side) as f64 / 5.0 - 1.0);
            }
            let [v, n] = [4 * strip + 1, strip + 1];
            text += &format!("f {v}//{n} {}//{n} {}//{n} {}//{n}\n", v + 1, v + 2, v + 3);
        }
        text
    };
    // A band of triangles that are two thousand times as long as wide.
    let slivers = || {
        let corners = (-1000..=1000).map(|i| format!("v {} {} 0\n", f64::from(i) * 1e-3, 1 - (i & 1) * 2));
        let faces = (1..2000).map(|i| format!("f {i} {} {}\n", i + 1 + i % 2, i + 2 - i % 2));
        corners.chain(faces).collect::<String>()
    };
    let triangle = || "v -9 -9 0\nv 9 -9 0\nv 0 18 0\nf 1 2 3\n".to_owned();
    let many = |scene: &mut Scene| {
        let first = scene.objects[0].clone();
        let object = |i: i32| {
            let at = Vec3::new((i % 100) as f32 - 50.0, (i / 100) as f32 - 25.0, (i % 7) as f32);
            ObjectSettings { translate: 0.04 * at, scale: 0.003, ..first.clone() }
        };
        scene.objects = (0..5000).map(object).collect();
    };
    vec![
        Case::mesh(folder, "normals at all angles to the view", strips, |scene| {
            scene.camera = looking_from(DVec3::new(0.0, 0.0, 200.0), 0.5);
        }),
        Case::mesh(folder, "slivers", slivers, |scene| scene.camera = looking_from(DVec3::new(0.0, 0.0, 3.0), 36.0)),
        Case::mesh(folder, "a triangle over all of the picture", triangle, |scene| {
            scene.camera = looking_from(DVec3::new(0.0, 0.0, 1.0), 60.0);
        }),
        Case::mesh(folder, "5000 objects", triangle, many),
        Case::scene("size 1e-9", |scene| scene.objects[0].scale = 1e-9),
        Case::scene("size 4e8", |scene| scene.objects[0].scale = 4e8),
    ]
}

/// A camera that looks at the origin.
fn looking_from(eye: DVec3, fov_y_deg: f64) -> Option<Camera> {
    Some(Camera { eye, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg })
}

fn views() -> Vec<Case> {
    let of_size = |name: &str, width: u32, height: u32| {
        let case = Case::scene(name, |scene| (scene.image.width, scene.image.height) = (width, height));
        Case { is_slow: width.max(height) > 1000, ..case }
    };
    vec![
        Case::scene("field of view 0.01", |scene| scene.camera = looking_from(DVec3::new(0.0, 0.0, 5.0), 0.01)),
        Case::scene("field of view 179", |scene| scene.camera = looking_from(DVec3::new(0.0, 0.0, 1.01), 179.0)),
        of_size("picture of 1 x 1", 1, 1),
        of_size("picture of 1 x 8192", 1, MAX_SIZE_PX / 2),
        of_size("picture of 8192 x 16", MAX_SIZE_PX / 2, 16),
        Case::scene("exposure 0", |scene| scene.image.exposure = *EXPOSURE.start()),
        Case::scene("exposure 3e38", |scene| scene.image.exposure = *EXPOSURE.end()),
        Case::scene("gamma 1e-38", |scene| scene.image.gamma = *GAMMA.start()),
        Case::scene("gamma 3e38", |scene| scene.image.gamma = *GAMMA.end()),
        Case::scene("intensity 0", |scene| scene.environment.intensity = *INTENSITY.start()),
        Case::scene("intensity 3e38", |scene| scene.environment.intensity = *INTENSITY.end()),
    ]
}
