#version 450
// One level of the pyramid of vMF kernels: the environment convolved with a kernel, from a finer level of it.
// Twin: src/environment/vmf_pyramid.rs.
#extension GL_GOOGLE_include_directive : require
#include "cube.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

// Radiance, three numbers a texel: face by face, row by row.
layout(set = 0, binding = 0, std430) readonly buffer Source {
    float source[];
};
layout(set = 0, binding = 1, std430) writeonly buffer Destination {
    float destination[];
};

// How wide the kernels are that texels were convolved with, in `texel_deficit`.
const uint BOX = 0;    // the texel itself
const uint VMF = 1;    // of a level of the pyramid
const uint MEAN = 2;  // of the level of twice this size, and then means of 2 x 2 texels

layout(push_constant) uniform Push {
    uint from_size; // of a face
    uint size;
    uint from_kernel;
    uint kernel;
    uint first_row;  // a dispatch makes these and what follows
    uint first_face;
} push;

const float TEXELS_A_WIDTH = 2.0;
const float KERNEL_EXTENT = 8.0;

// 1 - the mean cosine of a vMF kernel, 1 + 1 / kappa - coth(kappa) (F12).
float vmf_deficit(float kappa) {
    // Beyond 10, coth is 1 to the last bit of what is left.
    return kappa > 10.0 ? 1.0 / kappa : 1.0 + 1.0 / kappa - 1.0 / tanh(kappa);
}

float kappa_of_deficit(float deficit) {
    float kappa = 1.0 / deficit;
    // Beyond 10 kappa is the deficit's inverse; below, that is where the iteration starts.
    for (int i = 0; kappa <= 10.0 && i < 20; ++i) {
        kappa *= vmf_deficit(kappa) / deficit;
    }
    return kappa;
}

// 1 - the mean cosine of what a texel was convolved with (F13).
float texel_deficit(uint kernel, float size, vec3 direction) {
    float solid_angle = texel_solid_angle(size, direction);
    if (kernel == BOX) {
        return solid_angle / 12.0;
    }
    // Means of 2 x 2 are of texels of half the size, and moved by half of that along each axis.
    float texel = kernel == MEAN ? 0.25 * solid_angle : solid_angle;
    float width = 2.0 * TEXELS_A_WIDTH / (kernel == MEAN ? 2.0 * size : size);
    float tent = texel / 6.0;
    float deficit = (vmf_deficit(1.0 / (width * width)) - tent) / (1.0 - tent);
    return kernel == MEAN ? deficit + texel / 4.0 * (1.0 - deficit) : deficit;
}

// Where on a face, from -1 to 1, the direction of this shadow is; at the nearer edge if it is not there.
float face_place(vec2 shadow) {
    return shadow.y > abs(shadow.x) ? shadow.x / shadow.y : shadow.x < 0.0 ? -1.0 : 1.0;
}

// The texels along one axis of a face that a cone reaches: of directions whose shadow in the plane of that axis and the face's
// own is (x, z), within the angle of this sine. Empty where first >= end.
uvec2 cone_range(float x, float z, float sin_cone, uint size) {
    float shadow = length(vec2(x, z));
    if (shadow <= sin_cone) {
        return uvec2(0, size);
    }
    // The shadow of the cone is between these two directions.
    vec2 along = vec2(x, z) / shadow;
    float s = sin_cone / shadow;
    // Divisions may err by so little that s is above 1.
    float c = sqrt(max(1.0 - s * s, 0.0));
    // Behind the face a cone may reach beyond the opposite of its axis.
    float low = z < 0.0 && x < 0.0 ? -1.0 : face_place(vec2(along.x * c - along.y * s, along.y * c + along.x * s));
    float high = z < 0.0 && x >= 0.0 ? 1.0 : face_place(vec2(along.x * c + along.y * s, along.y * c - along.x * s));
    if (low > high) {
        return uvec2(0);
    }
    vec2 texels = 0.5 * (vec2(low, high) + 1.0) * float(size);
    // Divisions may err by so little that a place is beyond the edge, too, and what is negative is no uint.
    return uvec2(max(floor(texels.x), 0.0), min(ceil(texels.y), float(size)));
}

vec3 source_texel(uvec3 id) {
    uint at = 3 * ((id.z * push.from_size + id.y) * push.from_size + id.x);
    return vec3(source[at], source[at + 1], source[at + 2]);
}

void write(uvec3 id, vec3 radiance) {
    uint at = 3 * ((id.z * push.size + id.y) * push.size + id.x);
    destination[at] = radiance.r;
    destination[at + 1] = radiance.g;
    destination[at + 2] = radiance.b;
}

vec3 mean_of_four(uvec3 id) {
    uvec3 first = uvec3(2 * id.xy, id.z);
    return 0.25 * (source_texel(first) + source_texel(first + uvec3(1, 0, 0)) + source_texel(first + uvec3(0, 1, 0))
        + source_texel(first + uvec3(1, 1, 0)));
}

void main() {
    uvec3 id = gl_GlobalInvocationID + uvec3(0, push.first_row, push.first_face);
    if (any(greaterThanEqual(id.xy, uvec2(push.size)))) {
        return;
    }
    if (push.kernel == MEAN) {
        write(id, mean_of_four(id));
        return;
    }
    vec3 centre = normalize(cube_point(id.z, (vec2(id.xy) + 0.5) / float(push.size)));
    float from = texel_deficit(push.from_kernel, float(push.from_size), centre);
    float wanted = texel_deficit(push.kernel, float(push.size), centre);
    float kappa = kappa_of_deficit((wanted - from) / (1.0 - from)); // (F14)
    float extent = min(KERNEL_EXTENT / kappa, 2.0); // 1 - cos of the cone that the kernel fills
    float sin_cone = extent < 1.0 ? sqrt(extent * (2.0 - extent)) : 1.0;
    vec4 sum = vec4(0.0);
    float step_size = 2.0 / float(push.from_size);
    for (uint face = 0; face < 6; ++face) {
        vec3 axes = cube_coordinates(face, centre);
        uvec2 columns = cone_range(axes.x, axes.z, sin_cone, push.from_size);
        uvec2 rows = cone_range(axes.y, axes.z, sin_cone, push.from_size);
        for (uint row = rows.x; row < rows.y; ++row) {
            // In the face's own coordinates: (s, t, 1), on its plane at distance 1.
            vec2 st = vec2(float(columns.x) + 0.5, float(row) + 0.5) * step_size - 1.0;
            uint at = 3 * ((face * push.from_size + row) * push.from_size + columns.x);
            for (uint column = columns.x; column < columns.y; ++column) {
                float cos_face = inversesqrt(1.0 + dot(st, st));
                // 1 - cos as half the squared distance: exact for neighbours too.
                vec3 difference = vec3(st, 1.0) * cos_face - axes;
                float away = 0.5 * dot(difference, difference);
                float weight = exp(-kappa * away);
                // The solid angle of a texel is as the cube of the cosine.
                weight *= away < extent ? cos_face * cos_face * cos_face : 0.0;
                sum += weight * vec4(source[at], source[at + 1], source[at + 2], 1.0);
                st.x += step_size;
                at += 3;
            }
        }
    }
    write(id, sum.rgb / sum.a); // (F15)
}
