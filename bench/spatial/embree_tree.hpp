#pragma once
// A tree over triangles built by Embree's builder, evaluated by the same cost model as ours.

#include <cstdint>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

enum class EmbreeQuality : std::uint8_t {
  medium,  ///< binned surface area heuristic, the default of scenes
  high,    ///< may split triangles, which then occur in several leaves
};

/// For a mesh with more triangles than one leaf holds. rtcBuildBVH with our node width, leaf size and costs
/// (tree_cost.hpp); boxes have full precision.
double embree_tree_cost(const rtstdb::TriangleMesh& mesh, EmbreeQuality quality);

}  // namespace hil::bench
