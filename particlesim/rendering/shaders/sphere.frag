#include "common.glsl"
#include "light.glsl"
in vec2 across;
in vec3 ray;
flat in vec4 ball;
flat in vec4 gleam;
flat in vec3 paint;
out vec4 pixel;

bool inside(vec2 at) {
    return dot(at, at) <= 1.0;
}

void main() {
    // Which of the pixel's four samples lie inside the outline: exact edges without shading four times.
    vec2 right = dFdx(across);
    vec2 up = dFdy(across);
    int mask = (inside(across + samples[0].x * right + samples[0].y * up) ? 1 : 0)
             | (inside(across + samples[0].z * right + samples[0].w * up) ? 2 : 0)
             | (inside(across + samples[1].x * right + samples[1].y * up) ? 4 : 0)
             | (inside(across + samples[1].z * right + samples[1].w * up) ? 8 : 0);
    if (mask == 0) discard;
    gl_SampleMask[0] = mask;
    // With e = radius / distance, the ray through a point of the disc meets the sphere at ray / (1 + e h), where h is
    // the height sqrt(1 - across^2): the quadratic equation solved by hand, without its loss of digits.
    float height = sqrt(max(1.0 - dot(across, across), 0.0));
    vec3 place = ray / (1.0 + ball.w * height);
    gl_FragDepth = depth_of(place);
    vec3 normal = (place - ball.xyz) * gleam.w;
    float gloss = max(dot(normal, gleam.xyz), 0.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    // Shadows end in ragged edges where light grazes; on a round body it is faded out there.
    float grazing = smoothstep(0.0, 0.3, dot(normal, light.xyz));
    vec3 key = direct(paint, normal) * grazing + 0.22 * gloss;
    pixel = vec4(encode(ambient(paint, normal, height) + lit(place) * key), 1.0);
}
