//! Pictures beside each other: materials (the paper's figure 13), and methods by their number of samples (figures 10 and 11).
use std::sync::Arc;

use image::RgbImage;

use super::Row;
use super::cases::{Cases, Estimator};
use super::sheet::{Sheet, Tile};
use super::sweep::Measured;
use super::tables::in_order;
use crate::brdf::Brdf;
use crate::error::Result;
use crate::memo::Memo;
use crate::pipeline::Wanted;
use crate::progress::{Observer, Parts};
use crate::scene::MaterialSource;
use crate::vulkan::Device;

/// A picture and what it is of, after which its file is named.
pub type Named = (String, RgbImage);

/// All materials of `cases`, each with its name, in front of the environment, built-in ones by family: a sheet for each environment and scene, called
/// `materials` if it is the only one. Methods and counts of `cases` are not looked at.
///
/// # Errors
/// The first material, environment or scene that cannot be used; whatever Vulkan refuses; cancelled.
pub fn material_sheets(
    cases: &Cases,
    estimator: Estimator,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
) -> Result<Vec<Named>> {
    let mut tiles = Vec::new();
    let places = Parts::new(cases.place_count(), observer);
    cases.for_each_place(memo, observer, &mut |place| {
        place.choose(estimator)?;
        place.prepared.show_environment = true;
        let renderer = place.renderer(device);
        place.prepared.show_environment = false;
        let rendering = renderer?.render(Wanted::DISPLAY, 1)?;
        let rgba = rendering.display.as_chunks::<4>().0;
        let width = place.prepared.view.width;
        let picture = RgbImage::from_fn(width, place.prepared.view.height, |x, y| {
            let [r, g, b, _] = rgba[(y * width + x) as usize];
            image::Rgb([r, g, b])
        });
        let of = format!("{}_{}", place.environment, place.scene);
        tiles.push((of, Tile { picture, caption: place.material.to_owned() }));
        places.advance()
    })?;
    let is_builtin = |name: &str| {
        cases.materials.iter().any(|(its, source)| its == name && matches!(source, MaterialSource::Builtin(_)))
    };
    let sheets = in_order(tiles.iter().map(|(of, _)| of.clone()));
    let sheet = |of: &String| {
        let tiles: Vec<_> = tiles.iter().filter(|(its, _)| its == of).map(|(_, tile)| tile.clone()).collect();
        let name = if sheets.len() == 1 { "materials".to_owned() } else { format!("materials_{of}") };
        (name, by_family(tiles, &is_builtin).draw())
    };
    Ok(sheets.iter().map(sheet).collect())
}

/// Built-in materials family by family, then the others: rows that begin with the name of the family. If all are of one, a square.
fn by_family(tiles: Vec<Tile>, is_builtin: &dyn Fn(&str) -> bool) -> Sheet {
    const COLUMNS: usize = 6;
    let families: Vec<_> = Brdf::builtin_families().collect();
    let family_of = |tile: &Tile| {
        let name = tile.caption.as_str();
        let family = families.iter().position(|(_, names)| is_builtin(name) && names.contains(&name));
        family.unwrap_or(families.len())
    };
    let mut groups = vec![Vec::new(); families.len() + 1];
    let columns = (tiles.len() as f64).sqrt().ceil() as usize;
    tiles.into_iter().for_each(|tile| groups[family_of(&tile)].push(tile));
    let labels = families.iter().map(|(family, _)| *family).chain(["files"]);
    let mut labelled: Vec<_> = labels.zip(groups).filter(|(_, group)| !group.is_empty()).collect();
    if labelled.len() < 2 {
        return Sheet::of(labelled.pop().map(|(_, group)| group).unwrap_or_default(), columns);
    }
    let rows = labelled.into_iter().flat_map(|(label, group)| {
        let mut rows = Sheet::of(group, COLUMNS).rows;
        rows[0].0 = label.to_owned();
        rows
    });
    Sheet { headings: Vec::new(), rows: rows.collect() }
}

/// For each place in `measured`, whose pictures were kept, a row for each method and a column for each count, with RMS below
/// each picture, and the reference as the last row; called after material, environment and scene.
pub fn comparison_sheets(measured: &Measured) -> Vec<Named> {
    let sheet = |(place, reference): &([String; 3], RgbImage)| {
        let [material, environment, scene] = place;
        let here = || {
            measured
                .rows
                .iter()
                .zip(&measured.pictures)
                .filter(|(row, _)| (&row.material, &row.environment, &row.scene) == (material, environment, scene))
        };
        let counts = in_order(here().map(|(row, _)| row.threads));
        let mut rows = Vec::new();
        for method in in_order(here().map(|(row, _)| &row.method)) {
            let tile = |count: &u32| {
                let (row, picture) = here().find(|(row, _)| row.method == *method && row.threads == *count)?;
                Some(Tile { picture: picture.clone(), caption: format!("RMS {:.4}", row.rms) })
            };
            rows.push((method.clone(), counts.iter().map(tile).collect()));
        }
        // Below the pictures that are the nearest to it.
        let mut last = vec![None; counts.len().saturating_sub(1)];
        last.push(Some(Tile { picture: reference.clone(), caption: String::new() }));
        rows.push(("reference".to_owned(), last));
        let headings = counts.iter().map(|count| format!("n = {count}")).collect();
        (place.join("_"), Sheet { headings, rows }.draw())
    };
    measured.references.iter().map(sheet).collect()
}

/// For each place in `measured`, whose pictures were kept, a picture by each method at the highest of its counts, with what it took and its
/// RMS below, and the reference; called after material, environment and scene, and `side_by_side`.
pub fn side_by_side_sheets(measured: &Measured) -> Vec<Named> {
    const COLUMNS: usize = 3;
    let sheet = |(place, reference): &([String; 3], RgbImage)| {
        let [material, environment, scene] = place;
        let all = measured.rows.iter().zip(&measured.pictures);
        let here =
            all.filter(|(row, _)| (&row.material, &row.environment, &row.scene) == (material, environment, scene));
        let best_of =
            |method: &String| here.clone().filter(|(row, _)| row.method == *method).max_by_key(|(row, _)| row.threads);
        let best = in_order(here.clone().map(|(row, _)| &row.method)).into_iter().filter_map(best_of);
        let tile = |(row, picture): (&Row, &RgbImage)| {
            let Row { method, threads, gpu_ms, rms, .. } = row;
            Tile { picture: picture.clone(), caption: format!("{method} {threads}: {gpu_ms:.2} ms, RMS {rms:.4}") }
        };
        let truth = Tile { picture: reference.clone(), caption: "reference".to_owned() };
        let tiles = best.map(tile).chain([truth]).collect();
        (format!("{}_side_by_side", place.join("_")), Sheet::of(tiles, COLUMNS).draw())
    };
    measured.references.iter().map(sheet).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_are_in_rows_of_their_families_and_few_kinds_in_a_square() {
        let tiles = |names: &[&str]| -> Vec<Tile> {
            let tile = |name: &&str| Tile { picture: RgbImage::new(4, 3), caption: (*name).to_owned() };
            names.iter().map(tile).collect()
        };
        let metals: Vec<_> = Brdf::builtin_families().find(|(family, _)| *family == "metals").unwrap().1;
        let all = [&["clay", "own-file", "porcelain"][..], &metals[..7]].concat();
        let sheet = by_family(tiles(&all), &|name| name != "porcelain");
        let rows: Vec<_> = sheet.rows.iter().map(|(label, cells)| (label.as_str(), cells.len())).collect();
        assert_eq!(rows, [("metals", 6), ("", 1), ("ceramics", 1), ("files", 2)]);
        let square = by_family(tiles(&metals[..4]), &|_| true);
        assert!(
            square.rows.len() == 2 && square.rows.iter().all(|(label, cells)| label.is_empty() && cells.len() == 2)
        );
    }
}
