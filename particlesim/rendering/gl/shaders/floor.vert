#include "common.glsl"
layout(location = 0) in vec3 corner;
out vec3 place;
out vec2 beyond;            // how far outside the box, in widths of the fading rim

void main() {
    vec3 at = vec3(corner.xy * (floor_area.xy + floor_area.w), floor_area.z);
    beyond = corner.xy * (floor_area.xy / floor_area.w + 1.0);
    place = at - eye.xyz;
    gl_Position = clip_from_eye * vec4(place, 1.0);
}
