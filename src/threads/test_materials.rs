//! BRDFs that the tests of this module share.
use std::path::PathBuf;
use std::sync::LazyLock;

use glam::{DVec3, dvec2};

use super::slice_table::SliceTable;
use crate::brdf::{Brdf, CustomBrdf, MerlTable};

static NARROW: LazyLock<Brdf> = LazyLock::new(|| conductor("ggx", 0.005));
static ALUMINA_OXIDE: LazyLock<Option<Brdf>> = LazyLock::new(|| {
    let data = std::env::var_os("THREADLIGHT_DATA").map_or("../shared/data".into(), PathBuf::from);
    let path = data.join("merl/slices/alumina-oxide.slice");
    let Ok(bytes) = std::fs::read(&path) else {
        println!("skipped alumina-oxide: {} is not there", path.display());
        return None;
    };
    let values: Vec<f32> = bytes.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value)).collect();
    Some(Brdf::MerlTable(MerlTable::from_bytes(&merl_from_slice(&values)).unwrap()))
});

/// A MERL file from measured values at phi_d = 90 degrees (rows theta_d, columns theta_h, RGB), the same at every phi_d.
fn merl_from_slice(values: &[f32]) -> Vec<u8> {
    let mut bytes: Vec<u8> = [90i32, 90, 180].iter().flat_map(|dim| dim.to_le_bytes()).collect();
    for (channel, scale) in [1.0, 1.15, 1.66].into_iter().enumerate() {
        for cell in 0..90 * 90 * 180 {
            let (theta_h, theta_d) = (cell / 16200, cell / 180 % 90);
            let f = f64::from(values[3 * (90 * theta_d + theta_h) + channel]);
            bytes.extend((f * 1500.0 / scale).to_le_bytes());
        }
    }
    bytes
}

fn conductor(distribution: &str, alpha: f64) -> Brdf {
    let parameters = format!(
        "distribution = '{distribution}'\nalpha = {alpha}\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]"
    );
    Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap()
}

/// A lobe of 0.3 degrees.
pub fn narrow() -> &'static Brdf {
    &NARROW
}

/// A lobe on a base that has most of the mass.
pub fn glossy_plastic() -> Brdf {
    let parameters = "distribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = [0.3, 0.3, 0.6]";
    Brdf::from_parameters("plastic", parameters.parse().unwrap()).unwrap()
}

/// A lobe that leans to one side of the normal: no turn and no mirror leaves it as it is.
struct Leaning;

impl CustomBrdf for Leaning {
    fn name(&self) -> &str {
        "leaning"
    }
    fn key(&self) -> Vec<u8> {
        Vec::new()
    }
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let away = (w_i + w_o).normalize().truncate() - dvec2(0.15, 0.1);
        DVec3::new(1.0, 0.8, 0.5) * (-(away.x / 0.1).powi(2) - (away.y / 0.2).powi(2)).exp()
    }
}

/// Anisotropic ones of each symmetry, by name: of 19, 37 and 73 azimuths of the view.
pub fn anisotropic() -> Vec<(&'static str, Brdf)> {
    let brushed = |text: &str| Brdf::from_parameters("conductor", text.parse().unwrap()).unwrap();
    vec![
        ("brushed", brushed("distribution = 'ggx'\nmetal = 'Al'\nalpha_x = 0.05\nalpha_y = 0.3")),
        (
            "brushed aslant",
            brushed("distribution = 'beckmann'\nmetal = 'Au'\nalpha_x = 0.4\nalpha_y = 0.1\nrotation_deg = 30"),
        ),
        ("leaning", Brdf::custom(Leaning)),
    ]
}

/// A material of [`all`] or [`anisotropic`] with its CDFs.
pub struct InSlices {
    pub name: &'static str,
    pub brdf: Brdf,
    pub table: SliceTable,
}

/// All of them. Made once: it takes seconds.
pub fn in_slices() -> &'static [InSlices] {
    static IN_SLICES: LazyLock<Vec<InSlices>> = LazyLock::new(|| {
        let with_table = |(name, brdf): (&'static str, Brdf)| InSlices { name, table: SliceTable::new(&brdf), brdf };
        [all(), anisotropic()].concat().into_iter().map(with_table).collect()
    });
    &IN_SLICES
}

/// The kinds of material that threads have to work for, by name.
pub fn all() -> Vec<(&'static str, Brdf)> {
    let plastic = "distribution = 'ggx'\nalpha = 0.12\nior = 1.5\ndiffuse = [0.3, 0.08, 0.04]";
    let mut all = vec![
        ("lambert", Brdf::builtin("clay").unwrap()),
        ("conductor 0.005", narrow().clone()),
        ("conductor 0.1", conductor("ggx", 0.1)),
        ("conductor 0.5", conductor("beckmann", 0.5)),
        ("plastic", Brdf::from_parameters("plastic", plastic.parse().unwrap()).unwrap()),
    ];
    all.extend(ALUMINA_OXIDE.clone().map(|brdf| ("alumina-oxide", brdf)));
    all
}
