// The paper's threads as the GPU holds them. Twin of the layout: src/threads/table.rs.

// Row by row of theta_o: the row's albedo, then thread by thread the direction in the shading frame, and the logarithm
// to base 2 of its pdf in 1/sr. Between rows the logarithm is nearer to the pdf than a linear blend.
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    vec4 threads[];
};

uint row_start(Material material, uint row) {
    return material.threads.first + row * (material.threads.count + 1);
}

// Thread k of the row that starts at `row`: direction, and the logarithm of its pdf.
vec4 unpack_thread(uint row, uint k) {
    return threads[row + 1 + k];
}

vec3 unpack_albedo(uint row) {
    return threads[row].rgb;
}
