//! What is read, one function a reader: its seeds, words that mean something to it, and the memory that it may take.
use std::path::Path;

use glam::{DVec3, dvec3};
use threadlight::low_level::brdf::{BaseProfile, Brdf};
use threadlight::low_level::device_check::Verdict;
use threadlight::low_level::environment::{Environment, LightMoments, Pyramid, VmfPyramid, moments_file, pyramid_file};
use threadlight::low_level::evaluate::{Row, reference};
use threadlight::low_level::picture::{ExrHeader, parse_image, write_exr, write_png};
use threadlight::low_level::scene::{Mesh, Scene};
use threadlight::low_level::threads::{self, FittedTable, Sample, ThreadTable, Threads, fitted::PackedKernel};

use crate::common;

pub struct Reader {
    /// A name with the extension that the reader goes by.
    pub file_name: &'static str,
    /// Whole files.
    pub seeds: fn() -> Vec<Vec<u8>>,
    pub words: &'static [&'static str],
    /// Makes the checksum right, without which nothing else is looked at.
    pub seal: Option<fn(&mut [u8])>,
    /// Memory for each byte of a file.
    pub bytes_per_byte: usize,
    /// Reads a file; the error is the reason why not. Panics if what is read is not sound.
    pub read: fn(&Path, &[u8]) -> Result<(), String>,
}

fn text(error: impl ToString) -> String {
    error.to_string()
}

/// The bytes that `write` leaves in a file of this name.
fn written(name: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    write(&path);
    std::fs::read(path).expect("a file")
}

/// Replaces the BLAKE3 digest at the end.
fn seal_end(bytes: &mut [u8]) {
    if let Some(content) = bytes.len().checked_sub(blake3::OUT_LEN) {
        let digest = blake3::hash(&bytes[..content]);
        bytes[content..].copy_from_slice(digest.as_bytes());
    }
}

/// Reads a material, and looks at it from all sides.
fn read_material(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let brdf = Brdf::FILES.parse(path, bytes).map_err(text)?;
    let (grazing, oblique) = (dvec3(1.0, 0.0, 1e-12), dvec3(-0.6, 0.48, 0.64));
    for (w_i, w_o) in
        [(DVec3::Z, DVec3::Z), (oblique, DVec3::Z), (DVec3::Z, oblique), (grazing, oblique), (oblique, grazing)]
    {
        let f = brdf.evaluate(w_i, w_o);
        assert!(f.is_finite() && f.min_element() >= 0.0, "{f}");
    }
    Ok(())
}

pub fn merl_table() -> Reader {
    Reader {
        file_name: "x.binary",
        seeds: || vec![common::merl_like_table()],
        words: &["\x5a\0\0\0", "\0\0\0\0"],
        seal: None,
        bytes_per_byte: 2,
        read: read_material,
    }
}

pub fn rgl_file() -> Reader {
    fn spectral() -> Vec<u8> {
        let spectra: Vec<f32> = (0..32).map(|i| 0.1 * (i % 5) as f32).collect();
        common::rgl_file(&[
            ("phi_i", &[1], &[0.0]),
            ("theta_i", &[2], &[0.1, 1.2]),
            ("ndf", &[2, 2], &[1.0; 4]),
            ("sigma", &[2, 3], &[0.5; 6]),
            ("vndf", &[1, 2, 3, 2], &[1.0; 12]),
            ("wavelengths", &[4], &[360.0, 500.0, 600.0, 1000.0]),
            ("spectra", &[1, 2, 4, 2, 2], &spectra),
        ])
    }
    fn anisotropic() -> Vec<u8> {
        include_bytes!("../rgl/half_turn_rgb.bsdf").to_vec()
    }
    Reader {
        file_name: "x.bsdf",
        seeds: || vec![common::rgl_like_file(), spectral(), anisotropic()],
        words: &["tensor_file\0", "theta_i", "vndf", "rgb", "spectra", "wavelengths", "\x01\0\0\0\0\0\0\0", "\0\0\0\0"],
        seal: None,
        bytes_per_byte: 16,
        read: read_material,
    }
}

pub fn mit_file() -> Reader {
    Reader {
        file_name: "x.dat",
        seeds: || vec![common::mit_like_file()],
        words: &["\0\0\0\0", "\x01\0\0\0", "\x03\0\0\0"],
        seal: None,
        bytes_per_byte: 2,
        read: read_material,
    }
}

pub fn utia_file() -> Reader {
    Reader {
        file_name: "x.bin",
        seeds: || {
            let values = (0..3 * 288 * 288).map(|index| 0.01 * f64::from(index % 13) - 0.02);
            vec![values.flat_map(f64::to_le_bytes).collect()]
        },
        words: &["\0\0\0\0\0\0\0\0"],
        seal: None,
        bytes_per_byte: 2,
        read: read_material,
    }
}

pub fn material() -> Reader {
    Reader {
        file_name: "x.toml",
        seeds: || {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/materials");
            let files = std::fs::read_dir(folder).expect("assets").map(|entry| entry.expect("a file").path());
            files.map(|file| std::fs::read(file).expect("a file")).collect()
        },
        words: &[
            "model = ",
            "'conductor'",
            "metal = 'Au'",
            "alpha = ",
            "= [",
            "[",
            "]",
            "{",
            "\n",
            "\"\"\"",
            "\\u0000",
            "nan",
            "[a.b]\n",
            "diffuse = ",
        ],
        seal: None,
        // What a coat sends back to its base is half a megabyte of tables, for 60 bytes of a file.
        bytes_per_byte: 10_000,
        read: read_material,
    }
}

pub fn mesh() -> Reader {
    Reader {
        file_name: "x.obj",
        seeds: || {
            let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvn 0 0 1\nvt 0 0\n";
            ["f 1 2 3\n", "o a\ng b\nf 1//1 2//1 4//1 3//1\n", "f -4/1/1 -3/1/-1 -2/1\n# end\nf 2 3 4\n"]
                .map(|faces| format!("{corners}{faces}").into_bytes())
                .into()
        },
        words: &[
            "\nv ",
            "\nvn ",
            "\nvt ",
            "\nf ",
            "\nl ",
            " 1",
            " -1",
            "//1",
            "/",
            " 0 0 0",
            "\r\n",
            "\r",
            "\\\n",
            "#",
            "\ns off\n",
            "\ns 2\n",
            "usemtl x\n",
        ],
        seal: None,
        bytes_per_byte: 400,
        read: |path, bytes| {
            let mesh = Mesh::FILES.parse(path, bytes).map_err(text)?;
            assert!(mesh.positions.iter().all(|position| position.is_finite()));
            assert!(mesh.normals.len() == mesh.positions.len() && mesh.indices.len() % 3 == 0);
            assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()));
            Ok(())
        },
    }
}

fn read_environment(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let environment = Environment::FILES.parse(path, bytes).map_err(text)?;
    let [width, height] = environment.size();
    assert_eq!(environment.texels().len(), width * height);
    assert!(environment.texels().as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
    Ok(())
}

pub fn hdr_environment() -> Reader {
    fn header(size: &str) -> Vec<u8> {
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n{size}\n").into_bytes()
    }
    const XYZ_BY_COLUMNS: &[u8] = b"#?RGBE\r\nFORMAT=32-bit_rle_xyze\r\nCOLORCORR=1 2 3\r\n\r\n-X 3 +Y 2\r\n";
    Reader {
        file_name: "x.hdr",
        seeds: || {
            let flat = [header("-Y 2 +X 3"), [128, 64, 32, 129].repeat(6)].concat();
            // Four channels of a run of 8 and of 8 single values each.
            let channel = [&[136, 100][..], &[8, 1, 2, 3, 4, 5, 6, 7, 8]].concat();
            let line = [&[2, 2, 0, 16][..], &channel.repeat(4)].concat();
            let runs = [header("-Y 2 +X 16"), line.repeat(2)].concat();
            vec![flat, runs, [XYZ_BY_COLUMNS, &[128, 64, 32, 129].repeat(6)].concat()]
        },
        words: &["-Y ", "+X ", "+Y ", "\n\n", "\r", "FORMAT=", "\x02\x02", "\x01\x01\x01", "#?RADIANCE\n", "16 "],
        seal: None,
        bytes_per_byte: 1000,
        read: read_environment,
    }
}

/// A picture of 4 x 2 pixels.
fn pixels() -> Vec<[f32; 4]> {
    (0..8).map(|i| [i as f32, 0.5, 0.25, 1.0]).collect()
}

/// Pictures in several compressions, as layers and channels come.
fn exr_files() -> Vec<Vec<u8>> {
    use exr::prelude::*;
    let encodings =
        [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::PIZ, Compression::PXR24];
    let encodings = encodings.map(|compression| Encoding { compression, ..Encoding::UNCOMPRESSED }).into_iter();
    let tiles = Encoding { blocks: Blocks::Tiles(Vec2(2, 2)), ..Encoding::SMALL_LOSSLESS };
    let file = |size: (usize, usize), encoding: Encoding, names: [&str; 3]| {
        let count = size.0 * size.1;
        let half = FlatSamples::F16(vec![f16::ONE; count]);
        let (single, whole) = (FlatSamples::F32(vec![0.5; count]), FlatSamples::U32(vec![1; count]));
        let channels = names.into_iter().zip([half, single, whole]);
        let channels = AnyChannels::sort(channels.map(|(name, samples)| AnyChannel::new(name, samples)).collect());
        let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).expect("memory");
        bytes.into_inner()
    };
    // Less is stored as it is, and DWA has no whole numbers for colours.
    let dwa = [Compression::DWAA(None), Compression::DWAB(None)]
        .map(|compression| file((16, 16), Encoding { compression, ..Encoding::UNCOMPRESSED }, ["A", "Y", "Z"]));
    encodings.chain([tiles]).map(|encoding| file((4, 2), encoding, ["B", "G", "R"])).chain(dwa).collect()
}

const EXR_WORDS: &[&str] = &[
    "channels\0chlist\0",
    "compression\0compression\0",
    "dataWindow\0box2i\0",
    "tiles\0tiledesc\0",
    "R\0",
    "\x01\0\0\0",
    "\0\0\0\0",
    "lineOrder\0lineOrder\0",
    "name\0string\0",
];

pub fn exr_environment() -> Reader {
    Reader {
        file_name: "x.exr",
        seeds: exr_files,
        words: EXR_WORDS,
        seal: None,
        bytes_per_byte: 700_000,
        read: read_environment,
    }
}

pub fn kept_reference() -> Reader {
    Reader {
        file_name: "x.reference.exr",
        seeds: || {
            let digest = blake3::hash(bytemuck::cast_slice(&pixels())).to_string();
            let numbers = ["error_estimate", "max_error_estimate", "evaluations", "covered_subpixels"];
            let numbers = numbers.map(|name| (name.to_owned(), "1".to_owned()));
            let more = numbers.into_iter().chain([("digest".to_owned(), digest)]).collect();
            let header = ExrHeader { more, ..ExrHeader::default() };
            vec![written("x.exr", |path| write_exr(path, 4, 2, &pixels(), true, &header).expect("a file"))]
        },
        words: EXR_WORDS,
        seal: None,
        bytes_per_byte: 700_000,
        read: |path, bytes| reference::parse(path, bytes, [4, 2]).map(drop).map_err(text),
    }
}

pub fn png_picture() -> Reader {
    Reader {
        file_name: "x.png",
        seeds: || {
            let rgba = [10, 20, 30, 40].repeat(12);
            let file = |alpha| written("x.png", |path| write_png(path, 4, 3, &rgba, alpha).expect("a file"));
            vec![file(false), file(true)]
        },
        words: &["IHDR", "IDAT", "IEND", "PLTE", "tRNS", "\0\0\0\x0d"],
        seal: None,
        bytes_per_byte: 40_000,
        read: |path, bytes| parse_image(path, bytes).map(drop).map_err(text),
    }
}

pub fn scene() -> Reader {
    Reader {
        file_name: "x.toml",
        seeds: || {
            vec![
                include_bytes!("../../assets/scenes/materials.toml").to_vec(),
                b"[camera]\neye = [1.5, 1.0, 3.5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y_deg = 36.0\n[environment]\nfile = 'x.hdr'\nrotation_deg = 1\n[shading]\nmethod = 'paper'\nthreads = 3\nseed = 1\n[[material]]\nname = 'm'\nmodel = 'lambert'\nreflectance = [1, 0.5, 0]\n[[object]]\nmesh = 'x.obj'\nmaterial = 'm'\nscale = 2".to_vec(),
            ]
        },
        words: &[
            "[image]\n",
            "[[object]]\n",
            "[[material]]\n",
            "[camera]\n",
            "width = ",
            "'",
            "\"",
            "[",
            "]",
            "{a=",
            "=",
            "\n",
            "#",
            ".",
            "mesh = 'x.obj'\n",
            "\u{e9}",
        ],
        seal: None,
        bytes_per_byte: 400,
        read: |path, bytes| {
            let scene = Scene::FILES.parse(path, bytes).map_err(text)?;
            // What was read can be written, and read again.
            let written = scene.to_toml(None).map_err(text)?;
            Scene::parse(&written, Path::new("")).map(drop).map_err(|error| panic!("{error}: {written}"))
        },
    }
}

pub fn threads() -> Reader {
    Reader {
        file_name: "x.threads",
        seeds: || {
            let samples = (0..6).map(|i| Sample { theta: 0.2 * i as f32, phi: i as f32 - 3.0, p: 0.5 }).collect();
            let material = "m".to_owned();
            let paper = ThreadTable {
                rows: 3,
                count: 2,
                seed: 9,
                material: material.clone(),
                rim_power: 1.0,
                albedo: vec![[0.5; 3]; 3],
                samples,
            };
            let fitted = |rows, azimuths| FittedTable {
                rows,
                azimuths,
                count: 2,
                sets: 2,
                material: material.clone(),
                rim_power: -0.5,
                base: BaseProfile([0.5, 1.0, -0.25, 0.0, 0.0, 0.0]),
                albedo: vec![[0.1, 0.2, 0.4]; rows * azimuths],
                relative_error: vec![1e-3; rows * azimuths],
                kernels: vec![PackedKernel([0x1234_5678, 0x3800_4000, 0x3400_3000]); 2 * rows * azimuths],
                of_subpixels: None,
            };
            let of_subpixels = Some(Box::new(FittedTable { material: String::new(), ..fitted(2, 1) }));
            let of_both = FittedTable { sets: 1, of_subpixels, ..fitted(2, 1) };
            let (isotropic, anisotropic) = (Threads::Fitted(of_both.clone()), Threads::Fitted(fitted(1, 19)));
            let file = |threads| written("x.threads", |path| threads::write(&threads, path).expect("a file"));
            vec![file(Threads::Paper(paper)), file(isotropic), file(anisotropic), file(Threads::Gaussian(of_both))]
        },
        words: &[
            "\"rows\":",
            "\"sets\":",
            "\"count\":",
            "\"method\":\"fitted\"",
            "18446744073709551615",
            "{",
            "[",
            "\"",
            ",",
            "\0\0\0\0",
        ],
        seal: Some(seal_end),
        bytes_per_byte: 16,
        read: |path, bytes| threads::parse(path, bytes).map(drop).map_err(text),
    }
}

fn environment() -> Environment {
    let picture = written("x.exr", |path| {
        write_exr(path, 4, 2, &pixels(), false, &ExrHeader::default()).expect("a file");
    });
    Environment::FILES.parse(Path::new("x.exr"), &picture).expect("a picture")
}

pub fn pyramid() -> Reader {
    Reader {
        file_name: "x.pyramid",
        seeds: || {
            let pyramid = VmfPyramid::new(&Pyramid::box_filtered(&environment()), &()).expect("a pyramid");
            vec![written("x.pyramid", |path| pyramid_file::VMF.write(path, &pyramid.levels).expect("a file"))]
        },
        words: &["VMFMAPS\0", "\x04\0\0\0", "\x10\0\0\0", "\0\0\0\0"],
        seal: Some(seal_end),
        bytes_per_byte: 4,
        read: |path, bytes| pyramid_file::VMF.parse(path, bytes).map(drop).map_err(text),
    }
}

pub fn moments() -> Reader {
    Reader {
        file_name: "x.moments",
        seeds: || {
            let moments = LightMoments::of(&environment(), 1, &()).expect("moments");
            vec![written("x.moments", |path| moments_file::write(path, &moments).expect("a file"))]
        },
        words: &["MOMENTS\0", "\x01\0\0\0", "\x06\0\0\0", "\0\0\0\0"],
        seal: Some(seal_end),
        // They are in memory as for bases of six terms.
        bytes_per_byte: 6,
        read: |path, bytes| moments_file::parse(path, bytes).map(drop).map_err(text),
    }
}

pub fn device_verdict() -> Reader {
    Reader {
        file_name: "x.device",
        seeds: || {
            let verdicts = [Verdict::Right, Verdict::Wrong("half \"floats\"".into())];
            verdicts.map(|verdict| serde_json::to_vec(&verdict).expect("JSON")).into()
        },
        words: &["{\"RightBy\":\"DrawWithCubeMaps\"}", "{", "[", "\"", ":", "\\u0000", "null"],
        seal: None,
        bytes_per_byte: 16,
        read: |path, bytes| Verdict::parse(path, bytes).map(drop).map_err(text),
    }
}

#[cfg(feature = "viewer")]
pub fn replay() -> Reader {
    Reader {
        file_name: "x.jsonl",
        seeds: || {
            let lines = [
                r#"{"drag": {"button": "left", "from": [320, 240], "by": [40, -10]}}"#,
                r#"{"move": [320, 240]}"#,
                r#"{"scroll": {"pixels": -40}}"#,
                r#"{"key": "f"}"#,
                r#"{"drop": "material.binary"}"#,
                r#"{"set": {"parameter": {"material": "gold", "key": "alpha", "value": 0.3}}}"#,
                r#"{"set": {"material": {"builtin": "silver"}}}"#,
                r#"{"set": {"camera": null}}"#,
                r#"{"compare": {"shading": {"method": "paper", "threads": 64}}}"#,
                "# a comment\n\n\"wait\"\n\"quit\"",
            ];
            vec![lines.join("\n").into_bytes()]
        },
        words: &["{", "[", "\"", "\n", "{\"set\": ", "null", ",", "\\ud800", "\"x\": "],
        seal: None,
        bytes_per_byte: 400,
        read: |path, bytes| {
            let text_of = std::str::from_utf8(bytes).map_err(|cause| format!("{}: {cause}", path.display()))?;
            threadlight::low_level::viewer::input::parse_replay(text_of, path).map(drop).map_err(text)
        },
    }
}

pub fn measurements() -> Reader {
    Reader {
        file_name: "x.json",
        seeds: || {
            let row = r#"{"method":"paper","threads":4,"material":"m","environment":"e","scene":"s","rms":0.1,"rms_linear":0.1,"ssim":0.9,"flip":0.1,"max":1,"nan":0,"gpu_ms":1,"frame_ms":2,"lookups":3,"covered_pixels":1,"shade_ms":1,"settings":{"width":4,"height":3,"subpixels":2,"seed":0,"repeat":3,"whole_picture":false}}"#;
            vec![format!("[{row},{row}]").into_bytes()]
        },
        words: &["{", "[", "\"", ",", "null", "\"rms\":"],
        seal: None,
        bytes_per_byte: 100,
        read: |path, bytes| {
            let rows = serde_json::from_slice::<Vec<Row>>(bytes);
            rows.map(drop).map_err(|cause| format!("{}: {cause}", path.display()))
        },
    }
}
