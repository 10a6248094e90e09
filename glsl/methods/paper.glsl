// The paper's estimate, equation (2): L_o = 1/m sum over k of f(s_k, o) L_i(s_k) (n . s_k) / p(s_k).
// Twin: paper in src/shading.rs.

// Row by row of theta_o, thread by thread: direction in the shading frame, and the logarithm to base 2 of its pdf in
// 1/sr. Between rows the logarithm is nearer to the pdf than a linear blend, and it is what the level needs.
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    vec4 threads[];
};

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
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
        vec3 w_i = normalize(mix(sample_0.xyz, sample_1.xyz, t));
        float log2_p = mix(sample_0.w, sample_1.w, t);
        vec3 direction = surface.frame * w_i;
        float level = level_of(-log2(float(m)) - log2_p, push.face_size, direction);
        vec3 radiance = textureLod(environment_pyramid, direction, level).rgb;
        sum += brdf(material, w_i, w_o) * radiance * (w_i.z * exp2(-log2_p));
    }
    return sum / float(m);
}
