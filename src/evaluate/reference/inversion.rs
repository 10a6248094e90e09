//! Inversion of piecewise constant and piecewise linear densities.

/// The step of a cumulative sum `edge(0) = 0 ..= edge(steps)` in which it reaches the part `mass` (0 to 1) of its whole, and how
/// far through that step's own mass. A step without mass is never chosen, unless none has any.
pub fn find_step(steps: usize, mass: f64, edge: impl Fn(usize) -> f64) -> (usize, f64) {
    let target = mass * edge(steps);
    // The last edge that is not above the target.
    let (mut low, mut size) = (0, steps);
    while size > 1 {
        let middle = low + size / 2;
        // A choice of values, not of ways: no branch to mispredict.
        low = if edge(middle) <= target { middle } else { low };
        size -= size / 2;
    }
    let (from, to) = (edge(low), edge(low + 1));
    (low, if to > from { ((target - from) / (to - from)).clamp(0.0, 1.0) } else { 0.5 })
}

/// Where in [0, 1] a density that goes linearly from `ends[0]` to `ends[1]` has the part `mass` of its whole behind it.
pub fn invert_ramp([start, end]: [f64; 2], mass: f64) -> f64 {
    let whole = start + end;
    // The root of start t + (end - start) t^2 / 2 = mass whole / 2 in the form that has no cancellation.
    let root = (start * start + (end - start) * whole * mass).max(0.0).sqrt();
    if start + root > 0.0 { (whole * mass / (start + root)).min(1.0) } else { mass }
}
