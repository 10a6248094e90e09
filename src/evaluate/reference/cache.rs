//! Keeps reference pictures on disk, as EXR files that any viewer opens.
use std::path::{Path, PathBuf};

use super::ReferenceImage;
use crate::error::{Error, Result};
use crate::output::{ExrHeader, read_image, write_exr};
use crate::passes::View;
use crate::prepare::Prepared;

/// Changes whenever the same question gets another answer.
const VERSION: u32 = 4;

/// Names everything that the reference depends on. Meshes and their transforms are in `geometry`.
pub fn key(prepared: &Prepared, geometry: &[[u32; 2]], tolerance: f64) -> String {
    let Prepared { view, environment, .. } = prepared;
    let mut hasher = blake3::Hasher::new();
    let camera = &view.camera;
    let numbers = [tolerance, prepared.view.intensity, view.rotation_deg, view.exposure.into(), view.gamma.into()];
    let vectors = [camera.eye, camera.target, camera.up].map(|vector| vector.to_array());
    for number in numbers.iter().chain(vectors.as_flattened()).chain([&camera.fov_y_deg]) {
        hasher.update(&number.to_le_bytes());
    }
    let sizes = [view.width, view.height, view.subpixels, environment.width as u32, environment.height as u32, VERSION];
    sizes.iter().chain(geometry.as_flattened()).for_each(|number| {
        hasher.update(&number.to_le_bytes());
    });
    environment.texels.as_flattened().iter().for_each(|value| {
        hasher.update(&value.to_le_bytes());
    });
    for material in &prepared.materials {
        hasher.update(material.brdf.fingerprint().as_bytes());
    }
    hasher.finalize().to_string()
}

/// The picture that was kept under `key`; a damaged one is reported and counts as none.
pub fn read(folder: &Path, key: &str, view: &View) -> Option<ReferenceImage> {
    let path = path(folder, key);
    if !path.exists() {
        return None;
    }
    let image = parse(&path, view);
    if let Err(error) = &image {
        tracing::warn!("a cached reference is useless: {error}");
    }
    image.ok()
}

fn parse(path: &Path, view: &View) -> Result<ReferenceImage> {
    let picture = read_image(path)?;
    let damaged = || Error::in_file(path, "is damaged", "it is made again");
    let number =
        |name: &str| picture.attributes.get(name).and_then(|text| text.parse::<f64>().ok()).ok_or_else(damaged);
    let image = ReferenceImage {
        error_estimate: number("error_estimate")?,
        max_error_estimate: number("max_error_estimate")?,
        evaluations: number("evaluations")? as u64,
        covered_subpixels: number("covered_subpixels")? as u64,
        seconds: number("seconds")?,
        cached: true,
        radiance: picture.rgba,
    };
    let whole = (picture.width, picture.height) == (view.width, view.height)
        && picture.attributes.get("digest") == Some(&digest(&image.radiance));
    if whole { Ok(image) } else { Err(damaged()) }
}

/// Keeps `image`; a folder that cannot be written to is reported and otherwise no matter.
pub fn write(folder: &Path, key: &str, view: &View, image: &ReferenceImage) {
    let number = |name: &str, value: f64| (name.to_owned(), value.to_string());
    let header = ExrHeader {
        method: "reference".into(),
        seconds: image.seconds,
        more: vec![
            number("error_estimate", image.error_estimate),
            number("max_error_estimate", image.max_error_estimate),
            number("evaluations", image.evaluations as f64),
            number("covered_subpixels", image.covered_subpixels as f64),
            ("digest".to_owned(), digest(&image.radiance)),
        ],
        ..ExrHeader::default()
    };
    let made = std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause));
    let written =
        made.and_then(|()| write_exr(&path(folder, key), view.width, view.height, &image.radiance, true, &header));
    if let Err(error) = written {
        tracing::warn!("the reference is not cached: {error}");
    }
}

fn path(folder: &Path, key: &str) -> PathBuf {
    folder.join(format!("{key}.reference.exr"))
}

fn digest(radiance: &[[f32; 4]]) -> String {
    blake3::hash(bytemuck::cast_slice(radiance)).to_string()
}
