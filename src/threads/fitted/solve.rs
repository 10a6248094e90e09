//! The fit of one row: kernels and weights that answer test lights as the slice does, by Levenberg and Marquardt's method.
use std::mem::swap;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::solvers::{Llt, Solve};
use faer::{Accum, Mat, MatRef, Par, Side};
use glam::{DVec3, dvec3};

use super::answers::Answers;
use super::kernel::{Kernel, WIDEST_LEVEL, all_between, scale_rad};
use super::lights::{LANES, TestLights};
use crate::error::Result;
use crate::progress::Observer;

/// Iterations and when to stop.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most steps, taken or not.
    pub steps: usize,
    /// Ends when a step lowers the error by less than this part of it.
    pub least_gain: f64,
}

/// The damping of the first step. Beyond the most, steps are so short that none is good.
const FIRST_DAMPING: f32 = 1e-2;
const MOST_DAMPING: f32 = 1e6;
/// By how much it rises after the first step that is not good, and twice as much after each other one in a row: as in (2.21), see
/// [`change_of_damping`].
const FIRST_RISE: f32 = 2.0;
/// Less would be lost in the rounding of the products.
const LEAST_DAMPING: f32 = 1e-6;

/// Of the largest element of the diagonal, added to those of weights: there Cholesky's factor exists even if a kernel answers as the cosine
/// does, so that its own element is 0. Elsewhere it is less than rounding.
const LEAST_DIAGONAL: f32 = 1e-12;

/// Steps to the best weights: the first is exact but for weights that would be negative and for what rounding makes of kernels that are alike.
const WEIGHT_STEPS: usize = 4;

/// A step of a fit.
struct Step {
    /// Where it leads.
    kernels: Vec<Kernel>,
    /// By how much the cost falls if answers are linear, and no bound is met.
    promised: f64,
}

/// What kernels leave.
struct Rest {
    cost: f64,
    /// For the kernels of each set, half of what the cost changes by with their answers to lights: red, green, blue.
    of_sets: Vec<[Vec<f32>; 3]>,
}

/// The state of a fit.
#[derive(Clone, Copy)]
pub struct Fit<'a> {
    lights: &'a TestLights,
    albedo: DVec3,
    /// Kernel k is of set k % `sets`.
    sets: usize,
    /// How much the squared residuals of sets alone, in their mean, count beside those of all together.
    share_of_sets: f32,
    /// Tied to these, with this strength: the row before.
    prior: Option<(&'a [Kernel], f64)>,
    /// No step leaves a kernel sharper than this level.
    sharpest_level: f64,
    /// Nor one sharper than its own of these, if there are any.
    sharpest_levels: &'a [f64],
}

impl<'a> Fit<'a> {
    /// Of the slice with this albedo, which answers `lights` as they say; the albedo and all weights in units of `lights`.
    pub fn new(lights: &'a TestLights, albedo: DVec3) -> Self {
        Self {
            lights,
            albedo,
            sets: 1,
            share_of_sets: 0.0,
            prior: None,
            sharpest_level: lights.sharpest_level(),
            sharpest_levels: &[],
        }
    }

    /// The same in so many sets of kernels, each of which answers the lights by itself too, with as many times the weights: kernel k is of
    /// set k % `sets`. Their mean is what all kernels together answer. That counts once, and what sets answer `share_of_sets` times, in their mean.
    pub fn in_sets(self, sets: usize, share_of_sets: f32) -> Self {
        Self { sets, share_of_sets, ..self }
    }

    /// The same, tied to kernels `before`: each that moves by its width, or whose level changes by 1, counts as much as this part of the
    /// squared responses.
    pub fn tied(self, before: &'a [Kernel], strength: f64) -> Self {
        Self { prior: Some((before, strength * self.squared_responses())), ..self }
    }

    /// The same, in which no step leaves a kernel sharper than this level.
    pub fn no_sharper_than(self, level: f64) -> Self {
        Self { sharpest_level: self.sharpest_level.max(level), ..self }
    }

    /// The same, in which no step leaves one of the kernels sharper than its level of these.
    pub fn each_no_sharper_than(self, levels: &'a [f64]) -> Self {
        Self { sharpest_levels: levels, ..self }
    }

    /// Makes `kernels` that are sharper than any step leaves them as wide as that.
    pub fn bound(&self, kernels: &mut [Kernel]) {
        kernels.iter_mut().enumerate().for_each(|(k, kernel)| kernel.level = kernel.level.max(self.sharpest_level(k)));
    }

    fn sharpest_level(&self, k: usize) -> f64 {
        self.sharpest_levels.get(k).copied().unwrap_or(f64::NEG_INFINITY).max(self.sharpest_level)
    }

    /// How many sets of kernels there are.
    pub fn sets(&self) -> usize {
        self.sets
    }

    fn squared_responses(&self) -> f64 {
        squares(&self.lights.response)
    }

    /// The square root of the sum over lights and channels of squared weighted residuals, over that of squared weighted responses (F23); in units of
    /// `lights` where nothing is answered, so that threads that are carried there have an error of finite size.
    pub fn relative_error(&self, kernels: &[Kernel]) -> f64 {
        let residuals = self.residuals(kernels, &Answers::new(kernels, self.lights), None);
        let responses = self.squared_responses();
        (squares(&residuals) / if responses > 0.0 { responses } else { 1.0 }).sqrt()
    }

    /// What is minimised (F22), in units of `lights`.
    pub fn cost(&self, kernels: &[Kernel]) -> f64 {
        self.rest(kernels, &Answers::new(kernels, self.lights)).cost
    }

    /// (F21), of all kernels or of a set alone: red, green, blue.
    fn residuals(&self, kernels: &[Kernel], answers: &Answers, set: Option<usize>) -> [Vec<f32>; 3] {
        let TestLights { cosine, response, .. } = self.lights;
        let (first, stride) = set.map_or((0, 1), |set| (set, self.sets));
        let of_set = || (first..kernels.len()).step_by(stride);
        let weight = |k: usize| stride as f64 * kernels[k].weight;
        let cosine_part = self.albedo - of_set().map(weight).sum::<DVec3>();
        std::array::from_fn(|c| {
            let part = cosine_part[c] as f32;
            let mut sums: Vec<f32> = response[c].iter().zip(cosine).map(|(r, cosine)| part * cosine - r).collect();
            for k in of_set() {
                let weight = weight(k)[c] as f32;
                let answers = &answers.value[k * cosine.len()..];
                sums.iter_mut().zip(answers).for_each(|(sum, answer)| *sum += weight * answer);
            }
            sums
        })
    }

    /// What is left to answer, with the cost of that: (F22) but for its last sum.
    fn rest(&self, kernels: &[Kernel], answers: &Answers) -> Rest {
        let together = self.residuals(kernels, answers, None);
        let mut cost = squares(&together) + self.prior_cost(kernels);
        if self.sets == 1 {
            return Rest { cost, of_sets: vec![together] };
        }
        let of_set = |set: usize| {
            let mut alone = self.residuals(kernels, answers, Some(set));
            cost += f64::from(self.share_of_sets) / self.sets as f64 * squares(&alone);
            for (alone, together) in alone.iter_mut().zip(&together) {
                alone.iter_mut().zip(together).for_each(|(a, t)| *a = t + self.share_of_sets * *a);
            }
            alone
        };
        let of_sets = (0..self.sets).map(of_set).collect();
        Rest { cost, of_sets }
    }

    /// The last sum of (F22).
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
    /// a kink would keep all from moving (F25).
    fn level_bounds(&self, kernels: &[Kernel], answers: &Answers, rest: &Rest) -> Vec<[f64; 2]> {
        let slope = |k: usize, side: usize| -> f64 {
            let count = self.lights.count();
            let answers = &answers.by_level[side][k * count..(k + 1) * count];
            let channels =
                (0..3).map(|c| kernels[k].weight[c] * inner_product(&rest.of_sets[k % self.sets][c], answers));
            channels.sum::<f64>()
                + self.prior.map_or(0.0, |(before, strength)| strength * (kernels[k].level - before[k].level))
        };
        let bounds = |k: usize| {
            let whole = kernels[k].level.floor();
            if whole < kernels[k].level || whole < WIDEST_LEVEL && slope(k, 1) < 0.0 {
                [whole, whole + 1.0]
            } else if whole > self.sharpest_level(k) && slope(k, 0) > 0.0 {
                [whole - 1.0, whole]
            } else {
                [whole, whole]
            }
        };
        (0..kernels.len()).map(|k| bounds(k).map(|level| level.max(self.sharpest_level(k)))).collect()
    }

    /// What the answers of each kernel differ by from those of the base, whose weight is what kernels leave of the albedo; with room for so many
    /// `more` columns.
    fn differences(&self, answers: &Answers, more: usize) -> Vec<f32> {
        let cosine = &self.lights.cosine;
        let mut columns = Vec::with_capacity(answers.value.len() + more * cosine.len());
        for answers in answers.value.chunks(cosine.len()) {
            columns.extend(answers.iter().zip(cosine).map(|(answer, cosine)| answer - cosine));
        }
        columns
    }

    /// The weighted design, a row a light: answers of each kernel less the cosine's, then their derivatives by two tangents and the level,
    /// towards `levels`; last what is left to answer.
    fn design(&self, kernels: &[Kernel], answers: &Answers, levels: &[[f64; 2]], rest: &Rest) -> Vec<f32> {
        let [lights_x, lights_y, lights_z] = &self.lights.direction;
        let count = self.lights.count();
        let mut columns = self.differences(answers, 3 * (kernels.len() + self.sets));
        for (k, kernel) in kernels.iter().enumerate() {
            let of_kernel = k * count..(k + 1) * count;
            let (x, y) = kernel.direction.any_orthonormal_pair();
            for tangent in [x.as_vec3(), y.as_vec3()] {
                let by_cos = &answers.by_cos[of_kernel.clone()];
                columns.extend((0..count).map(|j| {
                    by_cos[j] * (tangent.x * lights_x[j] + tangent.y * lights_y[j] + tangent.z * lights_z[j])
                }));
            }
            let side = usize::from(levels[k][1] > kernel.level);
            columns.extend_from_slice(&answers.by_level[side][of_kernel]);
        }
        rest.of_sets.iter().flatten().for_each(|residuals| columns.extend_from_slice(residuals));
        columns
    }

    /// The best weights of `kernels` that stay where they are.
    pub fn solve_weights(&self, kernels: &mut [Kernel]) {
        let answers = Answers::new(kernels, self.lights);
        let mut rest = self.rest(kernels, &answers);
        let mut damping = LEAST_DAMPING;
        for _ in 0..WEIGHT_STEPS {
            let mut columns = self.differences(&answers, 3 * self.sets);
            rest.of_sets.iter().flatten().for_each(|residuals| columns.extend_from_slice(residuals));
            let products = products(&columns, self.lights.count());
            let next = self.with_better_weights(kernels, &products, damping);
            let next_rest = self.rest(&next, &answers);
            if next_rest.cost < rest.cost {
                kernels.copy_from_slice(&next);
                rest = next_rest;
            } else {
                // Kernels that answer nearly alike: single precision does not tell their weights apart.
                damping *= 100.0;
            }
        }
    }

    /// A step to the best weights, of the damped normal equations of each channel: a weight at zero that would fall stays there. `products` are
    /// those of the columns of [`Fit::differences`] and of what is left to answer.
    fn with_better_weights(&self, kernels: &[Kernel], products: &Mat<f32>, damping: f32) -> Vec<Kernel> {
        let m = kernels.len();
        let largest = (0..m).map(|k| products[(k, k)]).fold(0.0, f32::max);
        let mut next = kernels.to_vec();
        for c in 0..3 {
            let gradient = |k: usize| products[(m + 3 * (k % self.sets) + c, k)];
            let is_frozen = |k: usize| kernels[k].weight[c] <= 0.0 && gradient(k) > 0.0;
            let matrix = Mat::from_fn(m, m, |k, l| match k == l {
                true if is_frozen(k) => 1.0,
                true => (1.0 + damping) * self.coupling(k, l) * products[(k, l)] + LEAST_DIAGONAL * largest,
                false if k < l || is_frozen(k) || is_frozen(l) => 0.0,
                false => self.coupling(k, l) * products[(k, l)],
            });
            let Ok(factor) = Llt::new(matrix.as_ref(), Side::Lower) else { return next };
            let change = factor.solve(&Mat::from_fn(m, 1, |k, _| if is_frozen(k) { 0.0 } else { -gradient(k) }));
            for (k, kernel) in next.iter_mut().enumerate() {
                kernel.weight[c] = (kernel.weight[c] + f64::from(change[(k, 0)])).max(0.0);
            }
        }
        next
    }

    /// Kernels on the way from `start` to `end`, with the best weights there: at the end, or else half as far, again and again, until
    /// `is_steady`; but no nearer to the start than a 32nd, and not where the error is more than twice that at the end.
    pub fn part_of_the_way(
        &self,
        start: &[Kernel],
        end: &[Kernel],
        is_steady: impl Fn(&[Kernel]) -> bool,
    ) -> Vec<Kernel> {
        const PARTS: [f64; 5] = [0.5, 0.25, 0.125, 0.0625, 0.03125];
        const MOST_WORSE: f64 = 2.0;
        let mut kernels = end.to_vec();
        let most = MOST_WORSE * self.relative_error(end);
        for part in PARTS {
            if is_steady(&kernels) {
                break;
            }
            let mut nearer = all_between(start, end, part);
            self.solve_weights(&mut nearer);
            if self.relative_error(&nearer) > most {
                break;
            }
            kernels = nearer;
        }
        kernels
    }

    /// Which of `candidates` takes most of what `kernels` leave, if it is one of `set` and they stay as they are; none if none takes any.
    pub fn best_place(&self, kernels: &[Kernel], set: usize, candidates: &[Kernel]) -> Option<Kernel> {
        let rest = self.rest(kernels, &Answers::new(kernels, self.lights));
        let columns = self.differences(&Answers::new(candidates, self.lights), 0);
        let taken = |column: &[f32]| -> f32 {
            let product = |other: &[f32]| column.iter().zip(other).map(|(a, b)| a * b).sum::<f32>();
            rest.of_sets[set].iter().map(|rest| product(rest).min(0.0).powi(2)).sum::<f32>() / product(column)
        };
        let taken = columns.chunks(self.lights.count()).map(taken).zip(candidates);
        let (most, place) = taken.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        (most > 0.0).then_some(*place)
    }

    /// Improves `kernels`.
    ///
    /// # Errors
    /// Cancelled by `observer` (noticed within a step: a tenth of a second for the most threads that there can be).
    pub fn solve(&self, kernels: &mut Vec<Kernel>, effort: Effort, observer: &dyn Observer) -> Result<()> {
        let mut damping = FIRST_DAMPING;
        // By how much it rises where a step is not good.
        let mut rise = FIRST_RISE;
        let mut tried = 0;
        let mut answers = Answers::new(kernels, self.lights);
        let mut next_answers = answers.clone();
        let mut rest = self.rest(kernels, &answers);
        while tried < effort.steps {
            let levels = self.level_bounds(kernels, &answers, &rest);
            let products = products(&self.design(kernels, &answers, &levels, &rest), self.lights.count());
            let (hessian, gradient) = self.normal_equations(kernels, &products);
            let before = rest.cost;
            loop {
                observer.check()?;
                tried += 1;
                let Step { kernels: next, promised } = step(kernels, &levels, &hessian, &gradient, damping);
                next_answers.replace(&next, self.lights);
                let next_rest = self.rest(&next, &next_answers);
                if next_rest.cost < rest.cost {
                    let kept = ((rest.cost - next_rest.cost) / promised) as f32;
                    (*kernels, rest) = (next, next_rest);
                    swap(&mut answers, &mut next_answers);
                    damping = (damping * change_of_damping(kept)).max(LEAST_DAMPING);
                    rise = FIRST_RISE;
                    break;
                }
                damping *= rise;
                rise *= 2.0;
                if tried >= effort.steps || damping > MOST_DAMPING {
                    return Ok(());
                }
            }
            if rest.cost > before * (1.0 - effort.least_gain) || rest.cost == 0.0 {
                break;
            }
        }
        Ok(())
    }

    /// How often the product of the answers of kernels k and l is in the cost. Those of a set are in its residuals too, with as many times
    /// the weights as there are sets.
    fn coupling(&self, k: usize, l: usize) -> f32 {
        let is_within = self.sets > 1 && k % self.sets == l % self.sets;
        if is_within { 1.0 + self.share_of_sets * self.sets as f32 } else { 1.0 }
    }

    /// The lower half of Gauss and Newton's matrix, and the gradient. Unknowns: red, green and blue weights of all kernels, then two
    /// tangents and the level of each kernel. `products` are those of the columns of [`Fit::design`]: its lower half.
    fn normal_equations(&self, kernels: &[Kernel], products: &Mat<f32>) -> (Mat<f32>, Vec<f32>) {
        let m = kernels.len();
        let weights: Vec<_> = kernels.iter().map(|kernel| kernel.weight.as_vec3()).collect();
        let mut hessian = Mat::zeros(6 * m, 6 * m);
        let mut gradient = vec![0.0; 6 * m];
        for c in 0..3 {
            // The row of products with what is left for kernel k.
            let rest_of = |k: usize| 4 * m + 3 * (k % self.sets) + c;
            for l in 0..m {
                let products = products.col_as_slice(l);
                let column = hessian.col_as_slice_mut(c * m + l);
                for k in l..m {
                    column[c * m + k] = self.coupling(k, l) * products[k];
                }
                for (k, (column, products)) in
                    column[3 * m..].chunks_exact_mut(3).zip(products[m..4 * m].chunks_exact(3)).enumerate()
                {
                    (0..3).for_each(|i| column[i] = self.coupling(k, l) * weights[k][c] * products[i]);
                }
                gradient[c * m + l] = products[rest_of(l)];
            }
            for p in 0..3 * m {
                gradient[3 * m + p] += weights[p / 3][c] * products[(rest_of(p / 3), m + p)];
            }
        }
        for q in 0..3 * m {
            let products = &products.col_as_slice(m + q)[m..4 * m];
            let column = &mut hessian.col_as_slice_mut(3 * m + q)[3 * m..];
            for k in q / 3..m {
                let scale = self.coupling(k, q / 3) * weights[k].dot(weights[q / 3]);
                (3 * k..3 * k + 3).for_each(|p| column[p] = scale * products[p]);
            }
        }
        if let Some((before, strength)) = self.prior {
            for (k, (kernel, before)) in kernels.iter().zip(before).enumerate() {
                let (x, y) = kernel.direction.any_orthonormal_pair();
                let away = kernel.direction - before.direction;
                let scale = strength / scale_rad(before.level).powi(2);
                let terms = [
                    (x.dot(away) * scale, scale),
                    (y.dot(away) * scale, scale),
                    ((kernel.level - before.level) * strength, strength),
                ];
                for (p, (slope, curvature)) in (3 * m + 3 * k..).zip(terms) {
                    gradient[p] += slope as f32;
                    hessian[(p, p)] += curvature as f32;
                }
            }
        }
        (hessian, gradient)
    }
}

fn squares(channels: &[Vec<f32>; 3]) -> f64 {
    channels.iter().map(|channel| inner_product(channel, channel)).sum()
}

/// The sum over lights of the products of two numbers of each. Each lane has a sum of its own: one alone would wait for each addition before the next.
fn inner_product(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        (0..LANES).for_each(|j| sums[j] += f64::from(a[j]) * f64::from(b[j]));
    }
    sums.iter().sum()
}

/// The products of all pairs of columns of `length`: the lower half.
fn products(columns: &[f32], length: usize) -> Mat<f32> {
    let columns = MatRef::from_column_major_slice(columns, length, columns.len() / length);
    let mut products = Mat::zeros(columns.ncols(), columns.ncols());
    let whole = BlockStructure::Rectangular;
    let lower = BlockStructure::TriangularLower;
    matmul(&mut products, lower, Accum::Replace, columns.transpose(), whole, columns, whole, 1.0, Par::Seq);
    products
}

/// By how much the damping changes after a good step, by which part of what was promised it has kept: Madsen, Nielsen and Tingleff, "Methods for
/// Non-Linear Least Squares Problems" (2004), equation (2.21). It falls to a third where a step keeps all, stays where it keeps half, and doubles where
/// it keeps next to nothing.
fn change_of_damping(kept: f32) -> f32 {
    // Rounding may leave a promise below zero.
    (1.0 - (2.0 * kept.max(0.0) - 1.0).powi(3)).max(1.0 / 3.0)
}

/// The step of damped normal equations (F24), within bounds: a weight at zero that would fall stays there, and levels are bounded by `levels`.
fn step(kernels: &[Kernel], levels: &[[f64; 2]], hessian: &Mat<f32>, gradient: &[f32], damping: f32) -> Step {
    let m = kernels.len();
    let mut matrix = hessian.clone();
    let mut right = Mat::from_fn(6 * m, 1, |i, _| -gradient[i]);
    let largest = (0..6 * m).map(|i| hessian[(i, i)]).fold(0.0, f32::max);
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
        1e-10 * largest / (scale_rad(kernels[k].level) as f32).powi(2)
    };
    let damped = |i: usize| {
        damping * hessian[(i, i)] + if i < 3 * m { LEAST_DIAGONAL * largest } else { floor((i - 3 * m) / 3) }
    };
    for i in 0..6 * m {
        matrix[(i, i)] += damped(i);
        if frozen(i) {
            (0..i).for_each(|j| matrix[(i, j)] = 0.0);
            matrix.col_as_slice_mut(i)[i..].fill(0.0);
            matrix[(i, i)] = 1.0;
            right[(i, 0)] = 0.0;
        }
    }
    let Ok(factor) = Llt::new(matrix.as_ref(), Side::Lower) else {
        return Step { kernels: kernels.to_vec(), promised: 0.0 };
    };
    let change = factor.solve(&right);
    let change = |i: usize| f64::from(change[(i, 0)]);
    let promised = (0..6 * m).map(|i| change(i) * (f64::from(damped(i)) * change(i) + f64::from(right[(i, 0)]))).sum();
    let kernels = kernels
        .iter()
        .enumerate()
        .map(|(k, kernel)| {
            let (x, y) = kernel.direction.any_orthonormal_pair();
            let at = 3 * m + 3 * k;
            let width = scale_rad(kernel.level);
            // The model of a kernel's answer is linear over about its own width.
            let limit = |value: f64| value.clamp(-2.0 * width, 2.0 * width);
            let tangent = limit(change(at)) * x + limit(change(at + 1)) * y;
            let weight = dvec3(change(k), change(m + k), change(2 * m + k));
            Kernel {
                direction: (kernel.direction + tangent).normalize(),
                level: (kernel.level + change(at + 2)).clamp(levels[k][0], levels[k][1]),
                weight: (kernel.weight + weight).max(DVec3::ZERO),
            }
        })
        .collect();
    Step { kernels, promised }
}
