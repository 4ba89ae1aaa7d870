#include "common.glsl"
#include "light.glsl"
#include "rotate.glsl"
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 body_normal;
layout(location = 2) in vec4 to_edges;        // distances from the edges of the face, for size 1
layout(location = 3) in vec4 centre_size;
layout(location = 4) in vec4 turn;            // quaternion w, x, y, z
layout(location = 5) in vec4 colour_sky;      // linear colour; fraction of the sky's light that reaches it
out vec3 place;
out vec4 inward;
flat out vec3 dark;         // sRGB of the face in the shadow and in the light
flat out vec3 bright;

void main() {
    vec3 centre = centre_size.xyz - eye.xyz;
    vec3 normal = rotate(turn, body_normal);
    vec3 soft = colour_sky.a * ambient(colour_sky.rgb, normal, -dot(normal, normalize(centre)));
    float pale = haze_at(centre);
    dark = mix(encode(soft), background.rgb, pale);
    bright = mix(encode(soft + direct(colour_sky.rgb, normal)), background.rgb, pale);
    place = centre + rotate(turn, corner * centre_size.w);
    inward = to_edges * centre_size.w;
    gl_Position = clip_from_eye * vec4(place, 1.0);
}
