//! Threads are smooth: turning the camera a little changes a picture as little as it changes the truth.
mod common;

use common::{Validated, analytic_materials, ready, sphere};
use threadlight::low_level::evaluate::reference::Integrator;
use threadlight::low_level::pipeline::{Wanted, render_geometry};
use threadlight::low_level::shading::display_value;

/// What the camera turns by from frame to frame, and the places around the sphere at which it does.
const STEP_DEG: f64 = 0.5;
const PLACES: usize = 3;

/// Display values of a picture that has coverage 1 where it is compared.
fn shown(radiance: &[[f32; 4]]) -> Vec<f32> {
    let covered = radiance.iter().filter(|texel| texel[3] == 1.0);
    covered.flat_map(|&[r, g, b, _]| [r, g, b].map(|value| display_value(value, 1.0, 2.2))).collect()
}

fn largest_change(before: &[f32], after: &[f32]) -> f32 {
    assert!(!before.is_empty() && before.len() == after.len());
    let changes = before.iter().zip(after).map(|(before, after)| (after - before).abs());
    changes.inspect(|change| assert!(change.is_finite())).fold(0.0, f32::max)
}

#[test]
fn frames_half_a_degree_apart_change_as_the_reference_does() {
    let gpu = Validated::new();
    // Blurred environments are kept here.
    for (name, material) in analytic_materials().into_iter().filter(|(name, _)| *name != "conductor 0.5") {
        for environment in ["studio", "sun"] {
            let mut scene = sphere(material.clone(), environment, 8, (40, 30));
            scene.image.background = threadlight::low_level::scene::Background::None;
            let mut prepared = ready(&scene);
            let geometry = render_geometry(&gpu.device, &prepared, &gpu.round()).unwrap();
            let (light, brdf) = (prepared.environment.clone(), prepared.materials[0].brdf.clone());
            let (intensity, subpixels) = (prepared.view.intensity, prepared.view.subpixels);
            let integrator = Integrator::new(&light, intensity, std::iter::once(&*brdf), subpixels);
            let (mut of_threads, mut of_truth) = (0.0_f32, 0.0_f32);
            for place in 0..PLACES {
                let start = 360.0 * place as f64 / PLACES as f64;
                let pictures = [start, start + STEP_DEG].map(|degrees| {
                    // What a sphere shows to a camera that is turned around it.
                    prepared.view.rotation_deg = degrees;
                    let wanted = Wanted { radiance: true, ..Wanted::default() };
                    let found = gpu.renderer(&prepared).render(wanted, 1).unwrap();
                    let truth = integrator.image(&prepared.view, &geometry, 5e-4, &()).unwrap();
                    (shown(&found.radiance), shown(&truth.radiance))
                });
                let [(found_0, truth_0), (found_1, truth_1)] = pictures;
                of_threads = of_threads.max(largest_change(&found_0, &found_1));
                of_truth = of_truth.max(largest_change(&truth_0, &truth_1));
            }
            println!(
                "{name} under {environment}: frames change by at most {of_threads:.4}, the reference by {of_truth:.4}"
            );
            // A jump of one display step of 8 bits is what nobody sees.
            assert!(of_threads < 1.1 * of_truth + 1.0 / 255.0, "{name} under {environment}: {of_threads} {of_truth}");
        }
    }
    gpu.finish();
}
