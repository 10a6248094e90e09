//! Files that tests read and share: the folder of a run, measured data, and measurements of made-up materials.
use glam::Vec3;
use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;
use threadlight::low_level::brdf::merl_bytes_of_values;

/// Where the tests of a run share threads, blurred maps and references: making them is most of the time of tests. `ci/test` names a folder that is
/// empty at the start, since an earlier version of the program may have made others.
pub fn folder_of_run() -> Option<PathBuf> {
    std::env::var_os("THREADLIGHT_TEST_CACHE").map(PathBuf::from)
}

/// The file of Mesa's driver for AMD's GPUs, by the names of Debian's and of newer Mesa; none, and a word of that, where there is none.
pub fn radv() -> Option<&'static str> {
    let names = ["/usr/share/vulkan/icd.d/radeon_icd.x86_64.json", "/usr/share/vulkan/icd.d/radeon_icd.json"];
    let found = names.into_iter().find(|name| std::path::Path::new(name).is_file());
    if found.is_none() {
        println!("skipped: there is no {}", names.join(" or "));
    }
    found
}

/// What is at `name` in the folder of measured data beside the project, where it is there.
pub fn data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("THREADLIGHT_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    Some(folder.join(name)).filter(|path| path.exists())
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
    let slice = std::fs::read(data("merl/slices/alumina-oxide.slice")?).ok()?;
    let values: Vec<f32> = slice.chunks_exact(4).map(|v| f32::from_le_bytes([v[0], v[1], v[2], v[3]])).collect();
    // Rows are theta_d, columns theta_h.
    let of_cell = |[theta_h, theta_d, _]: [usize; 3]| Vec3::from_slice(&values[3 * (90 * theta_d + theta_h)..]);
    Some(merl_bytes_of_values(|cell| Some(of_cell(cell).as_dvec3())))
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
    merl_bytes_of_values(|cell| {
        let [theta_h, theta_d, phi_d] = cell.map(|bin| bin as f64 + 0.5);
        let theta_h = (theta_h / 90.0).powi(2) * FRAC_PI_2;
        let (theta_d, phi_d) = (theta_d.to_radians(), phi_d.to_radians());
        let swing = theta_h.sin() * theta_d.sin() * phi_d.cos();
        let is_above = theta_h.cos() * theta_d.cos() - swing.abs() >= 0.0;
        is_above.then(|| brdf(theta_h, theta_d, phi_d).into())
    })
}
