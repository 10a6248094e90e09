// The mean of the normals within a pixel, and how much they differ. Twin: normal_moments in src/shading/mod.rs.

// Sums over unit normals. 1 - R, with R the length of their mean, has no digits left where they are nearly the same. So the sums are of what
// they differ by from the first of them, and of the square of that.
struct NormalMoments {
    vec3 first;
    vec3 differences;
    float squares;
};

NormalMoments normal_moments(vec3 first) {
    return NormalMoments(first, vec3(0.0), 0.0);
}

void add_normal(inout NormalMoments moments, vec3 normal) {
    vec3 difference = normal - moments.first;
    moments.differences += difference;
    moments.squares += dot(difference, difference);
}

// The mean of `count` normals.
vec3 mean_normal(NormalMoments moments, uint count) {
    return moments.first + moments.differences / float(count);
}

// Their variance along each of two axes, 1 - R, by way of 1 - R^2.
float normal_variance(NormalMoments moments, uint count) {
    vec3 mean = moments.differences / float(count);
    float one_minus_square = clamp(moments.squares / float(count) - dot(mean, mean), 0.0, 1.0);
    return one_minus_square / (1.0 + sqrt(1.0 - one_minus_square));
}
