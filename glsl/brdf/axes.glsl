// The axes of an anisotropic material in the tangent plane. Twin of Axes in src/brdf/roughness.rs.
#ifndef AXES_GLSL
#define AXES_GLSL

// w along the axes that are turned from the tangent by an angle of this cosine and sine.
vec3 to_axes(vec2 rotation, vec3 w) {
    return vec3(rotation.x * w.x + rotation.y * w.y, rotation.x * w.y - rotation.y * w.x, w.z);
}

#endif
