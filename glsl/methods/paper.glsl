// The paper's estimate, equation (2): L_o = 1/m sum over k of f(s_k, o) L_i(s_k) (n . s_k) / p(s_k).
// Twin: paper in src/shading.rs.

// Row by row of theta_o, thread by thread: direction in the shading frame, and the logarithm to base 2 of its pdf in
// 1/sr. Between rows the logarithm is nearer to the pdf than a linear blend, and it is what the level needs.
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    vec4 threads[];
};

// One term of equation (2), but for 1/m; all directions in `frame`.
vec3 paper_term(Material material, mat3 frame, vec3 w_i, vec3 w_o, float log2_p) {
    ++lookups;
    vec3 direction = frame * w_i;
    float level = level_of(-log2(float(material.thread_count)) - log2_p, push.face_size, direction);
    vec3 radiance = textureLod(environment_pyramid, direction, level).rgb;
    return brdf(material, w_i, w_o) * radiance * (w_i.z * exp2(-log2_p));
}

// The threads as published: row and frame follow the view.
vec3 threads_following_view(Surface surface, Material material, uint first, uint stride) {
    uint m = material.thread_count;
    // Rows stand at multiples of 90 degrees / row_count. Beyond the last one the view angle is held there.
    float row = min(surface.theta_o * (float(material.row_count) / radians(90.0)), float(material.row_count - 1));
    float theta_o = row * (radians(90.0) / float(material.row_count));
    vec3 w_o = vec3(sin(theta_o), 0.0, cos(theta_o));
    uint row_0 = uint(row);
    uint row_1 = min(row_0 + 1, material.row_count - 1);
    float t = row - float(row_0);
    vec3 sum = vec3(0.0);
    for (uint k = first; k < m; k += stride) {
        vec4 sample_0 = threads[material.first_thread + row_0 * m + k];
        vec4 sample_1 = threads[material.first_thread + row_1 * m + k];
        vec4 between = mix(sample_0, sample_1, t);
        sum += paper_term(material, surface.frame, normalize(between.xyz), w_o, between.w);
    }
    return sum / float(m);
}

// The threads of the first row, in a frame that does not turn, carried to this view along their half vectors: lobes stay
// lobes, and p changes by the Jacobian 4 (w_o . h) of the reflection.
vec3 threads_of_facing_view(Surface surface, Material material, uint first, uint stride) {
    uint m = material.thread_count;
    mat3 frame = fixed_frame(surface.frame[2], to_environment(push.camera.right.xyz));
    vec3 w_o = surface.w_o * frame;
    vec3 sum = vec3(0.0);
    for (uint k = first; k < m; k += stride) {
        vec4 facing = threads[material.first_thread + k];
        vec3 h = normalize(facing.xyz + vec3(0.0, 0.0, 1.0));
        float cos_theta_d = dot(w_o, h);
        vec3 w_i = 2.0 * cos_theta_d * h - w_o;
        if (w_i.z > 0.0) {
            sum += paper_term(material, frame, w_i, w_o, facing.w + log2(h.z / cos_theta_d));
        }
    }
    return sum / float(m);
}

// Where the normal faces the eye the shading frame turns once around within a few pixels, and the threads with it: their
// error would show as a pinwheel. There the sum over threads that do not turn takes over.
vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    float following = smoothstep(radians(FACING_DEG), radians(TURNING_DEG), surface.theta_o);
    vec3 sum = vec3(0.0);
    if (following > 0.0) {
        sum += following * threads_following_view(surface, material, first, stride);
    }
    if (following < 1.0) {
        sum += (1.0 - following) * threads_of_facing_view(surface, material, first, stride);
    }
    return sum;
}
