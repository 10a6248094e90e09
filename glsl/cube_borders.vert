#version 450
// A triangle of which nothing is seen: see cube_borders.frag.

layout(location = 0) in vec3 position;

void main() {
    gl_Position = vec4(position, 1.0);
}
