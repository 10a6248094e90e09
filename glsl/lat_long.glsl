// Directions and their places in a latitude-longitude map. Twin: src/environment/mod.rs.
#ifndef LAT_LONG_GLSL
#define LAT_LONG_GLSL
#include "arc_tangent.glsl"

// A direction in the world in the axes of an environment that is turned by an angle of this cosine and sine about +Y: turned back.
vec3 turned_back(vec2 rotation, vec3 d) {
    return vec3(rotation.x * d.x - rotation.y * d.z, d.y, rotation.y * d.x + rotation.x * d.z);
}

// The place of a direction, of any length, in the map: from -z towards +x, -0.5 to 0.5 from side to side, and from +y, 0 to 1 from top to bottom.
vec2 lat_long(vec3 d) {
    float from_axis = length(d.xz);
    float phi = azimuth_of(d.x, -d.z, from_axis);
    return vec2(phi / radians(360.0), angle_of(from_axis, d.y, length(d)) / radians(180.0));
}
#endif
