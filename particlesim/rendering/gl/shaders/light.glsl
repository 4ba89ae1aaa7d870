// How close to the key light what it meets is: minus its depth along the light [m].
layout(binding = 0) uniform sampler2D shadow_map;

// The colours of the light, linear. Sky and ground make the light that comes from everywhere.
const vec3 KEY = vec3(0.86, 0.83, 0.78);
const vec3 SKY = vec3(0.44, 0.47, 0.52);
const vec3 GROUND = vec3(0.21, 0.20, 0.19);

// How much of the four texels about a place in the shadow map is behind it, evenly from one to the next.
float open_at(vec2 at, float close) {
    vec4 open = step(textureGather(shadow_map, at), vec4(close));
    vec2 share = fract(at * texel.zw - 0.5);
    vec2 along = mix(open.wx, open.zy, share.x);
    return mix(along.x, along.y, share.y);
}

// Fraction of the key light that reaches a place: two looks a little apart. Outside the map all is lit.
float lit(vec3 place) {
    vec3 at = (shadow_from_eye * vec4(place, 1.0)).xyz;
    vec2 aside = vec2(0.6, -0.6) * texel.xy;
    return 0.5 * (open_at(at.xy + aside, at.z) + open_at(at.xy - aside, at.z));
}

// What a matt surface sends to the eye of the light from everywhere: less where it turns away, which shows its form.
vec3 ambient(vec3 colour, vec3 normal, float towards_eye) {
    return colour * mix(GROUND, SKY, 0.5 + 0.5 * normal.z) * (0.55 + 0.45 * max(towards_eye, 0.0));
}

// The same of the key light.
vec3 direct(vec3 colour, vec3 normal) {
    return colour * KEY * max(dot(normal, light.xyz), 0.0);
}

// The same of both from a glossy surface that is round, in linear light; ``ray`` is a unit vector from the eye to it.
vec3 round_surface(vec4 paint, vec3 normal, vec3 ray, vec3 place) {
    float facing = -dot(normal, ray);
    float gloss = max(dot(normal, normalize(light.xyz - ray)), 0.0);
    gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
    // Shadows end in ragged edges where light grazes; on a round body it is faded out there.
    float grazing = smoothstep(0.0, 0.3, dot(normal, light.xyz));
    vec3 key = direct(paint.rgb, normal) * grazing + 0.22 * gloss;
    return paint.a * ambient(paint.rgb, normal, facing) + lit(place) * key;
}

// From linear light to the picture. The square root stands for the curve of sRGB at a tenth of its cost; colours
// come in by the square, so that a colour in full light is the one that was asked for.
vec3 encode(vec3 light) {
    return sqrt(light);
}
