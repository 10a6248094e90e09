// Incident directions in proportion to f cos, from a table of 2D CDFs (Matusik et al. 2003, Efficient Isotropic BRDF
// Measurement, for tables; here for every BRDF): for each view angle of a row a CDF over rings of the half vector, and within
// each ring one over azimuths.
// Twin: src/shading/importance_sampling.rs; the table: src/threads/slice_table.rs.

const uint SLICE_ROWS = 90;     // theta_o = row 90 deg / SLICE_ROWS
const uint SLICE_RINGS = 96;    // theta_h = 90 deg x^2, x in steps of 1 / SLICE_RINGS
const uint SLICE_AZIMUTHS = 64; // phi_h from -180 deg
const uint AZIMUTHS_START = SLICE_RINGS + 1;
const uint SLICE_SIZE = AZIMUTHS_START + SLICE_RINGS * (SLICE_AZIMUTHS + 1);

// For each material and row: the CDF over rings, then ring by ring that over azimuths, all in multiples of 2^-24 as random
// numbers are. So a step is drawn with exactly the probability that its ends tell.
layout(set = 0, binding = 12, std430) readonly buffer Slices {
    float slices[];
};

// Share of samples drawn from cos / pi instead: the table, made of other view angles and of finite cells, may miss light
// just above the horizon, and f cos / p must stay bounded.
const float DIFFUSE_SHARE = 0.05;

// Where a view angle lies among the rows; beyond the last one it is held there.
struct SliceRows {
    uint below; // starts of the two rows
    uint above;
    float t;
};

SliceRows slice_rows(Material material, vec3 w_o) {
    float row = min(atan(w_o.x, w_o.z) * (float(SLICE_ROWS) / radians(90.0)), float(SLICE_ROWS - 1));
    uint below = uint(row);
    uint above = min(below + 1, SLICE_ROWS - 1);
    return SliceRows(material.first_slice + below * SLICE_SIZE, material.first_slice + above * SLICE_SIZE,
                     row - float(below));
}

// sin^2(theta_h / 2) at the inner edge of a ring: even steps of it are even steps of solid angle, without cancellation.
float ring_edge(uint ring) {
    float x = float(ring) / float(SLICE_RINGS);
    float s = sin(radians(45.0) * x * x);
    return s * s;
}

// The step of the CDF at `start` in which `mass` lies, and how far into the step.
struct CdfStep {
    uint index;
    float within;
};

// Binary search by halving strides, for at most 128 steps. Unrolled, since a compiler's limit on iterations (lavapipe's is 65535
// in all) had better be left to samples.
CdfStep invert_cdf(uint start, uint steps, float mass) {
    uint low = 0; // slices[low] <= mass < slices[low + 1] at the end: empty steps are never met
    [[unroll]] for (int bit = 6; bit >= 0; --bit) {
        uint next = low + (1u << bit);
        low = next < steps && slices[start + min(next, steps)] <= mass ? next : low;
    }
    float from = slices[start + low];
    // Random numbers stand for the middle of their 2^-24.
    return CdfStep(low, (mass - from + 0.5 / 16777216.0) / (slices[start + low + 1] - from));
}

// A half vector from the row at `start`, uniform over the solid angle of its cell.
vec3 sample_half_vector(uint start, vec2 u) {
    CdfStep ring = invert_cdf(start, SLICE_RINGS, u.x);
    CdfStep azimuth = invert_cdf(start + AZIMUTHS_START + ring.index * (SLICE_AZIMUTHS + 1), SLICE_AZIMUTHS, u.y);
    float s = mix(ring_edge(ring.index), ring_edge(ring.index + 1), ring.within);
    float phi = radians(360.0) * (float(azimuth.index) + azimuth.within) / float(SLICE_AZIMUTHS) - radians(180.0);
    return vec3(2.0 * sqrt(s * (1.0 - s)) * vec2(cos(phi), sin(phi)), 1.0 - 2.0 * s);
}

// Density in 1/sr of the half vector h by the row at `start`; which cell holds h is the same for all rows.
struct SliceCell {
    uint ring;
    uint azimuth;
    float solid_angle_sr;
};

SliceCell slice_cell(vec3 h) {
    float sin_theta_h = length(h.xy);
    // atan(0, 0) is undefined; at the pole all azimuths meet.
    float phi = sin_theta_h > 0.0 ? atan(h.y, h.x) : 0.0;
    float x = sqrt(atan(sin_theta_h, h.z) / radians(90.0));
    uint ring = min(uint(x * float(SLICE_RINGS)), SLICE_RINGS - 1);
    uint azimuth = min(uint(max(phi / radians(360.0) + 0.5, 0.0) * float(SLICE_AZIMUTHS)), SLICE_AZIMUTHS - 1);
    float solid_angle_sr = 12.5663706 * (ring_edge(ring + 1) - ring_edge(ring)) / float(SLICE_AZIMUTHS);
    return SliceCell(ring, azimuth, solid_angle_sr);
}

float cell_mass(uint start, SliceCell cell) {
    uint ring = start + cell.ring;
    uint azimuth = start + AZIMUTHS_START + cell.ring * (SLICE_AZIMUTHS + 1) + cell.azimuth;
    return (slices[ring + 1] - slices[ring]) * (slices[azimuth + 1] - slices[azimuth]);
}

// Density in 1/sr of sample_brdf at w_i above the horizon, of which h is the half vector.
float brdf_pdf(SliceRows rows, vec3 w_i, vec3 w_o, vec3 h) {
    SliceCell cell = slice_cell(h);
    float mass = mix(cell_mass(rows.below, cell), cell_mass(rows.above, cell), rows.t);
    // dw_i = 4 (w_o . h) dw_h. Where w_i and w_o are above the horizon the product is at least their cosines' mean.
    float of_table = mass / (4.0 * cell.solid_angle_sr * dot(w_o, h));
    return mix(of_table, w_i.z * 0.318309886, DIFFUSE_SHARE);
}

// A direction and its density in 1/sr, which is 0 below the horizon.
struct DirectionSample {
    vec3 w_i;
    float p;
};

// The rows below and above are drawn in proportion, so the density is exactly the blend of theirs at every view angle.
DirectionSample sample_brdf(SliceRows rows, vec3 w_o, uvec4 bits) {
    vec4 u = to_unit(bits);
    vec3 w_i;
    vec3 h;
    if (u.x < DIFFUSE_SHARE) {
        float phi = radians(360.0) * u.z;
        w_i = vec3(sqrt(u.y) * vec2(cos(phi), sin(phi)), sqrt(1.0 - u.y));
        h = normalize(w_i + w_o);
    } else {
        bool is_above = u.x - DIFFUSE_SHARE < rows.t * (1.0 - DIFFUSE_SHARE);
        h = sample_half_vector(is_above ? rows.above : rows.below, u.yz);
        w_i = 2.0 * dot(w_o, h) * h - w_o;
    }
    if (!(w_i.z > 0.0 && dot(w_o, h) > 0.0)) {
        return DirectionSample(vec3(0.0), 0.0);
    }
    return DirectionSample(w_i, brdf_pdf(rows, w_i, w_o, h));
}
