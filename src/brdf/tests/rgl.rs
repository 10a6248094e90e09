//! RGL's files: what they hold is what Mitsuba 3 finds in them; bytes that are no such file are refused; the table that shaders look up.
use std::path::Path;

use super::*;
use crate::farthest::Farthest;
use crate::files::measured;

/// The folder of measured files.
const FOLDER: &str = "bsdf/rgl";

#[test]
fn values_are_those_that_mitsuba_finds() {
    let Some(folder) = measured(FOLDER) else { return };
    compare_with_mitsuba(&folder, include_str!("../../../tests/rgl_by_mitsuba.csv"), 1000);
}

#[test]
fn values_of_anisotropic_files_are_those_that_mitsuba_finds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rgl");
    compare_with_mitsuba(&folder, include_str!("../../../tests/rgl/by_mitsuba.csv"), 800);
}

/// Compares at least so many values of files in `folder` with the lines of `table`, made by tests/rgl_by_mitsuba.py.
fn compare_with_mitsuba(folder: &Path, table: &str, least: usize) {
    let (mut name, mut brdf) = ("", None);
    let mut errors = Vec::new();
    for line in table.lines().skip(1) {
        let (file, numbers) = line.split_once(',').unwrap();
        if file != name {
            (name, brdf) = (file, Some(Brdf::load(&folder.join(file)).unwrap()));
        }
        let brdf = brdf.as_ref().unwrap();
        // Directions are numbers in single precision. Of close to opposite ones, each digit matters.
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.parse::<f32>().unwrap().into()).collect();
        let [w_i, w_o, expected] = [0, 3, 6].map(|start| DVec3::from_slice(&numbers[start..]));
        // Mitsuba keeps what is out of the gamut.
        let expected = expected.max(DVec3::ZERO);
        // Seen along the normal, where of isotropic materials any plane of view is as good, Mitsuba's is that of -x.
        let is_turned = w_o.truncate() == DVec2::ZERO && brdf.is_isotropic();
        let w_i = if is_turned { dvec3(-w_i.x, -w_i.y, w_i.z) } else { w_i };
        let found = brdf.evaluate(w_i, w_o);
        for channel in 0..3 {
            let error = (found[channel] - expected[channel]).abs();
            // In the last column of integrals that end at 1, single precision has few digits: f is 4e-5 there, beside a peak of 30000.
            assert!(error <= 1e-3 * expected[channel] + 1e-6, "{line}: {found}");
            errors.push(error / expected[channel].max(f64::MIN_POSITIVE));
        }
    }
    errors.retain(|error| error.is_finite());
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    println!("{} values: median {median:.1e}, most {:.1e}", errors.len(), errors[errors.len() - 1]);
    assert!(errors.len() > least && median < 1e-6);
}

#[test]
fn anisotropic_files_have_the_symmetry_by_which_parts_of_a_turn_were_left_out() {
    let symmetry = |part: &str| {
        let file = format!("tests/rgl/{part}_turn_rgb.bsdf");
        Brdf::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap().symmetry()
    };
    let none = Symmetry { isotropic: false, half_turn: false, mirror_x: false, mirror_y: false };
    assert_eq!(symmetry("whole"), none);
    assert_eq!(symmetry("half"), Symmetry { half_turn: true, ..none });
    assert_eq!(symmetry("quarter"), Symmetry { half_turn: true, mirror_x: true, mirror_y: true, ..none });
}

#[test]
fn tables_of_measured_files_err_by_what_the_guide_says() {
    let Some(folder) = measured(FOLDER) else { return };
    for (file, most) in [
        ("paper_white_rgb.bsdf", 0.01),
        ("cg_sunflower_rgb.bsdf", 0.03),
        ("vch_golden_yellow_rgb.bsdf", 0.045),
        ("cc_ibiza_sunset_rgb.bsdf", 0.065),
    ] {
        let brdf = Brdf::load(&folder.join(file)).unwrap();
        let (table, error) = tabulate(&brdf);
        println!("{file}: {:?} nodes, error {:.2} %", table.made_table().unwrap().size(), 100.0 * error);
        assert!(error < most, "{file}: {error}");
    }
}

#[test]
fn measured_files_reflect_no_more_than_they_receive() {
    let Some(folder) = measured(FOLDER) else { return };
    for file in ["paper_white", "cg_sunflower", "vch_golden_yellow", "cc_ibiza_sunset"] {
        let brdf = Brdf::load(&folder.join(format!("{file}_rgb.bsdf"))).unwrap();
        assert!(brdf.is_isotropic(), "{file}");
        for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0, 89.0, 89.9] {
            let albedo = brdf.albedo(theta_o_deg.to_radians());
            assert!(albedo.is_finite() && albedo.max_element() < 1.0, "{file} at {theta_o_deg}: {albedo}");
        }
        for (w_i, w_o) in [
            (DVec3::Z, DVec3::Z),
            (dvec3(1.0, 0.0, 1e-300), dvec3(-1.0, 0.0, 1e-300)),
            (dvec3(0.0, 1.0, 1e-17), DVec3::Z),
            (dvec3(1.0, 0.0, 1e-9), dvec3(1.0, 0.0, 1e-9)),
        ] {
            let f = brdf.evaluate(w_i, w_o);
            assert!(f.is_finite() && f.min_element() >= 0.0, "{file}: {f} at {w_i} {w_o}");
        }
    }
}

/// A field of a made file: name, type, dimensions, bytes.
type Field = (&'static str, u8, Vec<u64>, Vec<u8>);

fn numbers(name: &'static str, shape: &[u64], values: impl IntoIterator<Item = f32>) -> Field {
    (name, 10, shape.to_vec(), values.into_iter().flat_map(f32::to_le_bytes).collect())
}

/// The bytes of a tensor file.
fn tensor_file(fields: &[Field]) -> Vec<u8> {
    let header: usize = fields.iter().map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len()).sum();
    let mut bytes = [&b"tensor_file\0\x01\0"[..], &(fields.len() as u32).to_le_bytes()].concat();
    let mut offset = bytes.len() + header;
    for (name, kind, shape, values) in fields {
        bytes.extend((name.len() as u16).to_le_bytes());
        bytes.extend(name.as_bytes());
        bytes.extend((shape.len() as u16).to_le_bytes());
        bytes.push(*kind);
        bytes.extend((offset as u64).to_le_bytes());
        bytes.extend(shape.iter().flat_map(|size| size.to_le_bytes()));
        offset += values.len();
    }
    fields.iter().for_each(|(.., values)| bytes.extend(values));
    bytes
}

/// A small file of two angles, whose visible normals fill the square evenly, with these last fields.
fn made(last: &[Field]) -> Vec<Field> {
    let mut fields = vec![
        numbers("phi_i", &[1], [0.0]),
        numbers("theta_i", &[2], [0.0, 1.0]),
        numbers("ndf", &[2, 3], [2.0; 6]),
        numbers("sigma", &[2, 2], [0.25; 4]),
        numbers("vndf", &[1, 2, 3, 4], [1.0; 24]),
        ("jacobian", 1, vec![1], vec![1]),
    ];
    fields.extend_from_slice(last);
    fields
}

/// M of red, green and blue, of which red goes from 0 to 1 with u, at the first angle, and is 3 at the second.
fn rgb() -> Field {
    let square = |red: [f32; 4]| [red, [0.5; 4], [-0.25; 4]].concat();
    numbers("rgb", &[1, 2, 3, 2, 2], [square([0.0, 1.0, 0.0, 1.0]), square([3.0; 4])].concat())
}

fn spectra(wavelengths_nm: Vec<f32>, spectrum: impl Fn(f32) -> f32) -> [Field; 2] {
    let count = wavelengths_nm.len();
    let values = wavelengths_nm.iter().flat_map(|&nm| [spectrum(nm); 4]);
    let values = numbers("spectra", &[1, 2, count as u64, 2, 2], values.clone().chain(values));
    [numbers("wavelengths", &[count as u64], wavelengths_nm), values]
}

fn parse(fields: &[Field]) -> Result<Brdf> {
    Brdf::FILES.parse(Path::new("made.bsdf"), &tensor_file(fields))
}

#[test]
fn a_made_file_has_the_values_that_were_put_in() {
    let brdf = parse(&made(&[rgb()])).unwrap();
    // Light and view at the angle theta on opposite sides: the half vector is the normal, and u is 0.
    let mirror = |theta: f64| (dvec3(-theta.sin(), 0.0, theta.cos()), dvec3(theta.sin(), 0.0, theta.cos()));
    for (theta, red) in [(0.0, 0.0), (0.5, 1.5), (1.0, 3.0), (1.5, 3.0)] {
        let (w_i, w_o) = mirror(theta);
        // D / (4 sigma) is 2. What is negative is 0.
        let expected = dvec3(2.0 * red, 1.0, 0.0) / w_i.z;
        let found = brdf.evaluate(w_i, w_o);
        assert!((found - expected).farthest() < 1e-6 * (1.0 + expected.x), "{theta}: {found}, not {expected}");
    }
    // Seen along the normal, the half vector is at half of the angle of light, and u is the root of its part of 90 degrees.
    let theta_i = 1.0f64;
    let found = brdf.evaluate(dvec3(theta_i.sin(), 0.0, theta_i.cos()), DVec3::Z).x;
    let expected = 2.0 * (0.5 * theta_i * std::f64::consts::FRAC_2_PI).sqrt() / theta_i.cos();
    assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
}

#[test]
fn a_material_that_was_measured_at_two_azimuths_is_isotropic() {
    let mut fields = made(&[]);
    fields[0] = numbers("phi_i", &[2], [0.0, std::f32::consts::PI]);
    fields[4] = numbers("vndf", &[2, 2, 3, 4], [1.0; 48]);
    let (_, _, shape, bytes) = rgb();
    fields.push(("rgb", 10, [&[2], &shape[1..]].concat(), bytes.repeat(2)));
    let (once, twice) = (parse(&made(&[rgb()])).unwrap(), parse(&fields).unwrap());
    assert!(twice.is_isotropic());
    let (w_i, w_o) = (dvec3(-0.3, 0.4, 0.75f64.sqrt()), dvec3(0.6, 0.0, 0.8));
    assert!(once.evaluate(w_i, w_o).distance(twice.evaluate(w_i, w_o)) < 1e-6);
}

#[test]
fn spectra_have_their_colour_under_daylight() {
    let every = |step: usize| (360..=1000).step_by(step).map(|nm| nm as f32).collect::<Vec<_>>();
    // From Mitsuba's tables of observer and illuminant, 360 to 830 nm summed in steps of 1 nm, by a program of its own.
    for (spectrum, expected) in [
        (&(|_| 0.5_f32) as &dyn Fn(f32) -> f32, [0.5; 3]),
        (&|nm| (nm - 360.0) / 640.0, [0.441_40, 0.285_93, 0.126_24]),
        (&|nm| 0.05 + 0.55 / (1.0 + (-(nm - 590.0) / 15.0).exp()), [0.579_17, 0.084_58, 0.035_42]),
        (&|nm| 0.1 + 0.6 * (-((nm - 530.0) / 30.0).powi(2)).exp(), [0.0, 0.486_50, 0.087_53]),
    ] {
        let f = parse(&made(&spectra(every(4), spectrum))).unwrap().evaluate(DVec3::Z, DVec3::Z);
        let expected = 2.0 * DVec3::from_array(expected);
        assert!((f - expected).farthest() < 1e-3, "{f}, not {expected}");
    }
}

#[test]
fn files_that_are_none_are_refused_with_a_reason() {
    let good = made(&[rgb()]);
    let with = |name: &str, field: Field| {
        let fields: Vec<Field> =
            good.iter().map(|old| if old.0 == name { field.clone() } else { old.clone() }).collect();
        tensor_file(&fields)
    };
    let without = |name: &str| tensor_file(&good.iter().filter(|field| field.0 != name).cloned().collect::<Vec<_>>());
    let whole = tensor_file(&good);
    let mut version = whole.clone();
    version[12] = 2;
    let mut count = whole.clone();
    count[14..18].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut offset = whole.clone();
    // Behind the first field's name of five letters, its dimensions and type.
    offset[28..36].copy_from_slice(&u64::MAX.to_le_bytes());
    let hostile = [
        (vec![], "is no tensor file"),
        (b"tensor_file\0".to_vec(), "ends within its list"),
        (version, "version 2.0"),
        (count, "4294967295 fields"),
        (offset, "ends before its field phi_i"),
        (whole[..60].to_vec(), "ends within its list"),
        (whole[..whole.len() - 1].to_vec(), "ends before its field rgb"),
        (without("sigma"), "no field sigma"),
        (without("rgb"), "no field rgb"),
        (without("jacobian"), "no field jacobian"),
        (with("phi_i", numbers("phi_i", &[3], [0.0, 1.0, 2.0])), "phi_i from 0.0 to 114.6 degrees"),
        (with("phi_i", numbers("phi_i", &[3], [-3.1, -1.6, 0.1])), "phi_i from -177.6 to 5.7 degrees"),
        (with("phi_i", numbers("phi_i", &[3], [-3.1, -3.2, 0.0])), "phi_i that does not ascend"),
        (with("phi_i", numbers("phi_i", &[3], [-3.1, -1.6, 0.0])), "do not go with its 3 x 2 angles"),
        (with("theta_i", numbers("theta_i", &[2], [1.0, 0.0])), "theta_i that does not ascend"),
        (with("theta_i", numbers("theta_i", &[2], [0.0, 2.0])), "holds 2e0 in theta_i"),
        (with("theta_i", numbers("theta_i", &[3], [0.0, 0.5, 1.0])), "3 angles"),
        (with("theta_i", numbers("theta_i", &[0], [])), "empty field theta_i"),
        (with("theta_i", numbers("theta_i", &[1, 2], [0.0, 1.0])), "2 dimensions instead of 1"),
        (with("theta_i", ("theta_i", 1, vec![2], vec![0, 1])), "type 1 instead of 10"),
        (with("vndf", numbers("vndf", &[1, 2, 3, 4], [0.0; 24])), "nothing but zeros in vndf"),
        (with("vndf", numbers("vndf", &[1, 2, 3, 4], [f32::NAN; 24])), "NaN in vndf"),
        (with("vndf", numbers("vndf", &[1, 2, 12, 1], [1.0; 24])), "12 x 1 nodes"),
        (with("vndf", numbers("vndf", &[1, 2, u64::MAX, u64::MAX], [1.0; 24])), "ends before its field vndf"),
        (with("sigma", numbers("sigma", &[2, 2], [0.25, 0.25, 0.0, 0.25])), "holds 0e0 in sigma, at position 2"),
        (with("rgb", numbers("rgb", &[1, 2, 3, 2, 2], [f32::INFINITY; 24])), "inf in rgb"),
        (with("rgb", numbers("rgb", &[1, 2, 4, 3, 1], [1.0; 24])), "do not go with its 1 x 2 angles"),
        (tensor_file(&made(&spectra(vec![500.0, 700.0], |_| 1.0))), "from 500 to 700 nm"),
        (tensor_file(&made(&spectra(vec![400.0, 600.0], |_| 1.0))), "from 400 to 600 nm"),
        (tensor_file(&made(&spectra(vec![600.0, 400.0, 700.0], |_| 1.0))), "wavelengths that does not ascend"),
        (tensor_file(&made(&spectra(vec![400.0, 700.0], |_| 1.0)[1..])), "no field wavelengths"),
    ];
    for (bytes, reason) in hostile {
        let error = Brdf::FILES.parse(Path::new("hostile.bsdf"), &bytes).expect_err(reason).to_string();
        assert!(
            error.starts_with("hostile.bsdf: ") && error.contains(reason) && !error.contains('\n'),
            "{reason}: {error}"
        );
    }
    // Every shorter file is refused as well.
    for length in 0..whole.len() {
        assert!(Brdf::FILES.parse(Path::new("cut.bsdf"), &whole[..length]).is_err(), "{length}");
    }
}
