#include "common.glsl"
#include "light.glsl"
#include "surface.glsl"
out vec4 pixel;

void main() {
    int row = first_row(BALL);
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
    vec3 colour = encode(round_surface(paint, normal, ray, place));
    pixel = vec4(mix(colour, background.rgb, haze_at(dot(forward.xyz, ball.xyz))), 1.0);
}
