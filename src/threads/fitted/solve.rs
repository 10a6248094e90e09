//! The fit of one row: kernels and weights that answer test lights as the slice does, by Levenberg and Marquardt's method.
use glam::{DVec3, dvec3};
use nalgebra::{Cholesky, DMatrix, DVector};

use super::kernel::{Pair, SHARPEST_LEVEL, WIDEST_LEVEL, kappa_of_level, overlap, scale_rad};
use super::lights::{Light, SCALES, TestLights, light_kappa};
use crate::error::{Error, Result};
use crate::progress::Observer;

/// A thread in one row: a kernel of the environment's pyramid, and the radiance it gives under light of radiance 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Where it looks, unit, in the shading frame.
    pub direction: DVec3,
    /// Level of the pyramid, [`SHARPEST_LEVEL`] to [`WIDEST_LEVEL`]: its width.
    pub level: f64,
    /// Linear Rec. 709, not negative.
    pub weight: DVec3,
}

/// What is left of the albedo for the cosine kernel.
pub fn cosine_part(kernels: &[Kernel], albedo: DVec3) -> DVec3 {
    albedo - kernels.iter().map(|kernel| kernel.weight).sum::<DVec3>()
}

/// Kernels of whole levels against lights of all scales.
fn pairs() -> &'static [[Pair; SCALES]] {
    static PAIRS: std::sync::OnceLock<Vec<[Pair; SCALES]>> = std::sync::OnceLock::new();
    PAIRS.get_or_init(|| {
        let levels = SHARPEST_LEVEL as i32..=WIDEST_LEVEL as i32;
        levels
            .map(|level| std::array::from_fn(|scale| Pair::new(kappa_of_level(level.into()), light_kappa(scale))))
            .collect()
    })
}

/// How a kernel of weight 1 answers a light, and the derivatives by the cosine between them and by the level: below it and above it,
/// which differ at whole levels.
#[derive(Clone, Copy)]
struct Answer {
    value: f64,
    by_cos: f64,
    by_level: [f64; 2],
}

fn answer(kernel: &Kernel, light: &Light) -> Answer {
    let from_sharpest = kernel.level - SHARPEST_LEVEL;
    let pairs = pairs();
    let finer = (from_sharpest as usize).min(pairs.len() - 2);
    let t = from_sharpest - finer as f64;
    let cos = kernel.direction.dot(light.direction);
    let (a, a_cos) = overlap(cos, &pairs[finer][light.scale]);
    let (b, b_cos) = overlap(cos, &pairs[finer + 1][light.scale]);
    let below = if t > 0.0 || finer == 0 { b - a } else { a - overlap(cos, &pairs[finer - 1][light.scale]).0 };
    Answer { value: a + t * (b - a), by_cos: a_cos + t * (b_cos - a_cos), by_level: [below, b - a] }
}

/// Iterations and when to stop.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most steps, taken or not.
    pub steps: usize,
    /// Ends when a step lowers the error by less than this part of it.
    pub least_gain: f64,
}

/// The state of a fit.
pub struct Fit<'a> {
    lights: &'a TestLights,
    albedo: DVec3,
    /// Tied to these, with this strength: the row before.
    prior: Option<(&'a [Kernel], f64)>,
}

impl<'a> Fit<'a> {
    /// Of the slice with this albedo, which answers `lights` as they say.
    pub fn new(lights: &'a TestLights, albedo: DVec3) -> Self {
        Self { lights, albedo, prior: None }
    }

    /// The same, tied to kernels `before`: each that moves by its width, or whose level changes by 1, counts as much as this part of the
    /// squared responses.
    pub fn tied(self, before: &'a [Kernel], strength: f64) -> Self {
        Self { prior: Some((before, strength * self.squared_responses())), ..self }
    }

    fn squared_responses(&self) -> f64 {
        let TestLights { weight, response, .. } = self.lights;
        weight.iter().zip(response).map(|(weight, response)| (*weight * *response).length_squared()).sum()
    }

    /// The square root of the sum over lights and channels of squared weighted residuals, over that of squared weighted responses.
    pub fn relative_error(&self, kernels: &[Kernel]) -> f64 {
        let residuals = self.residuals(kernels, &self.answers(kernels));
        let total = self.squared_responses();
        (residuals.iter().map(|r| r.length_squared()).sum::<f64>() / total.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Of each kernel to each light; all lights of the first kernel first.
    fn answers(&self, kernels: &[Kernel]) -> Vec<Answer> {
        kernels.iter().flat_map(|kernel| self.lights.lights.iter().map(|light| answer(kernel, light))).collect()
    }

    fn residuals(&self, kernels: &[Kernel], answers: &[Answer]) -> Vec<DVec3> {
        let cosine = cosine_part(kernels, self.albedo);
        let TestLights { lights, weight, cosine: cosine_answer, response } = self.lights;
        let mut sums: Vec<_> = response.iter().zip(cosine_answer).map(|(r, answer)| cosine * *answer - *r).collect();
        for (kernel, answers) in kernels.iter().zip(answers.chunks(lights.len())) {
            sums.iter_mut().zip(answers).for_each(|(sum, answer)| *sum += kernel.weight * answer.value);
        }
        sums.iter_mut().zip(weight).for_each(|(sum, weight)| *sum *= *weight);
        sums
    }

    fn prior_cost(&self, kernels: &[Kernel]) -> f64 {
        let Some((before, strength)) = self.prior else { return 0.0 };
        let cost = kernels.iter().zip(before).map(|(kernel, before)| {
            (kernel.direction - before.direction).length_squared() / scale_rad(before.level).powi(2)
                + (kernel.level - before.level).powi(2)
        });
        strength * cost.sum::<f64>()
    }

    /// The levels that each kernel may go to in one step, from and to. The cost has a kink at each whole level: a step ends there, and
    /// stays there where the cost rises both ways. Otherwise derivatives would be those of the wrong side, and one kernel at
    /// a kink would keep all from moving.
    fn level_bounds(&self, kernels: &[Kernel], answers: &[Answer], residuals: &[DVec3]) -> Vec<[f64; 2]> {
        let weight = &self.lights.weight;
        let slope = |k: usize, side: usize| -> f64 {
            let answers = answers[k * weight.len()..].iter();
            let terms = residuals.iter().zip(weight).zip(answers);
            terms.map(|((r, weight), answer)| r.dot(kernels[k].weight) * weight * answer.by_level[side]).sum::<f64>()
                + self.prior.map_or(0.0, |(before, strength)| strength * (kernels[k].level - before[k].level))
        };
        let bounds = |k: usize| {
            let whole = kernels[k].level.floor();
            if whole < kernels[k].level || whole < WIDEST_LEVEL && slope(k, 1) < 0.0 {
                [whole, whole + 1.0]
            } else if whole > SHARPEST_LEVEL && slope(k, 0) > 0.0 {
                [whole - 1.0, whole]
            } else {
                [whole, whole]
            }
        };
        (0..kernels.len()).map(bounds).collect()
    }

    /// The weighted design, a row a light: answers of each kernel less the cosine's, then their derivatives by two tangents and the level,
    /// towards `levels`.
    fn design(&self, kernels: &[Kernel], answers: &[Answer], levels: &[[f64; 2]]) -> DMatrix<f64> {
        let m = kernels.len();
        let TestLights { lights, weight, cosine, .. } = self.lights;
        let mut columns = DMatrix::zeros(lights.len(), 4 * m);
        for (k, (kernel, answers)) in kernels.iter().zip(answers.chunks(lights.len())).enumerate() {
            let (x, y) = kernel.direction.any_orthonormal_pair();
            let side = usize::from(levels[k][1] > kernel.level);
            for (j, (light, &Answer { value, by_cos, by_level })) in lights.iter().zip(answers).enumerate() {
                columns[(j, k)] = weight[j] * (value - cosine[j]);
                columns[(j, m + 3 * k)] = weight[j] * by_cos * x.dot(light.direction);
                columns[(j, m + 3 * k + 1)] = weight[j] * by_cos * y.dot(light.direction);
                columns[(j, m + 3 * k + 2)] = weight[j] * by_level[side];
            }
        }
        columns
    }

    /// Improves `kernels`.
    ///
    /// # Errors
    /// Cancelled by `observer` (noticed within a step: a tenth of a second for the most threads that there can be).
    pub fn solve(&self, kernels: &mut Vec<Kernel>, effort: Effort, observer: &dyn Observer) -> Result<()> {
        let mut damping = 1e-3;
        let mut tried = 0;
        let squares = |r: &[DVec3]| r.iter().map(|r| r.length_squared()).sum::<f64>();
        let mut answers = self.answers(kernels);
        let mut residuals = self.residuals(kernels, &answers);
        let mut cost = squares(&residuals) + self.prior_cost(kernels);
        while tried < effort.steps {
            let levels = self.level_bounds(kernels, &answers, &residuals);
            let design = self.design(kernels, &answers, &levels);
            if observer.cancelled() {
                return Err(Error::Cancelled);
            }
            let gram = design.transpose() * &design;
            let right: [DVector<f64>; 3] = std::array::from_fn(|c| {
                let r = DVector::from_iterator(residuals.len(), residuals.iter().map(|r| r[c]));
                design.tr_mul(&r)
            });
            let (hessian, gradient) = self.normal_equations(kernels, &gram, &right);
            let before = cost;
            loop {
                if observer.cancelled() {
                    return Err(Error::Cancelled);
                }
                tried += 1;
                let next = step(kernels, &levels, &hessian, &gradient, damping);
                let next_answers = self.answers(&next);
                let next_residuals = self.residuals(&next, &next_answers);
                let next_cost = squares(&next_residuals) + self.prior_cost(&next);
                if next_cost < cost {
                    (*kernels, answers, residuals, cost) = (next, next_answers, next_residuals, next_cost);
                    damping = (damping * 0.2).max(1e-9);
                    break;
                }
                damping *= 5.0;
                if tried >= effort.steps || damping > 1e6 {
                    return Ok(());
                }
            }
            if cost > before * (1.0 - effort.least_gain) || cost == 0.0 {
                break;
            }
        }
        Ok(())
    }

    /// Gauss and Newton's matrix and the gradient. Unknowns: red, green and blue weights of all kernels, then two tangents and the
    /// level of each kernel.
    fn normal_equations(
        &self,
        kernels: &[Kernel],
        gram: &DMatrix<f64>,
        right: &[DVector<f64>; 3],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let m = kernels.len();
        let mut hessian = DMatrix::zeros(6 * m, 6 * m);
        let mut gradient = DVector::zeros(6 * m);
        for c in 0..3 {
            for l in 0..m {
                for k in 0..m {
                    hessian[(c * m + k, c * m + l)] = gram[(k, l)];
                }
                for p in 0..3 * m {
                    let value = kernels[p / 3].weight[c] * gram[(m + p, l)];
                    hessian[(3 * m + p, c * m + l)] = value;
                    hessian[(c * m + l, 3 * m + p)] = value;
                }
                gradient[c * m + l] = right[c][l];
            }
            for p in 0..3 * m {
                gradient[3 * m + p] += kernels[p / 3].weight[c] * right[c][m + p];
            }
        }
        for q in 0..3 * m {
            for p in 0..3 * m {
                hessian[(3 * m + p, 3 * m + q)] =
                    kernels[p / 3].weight.dot(kernels[q / 3].weight) * gram[(m + p, m + q)];
            }
        }
        if let Some((before, strength)) = self.prior {
            for (k, (kernel, before)) in kernels.iter().zip(before).enumerate() {
                let (x, y) = kernel.direction.any_orthonormal_pair();
                let away = kernel.direction - before.direction;
                let scale = strength / scale_rad(before.level).powi(2);
                for (p, (gradient_part, scale)) in [
                    (x.dot(away) * scale, scale),
                    (y.dot(away) * scale, scale),
                    ((kernel.level - before.level) * strength, strength),
                ]
                .into_iter()
                .enumerate()
                {
                    gradient[3 * m + 3 * k + p] += gradient_part;
                    hessian[(3 * m + 3 * k + p, 3 * m + 3 * k + p)] += scale;
                }
            }
        }
        (hessian, gradient)
    }
}

/// The step of damped normal equations, within bounds: a weight at zero that would fall stays there, and levels are bounded by `levels`.
fn step(
    kernels: &[Kernel],
    levels: &[[f64; 2]],
    hessian: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Vec<Kernel> {
    let m = kernels.len();
    let mut matrix = hessian.clone();
    let mut right = -gradient;
    let largest = (0..6 * m).map(|i| hessian[(i, i)]).fold(0.0, f64::max);
    let frozen = |i: usize| {
        if i < 3 * m {
            kernels[i % m].weight[i / m] <= 0.0 && gradient[i] > 0.0
        } else {
            let [from, to] = levels[i / 3 - m];
            i % 3 == 2 && from == to
        }
    };
    let floor = |k: usize| {
        // Kernels without weight have no gradient in direction and level: they stay where they are.
        1e-10 * largest / scale_rad(kernels[k].level).powi(2)
    };
    for i in 0..6 * m {
        matrix[(i, i)] += damping * hessian[(i, i)] + if i < 3 * m { 1e-12 * largest } else { floor((i - 3 * m) / 3) };
        if frozen(i) {
            for j in 0..6 * m {
                matrix[(i, j)] = 0.0;
                matrix[(j, i)] = 0.0;
            }
            matrix[(i, i)] = 1.0;
            right[i] = 0.0;
        }
    }
    let Some(factor) = Cholesky::new(matrix) else { return kernels.to_vec() };
    let change = factor.solve(&right);
    kernels
        .iter()
        .enumerate()
        .map(|(k, kernel)| {
            let (x, y) = kernel.direction.any_orthonormal_pair();
            let at = 3 * m + 3 * k;
            let width = scale_rad(kernel.level);
            // The model of a kernel's answer is linear over about its own width.
            let limit = |value: f64| value.clamp(-2.0 * width, 2.0 * width);
            let tangent = limit(change[at]) * x + limit(change[at + 1]) * y;
            let weight = dvec3(change[k], change[m + k], change[2 * m + k]);
            Kernel {
                direction: (kernel.direction + tangent).normalize(),
                level: (kernel.level + change[at + 2]).clamp(levels[k][0], levels[k][1]),
                weight: (kernel.weight + weight).max(DVec3::ZERO),
            }
        })
        .collect()
}
