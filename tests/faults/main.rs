//! What may happen to the program from outside: it is killed, told to stop, not listened to; the disk is full, the cache of no use, the
//! device out of memory.
//!
//! `THREADLIGHT_FAULT_RUNS` is the number of random moments of each test that has such, in the place of a few.
#![cfg(target_os = "linux")]
#[path = "../common/mod.rs"]
mod common;
mod killed;
mod refused;

use common::{PROGRAM, device_flags, device_name};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use tempfile::TempDir;

/// Moments are of one process.
static ALONE: Mutex<()> = Mutex::new(());

/// A picture that takes as little as one can.
const RENDER: [&str; 11] = [
    "render",
    "--size",
    "48x36",
    "--threads",
    "1",
    "--material",
    "clay",
    "--environment",
    "light.hdr",
    "-o",
    "picture.png",
];

/// A folder with a small environment, the program's caches in it, and what it writes.
struct Place {
    folder: TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl Place {
    fn new() -> Self {
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().expect("a folder");
        let pixels = (0..32 * 16).flat_map(|i| [128, 64 + (i % 32) as u8, 40, 129]).collect::<Vec<u8>>();
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n";
        std::fs::write(folder.path().join("light.hdr"), [&header[..], &pixels].concat()).expect("a file");
        Self { folder, _alone }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Its cache.
    fn cache(&self) -> PathBuf {
        self.path("cache/threadlight")
    }

    /// `program` in this folder, with caches below it.
    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.folder).env("XDG_CACHE_HOME", self.path("cache"));
        for variable in ["THREADLIGHT_CACHE", "RUST_LOG", "DISPLAY", "WAYLAND_DISPLAY"] {
            command.env_remove(variable);
        }
        command
    }

    /// The program, on the test device where it takes one.
    fn threadlight(&self, arguments: &[&str]) -> Command {
        let mut command = self.command(PROGRAM);
        command.args(arguments);
        if arguments.first() == Some(&"render") {
            command.args(device_flags());
        }
        command
    }

    /// The picture where nothing happens.
    fn picture(&self) -> &'static [u8] {
        &self.undisturbed().0
    }

    /// The picture, and what is in the cache then; that of this place is empty.
    fn undisturbed(&self) -> &'static (Vec<u8>, Files) {
        static UNDISTURBED: OnceLock<(Vec<u8>, Files)> = OnceLock::new();
        UNDISTURBED.get_or_init(|| {
            let output = self.threadlight(&RENDER).output().expect("a process");
            assert!(output.status.success(), "{}", said(&output));
            let made = (std::fs::read(self.path("picture.png")).expect("a picture"), contents(&self.cache()));
            std::fs::remove_dir_all(self.path("cache")).expect("a cache");
            std::fs::remove_file(self.path("picture.png")).expect("a picture");
            made
        })
    }

    /// Fills the cache with all that a picture needs.
    fn fill_cache(&self) {
        // What has made it takes the folder of the cache away.
        let (_, files) = self.undisturbed();
        std::fs::create_dir_all(self.cache()).expect("a cache");
        for (name, bytes) in files {
            std::fs::write(self.cache().join(name), bytes).expect("a file");
        }
    }

    /// The same by a shell, behind some `words` of it.
    fn by_shell(&self, words: &str, arguments: &[&str]) -> Command {
        let direct = self.threadlight(arguments);
        let mut command = self.command("sh");
        command.args(["-c", &format!("{words}\"$@\""), "sh"]).arg(direct.get_program()).args(direct.get_args());
        command
    }
}

/// Every file in `folder`, by name.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Names of temporary files begin so.
const TEMPORARY: &str = ".threadlight-";

type Files = BTreeMap<String, Vec<u8>>;

/// What is in the files of `folder`, without what a killed writer left.
fn contents(folder: &Path) -> Files {
    let whole = names(folder).into_iter().filter(|name| !name.starts_with(TEMPORARY));
    whole.map(|name| (name.clone(), std::fs::read(folder.join(name)).unwrap_or_default())).collect()
}

/// What is on its standard error.
fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Numbers that look random: Steele, Lea and Flood's SplitMix64 (2014).
struct Random(u64);

impl Random {
    /// The next one, from 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }
}

/// The number of random moments of a test.
fn moments(few: u64) -> u64 {
    let runs = std::env::var("THREADLIGHT_FAULT_RUNS").ok();
    runs.map_or(few, |runs| runs.parse().expect("THREADLIGHT_FAULT_RUNS has to be a number"))
}
