#include "common.glsl"
#include "light.glsl"
layout(binding = 1) uniform isampler2D owner;           // number of the sphere that each pixel sees, or -1
layout(binding = 2) uniform samplerBuffer spheres;      // of each sphere its centre and radius; its linear colour and its share of the sky
out vec4 pixel;

void main() {
    int number = texelFetch(owner, ivec2(gl_FragCoord.xy), 0).x;
    if (number < 0) discard;
    vec4 ball = texelFetch(spheres, 2 * number);
    vec4 paint = texelFetch(spheres, 2 * number + 1);
    vec3 centre = ball.xyz - eye.xyz;
    // The ray through the middle of the pixel, and how far from it the centre is: the half chord follows without the
    // loss of digits that the quadratic equation has for small spheres far away.
    vec2 aside = (2.0 * gl_FragCoord.xy / viewport.xy - 1.0) * slopes.xy;
    vec3 ray = normalize(forward.xyz + aside.x * right.xyz + aside.y * up.xyz);
    float along = dot(centre, ray);
    vec3 miss = centre - along * ray;
    float half_chord = sqrt(max(ball.w * ball.w - dot(miss, miss), 0.0));
    vec3 place = (along - half_chord) * ray;
    gl_FragDepth = depth_of(place);
    vec3 normal = (place - centre) / ball.w;
    float facing = -dot(normal, ray);
    float gloss = max(dot(normal, normalize(light.xyz - ray)), 0.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    // Shadows end in ragged edges where light grazes; on a round body it is faded out there.
    float grazing = smoothstep(0.0, 0.3, dot(normal, light.xyz));
    vec3 key = direct(paint.rgb, normal) * grazing + 0.22 * gloss;
    vec3 colour = encode(paint.a * ambient(paint.rgb, normal, facing) + lit(place) * key);
    pixel = vec4(mix(colour, background.rgb, haze_at(centre)), 1.0);
}
