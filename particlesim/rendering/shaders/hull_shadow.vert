#include "common.glsl"
#include "rotate.glsl"
layout(location = 0) in vec3 corner;
layout(location = 1) in vec4 centre_size;
layout(location = 2) in vec4 turn;

void main() {
    vec3 place = centre_size.xyz - eye.xyz + rotate(turn, corner * centre_size.w);
    gl_Position = vec4((shadow_from_eye * vec4(place, 1.0)).xyz * 2.0 - 1.0, 1.0);
}
