//! The plots of the material that is shown, made in the background.
use std::sync::Arc;

use super::latest_job::LatestJob;
use crate::brdf::Brdf;
use crate::evaluate::material_curves::{LIGHTS, Side, albedo_angles_deg};
use crate::memo::{Key, Keyed};
use crate::progress::Observer;
use crate::{Error, Result};
use glam::DVec3;
use std::time::Duration;

/// How long a material has to stay before its albedo is found, which takes up to seconds of one core.
const STAY: Duration = Duration::from_millis(300);

/// What is drawn of a material.
#[derive(Clone, Debug)]
pub struct Plots {
    /// Of which material.
    pub key: Key,
    /// One for each azimuth that is plotted.
    pub sides: Vec<SidePlots>,
}

/// What is drawn of it from one azimuth.
#[derive(Clone, Debug)]
pub struct SidePlots {
    /// Degrees from the tangent; none of an isotropic material.
    pub azimuth_deg: Option<f64>,
    /// A lobe for each of [`LIGHTS`]: [`Side::lobe`].
    pub lobes: [Vec<[f64; 2]>; LIGHTS.len()],
    /// [`Side::image`].
    pub image: Vec<[u8; 3]>,
    /// View angles in degrees and albedos, as far as they are found.
    pub albedo: Vec<(f64, DVec3)>,
}

/// Makes the plots of the newest material: lobes and image at once, the albedo where the material stays.
pub struct Plotter {
    jobs: LatestJob<Plots>,
    begun: Option<Key>,
    latest: Option<Arc<Plots>>,
}

impl Plotter {
    /// Nothing is plotted yet. `wake` is called when there is something new to be drawn.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self { jobs: LatestJob::new("plots", wake), begun: None, latest: None }
    }

    /// Whether more is to come.
    pub fn is_busy(&self) -> bool {
        self.jobs.is_busy()
    }

    /// Makes nothing any more: [`LatestJob::close`].
    pub fn close(&self) {
        self.jobs.close();
    }

    /// The latest plots, which may be of the material before; begins those of `material` if they are not begun.
    pub fn of(&mut self, material: &Keyed<Brdf>) -> Option<&Arc<Plots>> {
        if self.begun != Some(material.key) {
            self.begun = Some(material.key);
            let material = material.clone();
            self.jobs.request(move |task| {
                plots(&material, &|plots| task.publish(plots), &|| task.rest(STAY), &|| task.cancelled())
            });
        }
        // What cannot be plotted leaves what was plotted before.
        while let Some(result) = self.jobs.take() {
            self.latest = result.ok().map(Arc::new).or(self.latest.take());
        }
        self.latest.as_ref()
    }
}

/// The plots of `material`; `publish` gets them without albedo, after which `rest` may end it.
fn plots(
    material: &Keyed<Brdf>,
    publish: &dyn Fn(Plots),
    rest: &dyn Fn() -> Result<()>,
    cancelled: &dyn Fn() -> bool,
) -> Result<Plots> {
    let sides = Side::of(material);
    let is_isotropic = sides.len() == 1;
    let of_side = |side: &Side| SidePlots {
        azimuth_deg: (!is_isotropic).then_some(side.azimuth_deg),
        lobes: LIGHTS.map(|(theta_i_deg, _)| side.lobe(theta_i_deg)),
        image: side.image(),
        albedo: Vec::new(),
    };
    let mut plots = Plots { key: material.key, sides: sides.iter().map(of_side).collect() };
    publish(plots.clone());
    rest()?;
    for (side, plotted) in sides.iter().zip(&mut plots.sides) {
        for theta_o_deg in albedo_angles_deg() {
            if cancelled() {
                return Err(Error::Cancelled);
            }
            plotted.albedo.push((theta_o_deg, side.albedo(theta_o_deg)));
        }
    }
    Ok(plots)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keyed(name: &str) -> Keyed<Brdf> {
        let brdf = Brdf::builtin(name).unwrap();
        Keyed::new(Key::of_digest(brdf.fingerprint()), brdf)
    }

    /// What `plotter` has of `material` when it has ended.
    fn ended(plotter: &mut Plotter, material: &Keyed<Brdf>) -> Arc<Plots> {
        plotter.of(material);
        while plotter.is_busy() {
            std::thread::sleep(Duration::from_millis(5));
            plotter.of(material);
        }
        plotter.of(material).unwrap().clone()
    }

    #[test]
    fn lobes_come_before_the_albedo_which_a_moving_slider_does_not_wait_for() {
        let clay = keyed("clay");
        let published = std::cell::RefCell::new(Vec::new());
        let moved = plots(&clay, &|plots| published.borrow_mut().push(plots), &|| Err(Error::Cancelled), &|| true);
        assert!(moved.is_err());
        let [first] = &published.borrow()[..] else { panic!("one") };
        assert!(first.sides[0].albedo.is_empty() && first.sides[0].lobes.iter().all(|lobe| lobe.len() > 1000));
    }

    #[test]
    fn plots_are_those_of_the_newest_material() {
        let mut plotter = Plotter::new(|| ());
        let (clay, steel) = (keyed("clay"), keyed("brushed-steel"));
        assert!(plotter.of(&steel).is_none_or(|plots| plots.key == steel.key));
        let plotted = ended(&mut plotter, &clay);
        assert_eq!((plotted.key, plotted.sides.len(), plotted.sides[0].azimuth_deg), (clay.key, 1, None));
        assert_eq!(plotted.sides[0].albedo.len(), albedo_angles_deg().count());
        // Asked again, nothing is made.
        plotter.of(&clay);
        assert!(!plotter.is_busy());
    }
}
