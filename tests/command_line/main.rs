//! The program as its user meets it: pictures, statistics, cache, scene files, help.
//!
//! Renders on the device that THREADLIGHT_TEST_DEVICE names, or else on the one that the program prefers, always validated.
#[path = "../common/mod.rs"]
mod common;
mod pictures;
mod text;

use assert_cmd::Command;
use common::{device_flags, own_cache, program, program_with_cache};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use threadlight::low_level::method::{Method, Pattern};
use threadlight::low_level::picture::{PictureFile, read_image};
use threadlight::low_level::scene::{ImageSettings, MaterialSource, Scene, ShadingSettings, Source};

/// What makes a render quick: few pixels, few threads, and an environment that takes no time.
const SMALL: &str = "--size 96x72 --threads 8 --environment map.hdr";

/// A folder with a small environment in it, `map.hdr`: different in all directions.
fn workplace() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    // Mantissas between 100 and 255; exponent 128 stands for 2^0 / 256.
    map.extend((0..128_u32).flat_map(|i| [100 + i as u8, 200 - (i * i % 97) as u8, 100 + (i * 7 % 101) as u8, 128]));
    fs::write(folder.path().join("map.hdr"), map).unwrap();
    folder
}

/// The program in `folder`, with `arguments` separated by spaces, and the cache of all tests if there is one.
fn threadlight(folder: &TempDir, arguments: &str) -> Command {
    let mut command = Command::from_std(program(folder));
    command.args(arguments.split(' ').filter(|argument| !argument.is_empty()));
    command
}

/// `render` with validation on the device to test on.
fn render(folder: &TempDir, arguments: &str) -> Command {
    let mut command = threadlight(folder, &format!("render --validate {arguments}"));
    command.args(device_flags());
    command
}

/// The same with a cache that is its own.
fn render_by_own_cache(folder: &TempDir, arguments: &str) -> Command {
    let mut command = render(folder, arguments);
    command.env("THREADLIGHT_CACHE", own_cache(folder));
    command
}

fn bytes(folder: &TempDir, name: &str) -> Vec<u8> {
    fs::read(folder.path().join(name)).unwrap()
}

fn picture(folder: &TempDir, name: &str) -> PictureFile {
    read_image(&folder.path().join(name)).unwrap()
}

/// The value at `column`, `row` of a picture.
fn at(picture: &PictureFile, column: u32, row: u32) -> [f32; 4] {
    picture.rgba[(row * picture.width + column) as usize]
}

fn stats(folder: &TempDir, name: &str) -> Value {
    serde_json::from_slice(&bytes(folder, name)).unwrap()
}

/// What a command printed; it must succeed and have nothing to complain about.
fn printed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && complaints.is_empty(), "{complaints}");
    String::from_utf8(output.stdout).unwrap()
}
