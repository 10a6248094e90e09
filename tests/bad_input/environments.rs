//! Environment files.
use crate::{noise, refuses, render, workplace};
use std::fs;

#[test]
fn hostile_environments_are_refused() {
    let folder = workplace();
    let hdr = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    let exr = |names: &[&str]| {
        use exr::prelude::*;
        let channels = names.iter().map(|&name| AnyChannel::new(name, FlatSamples::F32(vec![1.0; 8]))).collect();
        let channels = AnyChannels::sort(channels);
        let layer = Layer::new((4, 2), LayerAttributes::default(), Encoding::default(), channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    let colour = exr(&["R", "G", "B"]);
    for (name, bytes, reason) in [
        ("empty.hdr", vec![], "Radiance"),
        ("text.hdr", b"hello\n".to_vec(), "Radiance"),
        ("cut.hdr", [hdr("-Y 4 +X 8"), vec![128; 4 * 31]].concat(), "Radiance"),
        ("huge.hdr", hdr("-Y 1000000 +X 1000000"), "2^28"),
        ("none.hdr", hdr("-Y 0 +X 0"), "none.hdr"),
        // A header of some bytes must not ask for gigabytes.
        ("claims.hdr", hdr("-Y 16384 +X 16384"), "more than 16 pixels for each"),
        ("break.hdr", hdr("-Y 1\rX 1"), "break.hdr"),
        ("empty.exr", vec![], "EXR"),
        ("cut.exr", colour[..colour.len() - 9].to_vec(), "EXR"),
        ("head.exr", colour[..60].to_vec(), "EXR"),
        ("depth.exr", exr(&["Z"]), "R, G, B"),
        ("red.exr", exr(&["R", "A"]), "R, G, B"),
        (
            "beside.exr",
            with_windows(&colour, &["displayWindow"], [4, 0, 7, 1]),
            "data window is outside of its display window",
        ),
        ("map.jpg", b"hello".to_vec(), ".hdr"),
        ("noise.hdr", noise(4096), "Radiance"),
        (
            "claims.exr",
            with_windows(&colour, &["dataWindow", "displayWindow"], [0, 0, 15999, 15999]),
            "more than 1032 pixels for each",
        ),
        ("tiles.exr", with_large_tiles(), "more than 1032 pixels for each"),
        ("noise.exr", noise(4096), "EXR"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        refuses(&folder, &render(&format!("--environment {name}")), &[name, reason]);
    }
    for name in ["folder.hdr", "folder.exr"] {
        fs::create_dir(folder.path().join(name)).unwrap();
        refuses(&folder, &render(&format!("--environment {name}")), &[name]);
    }
    for name in ["missing.hdr", "missing.exr"] {
        refuses(&folder, &render(&format!("--environment {name}")), &[name]);
    }
}

/// An EXR whose header says that these windows have their first and last pixels at these places.
fn with_windows(exr: &[u8], windows: &[&str], corners: [i32; 4]) -> Vec<u8> {
    let mut bytes = exr.to_vec();
    for window in windows.iter().map(|window| format!("{window}\0box2i\0")) {
        let name = exr.windows(window.len()).position(|bytes| bytes == window.as_bytes()).expect("a window");
        // After the size of the value, 4 bytes.
        bytes[name + window.len() + 4..][..16].copy_from_slice(&corners.map(i32::to_le_bytes).concat());
    }
    bytes
}

/// An EXR of 4 x 2 pixels whose tiles say that they are 2 x 4 million.
fn with_large_tiles() -> Vec<u8> {
    use exr::prelude::*;
    let channel = |name| AnyChannel::new(name, FlatSamples::F32(vec![1.0; 8]));
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
    let encoding = Encoding { blocks: Blocks::Tiles(Vec2(2, 2)), ..Encoding::FAST_LOSSLESS };
    let mut bytes = std::io::Cursor::new(Vec::new());
    let layer = Layer::new((4, 2), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    let mut bytes = bytes.into_inner();
    let name = b"tiles\0tiledesc\0";
    let place = bytes.windows(name.len()).position(|window| window == name).expect("tiles");
    // After the size of the value and the width, 4 bytes each.
    bytes[place + name.len() + 8..][..4].copy_from_slice(&(1_u32 << 22).to_le_bytes());
    bytes
}
