#include "common.glsl"
#include "light.glsl"
#include "surface.glsl"
out vec4 pixel;

void main() {
    int row = first_row(FACE);
    if (row < 0) discard;
    vec4 plane = texelFetch(surfaces, row);
    vec4 paint = texelFetch(surfaces, row + 1);
    vec4 body = texelFetch(surfaces, row + 2);
    vec3 ray = ray_here();
    float close = dot(plane.xyz, ray) / plane.w;
    gl_FragDepth = depth_at(close);
    vec3 colour = encode(paint.a * ambient(paint.rgb, plane.xyz, body.x) + lit(ray / close) * direct(paint.rgb, plane.xyz));
    // Edges are a little darker, over about one and a half pixels whatever the distance.
    float edge = 2.0;
    for (int k = 0; k < int(body.z); k++) edge = min(edge, dot(texelFetch(surfaces, row + 3 + k).xyz, ray));
    float line = clamp(1.5 - 0.75 * edge, 0.0, 1.0);
    pixel = vec4(mix(colour, background.rgb, haze_at(body.y)) * (1.0 - 0.2 * line), 1.0);
}
