//! The `.threads` file: threads on disk.
//!
//! Little-endian throughout:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `THREADS\0` |
//! | 4 | u32 format version, [`FORMAT_VERSION`] |
//! | 4 | u32 length H of the header |
//! | H | header, JSON: `method` ("fitted", "paper" or "gaussian"), `material`, `count`, `rows`, `seed`, `rim_power`, `base`, `azimuths` and `sets` |
//! | ... | the rows, then the threads, see below |
//! | 32 | BLAKE3 digest of everything before |
//!
//! Row r is for the view angle theta_o = r 90 deg / (rows - 1), the last for 89.99 degrees, in the frame whose z is the normal and in which w_o = (sin theta_o, 0,
//! cos theta_o). Colours are linear Rec. 709. Thread k of row r is the (r count + k)-th. Of an anisotropic BRDF there are as many rows for
//! each of 19, 37 or 73 azimuths of w_o from the tangent, every 5 degrees; then those of the second azimuth follow those of the first. They
//! are of the BRDF without its `rotation_deg`.
//!
//! Between rows albedos and weights are blended linearly in theta_o, but between the two last in (90 deg - theta_o)^`rim_power`.
//!
//! Fitted threads and Gaussians may be in several sets, of which thread k is of set k % sets. A sub-pixel with a sum of its own takes one set,
//! with `sets` times the weights; a pixel whose sub-pixels share one sum takes all threads. If there are two tables, one after the other, the
//! first is for such pixels and its threads are in no sets; the second is for such sub-pixels. Then there are twice as many bytes.
//!
//! | method | a row | a thread |
//! |---|---|---|
//! | `paper` | albedo, 3 f32 | theta, phi (radians), p (1/sr), 3 f32 |
//! | `fitted`, `gaussian` | albedo, 3 f32; expected relative error, f32 | 3 words of 4 bytes, below |
//!
//! The words of a fitted thread: its direction's place on the stereographic map, (x, y) / (1.25 (1 + z)), as 16-bit signed normalised
//! numbers, x in the low half; level and red weight as half floats, level in the low half; green and blue weight as half floats, green
//! in the low half. The level says by which von Mises-Fisher kernel the environment is to be blurred: of width 2^level / 256 radians if
//! it is whole, by none at level -1, and otherwise by the linear blend of the two kernels of whole levels beside it. What the weights of
//! all threads leave of the albedo is the weight of the irradiance over pi, by a base that answers light at the cosine c with the
//! polynomial `base` in the place of Lambert's 1: its coefficients, that of c^0 first.
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::azimuths::is_azimuth_count;
use super::fitted::FittedTable;
use super::rim::is_rim_power;
use super::{ThreadKind, ThreadTable, Threads};
use crate::brdf::BaseProfile;
use crate::error::{Error, Result};
use crate::files::{self, sealed, unsealed, write_whole};

/// Version of the file format and of the threads in it: to be raised when either changes, since caches depend on it.
pub const FORMAT_VERSION: u32 = 33;

const MAGIC: &[u8; 8] = b"THREADS\0";

#[derive(Serialize, Deserialize)]
struct Header {
    method: String,
    material: String,
    count: usize,
    rows: usize,
    seed: u64,
    rim_power: f32,
    base: [f32; BaseProfile::TERMS],
    azimuths: usize,
    sets: usize,
}

/// Writes `threads` to `path`, whole or not at all.
pub fn write(threads: &Threads, path: &Path) -> Result<()> {
    write_whole(path, &encode(threads))
}

/// Reads threads back. Errors: unreadable, not a thread file, of another version, damaged.
pub fn read(path: &Path) -> Result<Threads> {
    parse(path, &files::read(path)?)
}

/// The threads in the bytes of the file at `path`.
///
/// # Errors
/// Not a thread file, of another version, damaged.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Threads> {
    decode(bytes).map_err(|problem| Error::in_file(path, problem, "it is made again"))
}

fn encode(threads: &Threads) -> Vec<u8> {
    let [rows, count] = threads.size();
    let method = threads.kind().name().to_owned();
    let (material, seed, rim_power, base, azimuths, sets) = match threads {
        Threads::Fitted(table) | Threads::Gaussian(table) => {
            (table.material.clone(), 0, table.rim_power, table.base.0, table.azimuths, table.for_subpixels().sets)
        }
        Threads::Paper(table) => (table.material.clone(), table.seed, table.rim_power, BaseProfile::EVEN.0, 1, 1),
    };
    let header = serde_json::to_vec(&Header { method, material, count, rows, seed, rim_power, base, azimuths, sets });
    let header = header.expect("a header of strings and numbers is always JSON");
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header);
    let words = match threads {
        Threads::Fitted(table) | Threads::Gaussian(table) => table.file_words(),
        Threads::Paper(table) => table.file_words(),
    };
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    sealed(bytes)
}

fn decode(bytes: &[u8]) -> Result<Threads, String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("is not a thread file")?;
    let (&version, rest) = rest.split_first_chunk().ok_or("is cut short")?;
    let version = u32::from_le_bytes(version);
    if version != FORMAT_VERSION {
        return Err(format!("has format version {version}, this program reads {FORMAT_VERSION}"));
    }
    let content = unsealed(bytes).ok_or("is damaged (its checksum does not match)")?;
    let rest = content.get(bytes.len() - rest.len()..).ok_or("is cut short")?;
    let (&length, rest) = rest.split_first_chunk().ok_or("is cut short")?;
    let (header, payload) = rest.split_at_checked(u32::from_le_bytes(length) as usize).ok_or("is cut short")?;
    let header: Header = serde_json::from_slice(header).map_err(|error| format!("has a bad header ({error})"))?;
    let Header { method, material, count, rows, seed, rim_power, base, azimuths, sets } = header;
    let kind = ThreadKind::ALL.into_iter().find(|kind| kind.name() == method);
    let kind = kind.ok_or_else(|| format!("holds threads of the unknown method {method:?}"))?;
    let words_a_row = match kind {
        ThreadKind::Fitted | ThreadKind::Gaussian => FittedTable::FILE_ROW_WORDS,
        ThreadKind::Paper => ThreadTable::FILE_ROW_WORDS,
    };
    let per_row = count.checked_mul(3).and_then(|words| words.checked_add(words_a_row));
    let all_rows = rows.checked_mul(azimuths);
    let expected = per_row.and_then(|words| words.checked_mul(all_rows?)?.checked_mul(4));
    let are_two = sets > 1 && expected.is_some_and(|bytes| Some(payload.len()) == bytes.checked_mul(2));
    let expected = if are_two { Some(payload.len()) } else { expected };
    let is_possible =
        (azimuths, sets) == (1, 1) || kind.are_kernels() && is_azimuth_count(azimuths) && (1..=count).contains(&sets);
    if !is_rim_power(rim_power) {
        return Err("has a header with a `rim_power` out of range".into());
    }
    if !base.iter().all(|term| term.is_finite()) {
        return Err("has a header with a `base` that is not of finite numbers".into());
    }
    if !(1..=kind.max_count()).contains(&count) {
        return Err(format!("has {count} threads, where there are 1 to {}", kind.max_count()));
    }
    if rows == 0 || !is_possible || expected != Some(payload.len()) {
        return Err("has a header that does not fit its content".into());
    }
    let words: Vec<u32> = payload.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let (first, second) = words.split_at(if are_two { words.len() / 2 } else { words.len() });
    Ok(match kind {
        ThreadKind::Fitted | ThreadKind::Gaussian => {
            let table = |words: &[u32], sets| -> Result<_, String> {
                let (of_rows, of_threads) = words.split_at(words_a_row * rows * azimuths);
                let table = FittedTable::from_file_words(of_rows, of_threads)?;
                Ok(FittedTable { rows, azimuths, count, sets, rim_power, base: BaseProfile(base), ..table })
            };
            let of_subpixels = are_two.then(|| table(second, sets).map(Box::new)).transpose()?;
            let table = table(first, if are_two { 1 } else { sets })?;
            let table = FittedTable { material, of_subpixels, ..table };
            if kind == ThreadKind::Fitted { Threads::Fitted(table) } else { Threads::Gaussian(table) }
        }
        ThreadKind::Paper => {
            let (of_rows, of_threads) = first.split_at(words_a_row * rows * azimuths);
            let table = ThreadTable::from_file_words(of_rows, of_threads)?;
            Threads::Paper(ThreadTable { rows, count, material, seed, rim_power, ..table })
        }
    })
}

#[cfg(test)]
mod tests {
    use super::super::{Sample, fitted::PackedKernel};
    use super::*;

    fn table() -> ThreadTable {
        let samples = (0..6).map(|i| Sample { theta: 0.2 * i as f32, phi: i as f32 - 3.0, p: 0.5 }).collect();
        ThreadTable {
            rows: 3,
            count: 2,
            seed: 9,
            material: "a \"name\"".into(),
            rim_power: -0.7,
            albedo: vec![[0.5; 3]; 3],
            samples,
        }
    }

    fn fitted() -> FittedTable {
        FittedTable {
            rows: 2,
            azimuths: 1,
            count: 1,
            sets: 1,
            material: "b".into(),
            rim_power: 0.3,
            base: BaseProfile([0.5, 1.0, -0.25, 0.0, 0.0, 0.0]),
            albedo: vec![[0.1, 0.2, 0.4]; 2],
            relative_error: vec![1e-3; 2],
            kernels: vec![PackedKernel([0x1234_5678, 0x3800_4000, 0x3400_3000]); 2],
            of_subpixels: None,
        }
    }

    /// Two threads, and two others in sets.
    fn in_sets() -> FittedTable {
        let two = FittedTable { count: 2, kernels: [fitted().kernels, fitted().kernels].concat(), ..fitted() };
        let of_subpixels = FittedTable {
            sets: 2,
            material: String::new(),
            relative_error: vec![2e-3; 2],
            kernels: vec![PackedKernel([0x4321_8765, 0x3000_3800, 0x3000_3400]); 4],
            ..two.clone()
        };
        FittedTable { of_subpixels: Some(Box::new(of_subpixels)), ..two }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.threads");
        let kernels = [Threads::Fitted(fitted()), Threads::Fitted(in_sets()), Threads::Gaussian(in_sets())];
        for threads in kernels.into_iter().chain([Threads::Paper(table())]) {
            write(&threads, &path).unwrap();
            assert_eq!(read(&path).unwrap(), threads);
        }
    }

    #[test]
    fn any_damage_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.threads");
        let good = encode(&Threads::Paper(table()));
        for length in 0..good.len() {
            assert!(decode(&good[..length]).is_err());
            let mut bad = good.clone();
            bad[length] ^= 0x10;
            assert!(decode(&bad).is_err());
        }
        std::fs::write(&path, &good[..good.len() - 1]).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.starts_with(&path.display().to_string()) && message.contains("damaged"), "{message}");
        assert!(read(&folder.path().join("absent.threads")).is_err());
    }

    #[test]
    fn a_sound_checksum_does_not_excuse_bad_numbers() {
        for bad in [
            Sample { theta: 2.0, phi: 0.0, p: 1.0 },
            Sample { theta: 0.1, phi: f32::NAN, p: 1.0 },
            Sample { theta: 0.1, phi: 0.0, p: 0.0 },
        ] {
            let mut table = table();
            table.samples[3] = bad;
            assert!(decode(&encode(&Threads::Paper(table))).unwrap_err().contains("sample"));
        }
    }

    #[test]
    fn an_unwritable_place_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent/a.threads");
        assert!(write(&Threads::Paper(table()), &path).unwrap_err().to_string().contains("cannot be written"));
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        assert!(write(&Threads::Paper(table()), &taken).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
