//! Material files: measured ones, and descriptions of models.
use crate::common;
use crate::{noise, refuses, render, workplace};
use std::fs;

/// Cells of a MERL table, and the bytes of its three planes.
const MERL_CELLS: usize = 90 * 90 * 180;

#[test]
fn hostile_measured_materials_are_refused() {
    let folder = workplace();
    let header = |dims: [i32; 3]| dims.map(i32::to_le_bytes).concat();
    let whole = |value: f64| [header([90, 90, 180]), value.to_le_bytes().repeat(3 * MERL_CELLS)].concat();
    let zeros = whole(0.0);
    let mut nan = zeros.clone();
    // Cells below the horizon, as the last one, mean nothing.
    nan.splice(12..20, f64::NAN.to_le_bytes());
    let mut infinite = whole(0.5);
    infinite.splice(20..28, f64::INFINITY.to_le_bytes());
    for (name, bytes, reason) in [
        ("missing", None, "cannot be read"),
        ("empty", Some(&b""[..]), "too short"),
        ("header", Some(&zeros[..11]), "too short"),
        ("cut", Some(&zeros[..zeros.len() - 1]), "bytes"),
        ("half", Some(&zeros[..zeros.len() / 2]), "bytes"),
        ("long", Some(&[&zeros[..], b"x"].concat()), "bytes"),
        ("dims", Some(&header([90, 90, 360])), "90 x 90 x 360"),
        ("negative_dims", Some(&header([-90, -90, 180])), "-90 x -90 x 180"),
        ("large_dims", Some(&header([i32::MAX; 3])), "2147483647"),
        ("zero", Some(&zeros), "zero"),
        ("negative", Some(&whole(-1.0)), "invalid"),
        ("nan", Some(&nan), "NaN"),
        ("infinite", Some(&infinite), "inf"),
    ] {
        let name = format!("{name}.binary");
        if let Some(bytes) = bytes {
            fs::write(folder.path().join(&name), bytes).unwrap();
        }
        refuses(&folder, &render(&format!("--material {name}")), &[&name, reason]);
    }
    refuses(&folder, "threads zero.binary --count 2 -o out/zero.threads", &["zero.binary"]);
}

#[test]
fn hostile_rgl_files_are_refused() {
    let folder = workplace();
    let good = common::rgl_like_file();
    let shape: &[u64] = &[1, 3, 2, 2];
    let with = |vndf: &[f32]| {
        common::rgl_file(&[("phi_i", &[1], &[0.0]), ("theta_i", &[3], &[0.0, 0.8, 1.4]), ("vndf", shape, vndf)])
    };
    let huge = common::rgl_file(&[("phi_i", &[u64::MAX], &[0.0])]);
    for (name, bytes, reason) in [
        ("missing", None, "cannot be read"),
        ("empty", Some(&b""[..]), "no tensor file"),
        ("header", Some(&good[..30]), "ends within its list"),
        ("cut", Some(&good[..good.len() - 1]), "ends before its field rgb"),
        ("huge", Some(&huge), "ends before its field phi_i"),
        ("zero", Some(&with(&[0.0; 12])), "nothing but zeros"),
        ("nan", Some(&with(&[f32::NAN; 12])), "NaN"),
        ("azimuths", Some(&common::rgl_file(&[("phi_i", &[2], &[0.0; 2])])), "phi_i that does not ascend"),
        ("noise", Some(&noise(4096)), "no tensor file"),
    ] {
        let name = format!("{name}.bsdf");
        if let Some(bytes) = bytes {
            fs::write(folder.path().join(&name), bytes).unwrap();
        }
        refuses(&folder, &render(&format!("--material {name}")), &[&name, reason]);
    }
}

#[test]
fn hostile_goniometric_files_are_refused() {
    let folder = workplace();
    for (name, bytes, reason) in [
        ("empty.bin", vec![], "1990656"),
        ("cut.bin", vec![0; 3 * 8 * 288 * 288 - 1], "1990656"),
        ("zero.bin", vec![0; 3 * 8 * 288 * 288], "nothing but zero"),
        ("nan.bin", vec![0xff; 3 * 8 * 288 * 288], "NaN in plane 0"),
        ("empty.dat", vec![], "too short"),
        ("zero.dat", vec![0; 64], "parameterisation 0"),
        ("noise.dat", noise(4096), "parameterisation"),
        ("cut.dat", common::mit_like_file()[..100].to_vec(), "bytes behind its header"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        refuses(&folder, &render(&format!("--material {name}")), &[name, reason]);
    }
}

#[test]
fn materials_that_have_no_table_and_no_nearest_model_are_refused() {
    let folder = workplace();
    fs::write(folder.path().join("black.toml"), "model = 'lambert'\nreflectance = 0").unwrap();
    refuses(&folder, "materials export black.toml -o out/black.binary", &["black.toml", "nothing but zero"]);
    refuses(&folder, "materials fit black.toml --model lambert -o out/fit.toml", &["black.toml", "is black"]);
    refuses(&folder, "materials export silk -o out/silk.binary", &["silk", "anisotropic"]);
    refuses(&folder, "materials fit silk --model ggx -o out/fit.toml", &["silk", "anisotropic"]);
}

#[test]
fn hostile_material_descriptions_are_refused() {
    let folder = workplace();
    for (name, text, key) in [
        ("empty.toml", "", "model"),
        ("syntax.toml", "model = ", "TOML"),
        ("comma.toml", "model = 'lambert'\nreflectance = 0,5", "line 2 (`reflectance = 0,5`)"),
        ("model.toml", "model = 'wood'", "wood"),
        ("number.toml", "model = 3", "model"),
        ("unknown.toml", "model = 'lambert'\nreflectance = 0.5\nshine = 1", "shine"),
        ("missing.toml", "model = 'lambert'", "reflectance"),
        ("range.toml", "model = 'lambert'\nreflectance = [0.5, 0.5, 1.5]", "reflectance"),
        ("nan.toml", "model = 'lambert'\nreflectance = nan", "reflectance"),
        ("rgb.toml", "model = 'lambert'\nreflectance = [0.5, 0.5]", "reflectance"),
        ("kind.toml", "model = 'conductor'\ndistribution = 'phong'\nalpha = 0.1\neta = 1\nk = 1", "distribution"),
        ("alpha.toml", "model = 'conductor'\ndistribution = 'ggx'\nalpha = 0\neta = 1\nk = 1", "alpha"),
        ("material.jpg", "", "material.jpg"),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        refuses(&folder, &render(&format!("--material {name}")), &[name, key]);
    }
    fs::write(folder.path().join("noise.toml"), noise(256)).unwrap();
    refuses(&folder, &render("--material noise.toml"), &["noise.toml"]);
}
