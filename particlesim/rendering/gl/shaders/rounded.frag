#include "common.glsl"
#include "light.glsl"
#include "surface.glsl"
out vec4 pixel;

void main() {
    int row = first_row(ROUNDED);
    if (row < 0) discard;
    vec4 form = texelFetch(surfaces, row);
    vec4 paint = texelFetch(surfaces, row + 1);
    vec4 body = texelFetch(surfaces, row + 2);
    vec3 ray = normalize(ray_here());
    vec3 normal = form.xyz;
    float distance = form.w / dot(normal, ray);
    if (form.w > 0.0) {
        // Seen along the axis of a cylinder it is a circle; a sphere has no axis. How far from the ray the axis is: the
        // half chord follows without the loss of digits of the quadratic equation.
        vec3 across = ray - dot(ray, body.xyz) * body.xyz;
        vec3 centre = form.xyz - dot(form.xyz, body.xyz) * body.xyz;
        float along = dot(centre, across) / dot(across, across);
        vec3 miss = centre - along * across;
        distance = along - sqrt(max(form.w * form.w - dot(miss, miss), 0.0) / dot(across, across));
        normal = (distance * across - centre) / form.w;
    }
    vec3 place = distance * ray;
    gl_FragDepth = depth_at(1.0 / dot(forward.xyz, place));
    vec3 colour = encode(round_surface(paint, normal, ray, place));
    pixel = vec4(mix(colour, background.rgb, haze_at(body.w)), 1.0);
}
