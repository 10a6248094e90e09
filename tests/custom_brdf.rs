//! BRDFs that a user of the crate defines, against the same BRDFs as built-in models.
mod common;

use common::{EVERYTHING, Validated, model, ready, sphere};
use glam::{DVec3, Vec4};
use threadlight::low_level::brdf::{Brdf, Custom, CustomBrdf};
use threadlight::low_level::memo::Memo;
use threadlight::low_level::scene::MaterialSource;
use threadlight::low_level::steps::LoadMaterial;

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

fn materials() -> [MaterialSource; 2] {
    let text = "model = 'plastic'\ndistribution = 'ggx'\nalpha = 0.15\nior = 1.5\ndiffuse = [0.3, 0.08, 0.04]";
    let wrapped = Wrapped((*Memo::default().round(&()).ask(&LoadMaterial(&model(text))).unwrap()).clone());
    [model(text), MaterialSource::Custom(Custom::new(wrapped))]
}

#[test]
fn a_custom_brdf_looks_like_the_model_with_its_values() {
    let gpu = Validated::new();
    for (method, environment, threads, tolerance) in [
        ("fitted", "studio", 8, 0.0),
        ("fitted", "sun", 8, 0.01),
        ("paper", "studio", 32, 0.01),
        ("mis", "sun", 16, 0.01),
    ] {
        let [expected, found] = materials().map(|material| {
            let mut scene = sphere(material, environment, threads, (48, 36));
            scene.shading.method = method.to_owned();
            gpu.render(&ready(&scene), EVERYTHING).radiance
        });
        let difference = |(a, b): (&[f32; 4], &[f32; 4])| (Vec4::from(*a) - Vec4::from(*b)).abs().element_sum();
        let difference: f32 = expected.iter().zip(&found).map(difference).sum();
        let total: f32 = expected.iter().flatten().sum();
        println!("{method}, {environment}: {:.3} %", 100.0 * difference / total);
        assert!(total > 100.0 && difference <= tolerance * total, "{method}, {environment}: {difference} of {total}");
    }
    gpu.finish();
}

#[test]
fn no_scene_file_holds_a_custom_brdf() {
    let [_, custom] = materials();
    let error = sphere(custom, "white", 1, (8, 8)).to_toml(None).unwrap_err().to_string();
    assert!(error.contains("material \"m\"") && error.contains("defined by a program"), "{error}");
}
