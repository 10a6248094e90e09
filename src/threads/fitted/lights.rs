//! The lights that a fit is tested with, and how a slice answers them.
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::ops::Range;
use std::sync::OnceLock;

use glam::{DVec2, DVec3, Vec3, dvec2};

use super::kernel::{SHARPEST_LEVEL, kappa_of_level, vmf_direction, vmf_peak};
use crate::brdf::{BaseProfile, luminance};
use crate::threads::slice::{Slice, fibonacci_lattice, on_sphere};
use crate::vector_math::exp;

/// Widths of the lights: so many, evenly spaced in their logarithm from a third of a degree, a pixel of a map of 1024 columns, to
/// where a light is as wide as the hemisphere.
pub const SCALES: usize = 8;
pub(super) const NARROWEST_RAD: f64 = 0.006;
const WIDEST_RAD: f64 = 1.0;

/// Lights of a width are weighted by this power of it. Light in the world has an amplitude spectrum of about 1 / frequency; a mixture of
/// lights of unit power, evenly spread over the logarithm of width, has that with an exponent of 1.
const WIDTH_EXPONENT: f64 = 0.8;

/// Residuals count relative to the response and so many times the mean radiance: displays show dim things well, and in the tails of lobes a
/// bright lamp is all that there is, but of most pixels other light is seen, too. The more `threads`, the less they leave of most, and the more
/// they can take of what is dim: 1 up to 4, 0.5 with 16, 0.25 with 64. With 0.1, 0.3, 0.5, 1 and 4 ten measured materials in three maps, sphere and
/// dragon at 80 x 60, err by 0.00163, 0.00149, 0.00147, 0.00145 and 0.00164 with 16; a metal of GGX 0.15 beside a window that is 300 times as
/// bright as the rest by 0.0103, 0.0096, 0.0095 and 0.0114 with the first four, and with 64 by 0.0025, 0.0047, 0.0058 and 0.0065.
fn dim_response(threads: usize) -> f64 {
    (2.0 / (threads as f64).sqrt()).min(1.0)
}

/// Which lights, and how they count.
#[derive(Clone, Copy, Debug)]
pub struct LightSettings {
    /// About how many.
    pub count: usize,
    /// They count as where so many threads are fitted.
    pub threads: usize,
    /// Turns them.
    pub seed: usize,
}

/// Lights of a scale are a multiple of this, so that loops over them are made of whole vectors.
pub const LANES: usize = 16;

/// The scale of lights without width, of which no other lights are: directions, to which a kernel's answer is its value there.
pub const POINTS: usize = SCALES;

/// kappa of the lights of a scale.
pub fn light_kappa(scale: usize) -> f64 {
    if scale == POINTS { kappa_of_level(SHARPEST_LEVEL) } else { light_width(scale).powi(-2) }
}

fn light_width(scale: usize) -> f64 {
    NARROWEST_RAD * (WIDEST_RAD / NARROWEST_RAD).powf(scale as f64 / (SCALES - 1) as f64)
}

/// Points of equal mass of the narrowest light in `direction`; some may be below the horizon.
pub fn points_of_narrowest(direction: DVec3) -> Vec<DVec3> {
    const COUNT: usize = 200;
    points_of(direction, light_kappa(0), COUNT)
}

/// So many points of equal mass of the kernel of this kappa in `direction`.
fn points_of(direction: DVec3, kappa: f64, count: usize) -> Vec<DVec3> {
    fibonacci_lattice(count).map(|uv| vmf_direction(direction, kappa, uv.x, TAU * uv.y)).collect()
}

/// Lights, how strongly each counts, and what a slice makes of them. A light has radiance vMF(w; direction, kappa), so unit power.
/// Arrays have an element a light, those of the first scale first; answers are times the weight.
pub struct TestLights {
    /// Radiance that responses, and the weights of kernels that are fitted to them, are measured in: the mean of what the slice reflects,
    /// so that single precision holds the darkest material as well as any.
    pub unit: f64,
    /// Unit directions in the shading frame: x, y, z.
    pub direction: [Vec<f32>; 3],
    /// Factor on the residual of each.
    pub weight: Vec<f32>,
    /// The base's answer to each.
    pub cosine: Vec<f32>,
    /// The slice's answer to each: radiance in units, red, green, blue.
    pub response: [Vec<f32>; 3],
    /// Of which scales they are, as many of each.
    pub scales: Range<usize>,
}

/// By how many points a slice is integrated over the lights.
#[derive(Clone, Copy, Debug)]
pub struct Quadrature {
    /// Points of equal mass of the slice: for wide lights.
    pub slice_points: usize,
    /// Points of each light.
    pub light_points: usize,
}

impl Quadrature {
    /// What a fit needs: with three times as many points of a light its error is the same.
    pub const FIT: Self = Self { slice_points: 1500, light_points: 16 };
    /// The same of an anisotropic BRDF, whose many fits this makes a third quicker: four brushed materials err under other lights as they do with
    /// [`Self::FIT`] and [`Resolution::FULL`](crate::threads::slice::Resolution::FULL), within 1 % in the mean with 16 threads and 2 % with 64.
    pub const OF_AZIMUTHS: Self = Self { slice_points: 750, light_points: 8 };
    /// For drafts.
    pub const DRAFT: Self = Self { slice_points: 400, light_points: 8 };
    /// Far more, to see what the fit's leaves.
    pub const FINE: Self = Self { slice_points: 6000, light_points: 200 };
}

impl TestLights {
    /// Half of the lights in the `lobes` of `slice`, half anywhere.
    pub fn new(
        [slice, lobes]: &[Slice; 2],
        LightSettings { count, threads, seed }: LightSettings,
        quadrature: Quadrature,
        base: &BaseAnswers,
    ) -> Self {
        let per_scale = (count / SCALES / 2).next_multiple_of(LANES / 2);
        let mut directions = Vec::with_capacity(count);
        for scale in 0..SCALES {
            // Sets of different scales, rows and seeds must not line up.
            let shift = |x: f64, by: usize| (x + 0.381_966 * by as f64).fract();
            let turn = scale + SCALES * seed;
            let near = |uv: DVec2| lobes.direction(dvec2(shift(uv.x, 3 * turn + 1), shift(uv.y, turn)));
            let anywhere = |uv: DVec2| on_sphere(dvec2(shift(uv.x, 3 * turn + 2), shift(uv.y, turn)));
            directions.extend(fibonacci_lattice(per_scale).map(near));
            directions.extend(fibonacci_lattice(per_scale).map(anywhere));
        }
        let response = quadrature.responses(slice, &directions, &parts(&directions));

        let unit = unit(slice);
        let scale_of = |j: usize| j / (2 * per_scale);
        // (F20)
        let dim_response = dim_response(threads);
        let weights = response.iter().enumerate().map(|(j, response)| {
            light_width(scale_of(j)).powf(WIDTH_EXPONENT) / (luminance(*response) / unit + dim_response)
        });
        let weights: Vec<f64> = weights.collect();
        let cosine = |j: usize| base.response(directions[j].z, scale_of(j));
        Self::weighted(slice, &directions, &weights, &response, 0..SCALES, &cosine)
    }

    /// Lights of these `scales`, which count by `weights`, with what `slice` and its base answer them.
    pub(super) fn weighted(
        slice: &Slice,
        directions: &[DVec3],
        weights: &[f64],
        response: &[DVec3],
        scales: Range<usize>,
        cosine: &dyn Fn(usize) -> f64,
    ) -> Self {
        let unit = unit(slice);
        let weighted =
            |value: &dyn Fn(usize) -> f64| (0..weights.len()).map(|j| (weights[j] * value(j)) as f32).collect();
        Self {
            unit,
            direction: parts(directions),
            weight: weighted(&|_| 1.0),
            cosine: weighted(cosine),
            response: std::array::from_fn(|c| weighted(&|j| response[j][c] / unit)),
            scales,
        }
    }

    /// The sharpest kernel that they can tell: that of none at all has no value at a direction.
    pub fn sharpest_level(&self) -> f64 {
        if self.scales.contains(&POINTS) { 0.0 } else { SHARPEST_LEVEL }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.weight.len()
    }

    /// Those of one scale.
    pub fn of_scale(&self, scale: usize) -> Range<usize> {
        let each = self.count() / self.scales.len();
        let first = each * (scale - self.scales.start);
        first..first + each
    }
}

/// What responses to `slice` are measured in.
fn unit(slice: &Slice) -> f64 {
    // Where nothing is reflected any unit will do.
    let albedo = luminance(slice.albedo());
    (if albedo > 0.0 { albedo } else { 1.0 }) / (2.0 * PI)
}

/// All x, all y, all z.
fn parts(directions: &[DVec3]) -> [Vec<f32>; 3] {
    let part = |f: fn(&DVec3) -> f64| directions.iter().map(|d| f(d) as f32).collect();
    [part(|d| d.x), part(|d| d.y), part(|d| d.z)]
}

impl Quadrature {
    /// The integral of f cos over each light at `directions`, whose parts are `parts`: points of equal mass of the slice and points of
    /// each light, with the balance heuristic (F19).
    fn responses(self, slice: &Slice, directions: &[DVec3], parts: &[Vec<f32>; 3]) -> Vec<DVec3> {
        let each = directions.len() / SCALES;
        let mut sums = self.of_slice_points(slice, parts, each);
        for scale in 0..SCALES {
            let kappa = light_kappa(scale);
            let peak = vmf_peak(kappa);
            let offsets = points_of(DVec3::Z, kappa, self.light_points);
            for j in each * scale..each * (scale + 1) {
                let (x, y) = directions[j].any_orthonormal_pair();
                let points =
                    offsets.iter().map(|offset| (offset.x * x + offset.y * y + offset.z * directions[j], offset.z));
                let (w, cos): (Vec<_>, Vec<_>) = points.filter(|(w, _)| w.z > 0.0).unzip();
                for ((f_cos, w), cos) in slice.f_cos_all(&w).into_iter().zip(&w).zip(cos) {
                    let radiance = peak * (kappa * (cos - 1.0)).exp();
                    let density = self.slice_points as f64 * slice.pdf_of(f_cos, *w);
                    sums[j] += f_cos * radiance / (density + self.light_points as f64 * radiance);
                }
            }
        }
        sums
    }

    /// The part of the slice's points in that, for `each` lights a scale.
    fn of_slice_points(self, slice: &Slice, parts: &[Vec<f32>; 3], each: usize) -> Vec<DVec3> {
        // Those below the horizon, by rounding, reflect nothing.
        let directions: Vec<_> = slice.points(self.slice_points).filter(|w| w.z > 0.0).collect();
        let point = |(w, f_cos): (&DVec3, DVec3)| SlicePoint {
            direction: w.as_vec3(),
            f_cos: f_cos.as_vec3(),
            density: (self.slice_points as f64 * slice.pdf_of(f_cos, *w)) as f32,
        };
        let points: Vec<_> = directions.iter().zip(slice.f_cos_all(&directions)).map(point).collect();
        let mut sums: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; SCALES * each]);
        for scale in 0..SCALES {
            let of_scale = each * scale..each * (scale + 1);
            pulp::Arch::new().dispatch(Summing {
                points: &points,
                light_points: self.light_points as f32,
                lights: parts.each_ref().map(|part| &part[of_scale.clone()]),
                kappa: light_kappa(scale),
                sums: sums.each_mut().map(|sums| &mut sums[of_scale.clone()]),
            });
        }
        let [red, green, blue] = &sums;
        (0..red.len()).map(|j| DVec3::new(red[j].into(), green[j].into(), blue[j].into())).collect()
    }
}

/// A direction, f cos there, and the density of such points.
struct SlicePoint {
    direction: Vec3,
    f_cos: Vec3,
    density: f32,
}

/// e^-30 of a light's peak is lost in single precision.
const LOST_EXPONENT: f32 = -30.0;

/// A call of what adds up the slice's points over lights of one kappa, compiled for the vector instructions that are there.
struct Summing<'a> {
    points: &'a [SlicePoint],
    light_points: f32,
    lights: [&'a [f32]; 3],
    kappa: f64,
    sums: [&'a mut [f32]; 3],
}

impl pulp::NullaryFnOnce for Summing<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (kappa, peak) = (self.kappa as f32, vmf_peak(self.kappa) as f32);
        let [xs, ys, zs] = self.lights.map(|part| part.as_chunks::<LANES>().0);
        let [reds, greens, blues] = self.sums.map(|sums| sums.as_chunks_mut::<LANES>().0);
        let lights = xs.iter().zip(ys).zip(zs);
        for (((xs, ys), zs), ((reds, greens), blues)) in lights.zip(reds.iter_mut().zip(greens).zip(blues)) {
            let [mut red, mut green, mut blue] = [[0.0; LANES]; 3];
            for &SlicePoint { direction, f_cos, density } in self.points {
                let mut exponents = [0.0; LANES];
                for j in 0..LANES {
                    let [x, y, z] = [direction.x - xs[j], direction.y - ys[j], direction.z - zs[j]];
                    exponents[j] = -0.5 * kappa * (x * x + y * y + z * z);
                }
                // Most points are far from narrow lights. `any` would not be made of vector instructions.
                let near = exponents.iter().fold(0, |near, &exponent| near | u32::from(exponent > LOST_EXPONENT));
                if near == 0 {
                    continue;
                }
                for j in 0..LANES {
                    let radiance = peak * exp(exponents[j]);
                    let share = radiance / (density + self.light_points * radiance);
                    red[j] += f_cos.x * share;
                    green[j] += f_cos.y * share;
                    blue[j] += f_cos.z * share;
                }
            }
            (*reds, *greens, *blues) = (red, green, blue);
        }
    }
}

/// What the base answers lights with: the integral of T cos / pi over a light of each scale, over z.
pub struct BaseAnswers(Vec<Vec<f64>>);

const STEPS: usize = 512;

impl BaseAnswers {
    /// Of a base of this profile: sums of the same integrals, since T is a polynomial.
    pub fn of(BaseProfile(profile): &BaseProfile) -> Self {
        static INTEGRALS: OnceLock<Vec<Vec<CosineIntegrals>>> = OnceLock::new();
        let integrals = INTEGRALS.get_or_init(|| {
            let of_scale = |scale| {
                let points = points_of(DVec3::Z, light_kappa(scale), 512);
                (0..=STEPS).map(|i| cosine_integrals(2.0 * i as f64 / STEPS as f64 - 1.0, &points)).collect()
            };
            (0..SCALES).map(of_scale).collect()
        });
        let answer = |integrals: &CosineIntegrals| {
            integrals.iter().zip(profile).map(|(integral, term)| integral * f64::from(*term)).sum()
        };
        Self(integrals.iter().map(|of_scale| of_scale.iter().map(answer).collect()).collect())
    }

    fn response(&self, z: f64, scale: usize) -> f64 {
        let at = (0.5 * (z + 1.0)).clamp(0.0, 1.0) * STEPS as f64;
        let below = (at as usize).min(STEPS - 1);
        let table = &self.0[scale];
        table[below] + (table[below + 1] - table[below]) * (at - below as f64)
    }
}

/// Integrals of cos, cos^2 and so on over pi, one for each term of a profile.
type CosineIntegrals = [f64; BaseProfile::TERMS];

/// Those over a light of these points whose direction has this z.
fn cosine_integrals(z: f64, points: &[DVec3]) -> CosineIntegrals {
    let sin = (1.0 - z * z).max(0.0).sqrt();
    let mut sums = CosineIntegrals::default();
    for point in points {
        let cos = (z * point.z + sin * point.x).max(0.0);
        let mut power = cos;
        for sum in &mut sums {
            *sum += power;
            power *= cos;
        }
    }
    sums.map(|sum| FRAC_1_PI * sum / points.len() as f64)
}
