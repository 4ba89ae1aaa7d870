#version 400 core
// What every shader shares. All positions in shaders are relative to the eye, along the axes of the world.
layout(std140) uniform View {
    mat4 clip_from_eye;
    mat4 shadow_from_eye;  // to texture coordinates and depth of the shadow map, all 0 .. 1
    vec4 eye;              // xyz [m]
    vec4 light;            // xyz: unit vector towards the key light; w: width of a texel of the shadow map
    vec4 background;       // sRGB, as all colours of the picture
    vec4 floor_bright;     // sRGB of the floor in the light and in the shadow
    vec4 floor_dark;
    vec4 viewport;         // width, height [pixels]; depth is z + w / distance
    vec4 forward;          // xyz: unit vector the camera looks along; w: height of one pixel at distance 1
    vec4 floor_area;       // half width x, y [m], height z [m], width of the fading rim [m]
    vec4 samples[2];       // the four sample points of a pixel about its centre, two a vector
};

float depth_of(vec3 place) {
    return viewport.z + viewport.w / dot(forward.xyz, place);
}
