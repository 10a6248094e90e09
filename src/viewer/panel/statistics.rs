//! What frames cost: time by pass, lookups, memory; and on what.
use super::group;
use crate::viewer::interaction::Viewer;
use egui::{Color32, Rect, Sense, Ui, vec2};

pub fn show(ui: &mut Ui, viewer: &Viewer) {
    let measured = &viewer.measured;
    group(ui, "Statistics", |ui| {
        times(ui, viewer);
        egui::Grid::new("statistics").num_columns(2).show(ui, |ui| {
            let mut row = |name: &str, value: String, tooltip: &str| {
                ui.label(name).on_hover_text(tooltip);
                ui.label(value).on_hover_text(tooltip);
                ui.end_row();
            };
            let [width, height] = measured.size;
            row("frame", format!("{:.1} ms", measured.frame.as_secs_f64() * 1e3), "From the start of the last frame until it was handed to the window.");
            if let (Some(median), Some(latest)) = (viewer.latency.shown_ms(0.5), viewer.latency.answers().back()) {
                row("input", format!("{median:.0} ms"), "From an input to the frame that shows it: median of the latest.");
                let finished = latest.finished_ms.map_or_else(String::new, |ms| format!(", finished {ms:.0} ms"));
                row("latest input", format!("{:.0} ms{finished}", latest.shown_ms), "The same of the latest one; where that frame shows threads that are only drafts, also to the frame with finished ones.");
            }
            row("picture", format!("{width} x {height}"), "Pixels of the last frame: fewer than the window has while it moves, where it would be slow.");
            if let Some((counters, lookups)) = measured.counted {
                let pixels = counters.interior_pixels + counters.edge_pixels;
                row("pixels", format!("{} interior, {} edge", counters.interior_pixels, counters.edge_pixels), "Pixels that see one smooth surface and share one sum over the threads, and those at edges, where each sub-pixel sums.");
                let each = lookups as f64 / f64::from(pixels.max(1));
                row("lookups", format!("{:.2} M, {each:.1} a pixel", lookups as f64 * 1e-6), "Lookups in the environment that shading made.");
            }
            let mib = viewer.device().allocated_bytes() as f64 / f64::from(1 << 20);
            row("memory", format!("{mib:.0} MiB"), "Device memory handed out to buffers and images.");
            row("frames", measured.frames.to_string(), "Frames drawn so far: none is drawn when nothing has changed.");
        });
        let description = viewer.device().description();
        ui.label(&description.name)
            .on_hover_text(format!("{}, Vulkan {}", description.driver, description.api_version));
    });
}

/// A bar for each pass, as long as it takes.
fn times(ui: &mut Ui, viewer: &Viewer) {
    let (passes, ran) = (&viewer.measured.passes, &viewer.measured.ran);
    let longest = passes.iter().map(|pass| pass.gpu_ms).fold(1e-3, f64::max);
    for pass in passes.iter().filter(|pass| !pass.is_readback()) {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 15.0), Sense::hover());
        let share = (pass.gpu_ms / longest) as f32;
        let bar = Rect::from_min_size(rect.min, vec2(rect.width() * share, rect.height() - 2.0));
        let has_run = ran.contains(&pass.name);
        let fill = if has_run { Color32::from_rgb(0, 92, 128) } else { Color32::from_gray(45) };
        ui.painter().rect_filled(bar, 2.0, fill);
        let font = egui::FontId::proportional(11.0);
        let color = if has_run { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
        ui.painter().text(
            rect.left_center(),
            egui::Align2::LEFT_CENTER,
            format!(" {}", pass.name),
            font.clone(),
            color,
        );
        let ms = if has_run { format!("{:.2} ms ", pass.gpu_ms) } else { "still good ".to_owned() };
        ui.painter().text(rect.right_center(), egui::Align2::RIGHT_CENTER, ms, font, color);
        response.on_hover_text("Time of this pass on the GPU. What it makes is kept: it runs only when something that it depends on has changed.");
    }
}
