#version 420 core
// All positions are relative to the eye, along the axes of the world.
layout(std140, binding = 0) uniform View {
    mat4 clip_from_eye;
    vec4 eye;              // xyz [m]
    vec4 forward;          // xyz: unit vector the camera looks along
    vec4 viewport;         // width, height [pixels]
};
layout(location = 0) in vec3 corner;          // x: 0 at the start, 1 at the end; y: -1 or 1, the side
layout(location = 1) in vec4 start_width;     // width [pixels]
layout(location = 2) in vec3 end;
layout(location = 3) in vec4 colour;
noperspective out float aside;    // distance from the middle of the line [pixels]
flat out float half_width;
flat out vec4 paint;

// A line is a strip of constant width on the screen, cut where it passes behind the eye.
void main() {
    vec3 a = start_width.xyz - eye.xyz;
    vec3 b = end - eye.xyz;
    float da = dot(a, forward.xyz);
    float db = dot(b, forward.xyz);
    float nearest = 1e-3 * max(abs(da), abs(db));
    if (da < nearest && db > nearest) a = mix(a, b, (nearest - da) / (db - da));
    if (db < nearest && da > nearest) b = mix(b, a, (nearest - db) / (da - db));
    vec4 ca = clip_from_eye * vec4(a, 1.0);
    vec4 cb = clip_from_eye * vec4(b, 1.0);
    vec2 along = (cb.xy / cb.w - ca.xy / ca.w) * viewport.xy;
    along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
    vec4 at = corner.x < 0.5 ? ca : cb;
    // Half a pixel more on each side, over which the line fades.
    half_width = 0.5 * start_width.w;
    aside = corner.y * (half_width + 0.5);
    at.xy += vec2(-along.y, along.x) * aside * 2.0 / viewport.xy * at.w;
    paint = colour;
    gl_Position = max(da, db) > 0.0 ? at : vec4(2.0, 2.0, 2.0, 1.0);
}
