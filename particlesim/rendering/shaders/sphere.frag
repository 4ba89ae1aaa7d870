#include "common.glsl"
#include "light.glsl"
in vec2 across;
in vec3 ray;
flat in vec4 ball;
flat in vec4 gleam;
flat in vec4 paint;
flat in float pale;
out vec4 pixel;

void main() {
    float square = dot(across, across);
    if (square > 1.0) discard;
    // With e = radius / distance, the ray through a point of the disc meets the sphere at ray / (1 + e h), where h is
    // the height sqrt(1 - across^2): the quadratic equation solved by hand, without its loss of digits.
    float height = sqrt(1.0 - square);
    vec3 place = ray / (1.0 + ball.w * height);
    gl_FragDepth = depth_of(place);
    vec3 normal = (place - ball.xyz) * gleam.w;
    float gloss = max(dot(normal, gleam.xyz), 0.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    // Shadows end in ragged edges where light grazes; on a round body it is faded out there.
    float grazing = smoothstep(0.0, 0.3, dot(normal, light.xyz));
    vec3 key = direct(paint.rgb, normal) * grazing + 0.22 * gloss;
    vec3 colour = encode(paint.a * ambient(paint.rgb, normal, height) + lit(place) * key);
    pixel = vec4(mix(colour, background.rgb, pale), 1.0);
}
