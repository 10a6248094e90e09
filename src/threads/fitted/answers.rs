//! How kernels answer the test lights, and the derivatives of their answers. Most of a fit's time is here and in the normal equations, so
//! it is single precision in plain arrays, which compilers turn into vector instructions.
use std::ops::Range;
use std::sync::OnceLock;

use super::kernel::{Kernel, SHARPEST_LEVEL, WIDEST_LEVEL, kappa_of_level};
use super::lights::{LANES, POINTS, TestLights, light_kappa};
use crate::vector_math::exp;

/// What the overlap of two kernels needs of their kappas a and b.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    sum: f32,
    twice_product: f32,
    factor: f32,
}

/// a + b above which sinh R / R is an exponential wherever the overlap is more than exp(-40).
const NARROW_SUM: f32 = 60.0;

impl Pair {
    /// Of kernels of these two kappas.
    pub fn new(a: f64, b: f64) -> Self {
        let rest = |kappa: f64| -(-2.0 * kappa).exp_m1();
        Self {
            sum: (a + b) as f32,
            twice_product: (2.0 * a * b) as f32,
            factor: (a * b / (std::f64::consts::TAU * rest(a) * rest(b))) as f32,
        }
    }

    /// [`Self::overlap`] of several.
    #[inline(always)]
    fn overlaps<const NARROW: bool>(&self, one_minus_cos: &[f32; LANES]) -> ([f32; LANES], [f32; LANES]) {
        let (mut values, mut by_cos) = ([0.0; LANES], [0.0; LANES]);
        for j in 0..LANES {
            (values[j], by_cos[j]) = self.overlap::<NARROW>(one_minus_cos[j]);
        }
        (values, by_cos)
    }

    /// The integral of the product of two kernels, and its derivative by the cosine between their directions, which is
    /// 1 - `one_minus_cos`. `NARROW`: the kappas sum to more than [`NARROW_SUM`].
    ///
    /// With R = |a d + b c| it is a b sinh R / (4 pi R sinh a sinh b) (Jupp and Mardia 1989), here with the exponentials divided out (F18).
    #[inline(always)]
    fn overlap<const NARROW: bool>(&self, one_minus_cos: f32) -> (f32, f32) {
        // Both kappas are at least 1, so R is only small where directions are opposite; 1e-3 is far from where 1 / R matters.
        let r = (self.sum * self.sum - self.twice_product * one_minus_cos).max(1e-6).sqrt();
        let inverse = 1.0 / r;
        // R - a - b without cancellation.
        let value = self.factor * inverse * exp(-self.twice_product * one_minus_cos / (r + self.sum));
        // d log(sinh R / R) / dR = coth R - 1 / R, dR / dcos = a b / R.
        let by_r_squared = 0.5 * self.twice_product * inverse;
        if NARROW {
            return (value, value * (1.0 - inverse) * by_r_squared);
        }
        let e = exp(-2.0 * r);
        let value = value * (1.0 - e);
        // Below 0.3 the difference cancels; the next term of the series is 2 r^5 / 945.
        let slope = if r < 0.3 { r / 3.0 - r * r * r / 45.0 } else { (1.0 + e) / (1.0 - e) - inverse };
        (value, value * slope * by_r_squared)
    }
}

/// Of the kernels of whole levels and the lights of all scales, those without width among them.
fn pairs() -> &'static [[Pair; POINTS + 1]] {
    static PAIRS: OnceLock<Vec<[Pair; POINTS + 1]>> = OnceLock::new();
    PAIRS.get_or_init(|| {
        let levels = SHARPEST_LEVEL as i32..=WIDEST_LEVEL as i32;
        levels
            .map(|level| std::array::from_fn(|scale| Pair::new(kappa_of_level(level.into()), light_kappa(scale))))
            .collect()
    })
}

/// The answers of kernels of weight 1 to lights, each times the weight of the light; all lights of the first kernel first.
#[derive(Clone)]
pub struct Answers {
    /// The answers.
    pub value: Vec<f32>,
    /// Their derivatives by the cosine between kernel and light.
    pub by_cos: Vec<f32>,
    /// By the level: below it and above it, which differ at whole levels.
    pub by_level: [Vec<f32>; 2],
}

/// Where answers of a kernel to the lights of a scale go.
struct Out<'a> {
    value: &'a mut [f32],
    by_cos: &'a mut [f32],
    by_level: [&'a mut [f32]; 2],
}

impl Answers {
    /// Of `kernels` to `lights`.
    pub fn new(kernels: &[Kernel], lights: &TestLights) -> Self {
        let zeros = || vec![0.0; kernels.len() * lights.count()];
        let mut answers = Self { value: zeros(), by_cos: zeros(), by_level: [zeros(), zeros()] };
        answers.replace(kernels, lights);
        answers
    }

    /// Those of other `kernels`, as many as before, in the place of these: what is allocated stays.
    pub fn replace(&mut self, kernels: &[Kernel], lights: &TestLights) {
        pulp::Arch::new().dispatch(Answering { kernels, lights, answers: self });
    }
}

/// A call of what computes answers, compiled for the vector instructions that are there.
struct Answering<'a> {
    kernels: &'a [Kernel],
    lights: &'a TestLights,
    answers: &'a mut Answers,
}

impl pulp::NullaryFnOnce for Answering<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Answers { value, by_cos, by_level: [below, above] } = self.answers;
        for (k, kernel) in self.kernels.iter().enumerate() {
            for scale in self.lights.scales.clone() {
                let Range { start, end } = self.lights.of_scale(scale);
                let place = k * self.lights.count() + start..k * self.lights.count() + end;
                let out = Out {
                    value: &mut value[place.clone()],
                    by_cos: &mut by_cos[place.clone()],
                    by_level: [&mut below[place.clone()], &mut above[place]],
                };
                answer(kernel, self.lights, scale, out);
            }
        }
    }
}

/// Answers to the lights of `scale`: linear in the level between whole ones.
#[inline(always)]
fn answer(kernel: &Kernel, lights: &TestLights, scale: usize, out: Out) {
    let from_sharpest = kernel.level - SHARPEST_LEVEL;
    let pairs = pairs();
    let finer = (from_sharpest as usize).min(pairs.len() - 2);
    let t = (from_sharpest - finer as f64) as f32;
    let [a, b] = [&pairs[finer][scale], &pairs[finer + 1][scale]];
    let below = (t == 0.0 && finer > 0).then(|| &pairs[finer - 1][scale]);
    let range = lights.of_scale(scale);
    let places = lights.direction.each_ref().map(|part| &part[range.clone()]);
    let direction = kernel.direction.as_vec3().to_array();
    let lights = Block { places, weights: &lights.weight[range], direction };
    if b.sum > NARROW_SUM {
        lights.fill::<true>(below, [a, b], t, out);
    } else {
        lights.fill::<false>(below, [a, b], t, out);
    }
}

/// The lights of one scale, as seen by a kernel.
struct Block<'a> {
    places: [&'a [f32]; 3],
    weights: &'a [f32],
    direction: [f32; 3],
}

impl Block<'_> {
    /// The level is the part `t` of the way from that of `a` to that of `b`; `below` is the level below `a` where `a` is met exactly.
    #[inline(always)]
    fn fill<const NARROW: bool>(&self, below: Option<&Pair>, [a, b]: [&Pair; 2], t: f32, out: Out) {
        let [xs, ys, zs] = self.places.map(|places| places.as_chunks::<LANES>().0);
        let weights = self.weights.as_chunks::<LANES>().0;
        let Out { value, by_cos, by_level: [by_level_below, by_level_above] } = out;
        let [values, by_coses, belows, aboves] =
            [value, by_cos, by_level_below, by_level_above].map(|out| out.as_chunks_mut::<LANES>().0);
        for i in 0..weights.len() {
            let mut one_minus_cos = [0.0; LANES];
            for j in 0..LANES {
                // Half the squared distance, so that nothing cancels.
                let [x, y, z] = self.direction;
                let [x, y, z] = [x - xs[i][j], y - ys[i][j], z - zs[i][j]];
                one_minus_cos[j] = 0.5 * (x * x + y * y + z * z);
            }
            let (finer, finer_cos) = a.overlaps::<NARROW>(&one_minus_cos);
            let (coarser, coarser_cos) = b.overlaps::<NARROW>(&one_minus_cos);
            let finest = below.map(|pair| pair.overlaps::<NARROW>(&one_minus_cos).0);
            let weights = &weights[i];
            for j in 0..LANES {
                values[i][j] = weights[j] * (finer[j] + t * (coarser[j] - finer[j]));
                by_coses[i][j] = weights[j] * (finer_cos[j] + t * (coarser_cos[j] - finer_cos[j]));
                aboves[i][j] = weights[j] * (coarser[j] - finer[j]);
            }
            match finest {
                Some(finest) => (0..LANES).for_each(|j| belows[i][j] = weights[j] * (finer[j] - finest[j])),
                None => belows[i] = aboves[i],
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::fitted::kernel::{vmf_direction, vmf_peak};
    use crate::threads::slice::fibonacci_lattice;
    use glam::DVec3;
    use std::f64::consts::TAU;

    fn vmf(cos: f64, kappa: f64) -> f64 {
        vmf_peak(kappa) * (kappa * (cos - 1.0)).exp()
    }

    /// Of kernels `angle` apart, with points drawn by the narrower one.
    fn quadrature(a: f64, b: f64, angle: f64) -> f64 {
        let (narrow, wide) = (a.max(b), a.min(b));
        let other = DVec3::new(angle.sin(), 0.0, angle.cos());
        let count = 200_000;
        let points = fibonacci_lattice(count).map(|uv| vmf_direction(DVec3::Z, narrow, uv.x, TAU * uv.y));
        points.map(|w| vmf(w.dot(other), wide)).sum::<f64>() / count as f64
    }

    #[test]
    fn overlap_is_the_integral_of_the_product() {
        // The last are the value of a kernel in a direction.
        let point = light_kappa(POINTS);
        for (a, b) in [
            (1.0, 1.0),
            (4.0, 100.0),
            (300.0, 200.0),
            (5000.0, 2.0),
            (kappa_of_level(-1.0), 300.0),
            (1.0, point),
            (65536.0, point),
        ] {
            for angle in [0.0f64, 0.05, 0.3, 1.0, 3.0, 3.13] {
                let pair = Pair::new(a, b);
                let one_minus_cos = (2.0 * (0.5 * angle).sin().powi(2)) as f32;
                let (value, slope) = match pair.sum > NARROW_SUM {
                    true => pair.overlap::<true>(one_minus_cos),
                    false => pair.overlap::<false>(one_minus_cos),
                };
                let sum = quadrature(a, b, angle);
                assert!((f64::from(value) - sum).abs() < 1e-3 * sum + 1e-9, "{a} {b} {angle}: {value} {sum}");
                // By the cosine: at angles whose cosines are `step` apart.
                let step = 1e-3 / a.min(b);
                let [more, less] = [step, -step].map(|step| (angle.cos() + step).clamp(-1.0, 1.0));
                let numeric = (quadrature(a, b, more.acos()) - quadrature(a, b, less.acos())) / (more - less);
                let error = (f64::from(slope) - numeric).abs();
                assert!(error < 3e-3 * numeric.abs() + 1e-7, "{a} {b} {angle}: {slope} {numeric}");
            }
        }
    }
}
