//! Light between a base and the inside of its coat, reflected to and fro.
//!
//! The coat's inside is level, so it mirrors: it keeps azimuths, and the mean over azimuth of what goes on is a matter of angles to the normal
//! alone. With B(theta, theta') the share of light from theta that the base sends to theta' and the coat back to it,
//! M and E the shares that leave the base at theta' and the coat there, all light leaves in proportion to
//!
//! ```text
//! E + B E + B^2 E + ... = P E,   P = 1 + B + B^2 + ...
//! ```
//!
//! which conserves energy whatever the base. Which way it leaves over azimuth, P does not say. See `mod.rs` beside this for what is made of it.
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3, dvec3};

use super::coat::{Coat, Interface};
use crate::brdf::cosines::{at_cosine, mean_under_even_light};
use crate::brdf::made_table::{exponential, exponential_slope, knee_of_lobe};
use crate::brdf::{Brdf, Lambert, half_vector_width, reflect};

/// Angles to the normal of light that comes from outside, at cosines (i / (n - 1))^2 there.
const OPEN: usize = 40;
/// Steps of means over the hemisphere.
const STEPS: usize = 512;
/// Angles of light that is reflected totally.
const TRAPPED: usize = 20;
/// Light this near to the mirror direction counts as such: enough for some hundred points of the lattice.
const NEAR_RAD: f64 = 0.05;
/// P has 2^DOUBLINGS terms: of white Lambert's base under ior 3, 4e-6 is left after 148.
const DOUBLINGS: usize = 12;
/// Points of the lattice over half vectors, and its generator: Fibonacci numbers, the second two before the first.
const POINTS: usize = 10946;
const GENERATOR: usize = 4181;
/// Parts of a turn from point to point: 1 over the plastic number, which has nothing in common with the lattice.
const AZIMUTH_STEP: f64 = 0.754_877_666_246_692_7;
/// How much of the light that comes later is counted: with so many points, white bases err by up to 0.65 %, and energy is hardly to exceed 1.
const COUNTED: f64 = 0.995;

/// What light between base and coat adds to what the base reflects once: see `mod.rs` beside this. By the cosine outside, as [`at_cosine`] reads it.
#[derive(Debug)]
pub(super) struct Interreflection {
    /// Square root of the factor of the base's lobe, times what gets in.
    lobe: Vec<DVec3>,
    /// Square root of what leaves evenly, times ior, in 1/sqrt(sr).
    haze: Vec<DVec3>,
}

impl Interreflection {
    /// Of the base's lobe.
    pub fn lobe(&self, cos_outside: f64) -> DVec3 {
        at_cosine(&self.lobe, cos_outside)
    }

    /// Of what leaves evenly.
    pub fn haze(&self, cos_outside: f64) -> DVec3 {
        at_cosine(&self.haze, cos_outside)
    }

    pub fn new(base: &Brdf, coat: &Coat, interface: &Interface) -> Self {
        match base {
            Brdf::Lambert(Lambert { reflectance }) => Self::over_diffuse(*reflectance, coat, interface),
            _ => Self::over_any(base, coat, interface),
        }
    }

    /// What a diffuse base sends up forgets where it came from. With r the share of it that the coat sends back, all that leaves is 1 / (1 -
    /// reflectance r) times what leaves at once, and evenly as that does (Saunderson 1942).
    fn over_diffuse(reflectance: DVec3, coat: &Coat, interface: &Interface) -> Self {
        let left = |cos_inside: f64| coat.left_after(cos_inside) * coat.left_after(cos_inside);
        // The integral of 2 cos dcos: within over what is reflected totally, and over the cosines c = t^2 outside, by 2 c dc / n^2, where T is known.
        let critical = coat.critical_cos();
        let trapped = mean_under_even_light(STEPS, |cos| left(critical * cos) * (critical * critical));
        let open = mean_under_even_light(STEPS, |cos| {
            left(coat.cos_inside(cos)) * ((1.0 - interface.transmittance(cos)) / (coat.ior * coat.ior))
        });
        let back = reflectance * (trapped + open);
        let factor = (back / (DVec3::ONE - back)).map(f64::sqrt);
        let lobe = |i: usize| {
            let cos_outside = Angles::open_cos(i);
            factor * coat.left_after(coat.cos_inside(cos_outside)) * interface.transmittance(cos_outside)
        };
        Self { lobe: (0..OPEN).map(lobe).collect(), haze: vec![DVec3::ZERO; OPEN] }
    }

    fn over_any(base: &Brdf, coat: &Coat, interface: &Interface) -> Self {
        let angles = Angles::new(coat);
        let knee = knee_of_lobe(base, half_vector_width(base));
        let seen_from = |i: usize| Shares::seen_from(&angles, angles.cos_inside(i), base, coat, interface, knee);
        let shares = each_on_own_threads(angles.count(), &seen_from);
        let near = angles.near();
        let [red, green, blue] = [0, 1, 2].map(|channel| of_channel(&shares, &near, channel));
        let entering = |i: usize| {
            let cos_outside = Angles::open_cos(i);
            interface.transmittance(cos_outside) * coat.left_after(coat.cos_inside(cos_outside))
        };
        let both = |i: usize| {
            let [(rl, rh), (gl, gh), (bl, bh)] = [red[i], green[i], blue[i]];
            (dvec3(rl, gl, bl) * entering(i), dvec3(rh, gh, bh) * entering(i))
        };
        let (lobe, mut haze): (Vec<_>, Vec<_>) = (0..OPEN).map(both).unzip();
        // What leaves evenly from theta_i is to be haze(theta_i) of the light outside: haze(theta_i) haze(theta_o) over this.
        let mean = mean_under_even_light(STEPS, |cos| at_cosine(&haze, cos)) * (PI / (coat.ior * coat.ior));
        let scale = mean.map(|mean| if mean > 0.0 { mean.sqrt().recip() } else { 0.0 });
        haze.iter_mut().for_each(|haze| *haze *= scale);
        Self { lobe, haze }
    }
}

/// `f` of each index below `count`, in order. Not on rayon's threads: one of these that waits goes on with other work of the pool, which may be to
/// evaluate this BRDF, and would then wait for itself.
fn each_on_own_threads<T: Send>(count: usize, f: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let part = count.div_ceil(std::thread::available_parallelism().map_or(1, usize::from)).max(1);
    std::thread::scope(|scope| {
        let parts = (0..count).step_by(part).map(|first| first..(first + part).min(count));
        let workers: Vec<_> = parts.map(|part| scope.spawn(move || part.map(f).collect::<Vec<_>>())).collect();
        let join = |worker: std::thread::ScopedJoinHandle<Vec<T>>| {
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        workers.into_iter().flat_map(join).collect()
    })
}

/// Angles to the normal within the coat: `OPEN` from which light leaves, and those of light that is trapped before them.
struct Angles {
    coat: Coat,
    trapped: usize,
}

impl Angles {
    fn new(coat: &Coat) -> Self {
        // ior = 1 traps none.
        Self { coat: *coat, trapped: if coat.critical_cos() > 1e-4 { TRAPPED } else { 0 } }
    }

    fn count(&self) -> usize {
        self.trapped + OPEN
    }

    /// The cosine outside of the `i`-th angle from which light leaves; the first is all but 0.
    fn open_cos(i: usize) -> f64 {
        (i as f64 / (OPEN - 1) as f64).powi(2).max(1e-4)
    }

    fn cos_inside(&self, i: usize) -> f64 {
        match i.checked_sub(self.trapped) {
            Some(open) => self.coat.cos_inside(Self::open_cos(open)).max(1e-4),
            None => self.coat.critical_cos() * (i as f64 + 0.5) / (self.trapped as f64 + 0.5),
        }
    }

    /// How near angles are to each other: 1 within 3 degrees, less beyond.
    fn near(&self) -> Matrix {
        let theta = |i: usize| self.cos_inside(i).acos();
        let weight = |i: usize, j: usize| (-((theta(i) - theta(j)) / NEAR_RAD).powi(2)).exp();
        (0..self.count()).map(|i| (0..self.count()).map(|j| weight(i, j)).collect()).collect()
    }

    /// The two angles between which a cosine is, and the share of the second.
    fn place(&self, cos_inside: f64) -> (usize, f64) {
        let position = match self.coat.cos_outside(cos_inside) {
            Some(cos_outside) => self.trapped as f64 + cos_outside.sqrt() * (OPEN - 1) as f64,
            None => cos_inside / self.coat.critical_cos() * (self.trapped as f64 + 0.5) - 0.5,
        };
        let first = (position.max(0.0) as usize).min(self.count() - 2);
        (first, (position - first as f64).clamp(0.0, 1.0))
    }
}

/// Shares of light from one angle that go to each of [`Angles`].
struct Shares {
    /// Off the base.
    off_base: Vec<DVec3>,
    /// Off the base and back to it from the coat.
    back: Vec<DVec3>,
    /// Off the base and out.
    out: Vec<DVec3>,
}

impl Shares {
    /// By a Fibonacci lattice over the half vector, dense where the base's lobe is.
    fn seen_from(angles: &Angles, cos_theta: f64, base: &Brdf, coat: &Coat, interface: &Interface, knee: f64) -> Self {
        let w_o = dvec3((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta);
        let none = || vec![DVec3::ZERO; angles.count()];
        let mut shares = Self { off_base: none(), back: none(), out: none() };
        // At another azimuth each time: of an anisotropic base all that follows is a mean over them.
        let f = |w: DVec3, i: usize| {
            let turn = DVec2::from_angle(TAU * (i as f64 * AZIMUTH_STEP).fract());
            let turned = |w: DVec3| turn.rotate(w.truncate()).extend(w.z);
            base.evaluate(turned(w), turned(w_o))
        };
        for i in 0..POINTS {
            // In right angles.
            let theta_h = exponential((i as f64 + 0.5) / POINTS as f64, knee);
            let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * theta_h).sin_cos();
            let solid_angle = sin_theta_h * FRAC_PI_2 * exponential_slope(theta_h, knee) * TAU / POINTS as f64;
            let phi = TAU * ((i * GENERATOR % POINTS) as f64 + 0.5) / POINTS as f64;
            let h = (DVec2::from_angle(phi) * sin_theta_h).extend(cos_theta_h);
            let cos_theta_d = w_o.dot(h);
            let w = reflect(w_o, h);
            if cos_theta_d > 0.0 && w.z > 0.0 {
                // dw = 4 (w_o . h) dw_h.
                let share = f(w, i) * (w.z * 4.0 * cos_theta_d * solid_angle);
                shares.add(angles, coat, interface, w.z, share);
            }
        }
        shares.normalised()
    }

    fn add(&mut self, angles: &Angles, coat: &Coat, interface: &Interface, cos_inside: f64, share: DVec3) {
        let transmittance = coat.cos_outside(cos_inside).map_or(0.0, |cos| interface.transmittance(cos));
        let left = coat.left_after(cos_inside);
        let (first, part) = angles.place(cos_inside);
        for (place, part) in [(first, 1.0 - part), (first + 1, part)] {
            self.off_base[place] += share * part;
            self.back[place] += share * left * left * ((1.0 - transmittance) * part);
            self.out[place] += share * left * (transmittance * part);
        }
    }

    /// A base that reflects more than it receives, were it by rounding, would do so ever again: here it reflects all.
    fn normalised(mut self) -> Self {
        let albedo: DVec3 = self.off_base.iter().sum();
        let scale = albedo.max(DVec3::ONE).recip();
        for share in [&mut self.off_base, &mut self.back, &mut self.out] {
            share.iter_mut().for_each(|share| *share *= scale);
        }
        self
    }
}

/// For each angle from which light leaves: square root of the factor of the base's lobe, and what leaves evenly, as a share of what got in.
fn of_channel(shares: &[Shares], near: &Matrix, channel: usize) -> Vec<(f64, f64)> {
    let matrix = |of: fn(&Shares) -> &Vec<DVec3>| -> Matrix {
        shares.iter().map(|row| of(row).iter().map(|share| share[channel]).collect()).collect()
    };
    let [off_base, back, out] = [matrix(|row| &row.off_base), matrix(|row| &row.back), matrix(|row| &row.out)];
    let all_orders = geometric_series(&back);
    let later = product(&all_orders, &product(&back, &off_base));
    let once: Vec<f64> = out.iter().map(|row| row.iter().sum()).collect();
    let total = times(&all_orders, &once);
    // Of light about the mirror direction, how much comes later to what comes at once.
    let ratio = |i: usize| {
        let [later, at_once] = [&later[i], &off_base[i]].map(|row| dot(row, &near[i]));
        if at_once > 0.0 { later / at_once } else { 0.0 }
    };
    let factors: Vec<f64> = (0..shares.len()).map(|i| ratio(i).max(0.0).sqrt()).collect();
    let of_lobe: Vec<f64> = times(&out, &factors).iter().zip(&factors).map(|(sum, factor)| sum * factor).collect();
    let left = |i: usize| COUNTED * (total[i] - once[i]).max(0.0);
    // No more may leave by the lobe than leaves at all.
    let capped = |i: usize| if of_lobe[i] > left(i) { factors[i] * left(i) / of_lobe[i] } else { factors[i] };
    let factors: Vec<f64> = (0..shares.len()).map(capped).collect();
    let of_lobe = times(&out, &factors);
    let first_open = shares.len() - OPEN;
    (first_open..shares.len()).map(|i| (factors[i], (left(i) - factors[i] * of_lobe[i]).max(0.0))).collect()
}

/// Rows of numbers. Not of a library: such small ones need no blocks, for which that of the fits takes 4 MB.
type Matrix = Vec<Vec<f64>>;

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let row = |row: &Vec<f64>| {
        let mut sum = vec![0.0; b[0].len()];
        for (factor, line) in row.iter().zip(b) {
            sum.iter_mut().zip(line).for_each(|(sum, value)| *sum += factor * value);
        }
        sum
    };
    a.iter().map(row).collect()
}

fn times(a: &Matrix, vector: &[f64]) -> Vec<f64> {
    a.iter().map(|row| dot(row, vector)).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// 1 + B + ... + B^(2^DOUBLINGS - 1), doubled again and again: with no loss at all there is no end to it.
fn geometric_series(b: &Matrix) -> Matrix {
    let unit = |i: usize| (0..b.len()).map(|j| f64::from(u8::from(i == j))).collect();
    let mut sum: Matrix = (0..b.len()).map(unit).collect();
    let mut power = b.clone();
    for _ in 0..DOUBLINGS {
        let next = product(&power, &sum);
        sum.iter_mut().flatten().zip(next.iter().flatten()).for_each(|(sum, next)| *sum += next);
        power = product(&power, &power);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn over_a_diffuse_base_the_closed_form_is_the_sum_over_all_angles() {
        for (reflectance, ior, alpha, absorption) in
            [(1.0, 1.5, 0.05, 0.0), (0.6, 2.5, 0.4, 0.0), (0.8, 1.33, 1.0, 1.0)]
        {
            let coat = Coat { alpha, ior, thickness_mm: 0.3, absorption: DVec3::splat(absorption) };
            let interface = coat.interface();
            let base = of_model("lambert", &format!("reflectance = {reflectance}"));
            let [closed, summed] =
                [Interreflection::new(&base, &coat, &interface), Interreflection::over_any(&base, &coat, &interface)];
            for cos_theta in [0.05, 0.3, 0.7, 1.0] {
                let energy = |found: &Interreflection| {
                    // By what each adds to f of white light, of which the sum counts 0.5 % less.
                    let haze = found.haze(cos_theta).x * found.haze(0.5).x * PI / reflectance;
                    found.lobe(cos_theta).x * found.lobe(0.5).x + haze
                };
                let (closed, summed) = (energy(&closed), energy(&summed));
                assert!(
                    (summed / closed - 1.0).abs() < 0.02,
                    "{ior} {alpha} at {cos_theta}: {closed}, summed {summed}"
                );
            }
        }
    }
}
