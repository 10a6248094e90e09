// The largest radiance of a picture: what would be more is that.

const float LARGEST_RADIANCE = 3.40282347e38; // of single precision

// Radiance that is finite; what is no number stays so. Twin: bounded in src/shading/mod.rs.
vec3 bounded(vec3 radiance) {
    return mix(radiance, vec3(LARGEST_RADIANCE), greaterThan(radiance, vec3(LARGEST_RADIANCE)));
}
