// Microfacet distributions, shadowing and Fresnel reflectance. Twin of src/brdf/microfacet/mod.rs, which cites the equations.
#ifndef MICROFACET_GLSL
#define MICROFACET_GLSL
#include "pi.glsl"

const float DISTRIBUTION_BECKMANN = 1.0; // else GGX

// Below, alpha is along x, the tangent, and along y.

// D(h) in 1/sr.
float microfacet_density(float distribution, vec3 h, vec2 alpha) {
    // sin^2 from x and y, not 1 - cos^2, which loses all digits in a narrow lobe.
    vec2 scaled = h.xy / alpha;
    float sin2_alpha2 = dot(scaled, scaled);
    float cos2 = h.z * h.z;
    if (distribution == DISTRIBUTION_BECKMANN) {
        float exponent = sin2_alpha2 / cos2;
        // e^-80 is 2e-35, as good as nothing; far beyond, 0 / 0 threatens at grazing h.
        return exponent < 80.0 ? exp(-exponent) * INVERSE_PI / (alpha.x * alpha.y * cos2 * cos2) : 0.0;
    }
    // At most a million: its square times alpha_x alpha_y, no less than a millionth, is in range.
    float denominator = cos2 + sin2_alpha2;
    return INVERSE_PI / (alpha.x * alpha.y * denominator * denominator);
}

// Smith's G1 / cos(theta), finite at grazing angles.
float g1_over_cos(float distribution, vec3 w, vec2 alpha) {
    vec2 projected = alpha * w.xy;
    float alpha2_sin2 = dot(projected, projected);
    if (distribution == DISTRIBUTION_BECKMANN) {
        float alpha_sin = sqrt(alpha2_sin2);
        if (w.z >= 1.6 * alpha_sin) return 1.0 / w.z;
        float a = w.z / alpha_sin;
        return (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a)) / alpha_sin;
    }
    return 2.0 / (w.z + sqrt(alpha2_sin2 + w.z * w.z));
}

// D G / (4 cos_theta_i cos_theta_o) in 1/sr.
float torrance_sparrow(float distribution, vec3 w_i, vec3 w_o, vec3 h, vec2 alpha) {
    return 0.25 * microfacet_density(distribution, h, alpha) * g1_over_cos(distribution, w_i, alpha)
        * g1_over_cos(distribution, w_o, alpha);
}

// Schlick's approximation of the Fresnel reflectance of what reflects f0 at normal incidence.
vec3 fresnel_schlick(float cos_theta, vec3 f0) {
    float rest = 1.0 - clamp(cos_theta, 0.0, 1.0);
    float rest2 = rest * rest;
    return f0 + (1.0 - f0) * (rest2 * rest2 * rest);
}

// Exact unpolarised Fresnel reflectance of a conductor, per channel.
vec3 fresnel_conductor(float cos_theta, vec3 eta, vec3 k) {
    cos_theta = clamp(cos_theta, 0.0, 1.0);
    float cos2 = cos_theta * cos_theta;
    float sin2 = 1.0 - cos2;
    vec3 difference = eta * eta - k * k - sin2;
    vec3 a2_b2 = sqrt(difference * difference + 4.0 * eta * eta * k * k);
    vec3 a = sqrt(max(0.5 * (a2_b2 + difference), 0.0));
    vec3 s_sum = a2_b2 + cos2;
    vec3 s_cross = 2.0 * a * cos_theta;
    vec3 r_s = (s_sum - s_cross) / (s_sum + s_cross);
    vec3 p_sum = cos2 * a2_b2 + sin2 * sin2;
    vec3 p_cross = s_cross * sin2;
    vec3 r_p = r_s * (p_sum - p_cross) / (p_sum + p_cross);
    // Where nothing is reflected, eta = 1 without absorption, rounding gives either sign.
    return max(0.5 * (r_s + r_p), vec3(0.0));
}

// Exact unpolarised Fresnel reflectance of a dielectric of index ior >= 1, seen from air.
float fresnel_dielectric(float cos_theta, float ior) {
    float cos_i = clamp(cos_theta, 0.0, 1.0);
    float cos_t = sqrt(max(1.0 - (1.0 - cos_i * cos_i) / (ior * ior), 0.0));
    if (cos_i + cos_t == 0.0) return 0.0; // ior = 1 at grazing: nothing is reflected
    float r_s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    float r_p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    return 0.5 * (r_s * r_s + r_p * r_p);
}

#endif
