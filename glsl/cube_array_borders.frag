#version 450
// The same as cube_borders.frag for an array of cube maps.

layout(set = 0, binding = 0) uniform samplerCubeArray cube;

layout(location = 0) out vec4 color;

void main() {
    color = textureLod(cube, vec4(1.0, 1.0, 1.0, 0.0), 0.0);
}
