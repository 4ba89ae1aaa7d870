#include "common.glsl"
layout(location = 0) in vec3 corner;          // of a square, -1 .. 1
layout(location = 1) in vec4 centre_radius;
out vec2 across;            // from the point below the centre, in heights of the centre
flat out float share;       // of the sky that the sphere hides from that point

// Farther than this, in heights, a sphere hides less than a fiftieth of what it hides below itself.
const float REACH = 3.6;

void main() {
    float height = max(centre_radius.z - floor_area.z, centre_radius.w);
    across = REACH * corner.xy;
    share = centre_radius.w * centre_radius.w / (height * height);
    vec3 at = vec3(centre_radius.xy + height * across, floor_area.z);
    gl_Position = clip_from_eye * vec4(at - eye.xyz, 1.0);
}
