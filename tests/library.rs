//! What a program does with the library: it renders, saves, watches and cancels, and keeps what took long from one run to the next.
mod common;
use common::device_name;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use threadlight::glam::DVec3;
use threadlight::low_level::picture::read_image;
use threadlight::{Background, Camera, Error, Method, Observer, Renderer, Scene};

fn renderer() -> Renderer {
    device_name().map_or_else(Renderer::new, |name| Renderer::on(&name)).unwrap()
}

fn small() -> Scene {
    Scene::default().with_environment("white").with_background(Background::None).with_size(16, 12).with_threads(4)
}

/// Notes what is begun; cancels when it is asked for the time after `asked` others.
struct Watcher {
    begun: Mutex<Vec<String>>,
    asked: AtomicUsize,
    patience: usize,
}

impl Watcher {
    fn of_patience(patience: usize) -> Self {
        Self { begun: Mutex::default(), asked: AtomicUsize::new(0), patience }
    }

    fn has_begun(&self, what: &str) -> bool {
        self.begun.lock().unwrap().iter().any(|begun| begun == what)
    }
}

impl Observer for Watcher {
    fn begin(&self, what: &str) {
        self.begun.lock().unwrap().push(what.to_owned());
    }

    fn progress(&self, _: usize, _: usize) {}

    fn cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.patience
    }
}

#[test]
fn a_picture_is_saved_as_it_is_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let picture = renderer().render(&small()).unwrap();
    assert_eq!(picture.size(), [16, 12]);
    assert!(
        picture.radiance().iter().any(|pixel| pixel[3] == 0.0)
            && picture.radiance().iter().any(|pixel| pixel[3] == 1.0)
    );
    let [png, exr] = ["picture.png", "picture.exr"].map(|name| folder.path().join(name));
    for path in [&png, &exr] {
        picture.save(path).unwrap();
    }
    let (png, exr) = (read_image(&png).unwrap(), read_image(&exr).unwrap());
    assert_eq!([png.width, png.height, exr.width, exr.height], [16, 12, 16, 12]);
    assert_eq!(exr.rgba, picture.radiance());
    let shown: Vec<u8> = png.rgba.as_flattened().iter().map(|value| (255.0 * value).round() as u8).collect();
    assert_eq!(shown, picture.display());
    let refused = picture.save(folder.path().join("picture.bmp")).unwrap_err().to_string();
    assert!(refused.contains("picture.bmp") && !folder.path().join("picture.bmp").exists(), "{refused}");
}

/// The pixels of a picture by a renderer that has nothing but what is in `folder`, and whether it made threads.
fn by_another_renderer(folder: &Path) -> (Vec<[f32; 4]>, bool) {
    let watcher = Watcher::of_patience(usize::MAX);
    let picture = renderer().with_cache(folder).render_watched(&small(), &watcher).unwrap();
    (picture.radiance().to_vec(), watcher.has_begun("threads"))
}

#[test]
fn what_took_long_is_kept_in_the_folder_for_the_next_renderer() {
    let folder = tempfile::tempdir().unwrap();
    let (first, made) = by_another_renderer(folder.path());
    let (second, made_again) = by_another_renderer(folder.path());
    assert!(made && !made_again && first == second);
    assert!(std::fs::read_dir(folder.path()).unwrap().count() > 0);
}

#[test]
fn a_rendering_ends_wherever_its_observer_says_so_and_the_next_one_is_whole() {
    let mut renderer = renderer();
    let mut patience = 0;
    // Each asks a little further, until one is not cancelled: it asked as often as there is to ask.
    let asked = loop {
        let watcher = Watcher::of_patience(patience);
        match renderer.render_watched(&small(), &watcher) {
            Err(Error::Cancelled) => patience += 1 + patience / 2,
            finished => {
                finished.unwrap();
                break watcher.asked.into_inner();
            }
        }
    };
    assert!(patience > 0 && asked > 0, "{patience} {asked}");
    assert_eq!(renderer.render(&small()).unwrap().radiance(), crate::renderer().render(&small()).unwrap().radiance());
}

#[test]
fn a_long_frame_can_be_ended_between_its_portions() {
    let mut renderer = renderer();
    // Portions are of the picture, however little of it there is to shade.
    let far = Camera { eye: DVec3::new(0.0, 0.0, 300.0), target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 30.0 };
    let scene = small().with_size(640, 480).with_camera(far).with_method(Method::Uniform);
    let mut asked = |samples: u32| {
        let scene = scene.clone().with_threads(samples);
        renderer.render(&scene).unwrap();
        // Nothing is left to be made but the frame.
        let watcher = Watcher::of_patience(usize::MAX);
        renderer.render_watched(&scene, &watcher).unwrap();
        watcher.asked.into_inner()
    };
    // 2^25 samples each.
    let [at_once, in_ten] = [64, 1024].map(&mut asked);
    assert!(in_ten >= at_once + 9, "{at_once} {in_ten}");
}
