#pragma once
// Reads the BLAS of a geometry back from the device and checks it: each triangle is in one leaf, and each box
// contains its children.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "rtstdb/accel/geometry_pool.hpp"
#include "shaders/shared/node.h"
#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::test {

using Words = std::vector<std::uint32_t>;

/// In double precision, which holds decoded boxes exactly.
struct ExactBox {
  glm::dvec3 lo, hi;
};

/// Visits one tree. The mesh must outlive it.
class StructureWalk {
 public:
  StructureWalk(const TriangleMesh& mesh, Words nodes, Words triangles)
      : mesh_(mesh),
        nodes_(std::move(nodes)),
        triangles_(std::move(triangles)),
        seen_(mesh.triangles.size()) {}

  /// Returns the box of all triangles below the node.
  ExactBox visit(std::uint32_t node, std::uint32_t depth) {
    ++node_count_;
    depth_ = std::max(depth_, depth);
    ExactBox all{glm::dvec3(1e300), glm::dvec3(-1e300)};
    std::uint32_t children = 0, inner = 0;
    glm::dvec3 centers(0.0), corners(0.0);
    for (std::uint32_t slot = 0; slot < shared::node_width && !testing::Test::HasFatalFailure(); ++slot) {
      const std::uint32_t reference = words(node)[16 + slot];
      if ((words(node)[3] >> 24 >> slot & 1u) == 0) {
        EXPECT_EQ(reference, shared::ref_none);
        continue;
      }
      ++children;
      const bool leaf = (reference & shared::ref_leaf_bit) != 0;
      inner += leaf ? 0 : 1;
      if (!leaf) referenced_.push_back(reference);
      const ExactBox below = leaf ? visit_leaf(reference) : visit(reference, depth + 1);
      const ExactBox box = box_of(node, slot);
      for (int axis = 0; axis < 3; ++axis) {
        if (box.lo[axis] > below.lo[axis] || box.hi[axis] < below.hi[axis]) ++not_contained_;
      }
      all.lo = glm::min(all.lo, below.lo);
      all.hi = glm::max(all.hi, below.hi);
      const glm::dvec3 towards((slot & 1u) != 0 ? 1.0 : -1.0, (slot & 2u) != 0 ? 1.0 : -1.0,
                               (slot & 4u) != 0 ? 1.0 : -1.0);
      centers += towards * (below.lo + below.hi);
      corners += towards;
      if (leaf) leaf_area_ += area_of(box) * ((reference >> shared::ref_triangle_count_shift & 0xFu) + 1);
    }
    node_area_ += area_of(all);
    const glm::dvec3 away = centers - corners * (all.lo + all.hi);
    slot_gain_ += 0.5 * (away.x + away.y + away.z);
    EXPECT_TRUE(inner == 0 || children == shared::node_width) << "wide_node_bound assumes full inner nodes";
    return all;
  }

  void expect_valid() const {
    EXPECT_EQ(not_contained_, 0u);
    EXPECT_EQ(wrong_corners_, 0u);
    EXPECT_TRUE(std::ranges::all_of(seen_, [](std::uint8_t times) { return times == 1; }));
    auto sorted = referenced_;
    std::ranges::sort(sorted);
    EXPECT_EQ(std::ranges::adjacent_find(sorted), sorted.end()) << "a node has two parents";
  }
  std::uint32_t node_count() const { return node_count_; }
  std::uint32_t depth() const { return depth_; }
  /// Of a ray through the box of the root: a node costs 1, a triangle 0.3.
  double cost(const ExactBox& root) const { return (node_area_ + 0.3 * leaf_area_) / area_of(root); }
  /// The sum of the distances of all children from the middle of their node towards the corners of their
  /// slots.
  double slot_gain() const { return slot_gain_; }

 private:
  static double area_of(const ExactBox& box) {
    const glm::dvec3 e = box.hi - box.lo;
    return e.x * e.y + e.y * e.z + e.z * e.x;
  }
  const std::uint32_t* words(std::uint32_t node) const { return &nodes_[4 * shared::node_texels * node]; }

  ExactBox box_of(std::uint32_t node, std::uint32_t slot) const {
    const std::uint32_t* const w = words(node);
    ExactBox box{};
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const auto edge = [&](std::uint32_t pair) {
        return static_cast<double>(w[4 + 4 * axis + pair + slot / 4] >> (8 * (slot % 4)) & 0xFFu);
      };
      const double origin = std::bit_cast<float>(w[axis]);
      const double quantum = std::ldexp(1.0, static_cast<int>(w[3] >> (8 * axis) & 0xFFu) - 127);
      box.lo[static_cast<int>(axis)] = origin + edge(0) * quantum;
      box.hi[static_cast<int>(axis)] = origin + edge(2) * quantum;
    }
    return box;
  }

  ExactBox visit_leaf(std::uint32_t reference) {
    const std::uint32_t first = reference & shared::ref_triangle_first_mask;
    const std::uint32_t count = (reference >> shared::ref_triangle_count_shift & 0xFu) + 1;
    EXPECT_LE(count, shared::max_triangles_per_leaf);
    ExactBox box{glm::dvec3(1e300), glm::dvec3(-1e300)};
    for (std::uint32_t i = first; i < first + count; ++i) {
      const std::uint32_t* const w = &triangles_[4 * shared::triangle_texels * i];
      const std::uint32_t triangle = w[3];
      if (triangle >= seen_.size()) {
        ++wrong_corners_;
        continue;
      }
      ++seen_[triangle];
      for (std::uint32_t corner = 0; corner < 3; ++corner) {
        const glm::vec3 expected = mesh_.positions_m[mesh_.triangles[triangle][static_cast<int>(corner)]];
        glm::vec3 actual;
        std::memcpy(&actual, w + 4 * corner, sizeof actual);
        wrong_corners_ += actual == expected ? 0 : 1;
        box.lo = glm::min(box.lo, glm::dvec3(actual));
        box.hi = glm::max(box.hi, glm::dvec3(actual));
      }
    }
    return box;
  }

  const TriangleMesh& mesh_;
  Words nodes_, triangles_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::uint32_t> referenced_;
  std::uint32_t node_count_ = 0, depth_ = 0;
  std::size_t not_contained_ = 0, wrong_corners_ = 0;
  double node_area_ = 0.0, leaf_area_ = 0.0, slot_gain_ = 0.0;
};

/// Fixture with a geometry pool.
class StructureTest : public gpu::test::GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    submit_ = accel::Submit::create(device()).value();
    new_pool();
  }
  void new_pool(std::uint32_t max_geometries = 64) {
    pool_ = accel::GeometryPool::create(device(), max_geometries, submit_).value();
  }

  std::uint32_t add(const TriangleMesh& mesh, const GeometryOptions& options = {}) {
    const auto added = pool_.add(device(), std::make_shared<const TriangleMesh>(mesh), submit_, options);
    if (!added) {
      ADD_FAILURE() << added.error().message;
      return 0;
    }
    return added.value();
  }
  std::uint32_t root_of(std::uint32_t geometry) {
    return pool_.geometries().host_as<shared::GeometryRecord>()[geometry].root;
  }

  Words read(const gpu::Buffer& buffer) {
    auto back = device().create_buffer(
        {.name = "read back", .size_bytes = buffer.size_bytes(), .memory = gpu::Memory::readback});
    if (!back) {
      ADD_FAILURE() << back.error().message;
      return {};
    }
    submit_.begin();
    submit_.recorder().copy(buffer, 0, back.value(), 0, buffer.size_bytes());
    EXPECT_TRUE(submit_.run());
    const auto words = back.value().host_as<std::uint32_t>();
    return {words.begin(), words.end()};
  }

  accel::Submit submit_;
  accel::GeometryPool pool_;
};

}  // namespace rtstdb::test
