#version 450
// Has a cube map bound while something is drawn: some drivers fill in what is beyond the edges of its faces only then
// (src/passes/cube_borders.rs).

layout(set = 0, binding = 0) uniform samplerCube cube;

layout(location = 0) out vec4 color;

void main() {
    color = textureLod(cube, vec3(1.0), 0.0);
}
