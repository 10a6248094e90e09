//! Measurements as text, in the layout of the paper's tables 2 to 4: a row for each method, a column for each count.
use std::collections::BTreeSet;
use std::fmt::Write;

use super::Row;

/// A table for each material where there are several (the paper's tables 2 and 3), and one over all of them (table 4).
///
/// Each has the mean RMS and SSIM over its environments and scenes; the last also FLIP, the largest RMS of any material,
/// environment and scene, and the mean time on the GPU.
pub fn tables(rows: &[Row]) -> String {
    let materials = in_order(rows.iter().map(|row| &row.material));
    let places = in_order(rows.iter().map(|row| (&row.environment, &row.scene))).len();
    let over_places = if places == 1 { String::new() } else { format!(", mean over {places} lights and scenes") };
    let rms_and_ssim =
        |rows: &[&Row]| table("RMS", rows, mean, |row| row.rms, 5) + &table("SSIM", rows, mean, |row| row.ssim, 5);
    let mut text = String::new();
    let title = match materials.as_slice() {
        [] => return text,
        [only] => (*only).clone(),
        several => {
            for material in several {
                let rows: Vec<_> = rows.iter().filter(|row| row.material == **material).collect();
                text += &format!("{material}{over_places}\n{}\n", rms_and_ssim(&rows));
            }
            format!("mean of {} materials", several.len())
        }
    };
    let rows: Vec<_> = rows.iter().collect();
    text += &format!("{title}{over_places}\n{}", rms_and_ssim(&rows));
    text += &table("FLIP", &rows, mean, |row| row.flip, 5);
    text += &table("RMS, worst", &rows, largest, |row| row.rms, 5);
    text += &table("GPU ms", &rows, mean, |row| row.gpu_ms, 3);
    text
}

/// A line for each method and a column for each count of `summary` of `value`.
fn table(
    title: &str,
    rows: &[&Row],
    summary: impl Fn(&[f64]) -> f64,
    value: impl Fn(&Row) -> f64,
    decimals: usize,
) -> String {
    let counts: BTreeSet<u32> = rows.iter().map(|row| row.threads).collect();
    let mut text = format!("  {title:<14}");
    for count in &counts {
        let _ = write!(text, "{count:>10}");
    }
    text.push('\n');
    for method in in_order(rows.iter().map(|row| &row.method)) {
        let _ = write!(text, "  {method:<14}");
        for count in &counts {
            let here = rows.iter().filter(|row| row.method == *method && row.threads == *count);
            let values: Vec<f64> = here.map(|row| value(row)).collect();
            let _ = match values.is_empty() {
                true => write!(text, "{:>10}", "-"),
                false => write!(text, "{:>10.decimals$}", summary(&values)),
            };
        }
        text.push('\n');
    }
    text
}

/// Arithmetic mean.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Each value once, in the order in which they first come.
pub(super) fn in_order<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Made-up measurements of two methods, three counts, two materials and two environments.
    pub(in super::super) fn rows() -> Vec<Row> {
        let mut rows = Vec::new();
        for (material, harder) in [("matt", 1.0), ("shiny", 3.0)] {
            for (environment, brighter) in [("sky", 1.0), ("sun", 2.0)] {
                for (method, power, cost) in [("paper", -0.7, 0.11), ("uniform", -0.5, 0.07)] {
                    for threads in [1, 16, 100] {
                        let rms = 0.1 * harder * brighter * f64::from(threads).powf(power);
                        rows.push(Row {
                            method: method.into(),
                            threads,
                            material: material.into(),
                            environment: environment.into(),
                            scene: "sphere".into(),
                            rms,
                            rms_linear: 2.0 * rms,
                            ssim: 1.0 - rms,
                            flip: 1.5 * rms,
                            max: 4.0 * rms,
                            nan: 0,
                            gpu_ms: 0.5 + cost * f64::from(threads),
                            frame_ms: 1.0 + cost * f64::from(threads),
                            lookups: u64::from(threads) * 1000,
                        });
                    }
                }
            }
        }
        rows
    }

    #[test]
    fn tables_have_the_means_by_method_and_count() {
        let text = tables(&rows());
        let expected = "\
matt, mean over 2 lights and scenes
  RMS                    1        16       100
  paper            0.15000   0.02154   0.00597
  uniform          0.15000   0.03750   0.01500
  SSIM                   1        16       100
  paper            0.85000   0.97846   0.99403
  uniform          0.85000   0.96250   0.98500

shiny";
        assert!(text.starts_with(expected), "{text}");
        let expected = "
mean of 2 materials, mean over 2 lights and scenes
  RMS                    1        16       100
  paper            0.30000   0.04308   0.01194
  uniform          0.30000   0.07500   0.03000
";
        assert!(text.contains(expected), "{text}");
        let expected = "
  RMS, worst             1        16       100
  paper            0.60000   0.08615   0.02389
  uniform          0.60000   0.15000   0.06000
  GPU ms                 1        16       100
  paper              0.610     2.260    11.500
  uniform            0.570     1.620     7.500
";
        assert!(text.ends_with(expected), "{text}");
    }

    #[test]
    fn what_was_not_measured_is_a_dash() {
        let rows: Vec<_> = rows().into_iter().filter(|row| row.method != "paper" || row.threads != 16).collect();
        assert!(tables(&rows).contains("  paper            0.15000         -   0.00597\n"));
        assert_eq!(tables(&[]), "");
    }

    #[test]
    fn a_single_material_has_one_table() {
        let rows: Vec<_> =
            rows().into_iter().filter(|row| row.material == "shiny" && row.environment == "sun").collect();
        let text = tables(&rows);
        assert!(text.starts_with("shiny\n  RMS  ") && text.matches("  RMS  ").count() == 1, "{text}");
    }

    #[test]
    fn the_json_of_a_row_has_exactly_the_documented_fields() {
        let json = serde_json::to_string(&rows()[0]).unwrap();
        let names = [
            "method",
            "threads",
            "material",
            "environment",
            "scene",
            "rms",
            "rms_linear",
            "ssim",
            "flip",
            "max",
            "nan",
            "gpu_ms",
            "frame_ms",
            "lookups",
        ];
        let places: Vec<_> = names.iter().map(|name| json.find(&format!("\"{name}\":")).unwrap()).collect();
        assert!(places.is_sorted(), "{json}");
        assert_eq!(json.matches("\":").count(), names.len(), "{json}");
        assert_eq!(serde_json::from_str::<Row>(&json).unwrap(), rows()[0]);
    }
}
