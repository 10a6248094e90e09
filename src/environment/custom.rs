//! Environments that a program makes.
use std::sync::Arc;

use super::Environment;
use crate::error::{Error, Result};
use crate::picture::MAX_PIXELS;

/// An environment of pixels that a program has made. Cheap to clone: clones and renderers share the pixels.
///
/// ```
/// use threadlight::{CustomEnvironment, Renderer, Scene};
///
/// // Eight columns and four rows: blue above, brown below.
/// let pixels = (0..8 * 4).map(|pixel| if pixel < 8 * 2 { [0.4, 0.6, 1.0] } else { [0.3, 0.2, 0.1] }).collect();
/// let field = CustomEnvironment::new("field", 8, 4, pixels)?;
/// let scene = Scene::default().with_material("clay").with_environment(field).with_size(32, 24).with_threads(4);
/// let picture = Renderer::new()?.render(&scene)?;
/// // The ball is bluer where it faces the sky.
/// let [top, bottom] = [8 * 32 + 16, 16 * 32 + 16].map(|pixel| picture.radiance()[pixel][2]);
/// assert!(top > 1.3 * bottom, "{top} {bottom}");
/// # Ok::<(), threadlight::Error>(())
/// ```
#[derive(Clone)]
pub struct CustomEnvironment(Arc<Environment>);

impl CustomEnvironment {
    /// A lat-long picture of this many columns and rows, at most 2^28 pixels: linear radiance, Rec. 709, in any unit, which is that of rendered
    /// pictures too; row by row from the top left. The middle of the picture is +z, its top row +y, and a quarter of the width from the left
    /// is +x: see [`Environment`]. It is known by its name and pixels.
    ///
    /// Radiance is from 0 to 1e30. Pixels that are NaN, infinite, above that or negative are repaired, and reported as a warning, as in files.
    ///
    /// # Errors
    /// No pixels, more or fewer than `width` times `height`, or more than there may be.
    pub fn new(name: impl Into<String>, width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Self> {
        let name = name.into();
        let count = pixels.len();
        if width.checked_mul(height) != Some(count) {
            let problem = format!("has {count} pixels, not {width} x {height}");
            return Err(Error::input(name, problem, "give one for each column of each row"));
        }
        if count as u64 > MAX_PIXELS {
            return Err(Error::input(name, format!("has {count} pixels, more than {MAX_PIXELS}"), "make it smaller"));
        }
        Environment::of_pixels(name, width, height, pixels).map(|environment| Self(Arc::new(environment)))
    }

    /// As it is after repair.
    pub(crate) fn environment(&self) -> &Environment {
        &self.0
    }
}

/// By its name.
impl std::fmt::Display for CustomEnvironment {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(&self.0.name)
    }
}

impl std::fmt::Debug for CustomEnvironment {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_tuple("CustomEnvironment").field(&self.0.name).finish()
    }
}

impl PartialEq for CustomEnvironment {
    fn eq(&self, other: &Self) -> bool {
        (&self.0.name, self.0.fingerprint()) == (&other.0.name, other.0.fingerprint())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::RepairCounts;
    use crate::picture::{ExrHeader, write_exr};

    #[test]
    fn pixels_that_a_program_gives_are_repaired_as_those_of_a_file_are() {
        let mut pixels: Vec<[f32; 3]> = (0..7 * 5).map(|i| [i as f32, 0.1, 1.0 / (1 + i) as f32]).collect();
        pixels[0][0] = f32::NAN;
        pixels[8] = [f32::INFINITY, 1.0, -1.0];
        pixels[30] = [-3.0, 1.0, 1e31];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sick.exr");
        let with_alpha: Vec<_> = pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        write_exr(&path, 7, 5, &with_alpha, false, &ExrHeader::default()).unwrap();
        let of_file = Environment::load(&path).unwrap();
        let custom = CustomEnvironment::new("sick", 7, 5, pixels).unwrap();
        assert_eq!(custom.environment().texels, of_file.texels);
        assert_eq!(custom.environment().repaired, of_file.repaired);
        assert_ne!(of_file.repaired, RepairCounts::default());
        assert_eq!(custom.environment().fingerprint(), of_file.fingerprint());
    }

    #[test]
    fn a_size_that_is_not_that_of_the_pixels_is_an_error_that_names_the_environment() {
        for (width, height, count, what) in [
            (2, 3, 5, "has 5 pixels, not 2 x 3"),
            (0, 3, 3, "has 3 pixels, not 0 x 3"),
            (usize::MAX, usize::MAX, 1, "has 1 pixels, not"),
            (0, 3, 0, "has no pixels"),
            (0, 0, 0, "has no pixels"),
        ] {
            let error = CustomEnvironment::new("dusk", width, height, vec![[1.0; 3]; count]).unwrap_err().to_string();
            assert!(error.starts_with("dusk: ") && error.contains(what), "{error}");
        }
    }

    #[test]
    fn equal_environments_have_equal_names_sizes_and_pixels() {
        let of =
            |name: &str, width, red| CustomEnvironment::new(name, width, 6 / width, vec![[red, 1.0, 1.0]; 6]).unwrap();
        assert_eq!(of("a", 2, 1.0), of("a", 2, 1.0));
        for other in [of("b", 2, 1.0), of("a", 3, 1.0), of("a", 2, 1.5)] {
            assert_ne!(of("a", 2, 1.0), other);
        }
    }
}
