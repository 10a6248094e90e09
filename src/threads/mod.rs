//! Sample threads: where the k-th incident sample lies, for every view angle (Kim, Kyung and Lee 2010, section 3.2).
//!
//! | paper | module |
//! |---|---|
//! | equation (4), the pdf of one view | [`mod@slice`] |
//! | equations (5), (6), cones | [`cones`] |
//! | equations (8) to (10), forces | [`forces`] |
//! | 3.2.2, smoothing | [`smoothing`] |
//! | 3.2.3, peaks | [`peaks`] |
//! | the whole | [`generate()`] |
//! | beyond it: azimuths of the view, for anisotropic BRDFs | [`azimuths`] |
//! | beyond it: threads fitted to the BRDF | [`fitted`] |
//! | beyond it: how albedos rise or fall in the last degree | [`rim`] |
//! | beside it: the split sum of engines | [`split_sum`] |
use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::brdf::{Brdf, LobeShape, MAX_THETA_O_DEG, MaterialRecord, luminance};
use crate::error::{Error, Result};
use crate::progress::Observer;

pub mod azimuths;
pub mod cones;
mod file;
pub mod fitted;
pub mod forces;
mod generate;
pub mod peaks;
mod plot;
pub mod rim;
pub mod slice;
pub mod slice_table;
pub mod smoothing;
pub mod split_sum;
mod table;
#[cfg(test)]
pub(crate) mod test_materials;

pub use file::{FORMAT_VERSION, parse, read, write};
pub use fitted::{FittedTable, GivingWay};
pub use plot::plot;

pub use slice_table::SliceTable;
pub use split_sum::SplitSum;
pub use table::{Sample, ThreadTable};

/// The lobe of a BRDF as it is shaded.
#[derive(Clone, Copy)]
pub struct ShadedLobe<'a> {
    /// The lobe.
    pub lobe: &'a LobeShape,
    /// By which threads, for methods that have any.
    pub threads: Option<&'a Threads>,
}

/// Lowest n . s of a sample: 0.006 degrees above the horizon, a thousand times what rounding theta to single precision moves
/// it by, and far below what any view angle of a table needs.
pub const MIN_COS: f64 = 1e-4;

/// Most of the paper's threads that a table can have.
pub const MAX_COUNT: usize = 1024;
/// Most view angles of a table: of more the last but one would be beyond the last, [`MAX_THETA_O_DEG`].
pub const MAX_ROWS: usize = 9000;

/// Which threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThreadKind {
    /// Fitted to the BRDF: [`fitted`].
    #[default]
    Fitted,
    /// The paper's.
    Paper,
    /// Gaussians fitted to the BRDF itself, not to its answers to lights: else as [`Self::Fitted`].
    Gaussian,
}

impl ThreadKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Fitted, Self::Paper, Self::Gaussian];

    /// Whether they are kernels of the blurred environment, a [`FittedTable`].
    pub fn are_kernels(self) -> bool {
        self != Self::Paper
    }

    /// What files call it, and the method that shades by it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fitted => "fitted",
            Self::Paper => "paper",
            Self::Gaussian => "gaussian",
        }
    }

    /// The number of threads where nobody asks for another: the paper's; fitted ones do with fewer.
    pub fn default_count(self) -> usize {
        match self {
            Self::Fitted | Self::Gaussian => 16,
            Self::Paper => 100,
        }
    }

    /// Most threads that a table can have.
    pub fn max_count(self) -> usize {
        match self {
            Self::Fitted | Self::Gaussian => fitted::MAX_COUNT,
            Self::Paper => MAX_COUNT,
        }
    }
}

/// Threads of any kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Threads {
    /// Fitted to the BRDF.
    Fitted(FittedTable),
    /// The paper's.
    Paper(ThreadTable),
    /// Gaussians fitted to the BRDF itself.
    Gaussian(FittedTable),
}

impl Threads {
    /// Which they are.
    pub fn kind(&self) -> ThreadKind {
        match self {
            Self::Fitted(_) => ThreadKind::Fitted,
            Self::Gaussian(_) => ThreadKind::Gaussian,
            Self::Paper(_) => ThreadKind::Paper,
        }
    }

    /// Deviation of the normals within a pixel, in radians, up to which its sub-pixels share one sum over these threads, where the lobe is this
    /// one and the view is along the normals: 0 if they do so only where they are nearly flat.
    pub fn shared_deviation(&self, lobe: &LobeShape) -> f64 {
        self.fitted().map_or(0.0, |table| fitted::shared_deviation(lobe, table))
    }

    /// Where these, if they are kernels of a BRDF of this lobe, give way to the BRDF beside small bright lights.
    pub fn giving_way(&self, lobe: &LobeShape) -> Option<GivingWay> {
        self.fitted().map(|table| GivingWay::of(lobe, table))
    }

    /// The record of a BRDF of this lobe, with what shading by these threads goes by.
    pub fn in_record(&self, record: MaterialRecord, lobe: &LobeShape) -> MaterialRecord {
        let record = MaterialRecord { rim_power: self.rim_power(), ..record };
        let Some(GivingWay { lobe_radius_rad, clear }) = self.giving_way(lobe) else { return record };
        let shared_deviation = self.shared_deviation(lobe) as f32;
        let base = self.fitted().map_or(record.base, |table| table.base);
        MaterialRecord { shared_deviation, lobe_radius: lobe_radius_rad as f32, clear, base, ..record }
    }

    /// Whether albedos do not go evenly from the last row but one to the last.
    pub(crate) fn has_uneven_rim(&self) -> bool {
        self.rim_power() != rim::EVEN
    }

    /// How albedos go from the last row but one to the last: [`rim::rim_power`].
    fn rim_power(&self) -> f32 {
        match self {
            Self::Fitted(table) | Self::Gaussian(table) => table.rim_power,
            Self::Paper(table) => table.rim_power,
        }
    }

    /// These, if they are kernels: fitted, or Gaussians.
    pub fn fitted(&self) -> Option<&FittedTable> {
        match self {
            Self::Fitted(table) | Self::Gaussian(table) => Some(table),
            Self::Paper(_) => None,
        }
    }

    /// Number of view angles and of threads.
    pub fn size(&self) -> [usize; 2] {
        match self {
            Self::Fitted(table) | Self::Gaussian(table) => [table.rows, table.count],
            Self::Paper(table) => [table.rows, table.count],
        }
    }

    /// Where `thread` looks in `row`, unit, in the shading frame.
    ///
    /// # Panics
    /// There are not so many rows or threads: [`Self::size`] has their numbers.
    pub fn direction(&self, row: usize, thread: usize) -> DVec3 {
        match self {
            Self::Fitted(table) | Self::Gaussian(table) => table.row(row)[thread].unpack().direction().as_dvec3(),
            Self::Paper(table) => table.row(row)[thread].direction(),
        }
    }

    /// Where each thread looks for the view angle `theta_o` and its azimuth `phi_o` from the tangent (radians), unit, in the shading frame,
    /// and which share of the light that is looked up it has: between rows as shading has them.
    pub fn seen_from(&self, theta_o: f64, phi_o: f64) -> Vec<(DVec3, f64)> {
        let count = self.size()[1];
        match self {
            Self::Fitted(table) | Self::Gaussian(table) => {
                let kernels = table.seen_from(theta_o, phi_o).into_iter();
                let kernels: Vec<_> = kernels.map(|kernel| (kernel.direction, luminance(kernel.weight))).collect();
                let total: f64 = kernels.iter().map(|(_, weight)| weight).sum();
                let share = |weight: f64| if total > 0.0 { weight / total } else { 1.0 / count as f64 };
                kernels.into_iter().map(|(direction, weight)| (direction, share(weight))).collect()
            }
            Self::Paper(table) => {
                (0..count).map(|thread| (table.interpolate(theta_o, thread).0, 1.0 / count as f64)).collect()
            }
        }
    }

    /// The same, with this name of the material.
    pub fn of_material(mut self, name: &str) -> Self {
        match &mut self {
            Self::Fitted(table) | Self::Gaussian(table) => name.clone_into(&mut table.material),
            Self::Paper(table) => name.clone_into(&mut table.material),
        }
        self
    }
}

/// The threads of `brdf`. `observer` hears of rows and may cancel.
///
/// # Errors
/// [`Error::Cancelled`]; settings that ask for no threads, no rows or too many.
pub fn generate(brdf: &Brdf, settings: &ThreadSettings, observer: &dyn Observer) -> Result<Threads> {
    Ok(match settings.kind {
        ThreadKind::Fitted => Threads::Fitted(fitted::generate(brdf, settings, observer)?),
        ThreadKind::Gaussian => Threads::Gaussian(fitted::generate(brdf, settings, observer)?),
        ThreadKind::Paper => Threads::Paper(generate::generate(brdf, settings, observer)?),
    })
}

/// What threads to make; together with the BRDF it determines the table to the last bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThreadSettings {
    /// Which they are.
    pub kind: ThreadKind,
    /// Number of threads m, 1 to [`ThreadKind::max_count`].
    pub count: usize,
    /// Number of view angles, evenly spaced from 0 to 90 degrees, but the last of them is 89.99; 1 to [`MAX_ROWS`], the paper's is 90.
    pub rows: usize,
    /// Where the first row's points start.
    pub seed: u64,
    /// How many sets the fitted threads or Gaussians of sub-pixels are made in, each of which does alone: thread k is of set k % `sets`.
    /// Whole pixels may have others, which are not. The paper's need no sets.
    pub sets: usize,
}

impl Default for ThreadSettings {
    fn default() -> Self {
        Self { kind: ThreadKind::default(), count: ThreadKind::default().default_count(), rows: 91, seed: 0, sets: 1 }
    }
}

impl ThreadSettings {
    /// The same, but as many as a picture of a BRDF of this lobe with `subpixels` x `subpixels` to the pixel has for them, and in as many sets.
    pub fn for_picture(self, lobe: &LobeShape, subpixels: u32) -> Self {
        if !self.kind.are_kernels() {
            return Self { sets: 1, ..self };
        }
        let [count, sets] = fitted::count_and_sets(lobe, self.count, subpixels);
        Self { count, sets, ..self }
    }

    /// Errors where there is nothing or too much to make.
    fn check(&self) -> Result<()> {
        let most = self.kind.max_count();
        if !(1..=most).contains(&self.count) {
            let problem = format!("{} is not possible for method \"{}\"", self.count, self.kind.name());
            return Err(Error::input("threads", problem, format!("use a number from 1 to {most}")));
        }
        if !(1..=self.count).contains(&self.sets) {
            let problem = format!("{} are not possible for {} threads", self.sets, self.count);
            return Err(Error::input("sets", problem, "use at least 1, and no more than threads"));
        }
        if !(1..=MAX_ROWS).contains(&self.rows) {
            let problem = format!("{} is not possible", self.rows);
            return Err(Error::input(
                "rows",
                problem,
                format!("use a number from 1 to {MAX_ROWS}; 91 are a degree apart"),
            ));
        }
        Ok(())
    }
}

/// View angle of `row` of `rows` in radians: even steps from 0 to a right angle, where the last is
/// [`MAX_THETA_O_DEG`], the largest there is.
fn theta_o(row: usize, rows: usize) -> f64 {
    let right_angles = row as f64 / (rows - 1).max(1) as f64;
    (right_angles * FRAC_PI_2).min(MAX_THETA_O_DEG.to_radians())
}

/// Where the view angle `theta_o` (radians) is among `rows`: the row below, the row above, and the part of the way between them.
fn rows_around(theta_o: f64, rows: usize) -> (usize, usize, f64) {
    let last = rows - 1;
    let position = (theta_o / FRAC_PI_2 * last as f64).clamp(0.0, last as f64);
    (position as usize, (position as usize + 1).min(last), position.fract())
}
