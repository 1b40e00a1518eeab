#include "bench/spatial/our_tree.hpp"

#include <bit>
#include <cmath>
#include <span>

#include "bench/spatial/side_by_side.hpp"
#include "bench/spatial/tree_cost.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "shaders/shared/entity.h"
#include "shaders/shared/node.h"

namespace hil::bench {
namespace {

using namespace rtstdb;

constexpr std::size_t node_words = 4 * shared::node_texels;

/// See shaders/shared/node.h.
CostBox box_of(std::span<const std::uint32_t> node, std::uint32_t slot) {
  CostBox box;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const auto edge = [&](std::uint32_t pair) {
      return static_cast<double>(node[4 + 4 * axis + pair + slot / 4] >> (8 * (slot % 4)) & 0xFFu);
    };
    const double origin = std::bit_cast<float>(node[axis]);
    const double quantum = std::ldexp(1.0, static_cast<int>(node[3] >> (8 * axis) & 0xFFu) - 127);
    box.lo[static_cast<int>(axis)] = origin + edge(0) * quantum;
    box.hi[static_cast<int>(axis)] = origin + edge(2) * quantum;
  }
  return box;
}

/// Adds the cost of everything below a node, and returns the box around it.
CostBox add_below(std::span<const std::uint32_t> nodes, std::uint32_t node, TreeCost& cost) {
  const auto words = nodes.subspan(node * node_words, node_words);
  CostBox all;
  for (std::uint32_t slot = 0; slot < shared::node_width; ++slot) {
    if ((words[3] >> 24 >> slot & 1u) == 0) continue;
    const CostBox box = box_of(words, slot);
    all.grow(box);
    const std::uint32_t reference = words[16 + slot];
    if ((reference & shared::ref_leaf_bit) != 0) {
      cost.add_leaf(box, (reference >> shared::ref_triangle_count_shift & 0xFu) + 1);
    } else {
      cost.add_node(box);
      add_below(nodes, reference, cost);
    }
  }
  return all;
}

}  // namespace

double our_tree_cost(const TriangleMesh& mesh) {
  const auto device = must(gpu::Device::open({}));
  auto submit = must(accel::Submit::create(*device));
  auto pool = must(accel::GeometryPool::create(*device, 1, submit));
  const std::uint32_t geometry =
      must(pool.add(*device, std::make_shared<const rtstdb::TriangleMesh>(mesh), submit));
  const auto read_back = must(device->create_buffer(
      {.name = "read back", .size_bytes = pool.nodes().size_bytes(), .memory = gpu::Memory::readback}));
  submit.begin();
  submit.recorder().copy(pool.nodes(), 0, read_back, 0, pool.nodes().size_bytes());
  if (!submit.run()) throw std::runtime_error("the device is lost");
  TreeCost cost;
  const std::uint32_t root = pool.geometries().host_as<shared::GeometryRecord>()[geometry].root;
  const CostBox all = add_below(read_back.host_as<const std::uint32_t>(), root, cost);
  cost.add_node(all);
  return cost.of_root(all);
}

}  // namespace hil::bench
