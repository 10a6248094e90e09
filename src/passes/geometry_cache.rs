//! Pass 1 of the paper (section 4.1): normal and material of what is seen, at sub-pixel resolution.
use super::region::Corner;
use super::{Region, View};
use crate::Result;
use crate::graph::{FrameGraph, ImageDesc, ImageHandle};
use crate::memo::Keyed;
use crate::packing::pack_snorm_2x16;
use crate::scene::{BoundingSphere, Mesh, TangentRule};
use crate::shader_constants::geometry_cache::{NO_TANGENT, TANGENT_ALONG, TANGENT_AROUND, TANGENT_OF_MESH};
use crate::vulkan::{
    Device, GraphicsPipeline, GraphicsState, PipelineCache, Shader, Triangles, VertexAttribute, compiled,
};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{BVec3, DAffine3, DVec2, DVec3, Vec3};
use half::f16;
use std::sync::Arc;

/// [`GeometryTexel`](crate::geometry_texel::GeometryTexel).
const GEOMETRY_FORMAT: vk::Format = vk::Format::R32G32_UINT;
const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

/// Bytes of a position, of a normal, and of a tangent.
const VERTEX_STRIDE: u32 = size_of::<[f32; 3]>() as u32;

/// How far the far plane is behind all that may be seen, in units of its extent: more than rounding moves a vertex, and no more than what
/// the narrowest camera sees is deep.
const BEHIND: f64 = 1e-6;

/// What the vertex shader may be off by, of the size of what it adds: some ten roundings of 2^-24.
const ROUNDING: f64 = 1e-6;

/// The triangles of a mesh on the device.
pub struct DeviceMesh {
    /// Positions are from the middle of the bounding sphere.
    triangles: Triangles,
    /// Around it in object space.
    sphere: BoundingSphere,
    /// The smallest and largest coordinates there.
    bounds: (Vec3, Vec3),
}

impl DeviceMesh {
    /// Uploads `mesh`.
    ///
    /// # Errors
    /// No device memory left.
    pub fn new(device: &Arc<Device>, name: &str, mesh: &Mesh) -> Result<Self> {
        let mesh = mesh.in_drawing_order();
        let sphere = mesh.bounding_sphere();
        let from_middle: Vec<_> =
            mesh.positions.iter().map(|position| (position.as_dvec3() - sphere.centre).as_vec3()).collect();
        let attribute = |name, bytes| VertexAttribute { name, stride: VERTEX_STRIDE, bytes };
        // What no tangent goes by takes no memory.
        let tangents = if mesh.tangents.is_empty() { &mesh.normals } else { &mesh.tangents };
        let attributes = [
            attribute("positions", bytemuck::cast_slice(&from_middle)),
            attribute("normals", bytemuck::cast_slice(&mesh.normals)),
            attribute("tangents", bytemuck::cast_slice(tangents)),
        ];
        Ok(Self { triangles: Triangles::new(device, name, &attributes, &mesh.indices)?, sphere, bounds: mesh.bounds() })
    }
}

/// A mesh in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedMesh {
    /// Which mesh.
    pub mesh: usize,
    /// Which material.
    pub material: u32,
    /// Object to world space.
    pub to_world: DAffine3,
    /// Which way its tangents go; none where its material is isotropic.
    pub tangent: Option<PlacedTangent>,
}

impl PlacedMesh {
    /// A sphere in world space that holds what `sphere` in object space does.
    pub fn placed_sphere(&self, sphere: BoundingSphere) -> BoundingSphere {
        let m = self.to_world.matrix3;
        let scale = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
        BoundingSphere { centre: self.to_world.transform_point3(sphere.centre), radius: scale * sphere.radius }
    }
}

/// Which way the tangents of an object go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedTangent {
    /// Those of the surface.
    pub rule: TangentRule,
    /// By how much they are turned from there, counter-clockwise seen from outside: the rotation of the material.
    pub turn_deg: f64,
}

impl PlacedTangent {
    /// Cosine and sine of the turn.
    pub fn turn(self) -> DVec2 {
        DVec2::from_angle(self.turn_deg.to_radians())
    }
}

/// What the pass is made of.
#[derive(Clone)]
pub struct GeometryCache {
    /// The shaders: see [`geometry_pipeline`].
    pub pipeline: Keyed<GraphicsPipeline>,
    /// Each mesh once.
    pub meshes: Vec<Keyed<DeviceMesh>>,
    /// Which of them are where.
    pub objects: Vec<PlacedMesh>,
}

/// `Object` in glsl/geometry_cache.glsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    to_world: [[f32; 4]; 3],
    clip_x: [f32; 4],
    clip_y: [f32; 4],
    clip_w: [f32; 4],
    tangent_axis: [f32; 3],
    to_middle_and_rule: [f16; 4],
    tangent_turn: u32,
    material: u32,
    far_plane: f32,
}

/// What its pipeline is besides shaders.
pub(crate) const GEOMETRY_STATE: GraphicsState = GraphicsState {
    attributes: &[(vk::Format::R32G32B32_SFLOAT, VERTEX_STRIDE); 3],
    colors: &[GEOMETRY_FORMAT],
    depth: DEPTH_FORMAT,
};

/// The vertex and the fragment shader, for objects with tangents or for those without.
pub(crate) fn geometry_shaders(has_tangents: bool) -> [&'static Shader; 2] {
    match has_tangents {
        true => [&compiled::GEOMETRY_CACHE_VERT_TANGENTS, &compiled::GEOMETRY_CACHE_FRAG_TANGENTS],
        false => [&compiled::GEOMETRY_CACHE_VERT, &compiled::GEOMETRY_CACHE_FRAG],
    }
}

/// Compiles the shaders of the pass.
///
/// # Errors
/// A driver that cannot compile them.
pub fn geometry_pipeline(device: &Arc<Device>, cache: &PipelineCache, has_tangents: bool) -> Result<GraphicsPipeline> {
    let [vertex, fragment] = geometry_shaders(has_tangents);
    Ok(GraphicsPipeline::new(device, cache, vertex, fragment, &GEOMETRY_STATE)?)
}

impl GeometryCache {
    /// The push constants of every object that is drawn.
    fn draws(&self, view: &View) -> Vec<(&Triangles, Push)> {
        let (right, up, forward) = view.camera.basis();
        let eye = view.camera.eye;
        let half_size = view.half_size();
        let clip_axes = [right / half_size.x, -up / half_size.y, forward];
        let pack = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
        let unit = self.extent(view);
        let draw = |object: &PlacedMesh| {
            let middle = self.meshes[object.mesh].sphere.centre;
            // Subtracted in double precision: far from the origin or from the eye the difference is what counts.
            let (matrix3, from_eye) =
                (object.to_world.matrix3 / unit, (object.to_world.transform_point3(middle) - eye) / unit);
            let [clip_x, clip_y, clip_w] = clip_axes.map(|axis| pack(matrix3.transpose() * axis, axis.dot(from_eye)));
            let radius = self.sphere(object).radius / unit;
            let to_middle = from_eye * (radius / from_eye.length()).min(1.0);
            let (axis, rule, at_middle) = match object.tangent.map(|tangent| tangent.rule) {
                None => (Vec3::ZERO, NO_TANGENT, DVec3::ZERO),
                Some(TangentRule::Around(axis)) => (axis, TANGENT_AROUND, axis.as_dvec3().cross(middle)),
                Some(TangentRule::Along(axis)) => (axis, TANGENT_ALONG, DVec3::ZERO),
                Some(TangentRule::Uv) => (Vec3::ZERO, TANGENT_OF_MESH, DVec3::ZERO),
            };
            let push = Push {
                to_world: [0, 1, 2].map(|i| pack(matrix3.row(i), at_middle[i])),
                clip_x,
                clip_y,
                clip_w,
                tangent_axis: axis.to_array(),
                to_middle_and_rule: to_middle.extend(rule.into()).to_array().map(f16::from_f64),
                tangent_turn: pack_snorm_2x16(object.tangent.map_or(DVec2::X, PlacedTangent::turn).as_vec2()),
                material: object.material,
                far_plane: (1.0 + BEHIND - forward.dot(from_eye)) as f32,
            };
            (&self.meshes[object.mesh].triangles, push)
        };
        self.seen(view).map(draw).collect()
    }

    /// The objects that may be in the picture.
    fn seen(&self, view: &View) -> impl Iterator<Item = &PlacedMesh> {
        let (inwards, eye) = (inward_normals(view), view.camera.eye);
        self.objects.iter().filter(move |object| {
            let BoundingSphere { centre, radius } = self.sphere(object);
            may_be_within(centre - eye, radius, &inwards)
        })
    }

    /// Where in the picture objects may be.
    pub fn region(&self, view: &View) -> Region {
        let (_, _, forward) = view.camera.basis();
        let corners = self.seen(view).flat_map(|object| {
            let &DeviceMesh { sphere, bounds: (low, high), .. } = &*self.meshes[object.mesh];
            let middle = sphere.centre;
            let from_eye = object.to_world.transform_point3(middle) - view.camera.eye;
            let off_axis = from_eye.reject_from_normalized(forward).length();
            let matrix3 = object.to_world.matrix3;
            (0..8).map(move |index| {
                let corner = Vec3::select(BVec3::from([1, 2, 4].map(|bit| index & bit != 0)), high, low);
                let turned = matrix3 * (corner.as_dvec3() - middle);
                Corner { from_eye: turned + from_eye, error: ROUNDING * (turned.length() + off_axis) }
            })
        });
        Region::of_boxes(view, corners)
    }

    /// A sphere around an object, in world space.
    fn sphere(&self, object: &PlacedMesh) -> BoundingSphere {
        object.placed_sphere(self.meshes[object.mesh].sphere)
    }

    /// Distance from the eye to the far side of what may be in the picture: the unit of length in which it is drawn, so that neither tiny nor
    /// huge scenes leave the range of single precision.
    fn extent(&self, view: &View) -> f64 {
        let far_side = |object: &PlacedMesh| {
            let BoundingSphere { centre, radius } = self.sphere(object);
            centre.distance(view.camera.eye) + radius
        };
        let farthest = self.seen(view).map(far_side).fold(0.0, f64::max);
        // Nothing, and a single point at the eye, have no extent, and nothing to be seen in any unit.
        if farthest > 0.0 { farthest } else { 1.0 }
    }
}

/// Normals of the planes through the eye that bound what a picture shows, inwards: its four sides, and what is behind the eye.
fn inward_normals(view: &View) -> [DVec3; 5] {
    let (right, up, forward) = view.camera.basis();
    let DVec2 { x, y } = view.half_size();
    let sides = [x * forward + right, x * forward - right, y * forward + up, y * forward - up];
    let [left, right, below, above] = sides.map(DVec3::normalize);
    [left, right, below, above, forward]
}

/// Whether something of what is within this sphere, of which `centre` is seen from the eye, may be on the inner side of all these planes.
fn may_be_within(centre: DVec3, radius: f64, inwards: &[DVec3; 5]) -> bool {
    // Bounds and vertices are in single precision.
    let margin = 1e-5 * (centre.length() + radius);
    inwards.iter().all(|normal| centre.dot(*normal) > -radius - margin)
}

/// Draws the objects that may be seen into the geometry cache. Outside of `region`, where they all are, it may hold anything.
pub fn geometry_cache<'a>(
    graph: &mut FrameGraph<'a>,
    cache: &'a GeometryCache,
    region: Region,
    view: &View,
) -> ImageHandle {
    let [width, height] = view.cache_size();
    let mut geometry = graph.kept_image("geometry", ImageDesc { format: GEOMETRY_FORMAT, width, height });
    // Nothing looks at it later, but a moving picture would allocate it anew in each frame.
    let mut depth = graph.kept_image("depth", ImageDesc { format: DEPTH_FORMAT, width, height });
    let pass = graph.raster("geometry_cache", &cache.pipeline);
    pass.color(&mut geometry, [0; 4]).depth(&mut depth, 0.0).within(region.subpixels(view)).draw(cache.draws(view));
    geometry
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use spirq::ReflectConfig;
    use spirq::var::Variable;

    /// Number `i` of `count` directions all around.
    fn direction(i: usize, count: usize) -> DVec3 {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        (DVec2::from_angle(2.4 * i as f64) * (1.0 - z * z).sqrt()).extend(z)
    }

    /// What is handed from stage to stage costs a device time, whether or not it is read.
    #[test]
    fn objects_without_tangents_interpolate_none() {
        let interpolated = |has_tangents| {
            let [_, fragment] = geometry_shaders(has_tangents);
            let entry_points = ReflectConfig::new().spv(fragment.words()).reflect().unwrap();
            let inputs = entry_points[0].vars.iter().filter(|variable| matches!(variable, Variable::Input { .. }));
            inputs.count()
        };
        assert_eq!([false, true].map(interpolated), [2, 3]);
    }

    /// Against points of the spheres, each on the picture or not.
    #[test]
    fn objects_off_the_picture_are_not_drawn_and_all_others_are() {
        let (eye, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 1.0, -4.0));
        let camera = Camera { eye, target, up: DVec3::Y, fov_y_deg: 30.0 };
        let (width, height, subpixels) = (400, 200, 1);
        let view =
            View { camera, width, height, subpixels, rotation_deg: 0.0, intensity: 1.0, exposure: 1.0, gamma: 1.0 };
        let (right, up, forward) = camera.basis();
        let half_height = 15f64.to_radians().tan();
        let is_on_picture = |point: DVec3| {
            let from_eye = point - eye;
            let depth = from_eye.dot(forward);
            let [x, y] = [right, up].map(|axis| from_eye.dot(axis).abs());
            depth > 0.0 && x < 2.0 * half_height * depth && y < half_height * depth
        };
        let inwards = inward_normals(&view);
        let [mut seen, mut left_out, mut needless] = [0; 3];
        for i in 0..2000 {
            let centre = eye + (0.1 + 0.01 * i as f64) * direction(i, 2000);
            let radius = 0.002 * (i * 7 % 700) as f64;
            let on_sphere = |j| centre + radius * direction(j, 500);
            let is_seen = is_on_picture(centre) || (0..500).map(on_sphere).any(is_on_picture);
            let is_drawn = may_be_within(centre - eye, radius, &inwards);
            assert!(is_drawn || !is_seen, "{centre} {radius}");
            seen += usize::from(is_seen);
            left_out += usize::from(!is_drawn);
            needless += usize::from(is_drawn && !is_seen);
        }
        // Needless are those that pass by a corner of the picture, or show less than the 500 points tell.
        assert!(seen > 100 && left_out > 1500 && needless < seen / 3, "{seen} {left_out} {needless}");
    }
}
