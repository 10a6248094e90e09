//! Physics of the BRDFs, against closed forms, reciprocity and energy; and hostile input.

use super::*;
use crate::farthest::Farthest;

mod anisotropy;
mod closed_forms;
mod every_model;
mod published_fits;
mod rgl;
pub(crate) mod samples;

/// A direction in the shading frame from angles in degrees.
pub(super) fn direction(theta_deg: f64, phi_deg: f64) -> DVec3 {
    let (sin_theta, cos_theta) = theta_deg.to_radians().sin_cos();
    let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
    dvec3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// What a material file of this text holds.
pub(super) fn from_toml(text: &str) -> Result<Brdf> {
    let (model, parameters) = model_of(text)?;
    Brdf::from_parameters(&model, parameters)
}

/// Copper of this roughness_alpha.
pub(crate) fn conductor(distribution: &str, alpha: f64) -> Brdf {
    from_toml(&format!(
        "model = 'conductor'\ndistribution = '{distribution}'\nalpha = {alpha}\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]"
    ))
    .unwrap()
}

fn plastic(distribution: &str, alpha: f64, diffuse: f64) -> Brdf {
    from_toml(&format!(
        "model = 'plastic'\ndistribution = '{distribution}'\nalpha = {alpha}\nior = 1.5\ndiffuse = {diffuse}"
    ))
    .unwrap()
}

fn blinn_phong(exponent: f64) -> Brdf {
    from_toml(&format!("model = 'blinn_phong'\ndiffuse = 0.4\nspecular = 0.6\nexponent = {exponent}")).unwrap()
}

/// A MERL table whose cells hold `stored(theta_h, theta_d, phi_d, channel)` in the file.
fn merl(stored: impl Fn(usize, usize, usize, usize) -> f64) -> MerlTable {
    let bytes = merl_bytes_of_stored(|[h, d, p]| std::array::from_fn(|channel| stored(h, d, p, channel)));
    MerlTable::from_bytes(&bytes).unwrap()
}

/// w_i, w_o with the given position in the table's index space (bin i covers [i, i + 1)); w_o's azimuth is arbitrary.
fn pair_at(theta_h: f64, theta_d: f64, phi_d: f64) -> (DVec3, DVec3) {
    let theta_h = (theta_h / 90.0).powi(2) * FRAC_PI_2;
    let d = direction(theta_d, phi_d);
    let rotation = glam::DQuat::from_rotation_z(0.7) * glam::DQuat::from_rotation_y(theta_h);
    (rotation * d, rotation * dvec3(-d.x, -d.y, d.z))
}

/// A table whose values jump from cell to cell.
pub(super) fn noisy_table() -> MerlTable {
    scaled_noisy_table(1.0)
}

fn scaled_noisy_table(scale: f64) -> MerlTable {
    merl(|h, d, p, c| scale * ((h * 7 + d * 3 + p * 5 + c) % 11) as f64 * 100.0)
}

fn all_models() -> Vec<Brdf> {
    let mut all: Vec<Brdf> = Brdf::builtin_names().map(|name| Brdf::builtin(name).unwrap()).collect();
    all.extend([conductor("ggx", 0.001), conductor("beckmann", 0.005), conductor("beckmann", 1.0), blinn_phong(0.0)]);
    all.push(Brdf::MerlTable(noisy_table()));
    all
}

#[test]
fn every_model_is_reciprocal() {
    for brdf in all_models() {
        for step in 0..400 {
            let t = f64::from(step);
            let w_i = direction((t * 7.31) % 89.9, t * 31.7);
            let w_o = direction((t * 3.77) % 89.9, t * 11.3);
            let (forth, back) = (brdf.evaluate(w_i, w_o), brdf.evaluate(w_o, w_i));
            assert!((forth - back).farthest() <= 1e-9 * (1.0 + forth.max_element()), "{brdf:?} {w_i} {w_o}");
        }
    }
}

#[test]
fn every_model_is_finite_everywhere_and_zero_below_the_horizon() {
    // By angle, and nearer to the horizon than angles tell.
    let seen_from = |phi: f64| {
        let by_angle = [0.0, 1e-9, 1e-4, 30.0, 89.999_999, 90.0].map(|theta| direction(theta, phi));
        let by_cosine = [1e-17, 1.1e-30, 1e-150, 1e-170, 1e-300].map(|cosine| direction(90.0, phi).with_z(cosine));
        by_angle.into_iter().chain(by_cosine)
    };
    for brdf in all_models() {
        for w_o in seen_from(0.0) {
            for w_i in [w_o, -w_o, dvec3(-w_o.x, 0.0, w_o.z)]
                .into_iter()
                .chain([0.0, 90.0, 180.0].into_iter().flat_map(seen_from))
            {
                let f = brdf.evaluate(w_i, w_o);
                assert!(f.is_finite() && f.min_element() >= 0.0, "{brdf:?} {w_i} {w_o} {f}");
            }
        }
        assert_eq!(brdf.evaluate(dvec3(0.6, 0.0, -0.8), DVec3::Z), DVec3::ZERO);
        assert_eq!(brdf.evaluate(DVec3::Z, dvec3(1.0, 0.0, 0.0)), DVec3::ZERO);
    }
}

#[test]
fn no_model_reflects_more_than_it_receives() {
    let mut brdfs: Vec<Brdf> = Brdf::builtin_names().map(|name| Brdf::builtin(name).unwrap()).collect();
    brdfs.extend([1.0, 10.0, 1e4].map(blinn_phong));
    for alpha in [0.002, 0.1, 0.5, 1.0] {
        // A perfect mirror's facets: k towards infinity.
        let mirror = |distribution| Conductor {
            distribution,
            roughness: Roughness::isotropic(alpha),
            eta: DVec3::splat(0.01),
            k: DVec3::splat(100.0),
        };
        brdfs.extend([Distribution::Ggx, Distribution::Beckmann].map(|d| Brdf::Conductor(mirror(d))));
        brdfs.extend(["ggx", "beckmann"].map(|distribution| plastic(distribution, alpha, 0.95)));
    }
    for brdf in brdfs {
        for theta_o_deg in [0.0f64, 45.0, 75.0, 87.0] {
            let albedo = brdf.albedo(theta_o_deg.to_radians()).max_element();
            assert!(albedo <= 1.0 + 1e-3, "{brdf:?} at {theta_o_deg}: {albedo}");
        }
    }
}

#[test]
fn albedo_of_lambert_is_its_reflectance_at_every_angle() {
    let reflectance = dvec3(0.8, 0.5, 0.2);
    let brdf = Brdf::Lambert(Lambert { reflectance });
    for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0, 89.0, 89.9] {
        let albedo = brdf.albedo(theta_o_deg.to_radians());
        assert!(((albedo - reflectance) / reflectance).farthest() < 2e-4, "{theta_o_deg}: {albedo}");
    }
}

#[test]
fn albedo_of_a_near_mirror_is_its_fresnel_reflectance() {
    for (alpha, theta_o_deg) in [(0.001, 0.0), (0.001, 60.0), (0.002, 75.0), (0.005, 30.0)] {
        let theta_o = f64::to_radians(theta_o_deg);
        let expected = fresnel_conductor(theta_o.cos(), dvec3(0.2, 0.924, 1.102), dvec3(3.912, 2.448, 2.142));
        for distribution in ["ggx", "beckmann"] {
            let albedo = conductor(distribution, alpha).albedo(theta_o);
            let error = ((albedo - expected) / expected).farthest();
            assert!(error < 2e-3, "{distribution} {alpha} at {theta_o_deg}: {albedo}, expected {expected}");
        }
    }
}

#[test]
fn albedo_of_blinn_phong_at_normal_incidence_is_diffuse_plus_specular() {
    for exponent in [0.0, 1.0, 10.0, 400.0, 1e4] {
        let albedo = blinn_phong(exponent).albedo(0.0).x;
        assert!((albedo - 1.0).abs() < 1e-3, "exponent {exponent}: {albedo}");
    }
}

#[test]
fn plastic_base_under_its_coat_keeps_diffuse_times_transmission() {
    // The coat does not depend on the base, so the difference of two plastics is the base alone.
    for theta_o_deg in [0.0f64, 40.0, 80.0] {
        let theta_o = theta_o_deg.to_radians();
        let base = plastic("ggx", 0.3, 0.5).albedo(theta_o).x - plastic("ggx", 0.3, 0.0).albedo(theta_o).x;
        let expected = 0.5 * (1.0 - fresnel_dielectric(theta_o.cos(), 1.5));
        assert!((base / expected - 1.0).abs() < 1e-3, "{theta_o_deg}: {base}, expected {expected}");
    }
}

#[test]
fn fresnel_at_normal_incidence_has_its_closed_form() {
    for (eta, k) in [(0.2, 3.912), (1.4748, 7.7941), (2.0, 0.0), (3.6375, 4.3644)] {
        let expected = ((eta - 1.0f64).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k);
        let f0 = fresnel_conductor(1.0, DVec3::splat(eta), DVec3::splat(k)).x;
        assert!((f0 - expected).abs() < 1e-12);
        assert!((fresnel_conductor(0.0, DVec3::splat(eta), DVec3::splat(k)).x - 1.0).abs() < 1e-12);
    }
    assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-12);
    assert_eq!(fresnel_dielectric(0.0, 1.0), 0.0);
}

#[test]
fn conductor_without_extinction_is_a_dielectric() {
    for cos_theta in [0.01, 0.3, 0.7, 0.99] {
        let conductor = fresnel_conductor(cos_theta, DVec3::splat(1.5), DVec3::ZERO).x;
        assert!((conductor - fresnel_dielectric(cos_theta, 1.5)).abs() < 1e-12);
    }
    // Without a surface nothing is reflected, and rounding does not make that negative.
    for step in 1..=1000 {
        let none = fresnel_conductor(f64::from(step) / 1000.0, DVec3::ONE, DVec3::ZERO).x;
        assert!((0.0..1e-9).contains(&none), "{step}: {none}");
    }
}

#[test]
fn projected_area_of_the_microfacets_is_one() {
    for distribution in [Distribution::Ggx, Distribution::Beckmann] {
        for alpha in [0.001f64, 0.05, 0.3, 1.0] {
            // Over t = log tan(theta), so that every alpha is resolved alike.
            let (steps, t_min, t_max) = (4000, alpha.ln() - 14.0, 14.0);
            let dt = (t_max - t_min) / f64::from(steps);
            let integral: f64 = (0..steps)
                .map(|step| {
                    let theta = (t_min + (f64::from(step) + 0.5) * dt).exp().atan();
                    let (sin_theta, cos_theta) = theta.sin_cos();
                    // dtheta = sin cos dt
                    let density = distribution.density(dvec3(sin_theta, 0.0, cos_theta), alpha);
                    density * cos_theta * 2.0 * PI * sin_theta * sin_theta * cos_theta * dt
                })
                .sum();
            assert!((integral - 1.0).abs() < 1e-5, "{distribution:?} {alpha}: {integral}");
        }
    }
}

#[test]
fn shadowing_keeps_the_visible_area_of_the_facets() {
    // Smith: the integral of G1(w_o) max(w_o . h, 0) D(h) dh is cos theta_o; Beckmann's rational form is good to 0.35 %.
    for (distribution, tolerance) in [(Distribution::Ggx, 1e-3), (Distribution::Beckmann, 5e-3)] {
        for theta_o_deg in [20.0, 60.0, 85.0] {
            let (alpha, w_o) = (0.4, direction(theta_o_deg, 0.0));
            let (theta_steps, phi_steps) = (400, 200);
            let mut area = 0.0;
            for i in 0..theta_steps {
                let theta_h = (f64::from(i) + 0.5) / f64::from(theta_steps) * FRAC_PI_2;
                for j in 0..phi_steps {
                    let h = direction(theta_h.to_degrees(), (f64::from(j) + 0.5) / f64::from(phi_steps) * 360.0);
                    area += distribution.density(h, alpha) * w_o.dot(h).max(0.0) * theta_h.sin();
                }
            }
            area *= FRAC_PI_2 / f64::from(theta_steps) * 2.0 * PI / f64::from(phi_steps);
            let visible = area * distribution.g1_over_cos(w_o.z, alpha);
            assert!((visible - 1.0).abs() < tolerance, "{distribution:?} at {theta_o_deg}: {visible}");
        }
    }
}

#[test]
fn merl_is_exact_at_bin_centres_and_linear_between() {
    let scale = dvec3(1.0, 1.15, 1.66) / 1500.0;
    let table = merl(|h, d, p, c| (1 + h + 2 * d + 3 * p + 1000 * c) as f64);
    let value = |h: f64, d: f64, p: f64| scale * dvec3(0.0, 1000.0, 2000.0) + scale * (1.0 + h + 2.0 * d + 3.0 * p);
    // Angles at which all eight neighbours are above the horizon, at centres and between them.
    for (h, d, p) in [(0.0, 0.0, 0.0), (20.0, 30.0, 90.0), (5.0, 12.0, 178.0), (20.25, 30.0, 90.0), (20.5, 30.75, 90.3)]
    {
        let (w_i, w_o) = pair_at(h + 0.5, d + 0.5, p + 0.5);
        let (found, expected) = (table.evaluate(w_i, w_o), value(h, d, p));
        assert!(((found - expected) / expected).farthest() < 1e-6, "{h} {d} {p}: {found}, expected {expected}");
    }
}

#[test]
fn merl_wraps_in_phi_d_and_clamps_in_the_other_angles() {
    let table = merl(|_, _, p, _| if p == 0 { 1500.0 } else { 0.0 });
    let at = |p: f64| {
        let (w_i, w_o) = pair_at(10.5, 20.5, p);
        table.evaluate(w_i, w_o).x
    };
    assert!((at(0.0) - 0.5).abs() < 1e-6 && (at(179.75) - 0.25).abs() < 1e-6 && (at(0.25) - 0.75).abs() < 1e-6);
    let table = merl(|h, d, _, _| if h == 0 { 1500.0 } else { 0.0 } + if d == 0 { 3000.0 } else { 0.0 });
    assert!((table.evaluate(DVec3::Z, DVec3::Z).x - 3.0).abs() < 1e-6);
}

#[test]
fn merl_invalid_cells_do_not_leak() {
    // 1e9 wherever the centre is below the horizon, negative in every fifth cell elsewhere, 1 in what remains.
    let table = merl(|h, d, p, _| match (merl::Horizon::of_bins(h, d).is_above(p), (h + 3 * d + 7 * p) % 5) {
        (false, _) => 1e9,
        (true, 0) => -1e9,
        (true, _) => 1500.0,
    });
    let mut lit = 0;
    for step in 0..20_000 {
        let t = f64::from(step);
        let (w_i, w_o) = (direction((t * 0.731) % 90.0, t * 31.7), direction((t * 0.377) % 90.0, t * 11.3));
        let f = table.evaluate(w_i, w_o).x;
        assert!(f == 0.0 || (f - 1.0).abs() < 1e-6, "{f} at {w_i} {w_o}");
        lit += u32::from(f > 0.0);
    }
    assert!(lit > 19_000, "{lit}");
}

#[test]
fn merl_table_of_a_model_gives_back_the_model() {
    // Filled at bin centres; between them linear interpolation of so smooth a function is good to a few per cent.
    let model = plastic("ggx", 0.5, 0.4);
    let bytes = merl_bytes_of_values(|cell| {
        let [h, d, p] = cell.map(|bin| bin as f64 + 0.5);
        let (w_i, w_o) = pair_at(h, d, p);
        Some(model.evaluate(w_i, w_o))
    });
    let table = Brdf::MerlTable(MerlTable::from_bytes(&bytes).unwrap());
    for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0] {
        let theta_o = theta_o_deg.to_radians();
        let (measured, exact) = (table.albedo(theta_o), model.albedo(theta_o));
        assert!(((measured - exact) / exact).farthest() < 5e-3, "{theta_o_deg}: {measured}, {exact}");
    }
}

#[test]
fn merl_tables_as_shaders_have_them_err_by_what_the_guide_says() {
    for model in [plastic("ggx", 0.1, 0.4), conductor("ggx", 0.02), conductor("beckmann", 0.3), blinn_phong(200.0)] {
        let table = MerlTable::from_bytes(&merl_bytes(&model)).unwrap();
        let error = tabulate(&Brdf::MerlTable(table)).1;
        println!("{:.3} % {}", 100.0 * error, model.model());
        assert!(error < 3e-3, "{}: {error}", model.model());
    }
    // What jumps from cell to cell is smoothed, and reflects as much.
    for scale in [1e-12, 1.0, 1e9] {
        let table = Brdf::MerlTable(scaled_noisy_table(scale));
        let of_shaders = tabulate(&table).0;
        for theta_o_deg in [5.0f64, 45.0, 70.0] {
            let [found, expected] = [&of_shaders, &table].map(|brdf| brdf.albedo(theta_o_deg.to_radians()));
            let error = ((found - expected) / expected).farthest();
            assert!(error < 0.01, "{scale} at {theta_o_deg}: {found}, {expected}");
        }
    }
}

#[test]
fn merl_files_that_are_no_tables_are_refused_with_a_reason() {
    let constant = |stored: f64| merl_bytes_of_stored(|_| [stored; 3]);
    let good = constant(1.0);
    let reason = |bytes: &[u8]| MerlTable::from_bytes(bytes).unwrap_err();
    assert!(reason(&good[..5]).contains("too short"));
    assert!(reason(&good[..good.len() - 1]).contains("bytes instead of"));
    assert!(reason(&[&good[..], &[0]].concat()).contains("bytes instead of"));
    let mut other = good.clone();
    other[0] = 91;
    assert!(reason(&other).contains("91 x 90 x 180"));
    let mut nan = good.clone();
    nan[12 + 8 * 181..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
    assert!(reason(&nan).contains("NaN in the red cell theta_h 0, theta_d 1, phi_d 1"), "{}", reason(&nan));
    assert!(reason(&constant(0.0)).contains("nothing but zero"));
    assert!(reason(&constant(-1.0)).contains("nothing but zero"));
    assert!(reason(&merl_bytes_of_stored(|_| [1.0, -1.0, 1.0])).contains("nothing but invalid cells in green"));
    assert!(reason(&constant(1e300)).contains("holds 1e300 in the red cell"));
}

#[test]
fn merl_file_errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.binary");
    std::fs::write(&path, [0; 100]).unwrap();
    for path in [path, folder.path().join("absent.binary"), folder.path().join("picture.jpg")] {
        let message = Brdf::load(&path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()) && !message.contains('\n'), "{message}");
    }
}

#[test]
fn bad_parameters_are_refused_by_their_key() {
    let conductor = "model = 'conductor'\ndistribution = 'ggx'\neta = [1, 1, 1]\nk = [2, 2, 2]\n";
    for (text, key) in [
        ("reflectance = 0.5", "model"),
        ("model = 3", "model"),
        ("model = 'velvet'", "model `velvet`"),
        ("model = 'merl'", "model `merl`"),
        ("model = 'lambert'", "reflectance"),
        ("model = 'lambert'\nreflectance = 1.01", "reflectance"),
        ("model = 'lambert'\nreflectance = -0.1", "reflectance"),
        ("model = 'lambert'\nreflectance = nan", "reflectance"),
        ("model = 'lambert'\nreflectance = 'red'", "reflectance"),
        ("model = 'lambert'\nreflectance = [0.1, 0.2]", "reflectance"),
        ("model = 'lambert'\nreflectance = 0.5\nshininess = 3", "shininess"),
        (&format!("{conductor}alpha = 0"), "alpha"),
        (&format!("{conductor}alpha = 1.5"), "alpha"),
        (&format!("{conductor}alpha = inf"), "alpha"),
        (&conductor.replace("ggx", "phong"), "distribution"),
        (&conductor.replace("[2, 2, 2]", "[2, -2, 2]\nalpha = 0.1"), "k"),
        ("model = 'lambert'\nreflectance = [0.1,", "TOML: line 2 (`reflectance = [0.1,`)"),
        ("model = 'lambert'\nreflectance = 0,5", "TOML: line 2 (`reflectance = 0,5`)"),
    ] {
        let message = from_toml(text).unwrap_err().within("scene.toml").to_string();
        assert!(message.starts_with(&format!("scene.toml: {key}: ")), "{text:?} gave {message:?}");
        assert!(!message.contains('\n'), "{message:?}");
    }
}

#[test]
fn a_parameter_that_others_rule_out_is_not_called_unknown() {
    let metal = "model = 'torrance_sparrow'\ndiffuse = 0\nspread_deg = 20\n";
    let principled = "model = 'principled'\nbase_colour = 0.5\nmetallic = 0\nroughness = 0.3\n";
    let lafortune = "model = 'lafortune'\ndiffuse = 0.1\nc_xy_1 = -1\nc_z_1 = 0.9\nexponent_1 = 10\n";
    for (text, said) in [
        (
            format!("{metal}metal = 'Au'\neta = 1\nk = 1"),
            "eta: is not a parameter beside `metal`; remove it, or `metal`",
        ),
        (format!("{metal}metal = 'Fe'"), "\"W\", or give `eta` and `k` in its place"),
        (
            format!("{principled}coat_roughness = 0.3"),
            "coat_roughness: is a parameter only beside `coat`; give `coat`, or remove it",
        ),
        (format!("{principled}coat_ior = 1.4"), "coat_ior: is a parameter only beside `coat`"),
        (format!("{principled}sheen_roughness = 0.3"), "sheen_roughness: is a parameter only beside `sheen`"),
        (
            "[[material]]\nname = 'a'\nmodel = 'lambert'\nreflectance = 0.5".to_owned(),
            "material: makes this a scene, where one material is asked for; give a file that has `model`",
        ),
        // What is misspelt goes first.
        (format!("{principled}cowt = 1\ncoat_ior = 1.4"), "cowt: is not a parameter of `principled`"),
        (format!("{lafortune}c_z_2 = 0.9"), "c_z_2: is a parameter only beside `c_xy_2`"),
        (format!("{lafortune}c_xy_3 = -1"), "c_xy_3: is a parameter only beside `c_xy_2`"),
        (format!("{lafortune}c_xy_9 = -1"), "c_xy_9: is not a parameter of `lafortune`"),
        (
            format!("model = 'layered'\ncoat = {{ alpha = 0.1, ior = 1.5 }}\n[base]\n{principled}coat_ior = 1.4"),
            "base.coat_ior: is a parameter only beside `coat`",
        ),
        (
            "model = 'layered'\ncoat = { alpha = 0.1, ior = 1.5 }\nbase = { model = 'lambert', reflectance = 0.5, alpha = 0.1 }".to_owned(),
            "base.alpha: is not a parameter of `lambert`",
        ),
        (
            "model = 'layered'\ncoat = { alpha = 0.1, ior = 1.5, haze = 1 }\nbase = 'gold'".to_owned(),
            "coat.haze: is not a parameter of `coat`",
        ),
    ] {
        let message = from_toml(&text).unwrap_err().to_string();
        assert!(message.contains(said), "{text}: {message}");
    }
}

#[test]
fn every_builtin_material_is_read_and_every_asset_is_listed() {
    let mut listed: Vec<String> = Brdf::builtin_names().map(|name| format!("{name}.toml")).collect();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/materials");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut files: Vec<String> = files.collect();
    listed.sort();
    files.sort();
    assert_eq!(listed, files);
    assert!(Brdf::builtin_names().all(|name| Brdf::builtin(name).is_some()));
    assert!(Brdf::builtin("no-such-material").is_none());
}

#[test]
fn fingerprints_tell_brdfs_apart() {
    let all = all_models();
    for (i, a) in all.iter().enumerate() {
        assert_eq!(a.fingerprint(), a.clone().fingerprint());
        assert!(all[..i].iter().all(|b| b.fingerprint() != a.fingerprint()), "{a:?}");
    }
}

#[test]
fn a_brdf_with_another_value_of_any_parameter_has_another_fingerprint() {
    let models = samples::tables().map(|(_, model, table)| (model, table));
    let models = models.chain(Brdf::builtin_names().filter_map(Brdf::builtin_model));
    let mut changed = std::collections::BTreeSet::new();
    for (model, table) in models {
        let before = Brdf::from_parameters(&model, table.clone()).unwrap();
        for Parameter { key, domain, .. } in Brdf::parameters(&model, &table).unwrap() {
            let others: Vec<toml::Value> = match &domain {
                Domain::Number(range, _) | Domain::Colour(range, _) => {
                    vec![(range.start() + 0.37 * (range.end() - range.start())).into()]
                }
                Domain::Choice(words) => words.iter().map(|word| word.as_str().into()).collect(),
            };
            for value in others {
                let mut other = table.clone();
                set_parameter(&mut other, &key, value);
                let Ok(after) = Brdf::from_parameters(&model, other) else { continue };
                // Some say nothing beside others, such as a metal's name.
                let differs = format!("{before:?}") != format!("{after:?}");
                assert!(!differs || before.fingerprint() != after.fingerprint(), "{model}: {key}");
                changed.extend(differs.then(|| format!("{model}: {key}")));
            }
        }
    }
    assert!(changed.contains("layered: coat.ior") && changed.len() > 70, "{changed:?}");
}

#[test]
fn a_model_tells_what_it_reads() {
    for name in Brdf::builtin_names() {
        let (model, table) = Brdf::builtin_model(name).unwrap();
        let parameters = Brdf::parameters(&model, &table).unwrap();
        // Those of a base and a coat are known by both names.
        let is_of = |parameter: &Parameter, key: &str| parameter.key.split('.').next() == Some(key);
        assert!(table.keys().all(|key| parameters.iter().any(|parameter| is_of(parameter, key))), "{name}");
        for Parameter { key, domain, default, .. } in &parameters {
            assert!(default.is_some() || parameter(&table, key).is_some(), "{name}: {key}");
            let (outside, of) = match domain {
                Domain::Number(range, _) | Domain::Colour(range, _) => {
                    (toml::Value::Float(2.0 * range.end() + 1.0), key)
                }
                Domain::Choice(words) => (toml::Value::String(words.concat()), key),
            };
            let mut wrong = table.clone();
            set_parameter(&mut wrong, key, outside);
            let error = Brdf::from_parameters(&model, wrong).unwrap_err().to_string();
            assert!(error.contains(of), "{name}: {error}");
        }
    }
}
