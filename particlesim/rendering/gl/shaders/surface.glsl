// What is seen at each pixel: its first row in the table of surfaces if it is a sphere, -2 minus that if it is the face
// of a hull, or -1. All places are relative to the eye, along the axes of the world.
// Sphere: centre, radius; linear colour, share of the sky's light.
// Face: normal, distance of its plane from the eye along that; linear colour, share of the sky's light;
//     how much it is turned to the eye, depth of its hull's centre, number of edges;
//     for each edge what, times a ray of depth 1, is the distance from it [pixels, as if seen from ahead].
layout(binding = 1) uniform isampler2D first_row;
layout(binding = 2) uniform samplerBuffer surfaces;

// The ray through the middle of this pixel, of depth 1.
vec3 ray_here() {
    vec2 aside = (2.0 * gl_FragCoord.xy / viewport.xy - 1.0) * slopes.xy;
    return forward.xyz + aside.x * right.xyz + aside.y * up.xyz;
}
