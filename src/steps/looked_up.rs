//! What shading looks up of a material, besides its threads.
use super::fit::FitSplitSum;
use super::load::{Tabulate, TabulateSlices};
use crate::Result;
use crate::brdf::Brdf;
use crate::memo::{Keyed, Round};
use crate::method::Method;
use crate::threads::{SliceTable, SplitSum};

/// What a method looks up of one material; none of what it does not.
pub struct LookedUp {
    /// The table of a BRDF that [has one](Brdf::has_table), where BRDFs are evaluated.
    pub table: Option<Keyed<Brdf>>,
    /// For methods that draw samples by the BRDF.
    pub slices: Option<Keyed<SliceTable>>,
    /// For the method of this name.
    pub split_sum: Option<Keyed<SplitSum>>,
}

impl LookedUp {
    /// Asks `round` for what `method` looks up of `brdf`, evaluating it or not.
    ///
    /// # Errors
    /// Cancelled.
    pub fn ask(round: &Round, method: Method, brdf: &Keyed<Brdf>, evaluates_brdf: bool) -> Result<Self> {
        let lookups = method.lookups();
        Ok(Self {
            table: (evaluates_brdf && brdf.has_table()).then(|| round.ask(&Tabulate(brdf))).transpose()?,
            slices: lookups.slices.then(|| round.ask(&TabulateSlices(brdf))).transpose()?,
            split_sum: lookups.split_sum.then(|| round.ask(&FitSplitSum(brdf))).transpose()?,
        })
    }
}
