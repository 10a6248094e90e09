//! Pictures that are not finished, since the device is lost or out of memory on the way.
use super::*;
use crate::memo::Memo;
use crate::method::Method;
use crate::prepare::prepare;
use crate::scene::{MaterialSource, Scene, Source};
use crate::vulkan::faults::{Fault, with_fault};
use crate::vulkan::{DeviceKind, test_device};
use ash::vk::Result as Call;
use std::time::{Duration, Instant};

/// Opens a device and renders a small picture, with what fails and the calls that were made; all is closed again.
fn render(prepared: &Prepared, fault: Option<Fault>) -> (Result<usize>, Vec<&'static str>) {
    let (device, messages) = test_device::open_validated();
    let memo = Memo::default();
    let rendered = with_fault(fault, || {
        let wanted = Wanted { radiance: true, display: true, geometry: true };
        Ok(DeviceScene::new(&device, prepared, &memo.round(&()))?.render(wanted, 1)?.radiance.len())
    });
    assert_eq!(Arc::strong_count(&device), 1, "something still holds the device");
    drop(device);
    assert_eq!(messages.all(), Vec::<String>::new());
    rendered
}

#[test]
fn wherever_the_device_fails_it_is_said_and_nothing_is_left() {
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = (8, 6);
    scene.environment.source = Source::Builtin("white".to_owned());
    scene.shading.method = Method::Cosine;
    let prepared = prepare(&scene, &Memo::default().round(&())).expect("a scene that can be prepared");
    let (pixels, calls) = render(&prepared, None);
    assert_eq!(pixels.expect("a picture"), 48);
    // What a driver says of a lost device, and of a full one.
    for (result, names) in [
        (Call::ERROR_DEVICE_LOST, &["vkQueueSubmit2", "vkWaitSemaphores", "vkGetQueryPoolResults"][..]),
        (Call::ERROR_OUT_OF_DEVICE_MEMORY, &["vkAllocateMemory"]),
    ] {
        let places = calls.iter().enumerate().filter(|(_, call)| names.contains(call));
        let places: Vec<_> = places.map(|(index, call)| (index, *call)).collect();
        println!("{result}: {} places of {} calls", places.len(), calls.len());
        assert!(places.len() > 5);
        // Every third: each opens a device with validation.
        for (index, name) in places.into_iter().step_by(3) {
            let start = Instant::now();
            let fault = Fault { of: None, after: None, index, result, lasts: result == Call::ERROR_DEVICE_LOST };
            let error = render(&prepared, Some(fault)).0.expect_err("a call fails").to_string();
            let remedy = if fault.lasts { "try again" } else { "a smaller size" };
            assert!(error.contains(name) && error.contains(remedy), "{index}, {name}: {error}");
            assert!(start.elapsed() < Duration::from_secs(60), "{index}, {name}: {:?}", start.elapsed());
        }
    }
}

/// The default scene but for its material, light and number of threads, on a device, with the memo that has what it is made of.
fn on_device(
    material: MaterialSource,
    environment: &str,
    threads: u32,
    (device, memo): &(Arc<Device>, Memo),
) -> DeviceScene {
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = (8, 6);
    scene.environment.source = Source::Builtin(environment.to_owned());
    scene.materials[0].source = material;
    scene.shading.threads = Some(threads);
    let round = memo.round(&());
    let prepared = prepare(&scene, &round).expect("a scene that can be prepared");
    DeviceScene::new(device, &prepared, &round).expect("a scene that fits the device")
}

#[test]
fn pictures_of_8_megapixels_are_shaded_at_once_by_64_threads_unless_there_are_lamps() {
    let made = (test_device::open_validated().0, Memo::default());
    let portions = |environment: &str, threads: u32, sizes: [(u32, u32); 2]| {
        let DeviceScene { view, shade, .. } =
            on_device(MaterialSource::Builtin("gold".to_owned()), environment, threads, &made);
        [DeviceKind::Discrete, DeviceKind::Integrated].map(|kind| {
            let shade = Shade { most_samples: most_samples(kind), ..shade.clone() };
            sizes.map(|(width, height)| shade.portion_count(&View { width, height, ..view.clone() }))
        })
    };
    assert_eq!(portions("white", 64, [(4096, 2048), (4096, 2049)]), [[1, 2], [4, 5]]);
    assert_eq!(portions("sun", 16, [(2560, 1440), (3840, 2160)]), [[1, 2], [3, 6]]);
}

#[test]
fn only_what_sharp_kernels_need_at_grazing_views_makes_a_second_shader() {
    let made = (test_device::open_validated().0, Memo::default());
    // One pipeline for each class of pixels: interior ones and those at edges.
    let shaders = |material| on_device(material, "lamps-70", 16, &made).shade.pipelines.len() / 2;
    // Above 80 degrees it has kernels sharper than the pyramid.
    let parameters = "distribution = 'beckmann'\nalpha = 0.015\nior = 1.5\ndiffuse = [0.6, 0.6, 0.55]";
    let parameters = parameters.parse().expect("TOML");
    assert_eq!(shaders(MaterialSource::Model { model: "plastic".to_owned(), parameters }), 2);
    assert_eq!(shaders(MaterialSource::Builtin("clay".to_owned())), 1);
}
