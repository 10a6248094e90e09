//! SGD and ABC with the published fits of MERL materials: they leave the errors that are known of them.
use std::collections::HashMap;
use std::path::Path;

use super::*;
use crate::files::measured;

/// The rows of a table of comma-separated values: each a map from column to text.
fn rows(path: &Path) -> Option<Vec<HashMap<String, String>>> {
    let text = std::fs::read_to_string(path).ok()?;
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let columns = lines.next()?;
    Some(lines.map(|values| columns.iter().cloned().zip(values).collect()).collect())
}

/// The BRDF of a row: our keys, the columns that they are in, and whether there is one a channel.
fn fitted(model: &str, keys: &[(&str, &str, bool)], row: &HashMap<String, String>) -> Brdf {
    let number = |column: String| toml::Value::Float(row[&column].parse().unwrap());
    let value = |column: &str, is_colour: bool| match is_colour {
        true => toml::Value::Array(["r", "g", "b"].map(|channel| number(format!("{column}_{channel}"))).to_vec()),
        false => number(column.to_owned()),
    };
    let table = keys.iter().map(|(key, column, is_colour)| ((*key).to_owned(), value(column, *is_colour))).collect();
    Brdf::from_parameters(model, table).unwrap_or_else(|error| panic!("{}: {error}", row["material"]))
}

const SGD: &[(&str, &str, bool)] = &[
    ("diffuse", "rhoD", true),
    ("specular", "rhoS", true),
    ("alpha", "alpha", true),
    ("p", "p", true),
    ("f0", "F0", true),
    ("f1", "F1", true),
    ("kappa", "kappa", true),
    ("lambda", "lambda", true),
    ("c", "c", true),
    ("k", "k", true),
    ("theta_0", "theta0", true),
];

const ABC: &[(&str, &str, bool)] =
    &[("diffuse", "kD", true), ("a", "A", true), ("b", "B", false), ("c", "C", false), ("ior", "ior", false)];

/// Mean |ln(1 + f cos) - ln(1 + g cos)| over the slice phi_d = 90 degrees up to 80 degrees from the normal, channels averaged.
fn error(brdf: &Brdf, slice: &Path) -> Option<f64> {
    let bytes = std::fs::read(slice).ok()?;
    let values: Vec<f64> = bytes.as_chunks().0.iter().map(|&value| f64::from(f32::from_le_bytes(value))).collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for (cell, measured) in values.as_chunks::<3>().0.iter().enumerate() {
        // Rows of theta_d in degrees, columns of theta_h in its square-root bins.
        let theta_h = ((cell % 90) as f64 + 0.5).powi(2) / 8100.0 * FRAC_PI_2;
        let theta_d = ((cell / 90) as f64 + 0.5) / 90.0 * FRAC_PI_2;
        let cos = theta_h.cos() * theta_d.cos();
        if cos <= 80f64.to_radians().cos() || measured.iter().any(|value| *value < 0.0) {
            continue;
        }
        let w = |side: f64| dvec3(theta_d.cos() * theta_h.sin(), side * theta_d.sin(), cos);
        let f = brdf.evaluate(w(1.0), w(-1.0)).to_array();
        sum +=
            (0..3).map(|channel| ((1.0 + f[channel] * cos) / (1.0 + measured[channel] * cos)).ln().abs()).sum::<f64>();
        count += 3.0;
    }
    Some(sum / count)
}

#[test]
fn published_fits_leave_the_errors_that_are_known_of_them() {
    let (Some(_), Some(slices)) = (measured("params/sgd_merl.csv"), measured("merl/slices")) else { return };
    let known = [
        ("alumina-oxide", 0.108, 0.063),
        ("aluminium", 0.089, 0.058),
        ("beige-fabric", 0.0065, 0.0056),
        ("blue-metallic-paint", 0.012, 0.017),
        ("chrome", 0.159, 0.061),
        ("gold-metallic-paint", 0.018, 0.028),
    ];
    for (model, keys) in [("sgd", SGD), ("abc", ABC)] {
        let rows = rows(&measured(&format!("params/{model}_merl.csv")).expect("fits")).expect("a table");
        for row in &rows {
            let brdf = fitted(model, keys, row);
            let name = row["material"].as_str();
            // All of them are sound at hostile directions.
            for (w_i, w_o) in [
                (DVec3::Z, DVec3::Z),
                (dvec3(1.0, 0.0, 1e-9), dvec3(-1.0, 0.0, 1e-9)),
                (dvec3(0.0, 1.0, 1e-9), DVec3::Z),
            ] {
                let f = brdf.evaluate(w_i.normalize(), w_o.normalize());
                assert!(f.is_finite() && f.min_element() >= 0.0, "{model} {name}: {f}");
            }
            let Some((_, sgd, abc)) = known.iter().find(|(known, ..)| *known == name) else { continue };
            let expected = if model == "sgd" { *sgd } else { *abc };
            let found = error(&brdf, &slices.join(format!("{name}.slice"))).expect("a slice");
            println!("{model} {name}: {found:.4}, known {expected}");
            // Half of the last digit that is known.
            assert!((found - expected).abs() < 0.01 * expected + 5e-4, "{model} {name}: {found}, known {expected}");
        }
        assert!(rows.len() >= 40, "{model}: {} fits", rows.len());
    }
}
