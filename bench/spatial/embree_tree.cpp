#include "bench/spatial/embree_tree.hpp"

#include <glm/ext/vector_float3.hpp>

#include <algorithm>
#include <new>
#include <vector>

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/tree_cost.hpp"
#include "shaders/shared/node.h"

namespace hil::bench {
namespace {

namespace shared = rtstdb::shared;

/// Upper bound on the average number of parts per triangle.
constexpr std::size_t max_split_factor = 3;

struct Node {
  std::size_t triangles = 0;  ///< of a leaf; 0: an inner node
  unsigned child_count = 0;
  Node* children[shared::node_width]{};
  CostBox boxes[shared::node_width];  ///< of the children
};

CostBox box_of(const RTCBounds& bounds) {
  return {{bounds.lower_x, bounds.lower_y, bounds.lower_z}, {bounds.upper_x, bounds.upper_y, bounds.upper_z}};
}

RTCBounds bounds_of(const glm::vec3& lo, const glm::vec3& hi) {
  return {lo.x, lo.y, lo.z, 0.0f, hi.x, hi.y, hi.z, 0.0f};
}

Node* new_node(RTCThreadLocalAllocator allocator) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(Node), 16)) Node;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned child_count, void*) {
  Node* const node = new_node(allocator);
  node->child_count = child_count;
  return node;
}

void set_children(void* node, void** children, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i)
    static_cast<Node*>(node)->children[i] = static_cast<Node*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i)
    static_cast<Node*>(node)->boxes[i] = box_of(*bounds[i]);
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive*, std::size_t count, void*) {
  Node* const node = new_node(allocator);
  node->triangles = count;
  return node;
}

struct Box {
  glm::vec3 lo{3e38f}, hi{-3e38f};
  void grow(const glm::vec3& point) {
    lo = glm::min(lo, point);
    hi = glm::max(hi, point);
  }
};

/// The boxes of the two parts of a triangle on both sides of a plane, within the box of the current part.
void split(const RTCBuildPrimitive* primitive, unsigned dimension, float position, RTCBounds* left,
           RTCBounds* right, void* mesh_pointer) {
  const auto& mesh = *static_cast<const rtstdb::TriangleMesh*>(mesh_pointer);
  const glm::uvec3 numbers = mesh.triangles[primitive->primID];
  const int axis = static_cast<int>(dimension);
  Box parts[2];
  for (int i = 0; i < 3; ++i) {
    const glm::vec3 from = mesh.positions_m[numbers[i]], to = mesh.positions_m[numbers[(i + 1) % 3]];
    if (from[axis] <= position) parts[0].grow(from);
    if (from[axis] >= position) parts[1].grow(from);
    if ((from[axis] < position) == (to[axis] < position)) continue;
    glm::vec3 crossing = glm::mix(from, to, (position - from[axis]) / (to[axis] - from[axis]));
    crossing[axis] = position;
    parts[0].grow(crossing);
    parts[1].grow(crossing);
  }
  const glm::vec3 lo(primitive->lower_x, primitive->lower_y, primitive->lower_z);
  const glm::vec3 hi(primitive->upper_x, primitive->upper_y, primitive->upper_z);
  *left = bounds_of(glm::max(lo, parts[0].lo), glm::min(hi, parts[0].hi));
  *right = bounds_of(glm::max(lo, parts[1].lo), glm::min(hi, parts[1].hi));
}

std::vector<RTCBuildPrimitive> primitives_of(const rtstdb::TriangleMesh& mesh) {
  std::vector<RTCBuildPrimitive> primitives;
  primitives.reserve(max_split_factor * mesh.triangles.size());
  for (const glm::uvec3& triangle : mesh.triangles) {
    Box box;
    for (int i = 0; i < 3; ++i)
      box.grow(mesh.positions_m[triangle[i]]);
    primitives.push_back({box.lo.x, box.lo.y, box.lo.z, 0, box.hi.x, box.hi.y, box.hi.z,
                          static_cast<unsigned>(primitives.size())});
  }
  return primitives;
}

void add_below(const Node& node, TreeCost& cost) {
  for (unsigned i = 0; i < node.child_count; ++i) {
    const Node& child = *node.children[i];
    if (child.triangles > 0) {
      cost.add_leaf(node.boxes[i], child.triangles);
    } else {
      cost.add_node(node.boxes[i]);
      add_below(child, cost);
    }
  }
}

}  // namespace

double embree_tree_cost(const rtstdb::TriangleMesh& mesh, EmbreeQuality quality) {
  const EmbreeDevice device = open_embree();
  const EmbreeTree tree(rtcNewBVH(device.get()));
  std::vector<RTCBuildPrimitive> primitives = primitives_of(mesh);
  rtstdb::TriangleMesh splittable = mesh;
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = quality == EmbreeQuality::high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = shared::node_width;
  arguments.maxDepth = 64;
  arguments.maxLeafSize = shared::max_triangles_per_leaf;
  arguments.traversalCost = static_cast<float>(node_cost);
  arguments.intersectionCost = static_cast<float>(triangle_cost);
  arguments.bvh = tree.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.capacity();
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  arguments.splitPrimitive = split;
  arguments.userPtr = &splittable;
  const auto* const root = static_cast<const Node*>(rtcBuildBVH(&arguments));
  check_embree(device.get());
  CostBox all;
  for (unsigned i = 0; i < root->child_count; ++i)
    all.grow(root->boxes[i]);
  TreeCost cost;
  cost.add_node(all);
  add_below(*root, cost);
  return cost.of_root(all);
}

}  // namespace hil::bench
