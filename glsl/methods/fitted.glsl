// Fitted threads: sum over k of w_k (environment blurred by kernel k)(d_k), plus the irradiance times what they leave of the
// albedo. Directions, widths and weights were fitted to f(w_i, w_o) (n . w_i), so no BRDF is left to evaluate.
//
// Few threads fit tails of lobes worst, and under small bright sources tails matter most. So the blurred environment is without
// these, and they are shaded by the BRDF itself.
// Twin: src/shading/fitted.rs.
#include "light_source.glsl"
#include "threads/fitted.glsl"
#include "threads/rim.glsl"
#include "vmf_pyramid.glsl"

// What no kernel of what is shaded and no light of the scene needs is compiled out.
layout(constant_id = 2) const uint HAS_SOURCES = 1;          // 0: the environment has none
layout(constant_id = 3) const uint HAS_MIRRORED_SOURCES = 1; // 0: no lobe mirrors them
layout(constant_id = 4) const uint HAS_SHARP_KERNELS = 1;    // 0: no kernel is sharper than the pyramid
layout(constant_id = 9) const uint HAS_UNEVEN_RIM = 1;       // 0: between the two last rows weights change evenly, as between all others

#include "shared_sum.glsl"

// A lobe, seen from w_o in the shading frame.
struct Lobe {
    vec3 w_o;
    vec3 mirror;  // the mirrored view, in the environment's coordinates
    float width;  // lobe_width of what is seen from w_o
    float radius; // and its lobe_radius
};

bool is_isotropic(Material material) {
    return HAS_TANGENTS == 0 || material.threads.azimuth_count == 1;
}

// The length of x and y of a vector in the shading frame: of a long lobe what is along it is shortened by as much as it is long (F34).
float across_lobe(vec2 w, Surface surface, Material material) {
    if (is_isotropic(material)) {
        return length(w);
    }
    w = turned(vec3(w, 0.0), surface.phi_o).xy;
    vec2 axis = material.long_axis;
    return length(vec2(dot(w, axis) * material.narrowness, dot(w, vec2(-axis.y, axis.x))));
}

// The half vector of light from `direction`, as far as it is in the tangent plane, and 2 cos theta_d.
vec3 half_vector(Lobe lobe, Surface surface, vec3 direction) {
    vec3 h = direction * surface.frame + lobe.w_o;
    // Opposite directions have no half vector; 1e-6 is far below any other sum of two above the horizon.
    float twice_cos_theta_d = max(length(h), 1e-6);
    return vec3(h.xy / twice_cos_theta_d, twice_cos_theta_d);
}

// sin theta_h, across the lobe, and cos theta_d of light from `direction`.
vec2 half_angles(Lobe lobe, Surface surface, Material material, vec3 direction) {
    vec3 h = half_vector(lobe, surface, direction);
    return vec2(across_lobe(h.xy, surface, material), 0.5 * h.z);
}

// How far `direction` is from the middle of the lobe, in radians. Reflection doubles angles, but across the plane of incidence, along y, light
// moves by cos theta_o of that.
float away_from(Lobe lobe, Surface surface, Material material, vec3 direction) {
    if (is_isotropic(material)) {
        return distance(direction, lobe.mirror);
    }
    vec3 h = half_vector(lobe, surface, direction);
    return 2.0 * across_lobe(vec2(h.x, lobe.w_o.z * h.y), surface, material);
}

// How far a source is from where the BRDF cannot be taken at a few points of it, because it is mirrored towards the eye and wider than
// the lobe; in units of two standard deviations of the source (F28). At the radius of the half vector f has lost a quarter or more, as a
// Gaussian has at 0.76 of its width; reflection doubles that. Twin: src/environment/sources.rs.
float clearance(float away, float source_width, float lobe_radius) {
    return (away + 4.0 * 2.6 * lobe_radius) / (2.0 * source_width);
}

// Above this clearance 2 x 2 points of a source do. No material has a larger one in `clear`, above which all are alike to share_of_brdf.
const float FAR = 4.0;

// Above this one its middle does: tails of Gaussian lobes go on falling steeply.
const float VERY_FAR = 40.0;

// A source is opened within so many of its standard deviations from the mirrored view. So many widths of a lobe count as part of the way,
// since f changes little within them. Measured: opened later, sources cost less, and err more in lobes with steep flanks.
const float OPENED_WITHIN = 12.0;
const float WIDTHS_ON_THE_WAY = 4.2;

// Where f is like e^-(theta_h/flank)^2, log f changes by STEEP or more within a standard deviation of the source where that times theta_h is above
// STEEP flank^2 cos theta_d: the half vector moves by up to 1 / (2 cos theta_d) of what light does. Measured: less steep ones cost time and gain
// nothing.
const float STEEP = 0.7;

// Of a source that is wider, in radians, the shape matters.
const float WIDEST_WHOLE_RAD = 0.1;

// Near the horizon f cos of measured materials bends within a few degrees of theta_i: light is low below this cosine, and a source of
// which the middle alone would be looked at within so many of its standard deviations.
const float LOW_COSINE = 0.3;
const float LOW_DEVIATIONS = 20.0;

// The clearance of a source that counts as no narrower than `least_width`.
float clearance_of(Source source, Lobe lobe, Surface surface, Material material, float least_width) {
    float away = away_from(lobe, surface, material, source.direction.xyz);
    return clearance(away, max(source.direction.w, least_width), lobe.radius);
}

// Whether a source is to be taken part by part, if it has any: where few points of it do not do beside the lobe or on its flank, or it is so
// wide that its shape matters.
// Parts of one that is no wider than `least_width` tell nothing more.
bool opens(Source source, Lobe lobe, Surface surface, Material material, float least_width) {
    float width = source.direction.w;
    float away = away_from(lobe, surface, material, source.direction.xyz);
    bool is_near = away + WIDTHS_ON_THE_WAY * lobe.width < OPENED_WITHIN * width;
    bool is_on_flank = false;
    if (material.flank > 0.0) {
        vec2 at = half_angles(lobe, surface, material, source.direction.xyz);
        is_on_flank = at.x * width > STEEP * material.flank * material.flank * at.y && at.x < material.dark_from;
    }
    return width > least_width && (is_near || is_on_flank || width > WIDEST_WHOLE_RAD);
}

// Source s, or the first of its parts that is not to be taken part by part. Nothing but s leaves the loop: of other values, lavapipe
// of Mesa 22.3 gives lanes that leave it early those of the others.
uint descend(uint s, Lobe lobe, Surface surface, Material material, float least_width) {
    bool is_divided;
    do {
        is_divided = sources[s].axis[0].w > 1.0 && opens(sources[s], lobe, surface, material, least_width);
        s += uint(is_divided);
    } while (is_divided);
    return s;
}

// How much of the answer to sources is the BRDF's, where this is the least clearance of one: the rest is the kernels', which fit best
// where the mirrored view is (F29).
float share_of_brdf(float least_clearance, Material material) {
    return smoothstep(material.clear.x, material.clear.y, least_clearance);
}

// The least clearance of all sources, of which there is at least one.
float least_clearance(Lobe lobe, Surface surface, Material material, float least_width) {
    float least = FAR;
    uint s = 0;
    do {
        s = descend(s, lobe, surface, material, least_width);
        least = min(least, clearance_of(sources[s], lobe, surface, material, least_width));
        s += uint(sources[s].axis[0].w);
    } while (s < source_count);
    return least;
}

// Twin: NARROWING_COSINES in src/brdf/lobe/narrowing.rs.
const vec4 NARROWING_FROM = vec4(1.0, 0.6, 0.4, 0.25);
const vec4 NARROWING_TO = vec4(NARROWING_FROM.yzw, 0.1);

// The same as in src/brdf/lobe/mod.rs.
const float MIN_COS_THETA_D = 0.05;

// The lobe of what is seen: across the plane of incidence it is narrower by the cosine, and it may be another one at grazing views.
Lobe lobe_of(Surface surface, Material material) {
    vec3 w_o = view_direction(surface);
    vec4 way = clamp((NARROWING_FROM - w_o.z) / (NARROWING_FROM - NARROWING_TO), 0.0, 1.0);
    float narrower = max(w_o.z, MIN_COS_THETA_D) * exp2(dot(material.narrowing, way));
    vec3 mirror = surface.frame * vec3(-w_o.x, -w_o.y, w_o.z);
    return Lobe(w_o, mirror, narrower * material.lobe_width, narrower * material.lobe_radius);
}

// Up to this deviation of their normals, in radians, sub-pixels are one surface to any lobe that is not narrower: src/threads/fitted/sets.rs.
const float NEARLY_FLAT_RAD = 0.01;

// What a flat mirror reflects to a pixel is spread by the view alone. Up to this part of the lobe's width it is one blur: a gently curved mirror of
// Beckmann 0.003 at 80 x 60 errs by 0.0019 with all of it, by 0.0007 so.
const float MOST_VIEW = 0.3;

// A sum at one normal does not do where normals vary more than half vectors within a narrow lobe, as thin as that is across the plane of
// incidence, or by a good part of a wide one: what sub-pixels mirror there is not one blur. Nor where a sun is mirrored within the pixel, or
// so near that its highlight bends within it.
bool needs_subpixels(Surface surface, Material material) {
    float deviation = sqrt(surface.normal_variance);
    Lobe lobe = lobe_of(surface, material);
    float most = max(min(lobe.width, NEARLY_FLAT_RAD), material.shared_deviation * lobe.w_o.z);
    // Of normals alone; their variance in the surface has the view's in it. What is mirrored turns twice as far as normals, and counts within
    // three standard deviations.
    return surface.normal_variance > most * most + 0.25 * view_variance()
        || 0.5 * sqrt(view_variance()) > MOST_VIEW * lobe.width
        || HAS_SOURCES != 0 && share_of_brdf(least_clearance(lobe, surface, material, 3.0 * 2.0 * deviation), material) < 1.0;
}

// What all sources are to a surface.
struct AtSources {
    vec3 f_cos;  // their powers times what is to be integrated over them
    vec3 cosine;
    float least_clearance;
};

// For a square of light whose middle has this z, and whose standard deviation along z is this. x: the part of it that has risen above the
// horizon, times z in the middle of that part; y: that z (F31).
vec2 risen(float z, float deviation) {
    // Light straight above has none.
    float half_side = max(sqrt(3.0) * deviation, 1e-6);
    if (z >= half_side) {
        return vec2(z);
    }
    float above = max(z + half_side, 0.0);
    return vec2(above * above / (4.0 * half_side), 0.5 * above);
}

// Points on a square of light of variance 1, in columns and rows about its middle.
struct Points {
    vec2 last;     // column and row, counted from the middle
    float between; // columns, and rows
    vec2 weight;   // of one in the middle, and what one next to it has more
    bool is_stairs;
};

// side x side of them, of Gauss and Legendre; of a square that sets the middles of equal parts, for what has risen of these adds up to what
// has risen of it.
Points points_on_square(int side, bool sets) {
    vec2 last = vec2(0.5 * float(side - 1));
    if (side == 3 && !sets) {
        return Points(last, sqrt(3.0 * 0.6), vec2(4.0, -1.5) / 9.0, false);
    }
    return Points(last, side == 2 && !sets ? 2.0 : sqrt(12.0) / float(side), vec2(1.0 / float(side), 0.0), false);
}

// Four of equal weight in equal steps up, so far to the sides that they have all moments of the square up to the third but for the variance up, which
// is 15/16 of it: on the flank of a lobe f is steep both ways.
Points points_on_stairs() {
    return Points(vec2(1.5, 0.0), sqrt(12.0) / 4.0, vec2(0.5, 0.0), true);
}

// An axis of a source, longer by what the normals of the pixel add to its variance: mirrored directions turn twice as far.
vec3 within_pixel(vec3 axis, Surface surface) {
    // No source is smaller than a pixel of the environment.
    return axis * sqrt(1.0 + 4.0 * surface.normal_variance / dot(axis, axis));
}

// What the base of a BRDF answers light at this cosine with, over what Lambert's does. Twin: src/brdf/base.rs.
float base_profile(Material material, float cosine) {
    float profile = 0.0;
    [[unroll]] for (int power = 5; power >= 0; --power) {
        profile = profile * cosine + material.base[power];
    }
    return profile;
}

// Adds a source, as a square of its variance.
void add_source(inout AtSources sum, Source source, float clear, Surface surface, Material material, vec3 w_o) {
    vec3 middle = source.direction.xyz * surface.frame;
    vec3 x = source.axis[0].xyz * surface.frame;
    vec3 y = source.axis[1].xyz * surface.frame;
    vec2 slope = vec2(x.z, y.z);
    float deviation = length(slope);
    float half_side = sqrt(3.0) * deviation;
    if (middle.z + half_side <= 0.0) {
        return;
    }
    float lowest = middle.z - half_side;
    int side = clear > VERY_FAR ? 1 : clear > FAR ? 2 : 3;
    // Four steps up.
    bool is_low = clear > FAR && lowest < (side == 1 ? LOW_DEVIATIONS * deviation : LOW_COSINE);
    Points points;
    if (is_low) {
        // Light straight above has no slope; 1e-6 is far below the deviation of any other.
        vec2 up = slope / max(deviation, 1e-6);
        vec3 to_side = up.x * y - up.y * x;
        x = up.x * x + up.y * y;
        y = to_side;
        points = points_on_stairs();
    } else {
        points = points_on_square(side, lowest < 0.0);
        // Light sets by the angle of normals, not by twice as much.
        if (lowest > 0.0) {
            x = within_pixel(x, surface);
            y = within_pixel(y, surface);
        }
    }
    float part_deviation = deviation / (2.0 * points.last.x + 1.0);
    vec2 place = -points.last;
    do {
        vec2 at = points.between * place;
        if (points.is_stairs) {
            // 1, -3, 3 and -1, over the square root of 5.
            at.y = place.x * (41.0 - 20.0 * place.x * place.x) / (6.0 * sqrt(5.0));
        }
        vec2 weights = points.weight.x + points.weight.y * abs(place);
        vec3 w_i = normalize(middle + at.x * x + at.y * y);
        vec2 above = risen(w_i.z, part_deviation);
        if (above.x > 0.0) {
            vec3 power = weights.x * weights.y * above.x * source.power.rgb;
            // Most light has risen as a whole.
            if (above.y != w_i.z) {
                w_i = normalize(vec3(w_i.xy, above.y));
            }
            sum.f_cos += power * brdf_at(surface, material, w_i, w_o);
            sum.cosine += power * base_profile(material, w_i.z);
        }
        place.x += 1.0;
        if (place.x > points.last.x) {
            place = vec2(-points.last.x, place.y + 1.0);
        }
    } while (place.y <= points.last.y);
}

AtSources at_sources(Surface surface, Material material, Lobe lobe) {
    AtSources sum = AtSources(vec3(0.0), vec3(0.0), FAR);
    // To a pixel no source is narrower than what its normals make of it.
    float least_width = 2.0 * sqrt(surface.normal_variance);
    uint s = 0;
    do {
        s = descend(s, lobe, surface, material, least_width);
        Source source = sources[s];
        float clear = clearance_of(source, lobe, surface, material, least_width);
        sum.least_clearance = min(sum.least_clearance, clear);
        add_source(sum, source, clear, surface, material, lobe.w_o);
        s += uint(source.axis[0].w);
    } while (s < source_count);
    return sum;
}

// Between which rows a view is: two of an isotropic BRDF, three of an anisotropic one, which are the corners of a triangle of view angles
// and azimuths.
struct Rows {
    uvec3 albedo;   // the buffer's elements with their albedos
    uint row_count; // of each azimuth
    vec3 share; // of each in what is between them, 1 together; the third has none of an isotropic BRDF
    vec3 weight_share; // the same of weights and albedos, which need not change evenly between the two last rows
    float side; // 1, or -1 where the view is the mirror image of one that there are rows for
    float added_variance; // of the kernels, by the pixel's normals
};

// Rows stand evenly from 0 to 90 degrees.
Rows rows_at(Surface surface, Material material) {
    ThreadTable table = material.threads;
    float row = min(surface.theta_o * (float(table.row_count - 1) / radians(90.0)), float(table.row_count - 1));
    uint below = table.first + uint(row);
    uint above = below + uint(uint(row) + 1 < table.row_count);
    float t = fract(row);
    uvec3 albedo = uvec3(below, above, below);
    vec3 share = vec3(1.0 - t, t, 0.0);
    Rows rows = Rows(albedo, table.row_count, share, share, 1.0, variance_of_pixel(surface.normal_variance));
    bool is_second_above = true;
    if (HAS_TANGENTS != 0 && table.azimuth_count > 1) {
        vec2 folded = fold_azimuth(surface.phi_o, table.azimuth_count);
        uint before = min(uint(folded.x), table.azimuth_count - 2);
        uint an_azimuth = elements_an_azimuth(table);
        rows.albedo += before * an_azimuth;
        rows.albedo.z = rows.albedo.y + an_azimuth;
        float towards_next = folded.x - float(before);
        if (towards_next > t) {
            rows.albedo.y = rows.albedo.x + an_azimuth;
            is_second_above = false;
        }
        rows.share = vec3(1.0 - max(t, towards_next), abs(t - towards_next), min(t, towards_next));
        rows.side = folded.y;
    }
    rows.weight_share = rows.share;
    float towards = HAS_UNEVEN_RIM != 0 ? towards_row_above(row, table.row_count, material.rim_power) : t;
    if (towards != t) {
        // So many times as much of the row below, and of the one above. 1e-6 is below any step of t.
        vec2 times = vec2(1.0 - towards, towards) / max(vec2(1.0 - t, t), 1e-6);
        rows.weight_share *= vec3(times.x, is_second_above ? times.y : times.x, times.y);
    }
    return rows;
}

// Thread k, in the shading frame, blurred by the normals of the pixel.
Kernel kernel_at(Rows rows, uint k) {
    Kernel a = unpack_kernel(rows.albedo.x, rows.row_count, k);
    Kernel b = unpack_kernel(rows.albedo.y, rows.row_count, k);
    vec2 share = rows.share.xy;
    Kernel kernel = Kernel(
        share.x * a.place + share.y * b.place,
        share.x * a.level + share.y * b.level,
        rows.weight_share.x * a.weight + rows.weight_share.y * b.weight
    );
    if (HAS_TANGENTS != 0) {
        Kernel c = unpack_kernel(rows.albedo.z, rows.row_count, k);
        kernel.place += rows.share.z * c.place;
        kernel.level += rows.share.z * c.level;
        kernel.weight += rows.weight_share.z * c.weight;
        kernel.place.y *= rows.side;
    }
    // The normal of a sub-pixel has no variance.
    if (IS_INTERIOR != 0) {
        kernel.level = level_within_pixel(kernel.level, rows.added_variance);
    }
    return kernel;
}

// Where a kernel looks, in the environment's coordinates; no unit vector.
vec3 looks_towards(Kernel kernel, Surface surface) {
    return surface.frame * stereographic_decode(kernel.place);
}

vec3 albedo_at(Rows rows) {
    vec3 albedo = rows.weight_share.x * unpack_albedo(rows.albedo.x) + rows.weight_share.y * unpack_albedo(rows.albedo.y);
    if (HAS_TANGENTS != 0) {
        albedo += rows.weight_share.z * unpack_albedo(rows.albedo.z);
    }
    return albedo;
}

// (F10) and (F30). Three loops, not one with three branches: where a driver masks lanes out, each pays for what none of its lanes does. For the same reason
// tests are at the ends of loops.
vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    ThreadTable table = material.threads;
    Rows rows = rows_at(surface, material);
    vec3 weights = vec3(0.0);
    vec3 sum = vec3(0.0);
    uint sharp_count = HAS_SHARP_KERNELS != 0 ? table.sharp_count : 0;
    uint k = first + (sharp_count + stride - 1 - first) / stride * stride;
    if (k < table.count) {
        do {
            Kernel kernel = kernel_at(rows, k);
            weights += kernel.weight;
            sum += kernel.weight * blurred_radiance(looks_towards(kernel, surface), kernel.level);
        } while ((k += stride) < table.count);
    }
    AtSources at = AtSources(vec3(0.0), vec3(0.0), FAR);
    float of_kernels = 0.0;
    if (HAS_SOURCES != 0) {
        Lobe lobe = lobe_of(surface, material);
        at = at_sources(surface, material, lobe);
        if (HAS_MIRRORED_SOURCES != 0) {
            of_kernels = 1.0 - share_of_brdf(at.least_clearance, material);
        }
    }
    k = first;
    if (HAS_SHARP_KERNELS != 0 && k < sharp_count) {
        do {
            Kernel kernel = kernel_at(rows, k);
            weights += kernel.weight;
            float sharp = sharp_part(kernel.level);
            if (sharp > 0.0) {
                sum += kernel.weight * sharp * sharp_radiance(looks_towards(kernel, surface), of_kernels);
            }
            if (sharp < 1.0) {
                sum += kernel.weight * (1.0 - sharp) * blurred_radiance(looks_towards(kernel, surface), kernel.level);
            }
        } while ((k += stride) < sharp_count);
    }
    k = first;
    if (HAS_MIRRORED_SOURCES != 0 && of_kernels > 0.0 && k < table.count) {
        do {
            Kernel kernel = kernel_at(rows, k);
            float blurred = HAS_SHARP_KERNELS != 0 ? 1.0 - sharp_part(kernel.level) : 1.0;
            if (blurred > 0.0) {
                sum += kernel.weight * blurred * of_kernels * blurred_sources(looks_towards(kernel, surface), kernel.level);
            }
        } while ((k += stride) < table.count);
    }
    vec3 cosine_part = albedo_at(rows) - float(stride) * weights; // (F11)
    ++lookups;
    vec3 irradiance = textureLod(irradiance_maps, vec4(surface.frame[2], float(material.base_map)), 0.0).rgb;
    sum = float(stride) * sum + cosine_part * irradiance;
    if (HAS_SOURCES != 0) {
        // Irradiance maps have no sources.
        sum += mix(at.f_cos, at.cosine * cosine_part / radians(180.0), of_kernels);
    }
    return max(sum, vec3(0.0));
}
