#include "common.glsl"
#include "light.glsl"
layout(binding = 3) uniform sampler2D floor_light;   // share of the light that reaches the floor
in vec3 place;
in vec2 beyond;
out vec4 pixel;

void main() {
    vec2 past = max(abs(beyond) - floor_area.xy / floor_area.w, 0.0);
    float strength = 1.0 - smoothstep(0.0, 1.0, length(past));
    vec3 colour = mix(floor_dark.rgb, floor_bright.rgb, lit(place));
    colour *= texture(floor_light, 0.5 + 0.5 * (place.xy + eye.xy) / (floor_area.xy + floor_area.w)).r;
    // Less than a step of grey at random hides the bands of a slow fade (noise of J. Jimenez, SIGGRAPH 2014).
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    pixel = vec4(mix(background.rgb, colour, strength) + strength * noise / 255.0, 1.0);
}
