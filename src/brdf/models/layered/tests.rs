//! A base under a coat: furnace, limits, closed forms, reciprocity, and how bases are named.
use std::f64::consts::FRAC_1_PI;

use glam::dvec3;
use rayon::prelude::*;

use super::*;
use crate::brdf::base_files_of;
use crate::brdf::tests::{direction, from_toml};
use crate::brdf::{fresnel_dielectric, merl_bytes};
use crate::farthest::Farthest;

fn read(text: &str) -> Result<Brdf> {
    from_toml(&text.replace(';', "\n"))
}

fn brdf(text: &str) -> Brdf {
    read(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn under(base: &str, alpha: f64, ior: f64) -> Brdf {
    brdf(&format!("model = 'layered'; base = {base}; coat = {{ alpha = {alpha}, ior = {ior} }}"))
}

const WHITE: &str = "{ model = 'lambert', reflectance = 1 }";
/// Facets that reflect nearly all light.
const MIRROR: &str = "{ model = 'multiscatter_conductor', alpha = 0.01, eta = 0.01, k = 100 }";
const WHITE_METAL: &str = "{ model = 'multiscatter_conductor', alpha = 0.3, eta = 0.01, k = 100 }";

const VIEWS_DEG: [f64; 6] = [0.0, 30.0, 60.0, 75.0, 85.0, 89.0];

fn pairs() -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..400).map(f64::from).map(|t| (direction((t * 7.31) % 89.9, t * 31.7), direction((t * 3.77) % 89.9, t * 11.3)))
}

#[test]
fn what_loses_nothing_reflects_all_light_under_a_clear_coat() {
    for base in [WHITE, MIRROR, WHITE_METAL] {
        for (alpha, ior) in [(0.001, 1.0), (0.001, 1.5), (0.3, 1.5), (1.0, 1.5), (0.001, 2.5), (0.3, 2.5), (1.0, 2.5)] {
            let coated = under(base, alpha, ior);
            for theta_o_deg in VIEWS_DEG {
                let albedo = coated.albedo(f64::to_radians(theta_o_deg)).x;
                assert!((0.98..1.001).contains(&albedo), "{base} {alpha} {ior} at {theta_o_deg}: {albedo}");
            }
        }
    }
}

#[test]
fn no_coat_makes_more_light_than_its_base_does() {
    for base in ["'gold'", "'linen'", "'red-plastic'", "{ model = 'oren_nayar', reflectance = 1, sigma_deg = 30 }"] {
        let [bare, smooth, rough] = [(1.0, 1.0), (0.001, 1.5), (1.0, 2.5)].map(|(alpha, ior)| under(base, alpha, ior));
        for theta_o_deg in [0.0, 60.0, 85.0] {
            let [bare, smooth, rough] =
                [&bare, &smooth, &rough].map(|brdf| brdf.albedo(f64::to_radians(theta_o_deg)).max_element());
            assert!(smooth.max(rough) < bare.max(1.0) + 1e-3, "{base} at {theta_o_deg}: {bare} {smooth} {rough}");
        }
    }
}

#[test]
fn a_base_that_makes_light_makes_no_more_of_it_under_a_coat() {
    let base = "{ model = 'blinn_phong', diffuse = 0.9, specular = 0.8, exponent = 40 }";
    let bare = under(base, 1.0, 1.0).albedo(0.0).x;
    for (alpha, ior) in [(0.001, 1.5), (1.0, 2.5)] {
        let coated = under(base, alpha, ior);
        for theta_o_deg in [0.0, 60.0, 85.0] {
            let albedo = coated.albedo(f64::to_radians(theta_o_deg)).x;
            assert!(albedo > 0.8 && albedo < bare, "{alpha} {ior} at {theta_o_deg}: {albedo}, without a coat {bare}");
        }
    }
}

#[test]
fn brushed_metal_under_a_coat_makes_no_light_at_any_azimuth() {
    let brushed = "distribution = 'ggx', alpha_x = 0.05, alpha_y = 0.3, eta = 0.01, k = 100";
    for rotation_deg in [0, 45, 90] {
        let base = format!("{{ model = 'conductor', {brushed}, rotation_deg = {rotation_deg} }}");
        let coated = under(&base, 0.05, 1.5);
        for theta_o_deg in [0.0, 60.0, 85.0] {
            let albedo = coated.albedo(f64::to_radians(theta_o_deg)).x;
            // Facets lose some light at each return.
            assert!((0.7..1.001).contains(&albedo), "{rotation_deg} at {theta_o_deg}: {albedo}");
        }
    }
}

#[test]
fn what_many_threads_ask_for_first_is_made_and_none_waits_for_itself() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    for _ in 0..20 {
        let coated = under("'linen'", 0.3, 1.5);
        let (tell, told) = std::sync::mpsc::channel();
        pool.spawn(move || {
            let values: Vec<_> = (0..4096).into_par_iter().map(|_| coated.evaluate(DVec3::Z, DVec3::Z)).collect();
            let _ = tell.send(values);
        });
        let values = told.recv_timeout(std::time::Duration::from_secs(60)).expect("an end");
        assert!(values.iter().all(|value| *value == values[0]));
    }
}

#[test]
fn a_coat_of_air_is_not_there() {
    for base in ["'gold'", "'linen'", WHITE] {
        let coated = brdf(&format!(
            "model = 'layered'; base = {base}; coat = {{ alpha = 0.3, ior = 1, thickness = 0, absorption = 3 }}"
        ));
        let Brdf::Layered(layered) = &coated else { panic!("a coat") };
        for (w_i, w_o) in pairs() {
            let [f, bare] = [coated.evaluate(w_i, w_o), layered.base.evaluate(w_i, w_o)];
            assert!((f - bare).farthest() <= 1e-9 * (1.0 + bare.max_element()), "{base} {w_i} {w_o}: {f} {bare}");
        }
    }
}

#[test]
fn a_diffuse_base_is_saundersons() {
    let (ior, reflectance) = (1.5, 0.5);
    let coated = under("{ model = 'lambert', reflectance = 0.5 }", 0.001, ior);
    // Reflectance for diffuse light from without: 0.0918 (e.g. Duntley's formula at 1.5); from within by reciprocity.
    let from_within = 1.0 - (1.0 - 0.0918) / (ior * ior);
    for (theta_i, theta_o) in [(0.0f64, 40.0f64), (30.0, 60.0), (70.0, 20.0)] {
        // Off the plane of incidence, where the coat mirrors nothing.
        let [w_i, w_o] = [direction(theta_i, 90.0), direction(theta_o, 0.0)];
        let transmitted = (1.0 - fresnel_dielectric(w_i.z, ior)) * (1.0 - fresnel_dielectric(w_o.z, ior));
        let expected = transmitted * reflectance * FRAC_1_PI / (ior * ior * (1.0 - reflectance * from_within));
        let f = coated.evaluate(w_i, w_o).x;
        assert!((f / expected - 1.0).abs() < 0.01, "{theta_i} {theta_o}: {f}, expected {expected}");
    }
}

#[test]
fn a_mirror_under_a_smooth_coat_stays_a_mirror() {
    let coated = under("{ model = 'conductor', distribution = 'ggx', alpha = 0.005, metal = 'Au' }", 0.001, 1.5);
    for theta_o_deg in [0.0, 45.0, 75.0] {
        let w_o = direction(theta_o_deg, 180.0);
        // All light but that within ten degrees of the mirror direction.
        let mut beside = DVec3::ZERO;
        for i in 0..20_000 {
            let (u, v) = ((f64::from(i) + 0.5) / 20_000.0, f64::from(i) * 0.618_033_988_75);
            let w_i = direction(u.sqrt().asin().to_degrees(), 360.0 * v);
            if w_i.dot(dvec3(-w_o.x, 0.0, w_o.z)) < 10f64.to_radians().cos() {
                beside += coated.evaluate(w_i, w_o) * (std::f64::consts::PI / 20_000.0);
            }
        }
        // At 75 degrees the coat sends a quarter of what the base reflects back to it.
        assert!(beside.max_element() < 0.05, "{theta_o_deg}: {beside}");
    }
}

#[test]
fn absorption_follows_beers_law_along_the_bent_paths() {
    let coat = "alpha = 0.001, ior = 1.5, thickness = 0.5, absorption = [0, 1, 3]";
    let dark =
        brdf(&format!("model = 'layered'; base = {{ model = 'lambert', reflectance = 1e-6 }}; coat = {{ {coat} }}"));
    let [w_i, w_o] = [direction(60.0, 90.0), direction(30.0, 0.0)];
    let f = dark.evaluate(w_i, w_o);
    let paths: f64 =
        [60.0f64, 30.0].iter().map(|theta: &f64| 0.5 / (1.0 - (theta.to_radians().sin() / 1.5).powi(2)).sqrt()).sum();
    // So dark a base sends no light there and back that counts.
    let coat_alone = under("{ model = 'lambert', reflectance = 0 }", 0.001, 1.5).evaluate(w_i, w_o);
    let below = f - coat_alone;
    for (channel, absorption) in [(1, 1.0), (2, 3.0)] {
        let ratio = below[channel] / below[0];
        assert!((ratio / (-absorption * paths).exp() - 1.0).abs() < 1e-3, "{channel}: {ratio}");
    }
    // Light that is reflected to and fro takes more of them.
    let white = brdf(&format!("model = 'layered'; base = {WHITE}; coat = {{ {coat} }}"));
    let albedo = white.albedo(0.5);
    assert!(albedo.x > 0.98 && albedo.y < (-2.0f64 * 0.5).exp() && albedo.z < albedo.y, "{albedo}");
}

#[test]
fn it_is_reciprocal_and_finite() {
    let colour = "thickness = 0.2, absorption = [0.1, 2, 30]";
    for base in ["'gold'", "'red-plastic'", "'linen'", "'reflective-tape'"] {
        for alpha in [0.001, 0.1, 1.0] {
            let coated =
                brdf(&format!("model = 'layered'; base = {base}; coat = {{ alpha = {alpha}, ior = 1.7, {colour} }}"));
            for (w_i, w_o) in pairs() {
                let [forth, back] = [coated.evaluate(w_i, w_o), coated.evaluate(w_o, w_i)];
                assert!((forth - back).farthest() <= 1e-9 * (1.0 + forth.max_element()), "{base} {w_i} {w_o}");
            }
            for grazing in [89.999_9, 90.0] {
                for phi in [0.0, 90.0, 180.0] {
                    let f = coated.evaluate(direction(grazing, phi), direction(grazing, 0.0));
                    assert!(f.is_finite() && f.min_element() >= 0.0, "{base} {grazing} {phi}: {f}");
                }
            }
        }
    }
}

#[test]
fn tables_of_it_know_whether_its_base_is_reciprocal() {
    let measured = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rgl/whole_turn_rgb.bsdf");
    for (base, is_reciprocal) in [("gold", true), (measured, false)] {
        let coated = brdf(&format!("model = 'layered'; base = '{base}'; coat = {{ alpha = 0.1, ior = 1.5 }}"));
        assert_eq!(coated.is_reciprocal(), is_reciprocal, "{base}");
        let Brdf::Layered(layered) = &coated else { panic!("a coat") };
        assert_eq!(layered.base.is_reciprocal(), is_reciprocal, "{base}");
    }
}

#[test]
fn a_base_is_a_name_a_file_or_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("below")).unwrap();
    std::fs::write(path("below/base.toml"), "model = 'lambert'\nreflectance = 0.25").unwrap();
    let coat = "coat = { alpha = 0.1, ior = 1.5, thickness = 0.1, absorption = 1 }";
    std::fs::write(path("file.toml"), format!("model = 'layered'\nbase = 'below/base.toml'\n{coat}")).unwrap();
    let of_file = Brdf::load(&path("file.toml")).unwrap();
    let of_table = brdf(&format!("model = 'layered'; base = {{ model = 'lambert', reflectance = 0.25 }}; {coat}"));
    assert_eq!(of_file.fingerprint(), of_table.fingerprint());
    assert_eq!(base_files_of(&path("file.toml")), [path("below/base.toml")]);
    // Its content counts, not its name.
    std::fs::write(path("below/base.toml"), "model = 'lambert'\nreflectance = 0.3").unwrap();
    assert_ne!(Brdf::load(&path("file.toml")).unwrap().fingerprint(), of_table.fingerprint());
    // Measured ones too, and a coat on a coat.
    std::fs::write(path("clay.binary"), merl_bytes(&Brdf::builtin("clay").unwrap())).unwrap();
    std::fs::write(
        path("two.toml"),
        format!("model = 'layered'\nbase = {{ model = 'layered', base = 'clay.binary', {coat} }}\n{coat}"),
    )
    .unwrap();
    let Brdf::Layered(upper) = Brdf::load(&path("two.toml")).unwrap() else { panic!("a coat") };
    let Brdf::Layered(lower) = &*upper.base else { panic!("a coat") };
    assert_eq!(lower.base.model(), "merl");
}

#[test]
fn errors_name_the_inner_key() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("own.toml");
    let own_text = own.to_str().unwrap();
    let coat = "coat = { alpha = 0.1, ior = 1.5 }";
    std::fs::write(&own, format!("model = 'layered'\nbase = 'own.toml'\n{coat}")).unwrap();
    for (text, subject) in [
        ("base = 'gold'".to_owned(), "coat"),
        ("base = 'gold'; coat = 3".to_owned(), "coat"),
        ("base = 'gold'; coat = { ior = 1.5 }".to_owned(), "coat.alpha"),
        ("base = 'gold'; coat = { alpha = 2, ior = 1.5 }".to_owned(), "coat.alpha"),
        ("base = 'gold'; coat = { alpha = 0.2, ior = 1.5, colour = 3 }".to_owned(), "coat.colour"),
        (coat.into(), "base"),
        (format!("base = 3; {coat}"), "base"),
        (format!("base = 'velvetine'; {coat}"), "base"),
        (format!("base = 'absent.binary'; {coat}"), "base: absent.binary"),
        (format!("base = 'picture.jpg'; {coat}"), "base: picture.jpg"),
        (format!("base = {{ reflectance = 1 }}; {coat}"), "base.model"),
        (format!("base = {{ model = 'lambert' }}; {coat}"), "base.reflectance"),
        (format!("base = {{ model = 'lambert', reflectance = 1, gloss = 1 }}; {coat}"), "base.gloss"),
        (format!("base = {{ model = 'layered', base = 'gold' }}; {coat}"), "base.coat"),
        (format!("base = '{own_text}'; {coat}"), &format!("base: {own_text}")),
    ] {
        let error = read(&format!("model = 'layered'; {text}")).unwrap_err().to_string();
        assert!(error.starts_with(&format!("{subject}: ")) && !error.contains('\n'), "{text}: {error}");
    }
    assert!(Brdf::load(&own).unwrap_err().to_string().contains("over itself"));
}

#[test]
fn numbers_of_coat_and_base_are_parameters() {
    let text =
        "base = { model = 'lambert', reflectance = 0.5 }\ncoat = { alpha = 0.1, ior = 1.5, absorption = [1, 2, 3] }";
    let mut table: toml::Table = text.parse().unwrap();
    let parameters = Brdf::parameters("layered", &table).unwrap();
    let keys: Vec<_> = parameters.iter().map(|parameter| parameter.key.as_str()).collect();
    assert_eq!(keys, ["base.reflectance", "coat.alpha", "coat.ior", "coat.thickness", "coat.absorption"]);
    assert_eq!(crate::brdf::parameter(&table, "coat.ior").and_then(toml::Value::as_float), Some(1.5));
    for (key, value) in [("coat.ior", 1.7), ("coat.thickness", 0.3), ("base.reflectance", 0.2)] {
        crate::brdf::set_parameter(&mut table, key, value.into());
        assert_eq!(crate::brdf::parameter(&table, key).and_then(toml::Value::as_float), Some(value));
    }
    let Brdf::Layered(layered) = Brdf::from_parameters("layered", table).unwrap() else { panic!("a coat") };
    assert_eq!((layered.coat.ior, layered.coat.thickness_mm), (1.7, 0.3));
}
