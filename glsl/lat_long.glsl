// Directions and their places in a latitude-longitude map. Twin: src/environment/mod.rs.
#ifndef LAT_LONG_GLSL
#define LAT_LONG_GLSL

// A direction in the world in the axes of an environment that is turned by an angle of this cosine and sine about +Y: turned back.
vec3 turned_back(vec2 rotation, vec3 d) {
    return vec3(rotation.x * d.x - rotation.y * d.z, d.y, rotation.y * d.x + rotation.x * d.z);
}

// The place of a unit direction in the map: from -z towards +x, -0.5 to 0.5 from side to side, and from +y, 0 to 1 from top to bottom.
vec2 lat_long(vec3 d) {
    float sin_theta = length(d.xz);
    // At the poles any phi will do, but atan(0, 0) is undefined.
    float phi = sin_theta > 0.0 ? atan(d.x, -d.z) : 0.0;
    return vec2(phi / radians(360.0), atan(sin_theta, d.y) / radians(180.0));
}
#endif
