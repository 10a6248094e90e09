// Directions in the tangent plane. Twin: src/tangent.rs.
#ifndef TANGENT_GLSL
#define TANGENT_GLSL

// An axis orthogonal to n, for where nothing gives one (Duff et al. 2017).
vec3 any_tangent(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    return vec3(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
}

// What of `direction`, of any length, is orthogonal to n, as a unit vector.
vec3 tangent_along(vec3 direction, vec3 n) {
    // To unit length first, so that neither tiny nor huge objects leave the range of floats.
    float largest = max(max(abs(direction.x), abs(direction.y)), abs(direction.z));
    vec3 unit = largest > 0.0 ? normalize(direction / largest) : n;
    vec3 along = unit - dot(unit, n) * n;
    // A direction within 1e-3 of n gives no tangent that single precision could be trusted with.
    return dot(along, along) > 1e-6 ? normalize(along) : any_tangent(n);
}

// Unit `tangent`, orthogonal to n, turned about n by an angle of this cosine and sine: counter-clockwise seen from where n points.
vec3 turned_tangent(vec3 tangent, vec3 n, vec2 turn) {
    return turn.x * tangent + turn.y * cross(n, tangent);
}

#endif
