//! Pictures beside each other: materials (the paper's figure 13), and methods by their number of samples (figures 10 and 11).
use std::sync::Arc;

use image::RgbImage;

use super::cases::{Cases, Estimator};
use super::sheet::{Sheet, Tile};
use super::sweep::Measured;
use super::tables::in_order;
use crate::error::{Error, Result};
use crate::memo::Memo;
use crate::pipeline::Wanted;
use crate::progress::Observer;
use crate::vulkan::Device;

/// A picture and what it is of: good as the name of its file, without extension.
pub type Named = (String, RgbImage);

/// All materials of `cases`, each with its name, in front of the environment: a sheet for each environment and scene, called
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
    observer.progress(0, cases.place_count());
    cases.for_each_place(memo, observer, &mut |place| {
        place.choose(estimator)?;
        place.prepared.show_environment = true;
        let renderer = place.renderer(device);
        place.prepared.show_environment = false;
        let rendering = renderer?.render(Wanted { display: true, ..Wanted::default() }, 1)?;
        let rgba = rendering.display.as_chunks::<4>().0;
        let width = place.prepared.view.width;
        let picture = RgbImage::from_fn(width, place.prepared.view.height, |x, y| {
            let [r, g, b, _] = rgba[(y * width + x) as usize];
            image::Rgb([r, g, b])
        });
        let of = format!("{}_{}", place.environment, place.scene);
        tiles.push((of, Tile { picture, caption: place.material.to_owned() }));
        observer.progress(tiles.len(), cases.place_count());
        if observer.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    })?;
    let sheets = in_order(tiles.iter().map(|(of, _)| of.clone()));
    let sheet = |of: &String| {
        let tiles: Vec<_> = tiles.iter().filter(|(its, _)| its == of).map(|(_, tile)| tile.clone()).collect();
        let columns = (tiles.len() as f64).sqrt().ceil() as usize;
        let name = if sheets.len() == 1 { "materials".to_owned() } else { format!("materials_{of}") };
        (name, Sheet::of(tiles, columns).draw())
    };
    Ok(sheets.iter().map(sheet).collect())
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
