#include "common.glsl"
layout(location = 0) in vec3 corner;
layout(location = 1) in vec4 centre_radius;
out vec2 across;

// For the shadow a sphere is the disc through its centre: the same outline, and no shadow on its own lit half.
void main() {
    vec3 u = normalize(cross(vec3(0.0, 1.0, 0.0), light.xyz));
    vec3 v = cross(light.xyz, u);
    across = corner.xy;
    vec3 place = centre_radius.xyz - eye.xyz + centre_radius.w * (u * across.x + v * across.y);
    gl_Position = vec4((shadow_from_eye * vec4(place, 1.0)).xyz * 2.0 - 1.0, 1.0);
}
