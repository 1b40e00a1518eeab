#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Builds the tree of a TLAS of at most small_build_max instances in one workgroup and one dispatch, since on
// lavapipe a dispatch costs as much as hundreds of instances. It has the phases of a large build, with a
// bitonic sort, and includes the refit.
#include "build/phase_collapse.glsl"
#include "build/phase_hierarchy.glsl"
#include "common/morton.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SmallBuildArgs args; };

layout(set = 0, binding = 10, scalar) buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
// The number of levels, then the first node of each, then the number of nodes.
layout(set = 0, binding = 11, scalar) writeonly buffer LevelsBuffer { uint levels[]; };
#include "build/phase_refit.glsl"

const uint lanes = 64u;

// 24 KiB of the 32 KiB of shared memory that every device has.
shared uvec2 sort_keys[small_build_max];
shared uint sort_values[small_build_max];
shared uint next_count;
shared vec3 lane_lo[lanes];
shared vec3 lane_hi[lanes];

shared uint level_begin[max_tlas_levels + 1u];

void find_scene_bounds(uint lane) {
  vec3 lo = vec3(3e38);
  vec3 hi = vec3(-3e38);
  for (uint i = lane; i < args.count; i += lanes) {
    const vec3 center = center_of(bounds[i]);
    lo = min(lo, center);
    hi = max(hi, center);
  }
  lane_lo[lane] = lo;
  lane_hi[lane] = hi;
  barrier();
  if (lane == 0u) {
    for (uint k = 1u; k < lanes; ++k) {
      lane_lo[0] = min(lane_lo[0], lane_lo[k]);
      lane_hi[0] = max(lane_hi[0], lane_hi[k]);
    }
  }
  barrier();
}

bool after(uint a, uint b) {
  const uvec2 ka = sort_keys[a];
  const uvec2 kb = sort_keys[b];
  if (ka.y != kb.y) return ka.y > kb.y;
  if (ka.x != kb.x) return ka.x > kb.x;
  return sort_values[a] > sort_values[b];
}

void sort_by_code(uint lane) {
  uint padded = 1u;
  while (padded < args.count) padded *= 2u;
  for (uint i = lane; i < padded; i += lanes) {
    sort_keys[i] =
        i < args.count ? morton_code(center_of(bounds[i]), lane_lo[0], lane_hi[0]) : uvec2(0xFFFFFFFFu);
    sort_values[i] = i;
  }
  for (uint size = 2u; size <= padded; size *= 2u) {
    for (uint distance = size / 2u; distance >= 1u; distance /= 2u) {
      barrier();
      for (uint k = lane; k < padded / 2u; k += lanes) {
        const uint a = 2u * k - (k & (distance - 1u));
        const uint b = a + distance;
        if (after(a, b) == ((a & size) == 0u)) {
          const uvec2 key = sort_keys[a];
          const uint value = sort_values[a];
          sort_keys[a] = sort_keys[b];
          sort_values[a] = sort_values[b];
          sort_keys[b] = key;
          sort_values[b] = value;
        }
      }
    }
  }
  barrier();
  for (uint i = lane; i < args.count; i += lanes) {
    keys[i] = sort_keys[i];
    values[i] = sort_values[i];
    arrivals[i] = 0u;
  }
  memoryBarrierBuffer();
  barrier();
}

// Collapses level by level from the root. Returns the number of levels.
uint collapse(uint lane) {
  uint level = 0u;
  uint level_count = 1u;
  uint level_first = 0u;
  uint half_index = 0u;
  if (lane == 0u) queue[0] = uvec2(0u, 0u);
  if (lane == 0u) level_begin[0] = 0u;
  if (args.count == 1u) {
    if (lane == 0u) write_single_leaf_root();
    if (lane == 0u) level_begin[1] = 1u;
    level_count = 0u;
    level = 1u;
  }
  memoryBarrierBuffer();
  barrier();
  while (level_count > 0u && level < max_tlas_levels) {
    for (uint i = lane; i < level_count; i += lanes) {
      const uint node = queue[half_index * args.half_size + i].x;
      offsets[i] = inner_children(choose_children(node));
    }
    memoryBarrierBuffer();
    barrier();
    if (lane == 0u) {
      uint total = 0u;
      for (uint i = 0u; i < level_count; ++i) {
        const uint here = offsets[i];
        offsets[i] = total;
        total += here;
      }
      next_count = total;
      level_begin[level + 1u] = level_first + level_count;
    }
    memoryBarrierBuffer();
    barrier();
    const uint next_level = level_first + level_count;
    for (uint i = lane; i < level_count; i += lanes) {
      const uvec2 entry = queue[half_index * args.half_size + i];
      const WideChildren children = choose_children(entry.x);
      write_tree_node(entry.y, children, next_level + offsets[i]);
      uint place = (1u - half_index) * args.half_size + offsets[i];
      uint next = next_level + offsets[i];
      for (uint k = 0u; k < children.count; ++k) {
        if (is_inner(children.child[k])) queue[place++] = uvec2(children.child[k], next++);
      }
    }
    ++level;
    level_first += level_count;
    level_count = next_count;
    half_index = 1u - half_index;
    memoryBarrierBuffer();
    barrier();
  }
  return level;
}

void main() {
  const uint lane = gl_LocalInvocationID.x;
  if (args.count == 0u) return;
  find_scene_bounds(lane);
  sort_by_code(lane);
  for (uint i = lane; i + 1u < args.count; i += lanes) build_inner_node(int(i), int(args.count));
  memoryBarrierBuffer();
  barrier();
  if (args.count > 1u) {
    for (uint i = lane; i < args.count; i += lanes) fit_from_leaf(i, args.count);
  }
  memoryBarrierBuffer();
  barrier();
  const uint level_count = collapse(lane);
  if (lane == 0u) levels[0] = level_count;
  for (uint i = lane; i <= level_count; i += lanes) levels[1u + i] = level_begin[i];
  for (uint level = level_count; level > 0u; --level) {
    for (uint node = level_begin[level - 1u] + lane; node < level_begin[level]; node += lanes)
      refit_node(node);
    memoryBarrierBuffer();
    barrier();
  }
}
