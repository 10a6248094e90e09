// The paper's estimate, equation (2), L_o = 1/m sum over k of f(s_k, o) L_i(s_k) (n . s_k) / p(s_k), divided by what it
// gives in a white furnace and multiplied by what it should give there, the albedo. So no error of p, between rows
// or in the proportion of colours, shows as a wrong brightness or tint.
// Twin: src/shading/paper.rs.
#include "environment_pyramid.glsl"
#include "partition.glsl"
#include "threads/paper.glsl"
#include "threads/rim.glsl"

// The threads of a partition: first, first + stride, ...
struct Partition {
    uint first;
    uint stride;
};

// Sums of f cos / p and of f cos / p times radiance over a partition.
struct WeightedSum {
    vec3 weight;
    vec3 radiance;
};

// Solid angle of the lookup for a sample of this pdf: its share of the hemisphere, 1 / (m p), and a footprint, up to what
// the partition's samples need to fill the hemisphere by themselves.
//
// Each sub-pixel looks where its part of the threads points, and the directions of one fill the gaps between those of another,
// but only where their normals agree. Normals d apart reflect 2 d apart, and gaps stay open once that is half of their
// width: then each lookup has to stand for the 4 d beside it in either direction. For 2 x 2 sub-pixels the variance is d^2 / 4
// along each axis, so (4 d)^2 is 64 times that, for each of the other sub-pixels (F5).
float lookup_solid_angle(Surface surface, Material material, Partition share, float log2_p) {
    float share_sr = exp2(-log2_p) / float(material.threads.count);
    float footprint_sr = 64.0 * float(share.stride - 1) * surface.normal_variance;
    return min(share_sr + footprint_sr, share_sr * float(share.stride));
}

// Adds one term of equation (2), but for 1/m; all directions in `frame`, a shading frame of the surface but for a turn about its normal.
void add_term(inout WeightedSum sum, Surface surface, Material material, mat3 frame, vec3 w_i, vec3 w_o, float log2_p,
              float solid_angle_sr) {
    ++lookups;
    vec3 direction = frame * w_i;
    float level = level_of(solid_angle_sr, push.face_size, direction);
    vec3 radiance = textureLod(environment_pyramid, direction, level).rgb;
    if (HAS_TANGENTS != 0) {
        vec2 turn = vec2(dot(surface.frame[0], frame[0]), dot(surface.frame[1], frame[0]));
        w_i = turned(w_i, turn);
        w_o = turned(w_o, turn);
    }
    vec3 weight = brdf_at(surface, material, w_i, w_o) * (w_i.z * exp2(-log2_p));
    sum.weight += weight;
    sum.radiance += weight * radiance;
}

// The mean radiance, weighted channel by channel (F6); black where nothing is reflected.
vec3 weighted_mean(WeightedSum sum) {
    return mix(sum.radiance / sum.weight, vec3(0.0), lessThanEqual(sum.weight, vec3(0.0)));
}

// Where a view lies among the rows, which stand evenly from 0 to 90 degrees.
struct Rows {
    uint below;
    uint above;
    float t;
    float towards; // t of albedos
};

Rows rows_at(Surface surface, Material material) {
    float last = float(material.threads.row_count - 1);
    float row = min(surface.theta_o * (last / radians(90.0)), last);
    uint below = uint(row);
    float towards = towards_row_above(row, material.threads.row_count, material.rim_power);
    return Rows(below, min(below + 1, material.threads.row_count - 1), row - float(below), towards);
}

// The threads as published: row and frame follow the view.
vec3 threads_following_view(Surface surface, Material material, Rows rows, Partition share) {
    uint below = row_start(material, rows.below);
    uint above = row_start(material, rows.above);
    vec3 w_o = view_direction(surface);
    WeightedSum sum = WeightedSum(vec3(0.0), vec3(0.0));
    for (uint k = share.first; k < material.threads.count; k += share.stride) {
        vec4 between = mix(unpack_thread(below, k), unpack_thread(above, k), rows.t);
        float solid_angle_sr = lookup_solid_angle(surface, material, share, between.w);
        add_term(sum, surface, material, surface.frame, normalize(between.xyz), w_o, between.w, solid_angle_sr);
    }
    return weighted_mean(sum);
}

// The threads of the first row, in a frame that does not turn, carried to this view along their half vectors: lobes stay
// lobes, and p changes by the ratio of both reflections' Jacobians, (n . h) / (w_o . h) (F7).
vec3 threads_of_facing_view(Surface surface, Material material, Partition share) {
    mat3 frame = fixed_frame(surface.frame[2], to_environment(push.camera.right.xyz));
    vec3 w_o = surface.w_o * frame;
    uint facing = row_start(material, 0);
    WeightedSum sum = WeightedSum(vec3(0.0), vec3(0.0));
    for (uint k = share.first; k < material.threads.count; k += share.stride) {
        vec4 thread = unpack_thread(facing, k);
        vec3 h = normalize(thread.xyz + vec3(0.0, 0.0, 1.0));
        float cos_theta_d = dot(w_o, h);
        vec3 w_i = 2.0 * cos_theta_d * h - w_o;
        if (w_i.z > 0.0) {
            float log2_p = thread.w + log2(h.z / cos_theta_d);
            float solid_angle_sr = lookup_solid_angle(surface, material, share, log2_p);
            add_term(sum, surface, material, frame, w_i, w_o, log2_p, solid_angle_sr);
        }
    }
    return weighted_mean(sum);
}

// Between these view angles the threads start to follow the view.
const float FACING_DEG = 3.0;
const float TURNING_DEG = 15.0;

// Where the normal faces the eye the shading frame turns once around within a few pixels, and the threads with it: their
// error would show as a pinwheel. There the sum over threads that do not turn takes over.
vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    if (first >= material.threads.count) {
        return vec3(0.0);
    }
    Partition share = Partition(first, stride);
    Rows rows = rows_at(surface, material);
    float following = smoothstep(radians(FACING_DEG), radians(TURNING_DEG), surface.theta_o);
    vec3 mean = vec3(0.0);
    if (following > 0.0) {
        mean += following * threads_following_view(surface, material, rows, share);
    }
    if (following < 1.0) {
        mean += (1.0 - following) * threads_of_facing_view(surface, material, share);
    }
    vec3 of_below = unpack_albedo(row_start(material, rows.below));
    vec3 of_above = unpack_albedo(row_start(material, rows.above));
    vec3 albedo = mix(of_below, of_above, rows.towards);
    // The partition's part of all threads.
    float fraction = float((material.threads.count - first + stride - 1) / stride) / float(material.threads.count);
    return fraction * albedo * mean;
}
