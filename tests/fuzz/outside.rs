//! Readers that take more than a function: the program, which reads its standard input, and a device, which reads its pipeline cache.
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, OnceLock};

use threadlight::low_level::vulkan::{Device, PipelineCache};

use crate::common::{bare_device, program};
use crate::readers::Reader;

/// The program's name and arguments follow: it ends if it takes more than a second of the processor's time, or 2 GiB of addresses. Of these clay takes
/// less than 128 MiB on two cores; allocators reserve more for each further one.
const LIMITS: &str = "ulimit -t 1 && ulimit -v 2097152 && exec \"$0\" \"$@\"";

/// `program` within [`LIMITS`], which are those of Unix.
fn limited(program: &Command) -> Command {
    let mut limited = Command::new("sh");
    limited.args(["-c", LIMITS]).arg(program.get_program());
    if let Some(folder) = program.get_current_dir() {
        limited.current_dir(folder);
    }
    for (name, value) in program.get_envs() {
        match value {
            Some(value) => limited.env(name, value),
            None => limited.env_remove(name),
        };
    }
    limited
}

/// Gives the program `bytes` on its standard input; the error is what it says.
fn evaluate(arguments: &[&str], bytes: &[u8]) -> Result<(), String> {
    let mut program = limited(&program(env!("CARGO_TARGET_TMPDIR")))
        .args(["materials", "evaluate", "clay"])
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program");
    let mut input = program.stdin.take().expect("piped");
    // What it refuses it does not read to the end.
    let writer = std::thread::spawn({
        let bytes = bytes.to_owned();
        move || input.write_all(&bytes)
    });
    let output = program.wait_with_output().expect("an end");
    drop(writer.join());
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    match output.status.code() {
        Some(0) => {
            let written = String::from_utf8(output.stdout).expect("UTF-8");
            let mut numbers = written.split_whitespace().map(|number| number.parse::<f64>().expect("a number"));
            assert!(numbers.all(|number| number.is_finite() && number >= 0.0), "{written}");
            assert!(said.is_empty(), "{said}");
            Ok(())
        }
        Some(2) => Err(said.trim_end_matches('\n').to_owned()),
        code => panic!("{code:?}: {said}"),
    }
}

pub fn evaluated_angles() -> Reader {
    Reader {
        file_name: "standard input",
        seeds: || vec![b"# theta_i theta_o phi\n30 30 180\n\n0 0 0\n 89.9 1e-3 -720 45\n".to_vec()],
        words: &["180", " 90 ", "-1", "nan", "1e308", "inf", "\n", "\r\n", "#", "\t", "0x1", "\u{2003}"],
        seal: None,
        bytes_per_byte: 100,
        read: |_, bytes| evaluate(&[], bytes),
    }
}

pub fn evaluated_directions() -> Reader {
    Reader {
        file_name: "standard input",
        seeds: || vec![b"0.6 0 0.8 -0.6 0 0.8\n0 0 1 0 0 1\n1 0 0 0 0 -1\n".to_vec()],
        words: &["0.6", "-1", "nan", "1e-320", "1e308", "\n", " 0 0 1", "#"],
        seal: None,
        bytes_per_byte: 100,
        read: |_, bytes| evaluate(&["--directions"], bytes),
    }
}

/// A device, and the file in which it keeps its pipelines.
fn device() -> &'static (Arc<Device>, PathBuf) {
    static DEVICE: OnceLock<(Arc<Device>, PathBuf)> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let device = bare_device();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz");
        // Nothing is in it but that file.
        let _ = std::fs::remove_dir_all(&folder);
        drop(PipelineCache::new(&device, Some(&folder)).expect("a cache"));
        let file = std::fs::read_dir(&folder).expect("a folder").next().expect("a file").expect("a file").path();
        (device, file)
    })
}

/// Whatever is in the file, the device has a cache, and the file is whole afterwards. What a driver makes of a file with a right checksum
/// is the driver's.
pub fn pipeline_cache() -> Reader {
    Reader {
        file_name: "pipelines.bin",
        seeds: || vec![std::fs::read(&device().1).expect("a file")],
        words: &["\0\0\0\0", "\x20\0\0\0", "\x01\0\0\0"],
        seal: None,
        bytes_per_byte: 8,
        read: |_, bytes| {
            let (device, file) = device();
            std::fs::write(file, bytes).expect("a file");
            drop(PipelineCache::new(device, file.parent()).expect("a cache"));
            let kept = std::fs::read(file).expect("a file");
            let (contents, checksum) = kept.split_last_chunk::<{ blake3::OUT_LEN }>().expect("a checksum");
            assert!(blake3::hash(contents) == *checksum);
            Ok(())
        },
    }
}
