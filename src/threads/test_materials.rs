//! BRDFs that the tests of this module share.
use std::sync::LazyLock;

use glam::{DVec3, Vec3, dvec2};

use super::slice_table::SliceTable;
use crate::brdf::tests::{conductor, samples::of_model};
use crate::brdf::{Brdf, CustomBrdf, MerlTable, merl_bytes_of_values};
use crate::files::measured;

static NARROW: LazyLock<Brdf> = LazyLock::new(|| conductor("ggx", 0.005));
static ALUMINA_OXIDE: LazyLock<Option<Brdf>> = LazyLock::new(|| {
    let bytes = std::fs::read(measured("merl/slices/alumina-oxide.slice")?).expect("a readable file");
    let values: Vec<f32> = bytes.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value)).collect();
    // Measured at phi_d = 90 degrees, in rows of theta_d and columns of theta_h, and taken for the same at every phi_d.
    let of_cell = |[theta_h, theta_d, _]: [usize; 3]| Vec3::from_slice(&values[3 * (90 * theta_d + theta_h)..]);
    let bytes = merl_bytes_of_values(|cell| Some(of_cell(cell).as_dvec3()));
    Some(Brdf::MerlTable(MerlTable::from_bytes(&bytes).unwrap()))
});

/// A lobe of 0.3 degrees.
pub fn narrow() -> &'static Brdf {
    &NARROW
}

/// A lobe on a base that has most of the mass.
pub fn glossy_plastic() -> Brdf {
    let parameters = "distribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = [0.3, 0.3, 0.6]";
    of_model("plastic", parameters)
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
    let brushed = |text: &str| of_model("conductor", text);
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
        ("plastic", of_model("plastic", plastic)),
    ];
    all.extend(ALUMINA_OXIDE.clone().map(|brdf| ("alumina-oxide", brdf)));
    all
}
