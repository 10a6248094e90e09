//! Anisotropic files of UTIA, MIT CSAIL and RGL, made here of a brushed metal: what is read has its values, its symmetries and its look.
mod common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use common::{EVERYTHING, Farthest, Validated, difference, pixels, ready, sphere, texels_of};
use glam::{DMat3, DVec2, DVec3, UVec2};
use threadlight::Method;
use threadlight::low_level::brdf::{Brdf, Symmetry};
use threadlight::low_level::evaluate::reference::{ReferenceSettings, reference};
use threadlight::low_level::evaluate::{Comparable, Display, compare};
use threadlight::low_level::scene::{Background, MaterialSource, Scene};
use threadlight::low_level::shading::CpuShader;

fn metal(roughness: &str) -> Brdf {
    let text = format!("distribution = 'ggx'\nmetal = 'Al'\n{}", roughness.replace(';', "\n"));
    Brdf::from_parameters("conductor", text.parse().unwrap()).unwrap()
}

fn brushed() -> Brdf {
    metal("alpha_x = 0.2; alpha_y = 0.5")
}

fn direction(theta: f64, phi: f64) -> DVec3 {
    (DVec2::from_angle(phi) * theta.sin()).extend(theta.cos())
}

/// UTIA's form of `brdf`.
fn utia_file(brdf: &Brdf) -> Vec<u8> {
    let at = |index: usize| direction(15f64.to_radians() * (index / 48) as f64, TAU / 48.0 * (index % 48) as f64);
    let cells: Vec<_> = (0..288 * 288).map(|cell| brdf.evaluate(at(cell / 288), at(cell % 288))).collect();
    let plane = |channel: usize| cells.iter().flat_map(move |value| value[channel].to_le_bytes());
    (0..3).flat_map(plane).collect()
}

/// MIT CSAIL's, in bins of 5 degrees, of 10 over phi_in.
fn mit_file(brdf: &Brdf, is_half: bool) -> Vec<u8> {
    const SIZES: [usize; 3] = [18, 72, 36];
    let [thetas, azimuths, turns] = [SIZES[0], SIZES[1] / (1 + usize::from(is_half)), SIZES[2]];
    let header = [18, 18, azimuths as i32, 36, 0, 0, 1, 0, 0, i32::from(is_half), 3, 0, 0, 0, 0, 0];
    let theta = |bin: usize| FRAC_PI_2 / thetas as f64 * (bin as f64 + 0.5);
    let value = |cell: usize| {
        let (line, phi_in) = (cell / turns, TAU / turns as f64 * ((cell % turns) as f64 + 0.5));
        let phi_diff = TAU / SIZES[1] as f64 * ((line % azimuths) as f64 + 0.5);
        let [theta_in, theta_out] = [line / azimuths / thetas, line / azimuths % thetas].map(theta);
        brdf.evaluate(direction(theta_in, phi_in), direction(theta_out, phi_in + phi_diff))
    };
    let cells: Vec<_> = (0..thetas * thetas * azimuths * turns).map(value).collect();
    let plane = |channel: usize| cells.iter().flat_map(move |value| (value[channel] as f32).to_le_bytes());
    header.into_iter().flat_map(i32::to_le_bytes).chain((0..3).flat_map(plane)).collect()
}

/// RGL's, of views from a quarter of a turn, or of one azimuth: of normals that are evenly visible over the unit
/// square, so that the warp changes nothing.
fn rgl_file(brdf: &Brdf, is_isotropic: bool) -> Vec<u8> {
    const SIDE: usize = 48;
    let phi_i = if is_isotropic { vec![0.0] } else { (0..7).map(|i| (-1.0 + i as f64 / 12.0) * PI).collect() };
    let theta_i: Vec<_> = (0..14).map(|i| FRAC_PI_2 * (1.0 - (1.0 - i as f64 / 13.3).powi(2))).collect();
    let (phis, thetas) = (phi_i.len(), theta_i.len());
    let mut rgb = vec![0f32; phis * thetas * 3 * SIDE * SIDE];
    for (view, squares) in rgb.chunks_exact_mut(3 * SIDE * SIDE).enumerate() {
        let w_o = direction(theta_i[view % thetas], phi_i[view / thetas]);
        for node in 0..SIDE * SIDE {
            let [u, v] = [node % SIDE, node / SIDE].map(|at| at as f64 / (SIDE - 1) as f64);
            let h = direction(FRAC_PI_2 * u * u, PI * (2.0 * v - 1.0));
            let w_i = 2.0 * w_o.dot(h) * h - w_o;
            let value = brdf.evaluate(w_i, w_o) * w_i.z;
            (0..3).for_each(|channel| squares[channel * SIDE * SIDE + node] = value[channel] as f32);
        }
    }
    let single = |numbers: &[f64]| numbers.iter().map(|&number| number as f32).collect::<Vec<_>>();
    let (side, [phis, thetas]) = (SIDE as u64, [phis, thetas].map(|count| count as u64));
    common::rgl_file(&[
        ("phi_i", &[phis], &single(&phi_i)),
        ("theta_i", &[thetas], &single(&theta_i)),
        ("ndf", &[2, 2], &[1.0; 4]),
        ("sigma", &[2, 2], &[1.0; 4]),
        ("vndf", &[phis, thetas, 2, 2], &vec![1.0; (phis * thetas * 4) as usize]),
        ("rgb", &[phis, thetas, 3, side, side], &rgb),
    ])
}

fn read(name: &str, bytes: &[u8]) -> Brdf {
    Brdf::FILES.parse(Path::new(name), bytes).unwrap()
}

/// `brdf` as it is read from a file of each form.
fn read_back(brdf: &Brdf) -> Vec<(&'static str, Brdf)> {
    vec![
        ("x.bin", read("x.bin", &utia_file(brdf))),
        ("x.dat", read("x.dat", &mit_file(brdf, false))),
        ("half x.dat", read("x.dat", &mit_file(brdf, true))),
        ("x.bsdf", read("x.bsdf", &rgl_file(brdf, false))),
    ]
}

/// Pairs of directions up to 70 degrees from the normal, with half vectors in the lobe and beyond. None is the normal itself, whose azimuth is
/// arbitrary.
fn pairs() -> impl Iterator<Item = [DVec3; 2]> {
    let views = (1..60).map(|i| direction(0.02 * i as f64, 2.4 * i as f64));
    let halves = (0..200).map(|j| direction(0.8 * (j as f64 / 200.0), 2.4 * j as f64));
    let pair = |w_o: DVec3, h: DVec3| [2.0 * w_o.dot(h) * h - w_o, w_o];
    views.flat_map(move |w_o| halves.clone().map(move |h| pair(w_o, h))).filter(|[w_i, _]| w_i.z > 0.342)
}

#[test]
fn files_of_a_model_have_its_values() {
    let model = brushed();
    for (file, brdf) in read_back(&model) {
        let (mut sum, mut difference) = (DVec3::ZERO, DVec3::ZERO);
        for [w_i, w_o] in pairs() {
            let expected = model.evaluate(w_i, w_o);
            sum += expected;
            difference += (brdf.evaluate(w_i, w_o) - expected).abs();
        }
        let error = (difference / sum).farthest();
        println!("{file}: {:.2} %", 100.0 * error);
        assert!(error < if file == "x.bin" { 0.1 } else { 0.03 }, "{file}: {error}");
    }
    // At a node the value is the one in the file.
    let brdf = read("x.bin", &utia_file(&model));
    for (theta_i, phi_i, theta_o, phi_o) in [(15.0f64, 7.5f64, 30.0f64, 172.5f64), (75.0, 352.5, 60.0, 187.5)] {
        let w_i = direction(theta_i.to_radians(), phi_i.to_radians());
        let w_o = direction(theta_o.to_radians(), phi_o.to_radians());
        let (found, expected) = (brdf.evaluate(w_i, w_o), model.evaluate(w_i, w_o));
        assert!((found / expected - 1.0).farthest() < 1e-5, "{found}, not {expected}");
    }
}

#[test]
fn what_is_isotropic_or_the_same_in_a_mirror_stays_so() {
    let all = Symmetry { isotropic: true, half_turn: true, mirror_x: true, mirror_y: true };
    for (file, brdf) in read_back(&brushed()) {
        let found = brdf.symmetry();
        // In files of half the azimuths one side is the other by reciprocity, which interpolation does not keep.
        let expected = if file == "half x.dat" { Symmetry { mirror_x: false, mirror_y: false, ..all } } else { all };
        assert_eq!(found, Symmetry { isotropic: false, ..expected }, "{file}");
    }
    let dull = metal("alpha = 0.3");
    for (file, brdf) in read_back(&dull).into_iter().filter(|(file, _)| *file != "x.bsdf") {
        assert!(brdf.is_isotropic(), "{file}");
    }
    assert!(read("x.bsdf", &rgl_file(&dull, true)).is_isotropic());
}

#[test]
fn a_file_of_the_turned_material_is_the_turned_file() {
    let turned = read_back(&metal("alpha_x = 0.2; alpha_y = 0.5; rotation_deg = 30"));
    // A turn by 30 degrees takes nodes of both forms to nodes. RGL's is of a quarter of a turn from the tangent.
    for ((file, brdf), (_, turned)) in read_back(&brushed()).into_iter().zip(turned).take(3) {
        let turn = DMat3::from_rotation_z(30f64.to_radians());
        for [w_i, w_o] in pairs().step_by(7) {
            let (found, expected) = (turned.evaluate(turn * w_i, turn * w_o), brdf.evaluate(w_i, w_o));
            assert!((found - expected).farthest() < 1e-4 * (1.0 + expected.x), "{file}: {found}, {expected}");
        }
    }
}

#[test]
fn values_are_finite_and_not_negative_for_any_pair_of_directions() {
    let mut directions = vec![DVec3::Z, DVec3::new(1.0, 0.0, 1e-300), DVec3::new(0.0, -1.0, 1e-17)];
    directions.extend((0..40).map(|i| direction(0.04 * i as f64 - 1e-9, 2.0 * i as f64)).filter(|w| w.z > 0.0));
    directions.extend([0.0, 0.5, 1.0, 1.5, 2.0].map(|half_turns| direction(FRAC_PI_2 - 1e-9, PI * half_turns)));
    let mut files = read_back(&brushed());
    for name in ["whole_turn_rgb.bsdf", "half_turn_rgb.bsdf", "quarter_turn_rgb.bsdf"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/rgl");
        files.push((name, Brdf::load(&folder.join(name)).unwrap()));
    }
    for (file, brdf) in files {
        for w_i in &directions {
            for w_o in &directions {
                let f = brdf.evaluate(*w_i, *w_o);
                assert!(f.is_finite() && f.min_element() >= 0.0, "{file}: {f} at {w_i} {w_o}");
            }
        }
    }
}

/// A sphere of the material in `file` under the sun.
fn scene(file: &Path, method: Method, threads: u32) -> Scene {
    let mut scene = sphere(MaterialSource::File(file.to_owned()), "sun", threads, (40, 30));
    scene.shading.method = method;
    scene.image.background = Background::None;
    scene
}

#[test]
fn shaders_look_measured_anisotropy_up_in_a_table() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("brushed.bsdf");
    std::fs::write(&file, rgl_file(&brushed(), false)).unwrap();
    for method in [Method::Fitted, Method::Importance, Method::Mis] {
        let prepared = ready(&scene(&file, method, 4));
        assert!(!prepared.environment.small_sources().nodes.is_empty(), "the sun is one");
        let rendering = gpu.render(&prepared, EVERYTHING);
        let twin = CpuShader::new(&prepared, &gpu.round()).unwrap();
        let relative = |(pixel, found): (UVec2, &[f32; 4])| {
            let expected = twin.shade(pixel, &texels_of(&prepared, &rendering, pixel));
            let radiance = expected.truncate().max_element();
            (expected.w > 0.0).then(|| difference(*found, expected) / radiance.max(f32::MIN_POSITIVE))
        };
        let mut differences: Vec<_> = pixels(&prepared).zip(&rendering.radiance).filter_map(relative).collect();
        differences.sort_by(f32::total_cmp);
        // A sample on the other side of a step of a CDF makes another pixel: seldom.
        let most = differences[differences.len() * if method == Method::Fitted { 100 } else { 97 } / 100 - 1];
        println!("{method}: {most:.1e}");
        assert!(most < 1e-3, "{method}: {most}");
        drop(twin);
        if method == Method::Fitted {
            let settings = ReferenceSettings { tolerance: 1e-3, ..ReferenceSettings::default() };
            let truth = reference(&prepared, &gpu.device, &settings, &gpu.round()).unwrap();
            let display = Display { exposure: 1.0, gamma: 2.2 };
            let comparable = |radiance: &[[f32; 4]]| Comparable::from_radiance(40, 30, radiance, true, display);
            let rms = compare(&comparable(&rendering.radiance), &comparable(&truth.radiance), true).unwrap().rms;
            println!("4 threads and a sun that is looked up: RMS {rms:.5}");
            assert!(rms < 0.005, "{rms}");
        }
    }
    gpu.finish();
}
