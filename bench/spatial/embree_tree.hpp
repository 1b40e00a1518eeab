#pragma once
// A tree over triangles built by Embree's own builder, to be judged by the same measure as ours.

#include <cstdint>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

enum class EmbreeQuality : std::uint8_t {
  medium,  ///< binned surface area heuristic: what scenes are built with
  high,    ///< triangles may be split, and then stand in several leaves
};

/// Of a mesh with more triangles than fit a leaf. rtcBuildBVH with nodes as wide and leaves as large as ours, by the costs of tree_cost.hpp; boxes in full
/// precision.
double embree_tree_cost(const rtstdb::TriangleMesh& mesh, EmbreeQuality quality);

}  // namespace hil::bench
