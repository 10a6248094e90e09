//! Materials that are written as files and read again: what is exported looks as before, and what is measured is found in words of a model.
mod common;

use common::{EVERYTHING, Validated, alumina_oxide, model, ready, sphere};
use threadlight::low_level::brdf::{Brdf, MerlTable, merl_bytes};
use threadlight::low_level::evaluate::material_fit::fit;
use threadlight::low_level::scene::{Background, MaterialSource};
use threadlight::low_level::shading::display_value;

#[test]
fn a_model_that_is_exported_and_rendered_looks_as_before() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let exported = folder.path().join("exported.binary");
    for text in [
        "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0.1\nmetal = 'Au'",
        "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0.005\nmetal = 'Au'",
        "model = 'plastic'\ndistribution = 'beckmann'\nalpha = 0.15\nior = 1.5\ndiffuse = [0.4, 0.2, 0.1]",
        "model = 'oren_nayar'\nreflectance = 0.7\nsigma_deg = 25",
        "model = 'layered'\nbase = 'linen'\ncoat = { alpha = 0.15, ior = 1.5 }",
    ] {
        let source = model(text);
        let picture = |source: MaterialSource| {
            let mut scene = sphere(source, "studio", 32, (160, 120));
            scene.image.background = Background::None;
            let prepared = ready(&scene);
            let brdf = (*prepared.materials[0].brdf).clone();
            (gpu.render(&prepared, EVERYTHING).radiance, brdf)
        };
        let (expected, brdf) = picture(source);
        std::fs::write(&exported, merl_bytes(&brdf)).unwrap();
        let (found, _) = picture(MaterialSource::File(exported.clone()));
        let shown = |value: f32| f64::from(display_value(value, 1.0, 2.2));
        let pairs = expected.iter().zip(&found).flat_map(|(a, b)| (0..3).map(move |channel| (a[channel], b[channel])));
        let square: f64 = pairs.map(|(a, b)| (shown(a) - shown(b)).powi(2)).sum();
        let rms = (square / (3 * expected.len()) as f64).sqrt();
        println!("{text:?}: RMS {rms:.5}");
        assert!(rms < 0.002, "{text}: RMS {rms}");
    }
    gpu.finish();
}

#[test]
fn models_come_as_near_to_a_measured_material_as_the_guide_says() {
    let Some(bytes) = alumina_oxide() else {
        println!("skipped: no measured data");
        return;
    };
    let table = Brdf::MerlTable(MerlTable::from_bytes(&bytes).unwrap());
    for (name, most) in [("ggx", 0.3), ("ward", 0.3)] {
        let nearest = &fit(&table, name).unwrap()[0];
        let relative = nearest.error / nearest.error_of_black;
        println!("{name}: {:.1} %", 100.0 * relative);
        assert!(relative < most, "{name}: {relative}");
        assert!(Brdf::from_parameters(&nearest.model, nearest.parameters.clone()).is_ok(), "{name}");
    }
}
