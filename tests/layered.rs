//! A base under a coat as methods shade it, through its table where they evaluate it, against the reference on the CPU.
mod common;

use common::{EVERYTHING, Validated, model, ready, sphere};
use threadlight::Method;
use threadlight::low_level::evaluate::reference::{ReferenceSettings, reference};
use threadlight::low_level::scene::Background;
use threadlight::low_level::shading::display_value;

#[test]
fn every_way_of_shading_comes_near_to_the_reference() {
    let gpu = Validated::new();
    let coat = "coat = { alpha = 0.1, ior = 1.5, thickness = 0.2, absorption = [0.1, 1, 4] }";
    let material = model(&format!("model = 'layered'\nbase = 'satin'\n{coat}"));
    let mut scene = sphere(material, "studio", 16, (48, 36));
    scene.shading.method = Method::Reference;
    scene.image.background = Background::None;
    let truth = reference(&ready(&scene), &gpu.device, &ReferenceSettings::default(), &gpu.round()).unwrap();
    let shown = |rgba: &[f32; 4]| [0, 1, 2].map(|channel| f64::from(display_value(rgba[channel], 1.0, 2.2)));
    for (method, count, limit) in [
        (Method::Fitted, 16, 0.007),
        (Method::Mis, 64, 0.015),
        (Method::Importance, 64, 0.05),
        (Method::Filtered, 64, 0.03),
    ] {
        (scene.shading.method, scene.shading.threads) = (method, Some(count));
        let found = gpu.render(&ready(&scene), EVERYTHING).radiance;
        let square = |(a, b): (&[f32; 4], &[f32; 4])| -> f64 {
            shown(a).iter().zip(shown(b)).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 3.0
        };
        let rms = (found.iter().zip(&truth.radiance).map(square).sum::<f64>() / found.len() as f64).sqrt();
        println!("{method}, {count}: RMS {rms:.5}");
        assert!(rms < limit, "{method}: RMS {rms}");
    }
    gpu.finish();
}
