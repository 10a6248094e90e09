// The azimuths of the view for which an anisotropic BRDF has rows. Twin: src/threads/azimuths.rs.
#include "arc_tangent.glsl"

// From one azimuth of the view to the next.
const float AZIMUTH_STEP_DEG = 5.0;
const float AZIMUTH_STEP = radians(AZIMUTH_STEP_DEG);

// Where the azimuth of a view is among so many of them, in steps, and whether what is seen is the mirror image of what is there (1 or -1).
// What their number says of the BRDF's symmetry stands with the twin: fold_azimuth in src/threads/azimuths.rs.
vec2 fold_azimuth(vec2 phi_o, uint count) {
    float last = float(count - 1);
    float period = max(last, radians(180.0) / AZIMUTH_STEP);
    float at = azimuth_of(phi_o.y, phi_o.x, length(phi_o)) / AZIMUTH_STEP;
    at -= period * floor(at / period);
    return at > last ? vec2(max(period - at, 0.0), -1.0) : vec2(min(at, last), 1.0);
}
