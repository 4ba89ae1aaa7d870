#include "common.glsl"
layout(location = 0) in vec3 corner;          // of a tile [pixels]
layout(location = 1) in vec2 tile;            // its lower left corner [pixels]

// Tiles of the picture in which something is seen.
void main() {
    gl_Position = vec4(2.0 * (tile + corner.xy) / viewport.xy - 1.0, 0.0, 1.0);
}
