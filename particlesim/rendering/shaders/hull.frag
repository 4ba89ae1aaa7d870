#include "common.glsl"
#include "light.glsl"
in vec3 place;
in vec4 inward;
flat in vec3 dark;
flat in vec3 bright;
out vec4 pixel;

void main() {
    // Edges are a little darker, over about one and a half pixels whatever the distance.
    float edge = min(min(inward.x, inward.y), min(inward.z, inward.w)) / (dot(forward.xyz, place) * forward.w);
    float line = clamp(1.5 - 0.75 * edge, 0.0, 1.0);
    pixel = vec4(mix(dark, bright, lit(place)) * (1.0 - 0.2 * line), 1.0);
}
