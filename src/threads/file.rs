//! The `.threads` file: a thread table on disk.
//!
//! Little-endian throughout:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `THREADS\0` |
//! | 4 | u32 format version, now 2 |
//! | 4 | u32 length H of the header |
//! | H | header, JSON: `method` ("paper"), `material`, `count`, `rows`, `seed` |
//! | 12 rows | albedo of each row as three f32, linear Rec. 709 |
//! | 12 rows count | samples as three f32 theta, phi (radians), p (1/sr); thread k of row r is sample r count + k |
//! | 32 | BLAKE3 digest of everything before |
//!
//! Row r is for the view angle theta_o = r 90 deg / rows; theta and phi are in the frame whose z is the normal and in which
//! w_o = (sin theta_o, 0, cos theta_o).
use std::f32::consts::FRAC_PI_2;
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Sample, ThreadTable};
use crate::error::{Error, Result};

/// Version of the file format and of the threads in it: to be raised when either changes, since caches depend on it.
pub const FORMAT_VERSION: u32 = 2;

const MAGIC: &[u8; 8] = b"THREADS\0";
const DIGEST_BYTES: usize = blake3::OUT_LEN;

#[derive(Serialize, Deserialize)]
struct Header {
    method: String,
    material: String,
    count: usize,
    rows: usize,
    seed: u64,
}

/// Writes `table` to `path`, whole or not at all.
pub fn write(table: &ThreadTable, path: &Path) -> Result<()> {
    let unwritable = |cause: std::io::Error| Error::unwritable(path, cause);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(unwritable)?;
    file.write_all(&encode(table)).map_err(unwritable)?;
    file.persist(path).map_err(|error| unwritable(error.error))?;
    Ok(())
}

/// Reads a table back. Errors: unreadable, not a thread file, of another version, damaged.
pub fn read(path: &Path) -> Result<ThreadTable> {
    let bytes = std::fs::read(path).map_err(|cause| Error::unreadable(path, cause))?;
    decode(&bytes).map_err(|problem| Error::in_file(path, problem, "generate it again"))
}

fn encode(table: &ThreadTable) -> Vec<u8> {
    let (count, rows, seed) = (table.count, table.rows, table.seed);
    let header = Header { method: "paper".into(), material: table.material.clone(), count, rows, seed };
    let header = serde_json::to_vec(&header).expect("a header of strings and numbers is always JSON");
    let mut bytes = MAGIC.to_vec();
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend((header.len() as u32).to_le_bytes());
    bytes.extend(header);
    bytes.extend_from_slice(bytemuck::cast_slice(&to_little_endian(table.albedo.as_flattened())));
    let samples = table.samples.iter().flat_map(|s| [s.theta, s.phi, s.p]).collect::<Vec<_>>();
    bytes.extend_from_slice(bytemuck::cast_slice(&to_little_endian(&samples)));
    let digest = blake3::hash(&bytes);
    bytes.extend(digest.as_bytes());
    bytes
}

fn decode(bytes: &[u8]) -> Result<ThreadTable, String> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("is not a thread file")?;
    let (&version, rest) = rest.split_first_chunk().ok_or("is cut short")?;
    let version = u32::from_le_bytes(version);
    if version != FORMAT_VERSION {
        return Err(format!("has format version {version}, this program reads {FORMAT_VERSION}"));
    }
    let content = bytes.len().checked_sub(DIGEST_BYTES).ok_or("is cut short")?;
    if blake3::hash(&bytes[..content]).as_bytes() != &bytes[content..] {
        return Err("is damaged (its checksum does not match)".into());
    }
    let rest = &rest[..rest.len().checked_sub(DIGEST_BYTES).ok_or("is cut short")?];
    let (&length, rest) = rest.split_first_chunk().ok_or("is cut short")?;
    let (header, payload) = rest.split_at_checked(u32::from_le_bytes(length) as usize).ok_or("is cut short")?;
    let header: Header = serde_json::from_slice(header).map_err(|error| format!("has a bad header ({error})"))?;
    // Of three numbers each: a row's albedo, and its samples.
    let expected = header.count.checked_add(1).and_then(|per_row| per_row.checked_mul(header.rows)?.checked_mul(12));
    if header.method != "paper" || header.count == 0 || header.rows == 0 || expected != Some(payload.len()) {
        return Err("has a header that does not fit its content".into());
    }
    let values = payload.as_chunks().0.iter().map(|&value| f32::from_le_bytes(value)).collect::<Vec<f32>>();
    let (albedo, samples) = values.as_chunks().0.split_at(header.rows);
    let samples: Vec<Sample> = samples.iter().map(|&[theta, phi, p]| Sample { theta, phi, p }).collect();
    // A foreign writer can get the checksum right and a number wrong.
    let is_usable =
        |s: &Sample| (0.0..FRAC_PI_2).contains(&s.theta) && s.phi.is_finite() && s.p > 0.0 && s.p.is_finite();
    if !samples.iter().all(is_usable) {
        return Err("holds a sample below the horizon or without a pdf".into());
    }
    if !albedo.as_flattened().iter().all(|value| (0.0..=f32::MAX).contains(value)) {
        return Err("holds an albedo that is none".into());
    }
    let Header { material, count, rows, seed, .. } = header;
    Ok(ThreadTable { rows, count, seed, material, albedo: albedo.to_vec(), samples })
}

fn to_little_endian(values: &[f32]) -> Vec<[u8; 4]> {
    values.iter().map(|value| value.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ThreadTable {
        let samples = (0..6).map(|i| Sample { theta: 0.2 * i as f32, phi: i as f32 - 3.0, p: 0.5 }).collect();
        ThreadTable { rows: 3, count: 2, seed: 9, material: "a \"name\"".into(), albedo: vec![[0.5; 3]; 3], samples }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.threads");
        write(&table(), &path).unwrap();
        assert_eq!(read(&path).unwrap(), table());
    }

    #[test]
    fn any_damage_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.threads");
        let good = encode(&table());
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
            assert!(decode(&encode(&table)).unwrap_err().contains("sample"));
        }
    }

    #[test]
    fn an_unwritable_place_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent/a.threads");
        assert!(write(&table(), &path).unwrap_err().to_string().contains("cannot be written"));
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        assert!(write(&table(), &taken).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
