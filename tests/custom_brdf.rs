//! BRDFs that a user of the crate defines, against the same BRDFs as built-in models.
mod common;

use common::{EVERYTHING, Validated, model, ready, sphere};
use threadlight::Method;
use threadlight::glam::{DVec3, Vec4};
use threadlight::low_level::brdf::{Brdf, Custom, CustomBrdf};
use threadlight::low_level::scene::{MaterialSource, Source};

/// A built-in model in the place of a user's function.
struct Wrapped(Brdf);

impl CustomBrdf for Wrapped {
    fn name(&self) -> &str {
        "wrapped"
    }

    fn key(&self) -> Vec<u8> {
        self.0.fingerprint().as_bytes().to_vec()
    }

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        self.0.evaluate(w_i, w_o)
    }
}

/// A plastic of this roughness, as a model and as a function.
fn materials(roughness: &str) -> [MaterialSource; 2] {
    let parameters = format!("distribution = 'ggx'\n{roughness}\nior = 1.5\ndiffuse = [0.3, 0.08, 0.04]");
    let wrapped = Wrapped(Brdf::from_parameters("plastic", parameters.parse().unwrap()).unwrap());
    [model(&format!("model = 'plastic'\n{parameters}")), MaterialSource::Custom(Custom::new(wrapped))]
}

#[test]
fn a_custom_brdf_looks_like_the_model_with_its_values() {
    let gpu = Validated::new();
    // Small, as a pyramid of kernels is made from it each time; with a sun, by which fitted threads evaluate BRDFs too.
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let texel = |i: i32| if i == 64 * 9 + 20 { [90.0, 70.0, 50.0, 1.0] } else { [(i % 7) as f32, 0.1, 0.5, 1.0] };
    let texels: Vec<_> = (0..64 * 32).map(texel).collect();
    threadlight::low_level::picture::write_exr(&map, 64, 32, &texels, false, &Default::default()).unwrap();
    let (sunny, white) = (Source::File(map), Source::Builtin("white".to_owned()));
    let (round, long) = ("alpha = 0.15", "alpha_x = 0.15\nalpha_y = 0.4\nrotation_deg = 20");
    for (roughness, method, environment, threads, tolerance) in [
        (round, Method::Fitted, &white, 8, 0.0),
        (round, Method::Fitted, &sunny, 8, 1e-4),
        (round, Method::Paper, &sunny, 32, 1e-4),
        (round, Method::Mis, &sunny, 16, 2e-4),
        // The axes of the model are not the tangent's, those of the function are.
        (long, Method::Fitted, &sunny, 8, 1e-2),
        (long, Method::Mis, &sunny, 16, 1e-2),
    ] {
        let [expected, found] = materials(roughness).map(|material| {
            let mut scene = sphere(material, "white", threads, (48, 36));
            scene.environment.source = environment.clone();
            scene.shading.method = method;
            gpu.render(&ready(&scene), EVERYTHING).radiance
        });
        let difference = |(a, b): (&[f32; 4], &[f32; 4])| (Vec4::from(*a) - Vec4::from(*b)).abs().element_sum();
        let difference: f32 = expected.iter().zip(&found).map(difference).sum();
        let total: f32 = expected.iter().flatten().sum();
        println!("{roughness:?}, {method}, {environment}: {:.4} %", 100.0 * difference / total);
        assert!(
            total > 100.0 && difference <= tolerance * total,
            "{roughness:?}, {method}, {environment}: {difference} of {total}"
        );
    }
    gpu.finish();
}

#[test]
fn no_scene_file_holds_a_custom_brdf() {
    let [_, custom] = materials("alpha = 0.1");
    let error = sphere(custom, "white", 1, (8, 8)).to_toml(None).unwrap_err().to_string();
    assert!(error.contains("material \"m\"") && error.contains("defined by a program"), "{error}");
}
