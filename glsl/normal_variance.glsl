// How much normals differ within a pixel. Twin: normal_variance in src/shading/mod.rs.

// The variance of `count` unit normals along each of two axes: 1 - R, with R the length of their mean. That has no digits left where they are
// nearly the same. So it comes from the sums of what they differ by from one of them, and of the squares of that, which give 1 - R^2.
float normal_variance(vec3 differences, float squares, uint count) {
    vec3 mean = differences / float(count);
    float one_minus_square = clamp(squares / float(count) - dot(mean, mean), 0.0, 1.0);
    return one_minus_square / (1.0 + sqrt(1.0 - one_minus_square));
}
