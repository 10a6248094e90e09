// Incident directions in proportion to f cos, from a table of 2D CDFs (Matusik et al. 2003, Efficient Isotropic BRDF
// Measurement, for tables; here for every BRDF): for each view angle of a row a CDF over rings of the half vector, and within
// each ring one over azimuths. Of an anisotropic BRDF there are such rows for several azimuths of the view.
// Twin: src/shading/importance_sampling.rs; the table: src/threads/slice_table.rs.
#include "arc_tangent.glsl"
#include "azimuths.glsl"
#include "circle.glsl"
#include "pi.glsl"

const uint SLICE_ROWS = 91;     // theta_o = row 90 deg / (SLICE_ROWS - 1)
const uint AZIMUTH_ROWS = 46;   // the same of each azimuth of an anisotropic BRDF
const uint SLICE_RINGS = 96;    // theta_h = 90 deg x^2, x in steps of 1 / SLICE_RINGS
const uint SLICE_AZIMUTHS = 64; // phi_h from -180 deg, against the view, or of an anisotropic BRDF against the tangent
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
    // Of an anisotropic BRDF, how far it is to the rows of the next azimuth, this many numbers on; 0 of an isotropic one.
    uint next_azimuth;
    float towards_next;
    vec2 phi_o; // cosine and sine of the view's azimuth, or of that of its mirror image
    float side; // 1, or -1 where it is the mirror image that there are rows for
};

SliceRows slice_rows(Surface surface, Material material, vec3 w_o) {
    uint azimuths = material.threads.azimuth_count;
    bool is_anisotropic = HAS_TANGENTS != 0 && azimuths > 1;
    uint row_count = is_anisotropic ? AZIMUTH_ROWS : SLICE_ROWS;
    float row = min(acute_angle(w_o.x, w_o.z, 1.0) * (float(row_count - 1) / radians(90.0)), float(row_count - 1));
    uint below = uint(row);
    uint above = min(below + 1, row_count - 1);
    SliceRows rows = SliceRows(material.first_slice + below * SLICE_SIZE, material.first_slice + above * SLICE_SIZE,
                               row - float(below), 0, 0.0, vec2(1.0, 0.0), 1.0);
    if (is_anisotropic) {
        vec2 folded = fold_azimuth(surface.phi_o, azimuths);
        uint before = min(uint(folded.x), azimuths - 2);
        rows.next_azimuth = AZIMUTH_ROWS * SLICE_SIZE;
        rows.below += before * rows.next_azimuth;
        rows.above += before * rows.next_azimuth;
        rows.towards_next = folded.x - float(before);
        rows.phi_o = on_circle(folded.x * (AZIMUTH_STEP / radians(360.0)));
        rows.side = folded.y;
    }
    return rows;
}

// A half vector of the shading frame, with its azimuth as that of the rows.
vec3 to_rows(SliceRows rows, vec3 h) {
    return HAS_TANGENTS != 0 ? turned(vec3(h.x, rows.side * h.y, h.z), rows.phi_o) : h;
}

// The inverse of to_rows.
vec3 to_view(SliceRows rows, vec3 h) {
    if (HAS_TANGENTS == 0) {
        return h;
    }
    vec3 seen = turned(h, vec2(rows.phi_o.x, -rows.phi_o.y));
    return vec3(seen.x, rows.side * seen.y, seen.z);
}

// sin^2(theta_h / 2) at the inner edge of a ring: even steps of it are even steps of solid angle, without cancellation.
float ring_edge(uint ring) {
    float x = float(ring) / float(SLICE_RINGS);
    float s = acute_sine(radians(45.0) * x * x);
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

// The cell of the table that holds a half vector: the same for all rows.
struct SliceCell {
    uint ring;
    uint azimuth;
    float solid_angle_sr;
};

SliceCell slice_cell(vec3 h) {
    float sin_theta_h = length(h.xy);
    float phi = azimuth_of(h.y, h.x, sin_theta_h);
    float x = sqrt(acute_angle(sin_theta_h, h.z, 1.0) / radians(90.0));
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
    SliceCell cell = slice_cell(to_rows(rows, h));
    float mass = mix(cell_mass(rows.below, cell), cell_mass(rows.above, cell), rows.t);
    if (HAS_TANGENTS != 0 && rows.next_azimuth != 0) {
        uint next = rows.next_azimuth;
        float of_next = mix(cell_mass(rows.below + next, cell), cell_mass(rows.above + next, cell), rows.t);
        mass = mix(mass, of_next, rows.towards_next);
    }
    // dw_i = 4 (w_o . h) dw_h. Where w_i and w_o are above the horizon the product is at least their cosines' mean.
    float of_table = mass / (4.0 * cell.solid_angle_sr * dot(w_o, h));
    return mix(of_table, w_i.z * INVERSE_PI, DIFFUSE_SHARE);
}

// A direction and its density in 1/sr, which is 0 below the horizon.
struct DirectionSample {
    vec3 w_i;
    float p;
};

// The rows below and above, and those of both azimuths, are drawn in proportion, so the density is exactly the blend of theirs at every view angle.
DirectionSample sample_brdf(SliceRows rows, vec3 w_o, uvec4 bits) {
    vec4 u = to_unit(bits);
    vec3 w_i;
    vec3 h;
    if (u.x < DIFFUSE_SHARE) {
        w_i = vec3(sqrt(u.y) * on_circle(u.z), sqrt(1.0 - u.y));
        h = normalize(w_i + w_o);
    } else {
        bool is_above = u.x - DIFFUSE_SHARE < rows.t * (1.0 - DIFFUSE_SHARE);
        uint drawn = is_above ? rows.above : rows.below;
        if (HAS_TANGENTS != 0 && u.w < rows.towards_next) {
            drawn += rows.next_azimuth;
        }
        h = to_view(rows, sample_half_vector(drawn, u.yz));
        w_i = 2.0 * dot(w_o, h) * h - w_o;
    }
    if (!(w_i.z > 0.0 && dot(w_o, h) > 0.0)) {
        return DirectionSample(vec3(0.0), 0.0);
    }
    return DirectionSample(w_i, brdf_pdf(rows, w_i, w_o, h));
}
