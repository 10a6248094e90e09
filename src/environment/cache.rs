//! Keeps pyramids of vMF kernels on disk, so that an environment is blurred once.
//!
//! | bytes | content, little-endian |
//! |---|---|
//! | 8 | magic `VMFMAPS\0` |
//! | 4 | u32 format version |
//! | 4 | u32 texels along the edge of a face of level 0 |
//! | ... | levels from fine to coarse: RGB, f32 |
//! | 32 | BLAKE3 digest of everything before |
use std::path::{Path, PathBuf};

use super::pyramid::MAX_FACE_SIZE;
use super::{BlurKernel, Environment, Pyramid, VmfPyramid};
use crate::error::{Error, Result};
use crate::output::write_whole;

/// Version of the file format and of the maps in it: to be raised when the same environment gets others.
const FORMAT_VERSION: u32 = 3;

const MAGIC: &[u8; 8] = b"VMFMAPS\0";

/// The pyramid of `environment`: from `folder` if it is there, else made by `make` and put there.
///
/// Which device made it is not asked: they agree to 1e-5. A damaged file is reported and replaced; a folder that cannot be written to
/// is reported and otherwise no matter.
///
/// # Errors
/// Those of `make`.
pub fn load_or_make(
    environment: &Environment,
    folder: Option<&Path>,
    make: impl FnOnce() -> Result<VmfPyramid>,
) -> Result<VmfPyramid> {
    let path = folder.map(|folder| path(folder, environment));
    if let Some(path) = path.as_deref().filter(|path| path.exists()) {
        match read(path) {
            Ok(pyramid) => return Ok(pyramid),
            Err(error) => tracing::warn!("a cached pyramid is useless: {error}"),
        }
    }
    let pyramid = make()?;
    if let Some(path) = path {
        let folder = path.parent().unwrap_or(Path::new("."));
        let made = std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause));
        if let Err(error) = made.and_then(|()| write_whole(&path, &encode(&pyramid))) {
            tracing::warn!("the pyramid is not cached: {error}");
        }
    }
    Ok(pyramid)
}

/// The file for `environment`: its name has all that the pyramid depends on.
fn path(folder: &Path, environment: &Environment) -> PathBuf {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&FORMAT_VERSION.to_le_bytes());
    for size in [environment.width, environment.height] {
        hasher.update(&(size as u64).to_le_bytes());
    }
    hasher.update(bytemuck::cast_slice(&environment.texels));
    folder.join(format!("{}.pyramid", hasher.finalize()))
}

fn encode(pyramid: &VmfPyramid) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend((pyramid.levels.face_size as u32).to_le_bytes());
    for map in &pyramid.levels.levels {
        bytes.extend(map.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    }
    let digest = blake3::hash(&bytes);
    bytes.extend(digest.as_bytes());
    bytes
}

fn read(path: &Path) -> Result<VmfPyramid> {
    let bytes = std::fs::read(path).map_err(|cause| Error::unreadable(path, cause))?;
    decode(&bytes).ok_or_else(|| Error::in_file(path, "is damaged", "it is made again"))
}

fn decode(bytes: &[u8]) -> Option<VmfPyramid> {
    let (content, digest) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>()?;
    if blake3::hash(content).as_bytes() != digest {
        return None;
    }
    let rest = content.strip_prefix(MAGIC)?.strip_prefix(&FORMAT_VERSION.to_le_bytes())?;
    let (&face_size, mut rest) = rest.split_first_chunk()?;
    let face_size = u32::from_le_bytes(face_size) as usize;
    if !face_size.is_power_of_two() || face_size > MAX_FACE_SIZE {
        return None;
    }
    let mut maps = Vec::new();
    let steps = VmfPyramid::steps(face_size).into_iter().filter(|step| step.kernel != BlurKernel::Mean);
    for size in steps.map(|step| step.size) {
        let (map, after) = rest.split_at_checked(6 * size * size * size_of::<[f32; 3]>())?;
        let values = map.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value));
        maps.push(values.collect::<Vec<_>>().as_chunks().0.to_vec());
        rest = after;
    }
    rest.is_empty().then_some(VmfPyramid { levels: Pyramid { face_size, levels: maps } })
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    fn map(value: f32) -> Environment {
        environment(16, 8, |x, y| [x as f32, y as f32 / 3.0, value])
    }

    /// The pyramid, and whether it had to be made.
    fn fetch(environment: &Environment, folder: Option<&Path>) -> (VmfPyramid, bool) {
        let mut made = false;
        let pyramid = load_or_make(environment, folder, || {
            made = true;
            Ok(VmfPyramid::new(environment.box_filtered()))
        });
        (pyramid.unwrap(), made)
    }

    #[test]
    fn the_second_time_is_a_hit_to_the_bit_and_any_other_environment_a_miss() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made/on/demand");
        let (pyramid, made) = fetch(&map(1.0), Some(&folder));
        assert!(made);
        assert_eq!(fetch(&map(1.0), Some(&folder)), (pyramid, false));
        let mut turned = map(1.0);
        (turned.width, turned.height) = (8, 16);
        for other in [map(2.0), turned] {
            assert!(fetch(&other, Some(&folder)).1);
        }
    }

    #[test]
    fn an_environment_blurred_before_is_not_even_box_filtered() {
        let folder = tempfile::tempdir().unwrap();
        let blur = |source: &Pyramid| Ok(VmfPyramid::new(source));
        let first = map(1.0);
        first.vmf_filtered(Some(folder.path()), &(), blur).unwrap();
        let second = map(1.0);
        second.vmf_filtered(Some(folder.path()), &(), |_| unreachable!("it is on disk")).unwrap();
        assert!(second.box_filtered.get().is_none());
    }

    #[test]
    fn a_damaged_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (pyramid, _) = fetch(&map(1.0), Some(folder.path()));
        let path = path(folder.path(), &map(1.0));
        let whole = std::fs::read(&path).unwrap();
        let mut flipped = whole.clone();
        flipped[1000] ^= 1;
        for damaged in [&whole[..100], &whole[..10], &flipped, b""] {
            std::fs::write(&path, damaged).unwrap();
            assert_eq!(fetch(&map(1.0), Some(folder.path())), (pyramid.clone(), true));
            assert_eq!(fetch(&map(1.0), Some(folder.path())), (pyramid.clone(), false));
        }
    }

    #[test]
    fn sizes_that_do_not_fit_the_content_are_refused() {
        let whole = encode(&fetch(&map(1.0), None).0);
        let content = &whole[..whole.len() - blake3::OUT_LEN];
        let signed = |content: &[u8]| [content, blake3::hash(content).as_bytes()].concat();
        assert!(decode(&signed(content)).is_some());
        assert!(decode(&signed(&content[..content.len() - 4])).is_none());
        assert!(decode(&signed(&[content, &[0; 4]].concat())).is_none());
        for face_size in [0, 3, 1, 2 * MAX_FACE_SIZE as u32, u32::MAX] {
            let mut other = content.to_vec();
            other[12..16].copy_from_slice(&face_size.to_le_bytes());
            assert!(decode(&signed(&other)).is_none(), "{face_size}");
        }
    }

    #[test]
    fn no_cache_and_an_unwritable_one_still_give_a_pyramid() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("file");
        std::fs::write(&occupied, "").unwrap();
        let (pyramid, made) = fetch(&map(1.0), Some(&occupied));
        assert!(made);
        assert_eq!(fetch(&map(1.0), None), (pyramid, true));
    }
}
