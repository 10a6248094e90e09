//! Filtered environments as files: of the form in src/files/values.rs, whose number is the texels along the edge of a face of level 0, and
//! whose values are red, green and blue of each texel, levels from fine to coarse.
use std::path::Path;

use super::pyramid::MAX_FACE_SIZE;
use super::{Pyramid, VmfPyramid, ggx_pyramid};
use crate::error::Result;
use crate::files::{self, ValuesFormat, write_whole};

/// Files of environments that are filtered in one way.
pub struct PyramidFormat {
    values: ValuesFormat,
    /// Texels along the edge of a face of each level, where level 0 has so many.
    sizes: fn(usize) -> Vec<usize>,
}

/// By kernels of fitted threads.
pub const VMF: PyramidFormat =
    PyramidFormat { values: ValuesFormat { magic: b"VMFMAPS\0", version: 5 }, sizes: VmfPyramid::sizes };

/// By GGX lobes.
pub const GGX: PyramidFormat =
    PyramidFormat { values: ValuesFormat { magic: b"GGXMAPS\0", version: 1 }, sizes: ggx_pyramid::sizes };

impl PyramidFormat {
    /// Version of the format and of the maps in it: to be raised when the same environment gets others.
    pub fn version(&self) -> u32 {
        self.values.version
    }

    /// Writes `pyramid` to the file at `path`, whole or not at all.
    ///
    /// # Errors
    /// A place that cannot be written to.
    pub fn write(&self, path: &Path, Pyramid { face_size, levels }: &Pyramid) -> Result<()> {
        let values = levels.iter().flat_map(|level| level.as_flattened()).copied();
        write_whole(path, &self.values.encode(*face_size as u32, values))
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// A file that cannot be read, or is not whole.
    pub fn read(&self, path: &Path) -> Result<Pyramid> {
        self.parse(path, &files::read(path)?)
    }

    /// The pyramid in the bytes of the file at `path`.
    ///
    /// # Errors
    /// They are not a whole file of this version.
    pub fn parse(&self, path: &Path, bytes: &[u8]) -> Result<Pyramid> {
        self.values.parse(path, bytes, |face_size, values| self.decode(face_size as usize, values))
    }

    fn decode(&self, face_size: usize, values: &[[u8; 4]]) -> Option<Pyramid> {
        let (mut texels, []) = values.as_chunks() else { return None };
        if !face_size.is_power_of_two() || face_size > MAX_FACE_SIZE {
            return None;
        }
        let mut levels = Vec::new();
        for size in (self.sizes)(face_size) {
            let (level, after) = texels.split_at_checked(6 * size * size)?;
            levels.push(level.iter().map(|texel: &[_; 3]| texel.map(f32::from_le_bytes)).collect());
            texels = after;
        }
        texels.is_empty().then_some(Pyramid { face_size, levels })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    /// Of each format.
    fn pyramids() -> [(PyramidFormat, Pyramid); 2] {
        let source = Pyramid::box_filtered(&environment(16, 8, |x, y| [x as f32, y as f32 / 3.0, 1.0]));
        let by_ggx = ggx_pyramid::ggx_pyramid(&source, &()).unwrap();
        [(VMF, VmfPyramid::new(&source, &()).unwrap().levels), (GGX, by_ggx)]
    }

    #[test]
    fn what_is_written_is_read_to_the_bit_and_a_damaged_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.pyramid");
        for (format, pyramid) in pyramids() {
            format.write(&path, &pyramid).unwrap();
            assert_eq!(format.read(&path).unwrap(), pyramid);
            let whole = std::fs::read(&path).unwrap();
            let mut flipped = whole.clone();
            flipped[1000] ^= 1;
            for damaged in [&whole[..100], &whole[..10], &flipped, b""] {
                std::fs::write(&path, damaged).unwrap();
                assert!(format.read(&path).unwrap_err().to_string().contains("x.pyramid"));
            }
        }
    }

    #[test]
    fn sizes_that_do_not_fit_the_content_are_refused() {
        for (format, pyramid) in pyramids() {
            refuses_other_sizes(&format, &pyramid);
        }
    }

    fn refuses_other_sizes(format: &PyramidFormat, pyramid: &Pyramid) {
        let values = || pyramid.levels.iter().flatten().flatten().copied();
        let is_read =
            |size, values: Vec<f32>| format.parse(Path::new("x"), &format.values.encode(size, values)).is_ok();
        let size = pyramid.face_size as u32;
        assert!(is_read(size, values().collect()));
        assert!(!is_read(size, values().skip(1).collect()));
        assert!(!is_read(size, values().chain([0.0]).collect()));
        for size in [0, 3, 1, 2 * MAX_FACE_SIZE as u32, u32::MAX] {
            assert!(!is_read(size, values().collect()), "{size}");
        }
    }
}
