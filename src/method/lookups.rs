//! What shading methods look up.

/// What a method's shader looks up besides BRDFs and threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lookups {
    /// The box-filtered pyramid of the environment.
    pub box_filtered: bool,
    /// The environment blurred by the kernels of fitted threads, with what belongs to that.
    pub blurred: bool,
    /// The environment as it is, with the density of its light.
    pub map: bool,
    /// The alias table of that density.
    pub aliases: bool,
    /// CDFs of BRDFs.
    pub slices: bool,
    /// What the split sum has: the environment filtered by GGX and by the cosine, albedos of BRDFs, and how rough the nearest GGX is.
    pub split_sum: bool,
}
