// A direction in 32 bits. Mirrors rtstdb/geometry/octahedron.hpp.
#ifndef RTSTDB_COMMON_OCTAHEDRON_GLSL
#define RTSTDB_COMMON_OCTAHEDRON_GLSL

// A unit vector from its place on an octahedron.
vec3 unpacked_direction(uint bits) {
  const vec2 place = max(vec2(ivec2(int(bits << 16), int(bits)) >> 16) / 32767.0, vec2(-1.0));
  const float z = 1.0 - abs(place.x) - abs(place.y);
  const vec2 folded = (1.0 - abs(place.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(place, vec2(0.0)));
  return normalize(vec3(z < 0.0 ? folded : place, z));
}

#endif
