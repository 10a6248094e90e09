//! Tables and means over the cosine to the normal, in steps that are dense where surfaces graze.
use std::iter::Sum;
use std::ops::{Add, Div, Mul};

/// The value of `table` at a cosine, linear between those at (i / (n - 1))^2.
pub(super) fn at_cosine<T: Copy + Add<Output = T> + Mul<f64, Output = T>>(table: &[T], cos_theta: f64) -> T {
    let position = cos_theta.clamp(0.0, 1.0).sqrt() * (table.len() - 1) as f64;
    let first = (position as usize).min(table.len() - 2);
    let part = position - first as f64;
    table[first] * (1.0 - part) + table[first + 1] * part
}

/// The mean of `f` under even light: its integral over 2 c dc for cosines c of 0 to 1, by the midpoint rule over sqrt(c) in so many steps.
pub(super) fn mean_under_even_light<T>(steps: usize, f: impl Fn(f64) -> T) -> T
where
    T: Mul<f64, Output = T> + Div<f64, Output = T> + Sum,
{
    let term = |i: usize| {
        let t = (i as f64 + 0.5) / steps as f64;
        f(t * t) * (4.0 * t * t * t)
    };
    (0..steps).map(term).sum::<T>() / steps as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_integrals_over_the_hemisphere_and_tables_are_linear_in_the_root() {
        assert!((mean_under_even_light(512, |cos| cos) - 2.0 / 3.0).abs() < 1e-5);
        let root: Vec<f64> = (0..9).map(|i| f64::from(i) / 8.0).collect();
        assert!([0.0, 0.01, 0.3, 1.0].iter().all(|&cos| (at_cosine(&root, cos) - cos.sqrt()).abs() < 1e-12));
    }
}
