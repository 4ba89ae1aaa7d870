#include "common.glsl"
layout(location = 0) in vec3 middle;          // of a tile, from its lower left corner [pixels]
layout(location = 1) in vec2 tile;            // that corner [pixels]

// Tiles of the picture in which something is seen.
void main() {
    // A point whose middle is beyond the picture would not be drawn; one on its rim covers what there is of the tile.
    vec2 at = min(tile + middle.xy, viewport.xy);
    gl_PointSize = 2.0 * middle.x;
    gl_Position = vec4(2.0 * at / viewport.xy - 1.0, 0.0, 1.0);
}
