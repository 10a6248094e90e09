//! Measurements of several files as those of one run.
use std::collections::HashMap;
use std::path::Path;

use super::Row;
use super::sweep::Settings;
use crate::error::{Error, Result};

/// All rows of `files`, in their order.
///
/// # Errors
/// A file that was measured with other settings than one before it, or that has a row of one before it.
pub fn merged<'a>(files: impl IntoIterator<Item = (&'a Path, Vec<Row>)>) -> Result<Vec<Row>> {
    // The first file of each scene with its settings, and the file of each row.
    let mut scenes: HashMap<String, (&Path, Option<Settings>)> = HashMap::new();
    let mut known: HashMap<([String; 4], u32), &Path> = HashMap::new();
    let mut all = Vec::new();
    for (path, rows) in files {
        for row in rows {
            let (first, settings) = scenes.entry(row.scene.clone()).or_insert_with(|| (path, row.settings.clone()));
            if *settings != row.settings {
                let text =
                    |settings: &Option<Settings>| settings.as_ref().map_or("unknown".to_owned(), Settings::to_string);
                let [here, there] = [&row.settings, &*settings].map(text);
                let problem = format!("was measured with other settings ({here}) than {} ({there})", first.display());
                return Err(Error::in_file(path, problem, "give files of one sweep"));
            }
            let Row { method, threads, material, environment, scene, .. } = &row;
            let names = [method, material, environment, scene].map(String::clone);
            if let Some(other) = known.insert((names, *threads), path) {
                let what = format!("{method} with {threads} of {material} in {environment} on {scene}");
                let problem = format!("has {what}, as {} has", other.display());
                return Err(Error::in_file(path, problem, "give each part of a sweep once"));
            }
            all.push(row);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(material: &str, width: u32) -> Row {
        let text = format!(
            r#"{{"method": "paper", "threads": 4, "material": "{material}", "environment": "e", "scene": "s", "rms": 0.1,
            "rms_linear": 0.1, "ssim": 0.9, "flip": 0.1, "max": 0.3, "nan": 0, "gpu_ms": 1, "frame_ms": 1, "lookups": 1,
            "settings": {{"width": {width}, "height": 60, "subpixels": 2, "seed": 0, "repeat": 3, "whole_picture": false}}}}"#
        );
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn parts_are_put_together_and_what_is_not_of_one_sweep_is_refused() {
        let merge =
            |second: Row| merged([(Path::new("a.json"), vec![row("gold", 80)]), (Path::new("b.json"), vec![second])]);
        let materials: Vec<_> = merge(row("clay", 80)).unwrap().into_iter().map(|row| row.material).collect();
        assert_eq!(materials, ["gold", "clay"]);
        for (second, names) in [
            (row("clay", 40), ["b.json", "40x60", "a.json", "80x60"]),
            (Row { settings: None, ..row("clay", 80) }, ["b.json", "unknown", "a.json", "80x60"]),
            (row("gold", 80), ["b.json", "paper with 4 of gold in e on s", "a.json", "once"]),
        ] {
            let error = merge(second).unwrap_err().to_string();
            assert!(names.iter().all(|name| error.contains(name)), "{error}");
        }
    }
}
