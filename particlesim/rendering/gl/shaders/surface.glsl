// What is seen at each pixel: -1, or 4 times its first row in the table of surfaces, plus how it is drawn (see
// geometry_tables.py). All positions are relative to the eye, along the axes of the world.
// Ball: centre, radius; linear colour, share of the ambient light.
// Face: normal, distance of its plane from the eye along that; linear colour, share of the ambient light;
//     how much it is turned to the eye, depth of its body's centroid, number of edges;
//     for each edge what, times a ray of depth 1, is the distance from it [pixels, as if seen from ahead].
// Part of a rounded shape: normal, distance of its plane from the eye along that, below 0, if it is an offset face, else
//     a point on the axis, radius; linear colour, share of the ambient light;
//     unit vector along the axis of a cylinder, 0 of a sphere, depth of its body's centroid.
layout(binding = 1) uniform isampler2D seen;
layout(binding = 2) uniform samplerBuffer surfaces;

const int BALL = 0;
const int FACE = 1;
const int ROUNDED = 2;

// The first row of what is seen at this pixel if that is drawn as ``kind``, else -1.
int first_row(int kind) {
    int at = texelFetch(seen, ivec2(gl_FragCoord.xy), 0).x;
    return at >= 0 && (at & 3) == kind ? at >> 2 : -1;
}

// The ray through the middle of this pixel, of depth 1.
vec3 ray_here() {
    vec2 aside = (2.0 * gl_FragCoord.xy / viewport.xy - 1.0) * slopes.xy;
    return forward.xyz + aside.x * right.xyz + aside.y * up.xyz;
}
