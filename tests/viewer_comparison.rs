//! The viewer's comparison of two pictures, without a window.
#![cfg(feature = "viewer")]
mod common;
use common::{Validated, ready, sphere};
use threadlight::Method;
use threadlight::low_level::scene::{MaterialSource, ShadingSettings};
use threadlight::low_level::viewer::comparison::{Compared, Other, compare_with};

#[test]
fn a_picture_is_compared_with_another_method_with_itself_and_with_the_reference() {
    let gpu = Validated::new();
    let mut scene = sphere(MaterialSource::Builtin("gold".into()), "studio", 16, (96, 72));
    scene.shading.method = Method::Paper;
    let prepared = ready(&scene);
    let compared = |other: Other| {
        let mut all: Vec<Compared> = Vec::new();
        compare_with(&prepared, &other, &gpu.device, &gpu.memo, &(), &mut |compared| all.push(compared)).unwrap();
        all
    };

    let itself = compared(Other::Shading(scene.shading.clone()));
    let [itself] = &itself[..] else { panic!("one result") };
    let metrics = itself.metrics.unwrap();
    assert_eq!((metrics.rms, itself.part, itself.error_estimate, itself.size), (0.0, 1.0, None, [96, 72]));
    assert_eq!((itself.display.len(), itself.heat_map.len()), (4 * 96 * 72, 4 * 96 * 72));

    let fitted = ShadingSettings { method: Method::Fitted, threads: Some(16), ..ShadingSettings::default() };
    let fitted = compared(Other::Shading(fitted)).remove(0);
    assert_eq!(fitted.name, "fitted, 16");
    let between = fitted.metrics.unwrap();
    assert!(between.rms > 0.003 && between.rms < 0.1 && between.ssim < 0.999, "{between:?}");

    // The reference converges, and so does what it says of the picture.
    let stages = compared(Other::Reference);
    for stage in &stages {
        println!("{:.3} of the pixels, within {:.1e}: {:?}", stage.part, stage.error_estimate.unwrap(), stage.metrics);
    }
    let last = stages.last().unwrap();
    let truth = last.metrics.unwrap();
    assert!(last.part == 1.0 && last.error_estimate.unwrap() < 2e-4);
    assert!((truth.rms - between.rms).abs() < 0.01, "fitted threads are near the truth: {truth:?}, {between:?}");
    for stage in &stages {
        let Some(metrics) = stage.metrics else { continue };
        assert!((metrics.rms / truth.rms - 1.0).abs() < 0.5, "{metrics:?}, in the end {truth:?}");
    }
    gpu.finish();
}
