#version 400 core
uniform sampler2D picture;
out vec4 pixel;

// Smooths jagged edges of a finished picture: where brightness steps, the pixel is mixed with the one across the edge,
// by how far it is from the end of its step along the edge. After the idea of T. Lottes, FXAA (NVIDIA, 2009).
const float STEEP = 0.06;       // steps of brightness smaller than this share of the brightest ...
const float DIM = 0.03;         // ... or than this are no edges
const int FARTHEST = 12;        // pixels along the edge to look for its end

ivec2 last;

vec3 colour_at(ivec2 at) {
    return texelFetch(picture, clamp(at, ivec2(0), last), 0).rgb;
}

float brightness(vec3 colour) {
    return dot(colour, vec3(0.299, 0.587, 0.114));
}

float bright_at(ivec2 at) {
    return brightness(colour_at(at));
}

void main() {
    last = textureSize(picture, 0) - 1;
    // The first row of the result is the highest of the picture.
    ivec2 at = ivec2(gl_FragCoord.x, last.y - int(gl_FragCoord.y));
    vec3 here = colour_at(at);
    float c = brightness(here);
    float n = bright_at(at + ivec2(0, 1));
    float s = bright_at(at - ivec2(0, 1));
    float e = bright_at(at + ivec2(1, 0));
    float w = bright_at(at - ivec2(1, 0));
    float most = max(c, max(max(n, s), max(e, w)));
    float least = min(c, min(min(n, s), min(e, w)));
    pixel = vec4(here, 1.0);
    if (most - least < max(DIM, STEEP * most)) return;

    // The edge runs along the direction in which brightness bends less.
    float ne = bright_at(at + ivec2(1, 1));
    float nw = bright_at(at + ivec2(-1, 1));
    float se = bright_at(at + ivec2(1, -1));
    float sw = bright_at(at + ivec2(-1, -1));
    float down = abs(ne - 2.0 * e + se) + 2.0 * abs(n - 2.0 * c + s) + abs(nw - 2.0 * w + sw);
    float aside = abs(ne - 2.0 * n + nw) + 2.0 * abs(e - 2.0 * c + w) + abs(se - 2.0 * s + sw);
    bool level = down >= aside;
    float plus = level ? n : e;
    float minus = level ? s : w;
    bool ahead = abs(plus - c) >= abs(minus - c);
    ivec2 across = (level ? ivec2(0, 1) : ivec2(1, 0)) * (ahead ? 1 : -1);
    ivec2 along = level ? ivec2(1, 0) : ivec2(0, 1);

    // Along the edge, the mean of its two sides stays what it is here until the step ends.
    float middle = 0.5 * (c + (ahead ? plus : minus));
    float quarter = 0.25 * abs((ahead ? plus : minus) - c);
    float gone[2];
    float rest[2];
    for (int side = 0; side < 2; side++) {
        ivec2 forth = side == 0 ? along : -along;
        int k = 1;
        float change = 0.0;
        for (; k <= FARTHEST; k++) {
            change = 0.5 * (bright_at(at + forth * k) + bright_at(at + forth * k + across)) - middle;
            if (abs(change) >= quarter) break;
        }
        gone[side] = float(k);
        rest[side] = change;
    }
    // Only the side on which this pixel's colour ends takes from across: half a pixel at the end, nothing midway.
    int nearer = gone[0] <= gone[1] ? 0 : 1;
    bool ends_here = (rest[nearer] < 0.0) != (c < middle);
    float share = ends_here ? max(0.5 - (gone[nearer] - 0.5) / (gone[0] + gone[1] - 1.0), 0.0) : 0.0;
    // Single pixels that stick out of what is around them are drawn in a little, too.
    float around = (2.0 * (n + s + e + w) + ne + nw + se + sw) / 12.0;
    float sticks = clamp(abs(around - c) / (most - least), 0.0, 1.0);
    share = max(share, 0.6 * sticks * sticks);
    pixel = vec4(mix(here, colour_at(at + across), share), 1.0);
}
