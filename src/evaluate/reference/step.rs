//! The reference as a step: made once, and kept on disk as an EXR file that any viewer opens.
use std::path::Path;

use super::{Integrator, ReferenceImage};
use crate::error::{Error, Result};
use crate::files;
use crate::memo::{Key, Memo, Round, Step, Stored};
use crate::passes::View;
use crate::picture::{ExrHeader, parse_image, write_exr};
use crate::prepare::Prepared;

/// Changes whenever the same question gets another answer.
const VERSION: u32 = 9;

/// Integrates equation (1) for every pixel of a picture.
pub struct Integrate<'a> {
    /// Of what.
    pub prepared: &'a Prepared,
    /// Texels of the geometry cache: meshes and their transforms are in there.
    pub geometry: &'a [[u32; 2]],
    /// Largest estimated error of a pixel, in display values.
    pub tolerance: f64,
}

impl Step for Integrate<'_> {
    type Output = ReferenceImage;
    const NAME: &'static str = "reference";

    fn key(&self, _: &Memo) -> Result<Key> {
        let Prepared { view, environment, materials, .. } = self.prepared;
        let camera = &view.camera;
        let numbers = [self.tolerance, view.intensity, view.rotation_deg, view.exposure.into(), view.gamma.into()];
        let vectors = [camera.eye, camera.target, camera.up].map(|vector| vector.to_array());
        let numbers = numbers.iter().chain(vectors.as_flattened()).chain([&camera.fov_y_deg]);
        let key = numbers.fold(Key::builder("reference"), |key, &number| key.real(number));
        let sizes = [view.width, view.height, view.subpixels, VERSION];
        let key = sizes.iter().fold(key, |key, &size| key.number(size));
        let key = key.bytes(bytemuck::cast_slice(self.geometry)).key(environment.key);
        Ok(key.keys(materials.iter().map(|material| material.brdf.key)).build())
    }

    fn make(&self, round: &Round) -> Result<ReferenceImage> {
        let integrator = Integrator::of(self.prepared);
        integrator.image(&self.prepared.view, self.geometry, self.tolerance, round.observer())
    }

    fn stored(&self) -> Option<Stored<'_, ReferenceImage>> {
        let view = &self.prepared.view;
        Some(Stored {
            extension: "reference.exr",
            read: Box::new(move |path| parse(path, &files::read(path)?, [view.width, view.height])),
            write: Box::new(move |path, image| write(path, view, image)),
        })
    }
}

/// The reference in the bytes of the cache's file at `path`, of a picture of this width and height.
///
/// # Errors
/// They are no such reference, or not whole.
pub fn parse(path: &Path, bytes: &[u8], size: [u32; 2]) -> Result<ReferenceImage> {
    let picture = parse_image(path, bytes)?;
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
    let whole =
        [picture.width, picture.height] == size && picture.attributes.get("digest") == Some(&digest(&image.radiance));
    if whole { Ok(image) } else { Err(damaged()) }
}

fn write(path: &Path, view: &View, image: &ReferenceImage) -> Result<()> {
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
    write_exr(path, view.width, view.height, &image.radiance, true, &header)
}

fn digest(radiance: &[[f32; 4]]) -> String {
    blake3::hash(bytemuck::cast_slice(radiance)).to_string()
}
