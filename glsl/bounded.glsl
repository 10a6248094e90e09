// The largest radiance of a picture: what would be more is that.

const float LARGEST_RADIANCE = 3.40282347e38; // of single precision

// Radiance that is finite; what is no number stays so. Twin: bounded in src/shading/mod.rs.
vec3 bounded(vec3 radiance) {
    // By its bits: compilers may take it that no number is infinite, and leave a comparison out.
    const uint INFINITE = 0x7F800000;
    return mix(radiance, vec3(LARGEST_RADIANCE), equal(floatBitsToUint(radiance), uvec3(INFINITE)));
}
