#version 420 core
// What every shader shares. All positions in shaders are relative to the eye, along the axes of the world.
layout(std140, binding = 0) uniform View {
    mat4 clip_from_eye;
    mat4 shadow_from_eye;  // to texture coordinates of the shadow map, 0 .. 1, and closeness to the light [m]
    vec4 eye;              // xyz [m]
    vec4 light;            // xyz: unit vector towards the key light
    vec4 texel;            // width and height of a texel of the shadow map, whose sides are 1; how many they are
    vec4 background;       // sRGB, as all colours of the picture
    vec4 floor_bright;     // sRGB of the floor in the light and in the shadow
    vec4 floor_dark;
    vec4 viewport;         // width, height [pixels]; depth is z + w / distance
    vec4 forward;          // xyz: unit vector the camera looks along; w: height of one pixel at distance 1
    vec4 right;            // xyz: unit vectors to the right and upwards in the picture
    vec4 up;
    vec4 slopes;           // tangents of half the field of view across and up
    vec4 floor_area;       // half width x, y [m], height z [m], width of the fading rim [m]
    vec4 haze;             // distance where it begins [m], 1 / distance over which it grows [1/m], strength at its end
};

float depth_at(float close) {
    return viewport.z + viewport.w * close;
}

// How much of the background's colour lies over what is so far away [m]: far things are paler, which tells depth.
float haze_at(float distance) {
    return haze.z * clamp((distance - haze.x) * haze.y, 0.0, 1.0);
}
