// Reductions and scans over the eight lanes of a subgroup, by shuffles: on lavapipe a shuffle is one or two
// instructions, while all other subgroup operations run lane by lane.
#ifndef RTSTDB_QUERY_SIMD8_LANES_GLSL
#define RTSTDB_QUERY_SIMD8_LANES_GLSL

uint of_lane(uint v, uint lane) { return subgroupShuffle(v, lane); }
int of_lane(int v, uint lane) { return subgroupShuffle(v, lane); }
float of_lane(float v, uint lane) { return subgroupShuffle(v, lane); }
vec3 of_lane(vec3 v, uint lane) {
  return vec3(subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane));
}
uvec4 of_lane(uvec4 v, uint lane) {
  return uvec4(subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane),
               subgroupShuffle(v.w, lane));
}

uint min_of_lanes(uint v) {
  v = min(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 4u));
  v = min(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 2u));
  return min(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 1u));
}

// The bitwise or over all lanes.
uint in_any(uint bits) {
  bits |= subgroupShuffle(bits, gl_SubgroupInvocationID ^ 4u);
  bits |= subgroupShuffle(bits, gl_SubgroupInvocationID ^ 2u);
  return bits | subgroupShuffle(bits, gl_SubgroupInvocationID ^ 1u);
}

uint sum_of_lanes(uint v) {
  v += subgroupShuffle(v, gl_SubgroupInvocationID ^ 4u);
  v += subgroupShuffle(v, gl_SubgroupInvocationID ^ 2u);
  return v + subgroupShuffle(v, gl_SubgroupInvocationID ^ 1u);
}

uint count_of_lanes(bool which) { return sum_of_lanes(which ? 1u : 0u); }

// Adds the value of the lane `lanes` before this one.
uint sum_with_before(uint v, uint lanes) {
  const uint before = subgroupShuffle(v, (gl_SubgroupInvocationID - lanes) & 7u);
  return v + (gl_SubgroupInvocationID >= lanes ? before : 0u);
}

// How many of the lanes before this one have `which`.
uint lanes_before(bool which) {
  const uint own = which ? 1u : 0u;
  return sum_with_before(sum_with_before(sum_with_before(own, 1u), 2u), 4u) - own;
}

float lesser(float a, float b) { return a < b ? a : b; }

float min_of_lanes(float v) {
  v = lesser(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 4u));
  v = lesser(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 2u));
  return lesser(v, subgroupShuffle(v, gl_SubgroupInvocationID ^ 1u));
}

float max_of_lanes(float v) { return -min_of_lanes(-v); }

vec3 min_of_lanes(vec3 v) { return vec3(min_of_lanes(v.x), min_of_lanes(v.y), min_of_lanes(v.z)); }

#endif
