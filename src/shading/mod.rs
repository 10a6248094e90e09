//! Pass 2 of the paper on the CPU: the twin of glsl/shade.comp and its methods, in single precision as there.
//!
//! It starts from the texels of the geometry cache, so that the two can be compared pixel by pixel. BRDFs are evaluated
//! in double precision; everything else follows the shader line by line.
use crate::Result;
use crate::brdf::{MAX_THETA_O_DEG, MaterialRecord};
use crate::environment::{Alias, FractionBits, LightMap, SourceRecord};
use crate::geometry_texel::GeometryTexel;
use crate::light::{Light, bases};
use crate::memo::Round;
use crate::method::{Lookups, Method, Pattern};
use crate::passes::{SMOOTH_DEG, SmoothVariance, View};
use crate::prepare::{Prepared, PreparedMaterial};
use crate::shader_constants::surface::{LEAST_COS_THETA_O, LEAST_SIN_THETA_O, LEAST_TANGENT};
use crate::steps::{LookedUp, light};
use crate::tangent::any_tangent;
use crate::threads::fitted::{place_of_sum, sums_of_pixel};
use crate::threads::{FittedTable, SliceTable, SplitSum, Threads};
use glam::{Mat3, UVec2, Vec2, Vec3, Vec4};
use low_discrepancy::Stream;
use random::random_bits;
use std::f32::consts::FRAC_PI_2;

mod cosine;
mod environment;
mod filtered;
mod fitted;
mod gaussian;
mod importance;
mod importance_sampling;
mod light_sampling;
mod low_discrepancy;
mod mis;
mod paper;
pub(crate) mod random;
mod ris;
mod split_sum;
mod uniform;

/// The estimate of `method` for `point`.
fn estimate(method: Method, point: &Point) -> Vec3 {
    match method {
        Method::Fitted => fitted::estimate(point),
        Method::Paper => paper::estimate(point),
        Method::Gaussian => gaussian::estimate(point),
        Method::SplitSum => split_sum::estimate(point),
        Method::Uniform => uniform::estimate(point),
        Method::Cosine => cosine::estimate(point),
        Method::Importance => importance::estimate(point),
        Method::Filtered => filtered::estimate(point),
        Method::Environment => environment::estimate(point),
        Method::Ris => ris::estimate(point),
        Method::Mis => mis::estimate(point),
        Method::Reference => unreachable!("a twin is made for methods that have a shader"),
    }
}

/// A point to shade: its shading frame and view angle. Twin of `Surface` in glsl/surface.glsl.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Columns: x, the part of w_o orthogonal to n; y = z cross x; z = n.
    pub frame: Mat3,
    /// Towards the eye, unit.
    pub w_o: Vec3,
    /// Angle between the normal and w_o in radians; above 90 degrees where an interpolated normal faces away.
    pub theta_o: f32,
    /// Variance of the normal within the pixel along each axis, in rad^2, and a quarter of that of the view, where sub-pixels share one sum; else 0.
    pub normal_variance: f32,
    /// Cosine and sine of the azimuth of w_o from the tangent; (1, 0) where the material is isotropic.
    pub phi_o: Vec2,
}

impl Surface {
    /// The frame at unit normal `n`, seen from unit `w_o`. Twin of `make_surface`.
    pub fn new(n: Vec3, w_o: Vec3) -> Self {
        let cos_theta_o = n.dot(w_o);
        let across = w_o - cos_theta_o * n;
        let sin_theta_o = across.length();
        let x = if sin_theta_o > LEAST_SIN_THETA_O { across / sin_theta_o } else { any_tangent(n) };
        Self {
            frame: Mat3::from_cols(x, n.cross(x), n),
            w_o,
            theta_o: sin_theta_o.atan2(cos_theta_o),
            normal_variance: 0.0,
            phi_o: Vec2::X,
        }
    }

    /// Turns the tangent to what of `tangent`, of any length, is in the tangent plane. Twin of `set_tangent`.
    pub fn set_tangent(&mut self, tangent: Vec3) {
        let along = Vec2::new(self.frame.x_axis.dot(tangent), -self.frame.y_axis.dot(tangent));
        self.phi_o = if along.length() > LEAST_TANGENT { along / along.length() } else { Vec2::X };
    }

    /// Towards the eye in the shading frame, at most [`MAX_THETA_O_DEG`] from the normal. Twin of `view_direction`.
    pub fn view_direction(&self) -> Vec3 {
        let cos_theta_o = self.frame.z_axis.dot(self.w_o).max(LEAST_COS_THETA_O);
        Vec3::new(self.frame.x_axis.dot(self.w_o), 0.0, cos_theta_o).normalize()
    }
}

/// The cosine of an angle so near to a right one is what it lacks.
const _: () = assert!((LEAST_COS_THETA_O as f64 / (90.0 - MAX_THETA_O_DEG).to_radians() - 1.0).abs() < 1e-4);

/// Where a view angle (radians) is among `count` rows, in single precision as shaders have it; and the rows below and above.
fn rows_around(theta_o: f32, count: usize) -> (f32, [usize; 2]) {
    let last = (count - 1) as f32;
    let row = (theta_o * (last / FRAC_PI_2)).min(last);
    (row, [row as usize, (row as usize + 1).min(count - 1)])
}

/// GLSL's function of this name, between two edges.
fn smoothstep([from, to]: [f32; 2], x: f32) -> f32 {
    let x = ((x - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// `w` of the shading frame, turned about z by an angle of this cosine and sine. Twin of `turned`.
fn turned(w: Vec3, angle: Vec2) -> Vec3 {
    angle.rotate(w.truncate()).extend(w.z)
}

/// The texels of `geometry`, a geometry cache, that a pixel of `view` sees, row by row.
pub fn texels_of_pixel(view: &View, geometry: &[[u32; 2]], pixel: UVec2) -> Vec<UVec2> {
    let s = view.subpixels;
    let texel = |j: u32| {
        let at = pixel * s + UVec2::new(j % s, j / s);
        UVec2::from(geometry[(at.y * view.width * s + at.x) as usize])
    };
    (0..s * s).map(texel).collect()
}

/// Whether the sub-pixels of a pixel of `prepared` lie on one smooth surface. Twin of glsl/classify.comp.
pub fn is_interior(prepared: &Prepared, texels: &[UVec2]) -> bool {
    let Some(first) = texels.first().copied().and_then(GeometryTexel::unpack) else { return false };
    let is_near = |texel: &UVec2| {
        GeometryTexel::unpack(*texel).is_some_and(|GeometryTexel { normal, material, .. }| {
            material == first.material && normal.dot(first.normal) >= SMOOTH_DEG.to_radians().cos()
        })
    };
    let SmoothVariance { of_normals, of_tangents } = prepared.smooth_variance();
    let tangents_agree =
        || first.tangent.is_none() || 1.0 - tangent_sum(texels).length() / (texels.len() as f32) < of_tangents;
    texels.iter().all(is_near) && normal_moments(texels).1 < of_normals && tangents_agree()
}

/// The sum of the tangents of these sub-pixels, as far as they have any.
fn tangent_sum(texels: &[UVec2]) -> Vec3 {
    texels.iter().filter_map(|texel| GeometryTexel::unpack(*texel)?.tangent).sum()
}

/// The mean of the normals of these sub-pixels, which all see a surface, and their variance along each of two axes, in rad^2. Twin of
/// glsl/normal_variance.glsl.
fn normal_moments(texels: &[UVec2]) -> (Vec3, f32) {
    let normals = texels.iter().filter_map(|texel| GeometryTexel::unpack(*texel)).map(|texel| texel.normal);
    let (first, count) = (normals.clone().next().unwrap_or_default(), texels.len() as f32);
    let (mut differences, mut squares) = (Vec3::ZERO, 0.0);
    for difference in normals.map(|normal| normal - first) {
        differences += difference;
        squares += difference.length_squared();
    }
    let mean = differences / count;
    let one_minus_square = (squares / count - mean.length_squared()).clamp(0.0, 1.0);
    (first + mean, one_minus_square / (1.0 + (1.0 - one_minus_square).sqrt()))
}

/// The CPU twin of pass 2 for one scene.
pub struct CpuShader<'a> {
    prepared: &'a Prepared,
    /// What has to be filtered of the environment.
    light: Light,
    /// The environment as it is, or for fitted threads with its sources marked.
    map: Option<LightMap>,
    aliases: Vec<Alias>,
    /// Of each material.
    looked_up: Vec<LookedUp>,
    /// Of each material.
    records: Vec<MaterialRecord>,
    /// The small bright sources of the environment.
    sources: Vec<SourceRecord>,
    /// Those of lookups in cube maps.
    fractions: FractionBits,
}

impl<'a> CpuShader<'a> {
    /// Makes what the method of `prepared` looks up, as the device has it.
    ///
    /// # Errors
    /// Cancelled.
    pub fn new(prepared: &'a Prepared, round: &Round) -> Result<Self> {
        let Prepared { method, environment, materials, .. } = prepared;
        let evaluates_brdf = method.evaluates_brdf(environment);
        let lookups = method.lookups();
        let light = light(round, None, *method, environment, &prepared.shaded(), false)?;
        let map = match lookups {
            Lookups { blurred: true, .. } => Some(LightMap::with_sources_marked(environment)),
            Lookups { map: true, .. } => Some(LightMap::new(environment)),
            _ => None,
        };
        let looked_up = materials.iter().map(|of| LookedUp::ask(round, *method, &of.brdf, evaluates_brdf));
        let (_, base_maps) = bases(materials.iter().map(|material| material.threads.as_deref()));
        let record = |(material, base_map): (&PreparedMaterial, usize)| {
            let record =
                MaterialRecord { base_map: base_map as u32, ..MaterialRecord::new(&material.brdf, &material.lobe) };
            material.threads.as_deref().map_or(record, |threads| threads.in_record(record, &material.lobe))
        };
        Ok(Self {
            prepared,
            light,
            aliases: map.as_ref().filter(|_| lookups.aliases).map(LightMap::aliases).unwrap_or_default(),
            map,
            looked_up: looked_up.collect::<Result<_>>()?,
            records: materials.iter().zip(base_maps).map(record).collect(),
            sources: environment.small_sources().records(1.0),
            fractions: FractionBits::ALL,
        })
    }

    /// The same as on a device whose lookups in cube maps blend by fractions of so many bits.
    pub fn with_fractions(self, fractions: FractionBits) -> Self {
        Self { fractions, ..self }
    }

    /// The same as on a device whose cube maps hold half floats.
    pub fn with_half_light(self) -> Self {
        Self { light: self.light.in_half_floats(), ..self }
    }

    /// Linear radiance times coverage, and coverage, of the pixel that sees `texels`: its sub-pixels, row by row.
    /// Twin of glsl/shade.comp.
    pub fn shade(&self, pixel: UVec2, texels: &[UVec2]) -> Vec4 {
        let interior = is_interior(self.prepared, texels);
        let shaded = match self.prepared.method.shares_surface() {
            true => self.shade_shared(pixel, texels, interior),
            false => self.shade_partition(pixel, texels, interior),
        };
        bounded(shaded.truncate() * self.prepared.view.intensity as f32).extend(shaded.w)
    }

    /// Twin of `shade_pixel` in glsl/partition.glsl.
    fn shade_partition(&self, pixel: UVec2, texels: &[UVec2], interior: bool) -> Vec4 {
        let normal_variance = if interior { normal_moments(texels).1 } else { 0.0 };
        let stride = if interior { texels.len() } else { 1 };
        let mut sum = Vec4::ZERO;
        for (j, texel) in texels.iter().enumerate() {
            let Some(mut point) = self.subpixel(pixel, j, *texel) else { continue };
            point.surface.normal_variance = normal_variance;
            (point.first, point.stride) = if interior { (j as u32, stride) } else { (0, 1) };
            sum += point.estimate().extend(1.0);
        }
        let count = texels.len() as f32;
        if interior { sum.truncate().extend(sum.w / count) } else { sum / count }
    }

    /// Twin of `shade_pixel` in glsl/shared_sum.glsl.
    fn shade_shared(&self, pixel: UVec2, texels: &[UVec2], interior: bool) -> Vec4 {
        let mean = texels.first().filter(|_| interior).and_then(|texel| self.subpixel(pixel, 0, *texel));
        if let Some(mut point) = mean {
            let View { width, height, .. } = self.prepared.view;
            let position = (pixel.as_vec2() + 0.5) / UVec2::new(width, height).as_vec2();
            let (mean, normal_variance) = normal_moments(texels);
            point.surface = self.surface_at(position, mean.normalize(), tangent_sum(texels));
            point.surface.normal_variance = normal_variance + 0.25 * self.prepared.view.view_variance();
            if !fitted::needs_subpixels(&point) {
                point.is_pixel = true;
                return point.estimate().extend(1.0);
            }
        }
        let subpixels = self.prepared.view.subpixels;
        let places: Vec<u32> = match interior {
            true => (0..sums_of_pixel(subpixels)).map(|j| place_of_sum(j, subpixels)).collect(),
            false => (0..subpixels * subpixels).collect(),
        };
        let points = places.iter().enumerate().filter_map(|(j, &place)| {
            let place = place as usize;
            let mut point = self.subpixel(pixel, place, texels[place])?;
            let sets = point.fitted_threads().map_or(1, |table| table.sets);
            (point.first, point.stride) = ((j % sets) as u32, sets);
            Some(point)
        });
        points.map(|point| point.estimate().extend(1.0)).sum::<Vec4>() / places.len() as f32
    }

    /// The surface that is seen at a place in the picture, from 0 to 1. Twin of `surface_at` in glsl/shade.comp.
    fn surface_at(&self, position: Vec2, normal: Vec3, tangent: Vec3) -> Surface {
        let w_o = -self.prepared.view.camera_rays().ray(position).normalize();
        let mut surface = Surface::new(self.to_environment(normal), self.to_environment(w_o));
        if self.prepared.has_tangents() {
            surface.set_tangent(self.to_environment(tangent));
        }
        surface
    }

    /// Twin of `to_environment`.
    fn to_environment(&self, d: Vec3) -> Vec3 {
        let [cos, sin] = self.prepared.view.rotation();
        Vec3::new(cos * d.x - sin * d.z, d.y, sin * d.x + cos * d.z)
    }

    /// Sub-pixel `j` of `pixel`, which sees `texel`, by all threads or samples; none if it sees no surface.
    fn subpixel(&self, pixel: UVec2, j: usize, texel: UVec2) -> Option<Point<'_>> {
        let GeometryTexel { normal, tangent, material } = GeometryTexel::unpack(texel)?;
        let view = &self.prepared.view;
        let subpixel = pixel * view.subpixels + UVec2::new(j as u32 % view.subpixels, j as u32 / view.subpixels);
        let size = UVec2::new(view.width, view.height) * view.subpixels;
        let position = (subpixel.as_vec2() + 0.5) / size.as_vec2();
        let surface = self.surface_at(position, normal, tangent.unwrap_or_default());
        let axis = self.to_environment(view.camera_rays().right());
        Some(Point { twin: self, surface, axis, material, subpixel, first: 0, stride: 1, is_pixel: false })
    }
}

/// A sub-pixel to shade, and its part of the samples: what `estimate` gets in the shader.
struct Point<'a> {
    twin: &'a CpuShader<'a>,
    surface: Surface,
    /// The camera's right, in the environment's coordinates.
    axis: Vec3,
    material: usize,
    subpixel: UVec2,
    /// Threads or samples `first`, `first + stride`, ...
    first: u32,
    stride: usize,
    /// Whether it stands for all sub-pixels.
    is_pixel: bool,
}

impl Point<'_> {
    fn estimate(&self) -> Vec3 {
        estimate(self.twin.prepared.method, self)
    }

    fn material(&self) -> &PreparedMaterial {
        &self.twin.prepared.materials[self.material]
    }

    /// The threads by which it is shaded, for methods that have any.
    fn threads(&self) -> Option<&Threads> {
        self.material().threads.as_deref()
    }

    /// These, if they are kernels: a sub-pixel that shares no sum has its own.
    fn fitted_threads(&self) -> Option<&FittedTable> {
        let table = self.threads()?.fitted()?;
        Some(if self.is_pixel { table } else { table.for_subpixels() })
    }

    fn record(&self) -> &MaterialRecord {
        &self.twin.records[self.material]
    }

    fn sample_count(&self) -> u32 {
        self.twin.prepared.sampling.count
    }

    fn partition(&self) -> impl Iterator<Item = u32> + use<> {
        (self.first..self.sample_count()).step_by(self.stride)
    }

    /// Twin of `brdf_at`.
    fn brdf(&self, w_i: Vec3, w_o: Vec3) -> Vec3 {
        let brdf = self.looked_up().table.as_ref().unwrap_or(&self.material().brdf);
        let [w_i, w_o] = [w_i, w_o].map(|w| turned(w, self.surface.phi_o));
        brdf.evaluate(w_i.as_dvec3(), w_o.as_dvec3()).as_vec3()
    }

    fn random_bits(&self, index: u32) -> [u32; 4] {
        random_bits(self.subpixel, index, self.twin.prepared.sampling.seed)
    }

    /// The low-discrepancy set that is the same for all pixels. Twin of `fixed_stream` in glsl/pattern.glsl.
    fn fixed_stream(&self) -> Stream {
        Stream::new(UVec2::ZERO, 0, self.twin.prepared.sampling.seed)
    }

    /// The random words of sample `k`. Twin of `sample_bits` in glsl/pattern.glsl.
    fn sample_bits(&self, fixed_set: &Stream, k: u32) -> [u32; 4] {
        if self.twin.prepared.sampling.pattern == Pattern::PerPixel {
            return self.random_bits(k);
        }
        let [x, y, z, w] = fixed_set.bits(k);
        [z, x, y, w]
    }

    /// The pyramid's mean radiance over `solid_angle` (sr) around `direction`.
    fn filtered_radiance(&self, direction: Vec3, solid_angle: f32) -> Vec3 {
        let pyramid = self.twin.light.box_filtered.as_ref().expect("the method looks the pyramid up");
        pyramid.lookup_by(direction, pyramid.level_of(solid_angle, direction), self.twin.fractions)
    }

    /// Radiance and density of the map. Twin of `environment_texel`.
    fn environment_texel(&self, direction: Vec3) -> Vec4 {
        self.map().texel(direction)
    }

    fn environment_radiance(&self, direction: Vec3) -> Vec3 {
        self.environment_texel(direction).truncate()
    }

    fn map(&self) -> &LightMap {
        self.twin.map.as_ref().expect("the method declares the map")
    }

    fn looked_up(&self) -> &LookedUp {
        &self.twin.looked_up[self.material]
    }

    fn split_sum(&self) -> &SplitSum {
        self.looked_up().split_sum.as_ref().expect("the method looks split sums up")
    }

    fn slices(&self) -> &SliceTable {
        self.looked_up().slices.as_ref().expect("the method looks CDFs up")
    }
}

/// Radiance that is finite: what would be more is the largest number of single precision. What is no number stays so. Twin of
/// glsl/bounded.glsl.
fn bounded(radiance: Vec3) -> Vec3 {
    Vec3::select(radiance.cmpgt(Vec3::MAX), Vec3::MAX, radiance)
}

/// Display value in [0, 1] of linear radiance. Twin of glsl/tone_map.comp.
pub fn display_value(radiance: f32, exposure: f32, gamma: f32) -> f32 {
    (exposure * radiance).clamp(0.0, 1.0).powf(1.0 / gamma)
}
