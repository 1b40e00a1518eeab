// The binary radix tree over sorted Morton codes. Every inner node finds its range independently (Karras
// 2012, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees"). Equal codes are
// ordered by their position.
#ifndef RTSTDB_BUILD_PHASE_HIERARCHY_GLSL
#define RTSTDB_BUILD_PHASE_HIERARCHY_GLSL
#include "build/scratch.glsl"

// Length of the common prefix of the codes at i and j; -1 if j is out of range.
int common_prefix(int i, int j, int count) {
  if (j < 0 || j >= count) return -1;
  const uvec2 difference = keys[i] ^ keys[j];
  if (difference.y != 0u) return 31 - findMSB(difference.y);
  if (difference.x != 0u) return 63 - findMSB(difference.x);
  return 95 - findMSB(uint(i ^ j));
}

void link_child(uint parent, int index, bool is_leaf, uint inner_count) {
  parents[is_leaf ? inner_count + uint(index) : uint(index)] = parent;
}

void build_inner_node(int i, int count) {
  const int direction = common_prefix(i, i + 1, count) > common_prefix(i, i - 1, count) ? 1 : -1;
  const int outside = common_prefix(i, i - direction, count);
  int reach = 2;
  while (common_prefix(i, i + reach * direction, count) > outside) reach *= 2;
  int length = 0;
  for (int step = reach / 2; step >= 1; step /= 2) {
    if (common_prefix(i, i + (length + step) * direction, count) > outside) length += step;
  }
  const int other_end = i + length * direction;
  const int node_prefix = common_prefix(i, other_end, count);
  int split = 0;
  int step = length;
  do {
    step = (step + 1) / 2;
    if (common_prefix(i, i + (split + step) * direction, count) > node_prefix) split += step;
  } while (step > 1);
  const int left = i + split * direction + min(direction, 0);
  const int first = min(i, other_end);
  const int last = max(i, other_end);
  const bool left_is_leaf = first == left;
  const bool right_is_leaf = last == left + 1;
  binary[i] = uvec4(uint(left) | (left_is_leaf ? leaf_child_bit : 0u),
                    uint(left + 1) | (right_is_leaf ? leaf_child_bit : 0u), uint(first), uint(last));
  link_child(uint(i), left, left_is_leaf, uint(count - 1));
  link_child(uint(i), left + 1, right_is_leaf, uint(count - 1));
}

#endif
