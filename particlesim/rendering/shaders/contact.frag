#include "common.glsl"
in vec2 across;
flat in float share;
out vec4 pixel;

// A sphere of radius r, its centre at height h, hides (r / h)^2 / (1 + (d / h)^2)^(3/2) of the light of an even sky from
// a point of the floor at distance d: its configuration factor (J. R. Howell's catalog, plane element to sphere).
void main() {
    float reach = 1.0 + dot(across, across);
    float hidden = share / (reach * sqrt(reach));
    // Faded to nothing at the square's rim.
    hidden *= smoothstep(3.6, 1.8, length(across));
    pixel = vec4(vec3(1.0 - 0.45 * hidden), 1.0);
}
