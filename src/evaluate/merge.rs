//! Measurements of several files as those of one run.
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::Row;
use super::cases::Shard;
use super::sweep::Settings;
use crate::error::{Error, Result};

/// All rows of `files`, in their order, as those of a whole sweep.
///
/// # Errors
/// A file that was measured with other settings than one before it, or that has a row of one before it; a part of a sweep that is missing, or
/// that was interrupted.
pub fn merged<'a>(files: impl IntoIterator<Item = (&'a Path, Vec<Row>)>) -> Result<Vec<Row>> {
    // The first file of each scene with its settings, and the file of each row.
    let mut scenes: HashMap<String, (&Path, Settings)> = HashMap::new();
    let mut known: HashMap<([String; 4], u32), &Path> = HashMap::new();
    // Of which part each row of a method and count on a scene is, where so many parts have so many combinations of materials and environments.
    let mut parts: BTreeMap<(String, u32, String, usize, usize), Vec<Shard>> = BTreeMap::new();
    let mut all = Vec::new();
    for (path, rows) in files {
        for row in rows {
            let (first, settings) = scenes.entry(row.scene.clone()).or_insert_with(|| (path, row.settings.clone()));
            if *settings != row.settings {
                let (here, there) = (&row.settings, &*settings);
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
            if let Some((shard, combinations)) = row.shard.zip(row.combinations) {
                if shard.count > combinations {
                    let problem = format!("has part {shard} of a sweep of {combinations} combinations");
                    return Err(Error::in_file(
                        path,
                        problem,
                        "give a file that `threadlight bench error --json` wrote",
                    ));
                }
                let of = (method.clone(), *threads, scene.clone(), shard.count, combinations);
                parts.entry(of).or_default().push(shard);
            }
            // Together they are a whole one.
            all.push(Row { shard: row.combinations.map(|_| Shard::WHOLE), ..row });
        }
    }
    for ((method, threads, scene, count, combinations), there) in parts {
        for shard in Shard::all(count) {
            let rows = there.iter().filter(|part| **part == shard).count();
            let wanted = shard.of(combinations).len();
            if rows < wanted {
                let extent = if rows == 0 { String::new() } else { format!("{} of the {wanted} of ", wanted - rows) };
                let problem = format!("lack {extent}{shard} of {method} with {threads} on {scene}");
                let remedy = match shard {
                    Shard::WHOLE => "measure the sweep to its end".to_owned(),
                    part => format!("measure it with --shard {part}, and give all parts"),
                };
                return Err(Error::input("the parts of a sweep", problem, remedy));
            }
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
            "covered_pixels": 1, "shade_ms": 1,
            "settings": {{"width": {width}, "height": 60, "subpixels": 2, "seed": 0, "repeat": 3, "whole_picture": false}}}}"#
        );
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn a_part_that_is_missing_is_named() {
        let part = |material: &str, shard: &str| {
            let shard: Shard = shard.parse().unwrap();
            Row { shard: Some(shard), combinations: Some(shard.count), ..row(material, 80) }
        };
        let merge = |rows: Vec<Row>| merged([(Path::new("a.json"), rows)]);
        let all = [part("gold", "1/3"), part("clay", "2/3"), part("satin", "3/3")];
        assert!(merge(all.to_vec()).unwrap().iter().all(|row| row.shard == Some(Shard::WHOLE)));
        for (missing, name) in ["1/3", "2/3", "3/3"].iter().enumerate() {
            let mut rows = all.to_vec();
            rows.remove(missing);
            // What was not shared has no parts.
            rows.push(row("chalk", 80));
            let error = merge(rows).unwrap_err().to_string();
            assert!(error.contains(&format!("lack {name} of paper with 4 on s")), "{error}");
        }
        // Of five combinations the first of three parts has one, the others have two.
        let of_five = |row: &Row| Row { combinations: Some(5), ..row.clone() };
        let interrupted = all.each_ref().map(of_five);
        let second = of_five(&part("rubber", "2/3"));
        let error = merge([&interrupted[..], &[second]].concat()).unwrap_err().to_string();
        assert!(error.contains("lack 1 of the 2 of 3/3 of paper with 4 on s"), "{error}");
        let rest = ["2/3", "3/3"].map(|shard| of_five(&part(shard, shard)));
        assert!(merge([&interrupted[..], &rest].concat()).unwrap().iter().all(|row| row.combinations == Some(5)));
        let alone = Row { combinations: Some(2), ..part("gold", "1/1") };
        let error = merge(vec![alone]).unwrap_err().to_string();
        assert!(error.contains("lack 1 of the 2 of 1/1 of paper") && error.contains("to its end"), "{error}");
        let error = merge(vec![Row { combinations: Some(1), ..part("gold", "1/99999999999999999") }]).unwrap_err();
        assert!(error.to_string().contains("part 1/99999999999999999 of a sweep of 1 comb"), "{error}");
        // Another method may have been shared by others.
        let of_two = |shard: &str| Row { method: "fitted".into(), ..part("gold", shard) };
        assert!(merge([&all[..], &[of_two("1/2")]].concat()).is_err());
        let other = Row { material: "clay".into(), ..of_two("2/2") };
        assert!(merge([&all[..], &[of_two("1/2"), other]].concat()).is_ok());
    }

    #[test]
    fn parts_are_put_together_and_what_is_not_of_one_sweep_is_refused() {
        let merge =
            |second: Row| merged([(Path::new("a.json"), vec![row("gold", 80)]), (Path::new("b.json"), vec![second])]);
        let materials: Vec<_> = merge(row("clay", 80)).unwrap().into_iter().map(|row| row.material).collect();
        assert_eq!(materials, ["gold", "clay"]);
        for (second, names) in [
            (row("clay", 40), ["b.json", "40x60", "a.json", "80x60"]),
            (row("gold", 80), ["b.json", "paper with 4 of gold in e on s", "a.json", "once"]),
        ] {
            let error = merge(second).unwrap_err().to_string();
            assert!(names.iter().all(|name| error.contains(name)), "{error}");
        }
    }
}
