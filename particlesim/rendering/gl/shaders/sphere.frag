#include "common.glsl"
#include "light.glsl"
#include "surface.glsl"
out vec4 pixel;

void main() {
    int row = texelFetch(first_row, ivec2(gl_FragCoord.xy), 0).x;
    if (row < 0) discard;
    vec4 ball = texelFetch(surfaces, row);
    vec4 paint = texelFetch(surfaces, row + 1);
    // How far from the ray the centre is: the half chord follows without the loss of digits that the quadratic equation
    // has for small spheres far away.
    vec3 ray = normalize(ray_here());
    float along = dot(ball.xyz, ray);
    vec3 miss = ball.xyz - along * ray;
    float half_chord = sqrt(max(ball.w * ball.w - dot(miss, miss), 0.0));
    vec3 place = (along - half_chord) * ray;
    gl_FragDepth = depth_at(1.0 / dot(forward.xyz, place));
    vec3 normal = (place - ball.xyz) / ball.w;
    float facing = -dot(normal, ray);
    float gloss = max(dot(normal, normalize(light.xyz - ray)), 0.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    // Shadows end in ragged edges where light grazes; on a round body it is faded out there.
    float grazing = smoothstep(0.0, 0.3, dot(normal, light.xyz));
    vec3 key = direct(paint.rgb, normal) * grazing + 0.22 * gloss;
    vec3 colour = encode(paint.a * ambient(paint.rgb, normal, facing) + lit(place) * key);
    pixel = vec4(mix(colour, background.rgb, haze_at(dot(forward.xyz, ball.xyz))), 1.0);
}
