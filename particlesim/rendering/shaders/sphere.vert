#include "common.glsl"
layout(location = 0) in vec3 corner;          // of a square, -1 .. 1
layout(location = 1) in vec4 centre_radius;
layout(location = 2) in vec4 colour_sky;      // linear colour; fraction of the sky's light that reaches it
out vec2 across;            // on the disc the eye sees: length 1 on the outline
out vec3 ray;               // a point of that disc, seen from the eye
flat out vec4 ball;         // centre seen from the eye, radius / distance
flat out vec4 gleam;        // where the light is mirrored to the eye, 1 / radius
flat out vec4 paint;
flat out float pale;

// The outline of a sphere is a circle where the cone from the eye touches it. The square is drawn about that circle.
void main() {
    vec3 centre = centre_radius.xyz - eye.xyz;
    float distance = length(centre);
    float e = centre_radius.w / distance;
    vec3 axis = centre / distance;
    vec3 u = normalize(cross(abs(axis.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0), axis));
    vec3 v = cross(axis, u);
    float rim = sqrt(max(1.0 - e * e, 0.0));
    across = corner.xy;
    ray = centre * (rim * rim) + (u * across.x + v * across.y) * (centre_radius.w * rim);
    ball = vec4(centre, e);
    gleam = vec4(normalize(light.xyz - axis), 1.0 / centre_radius.w);
    paint = colour_sky;
    pale = haze_at(centre);
    gl_Position = e < 1.0 ? clip_from_eye * vec4(ray, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
