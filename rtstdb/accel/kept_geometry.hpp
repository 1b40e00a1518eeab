#pragma once
// What the host keeps of geometry, so that it comes back to a device that has nothing: its nodes byte for byte, since a copy is
// sooner there than a build, and the same tree gives the same answers also where a search is cut short; and which triangle of the mesh
// stands where.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/deforming_geometry.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

/// Where a geometry stands in the pools, in their elements.
struct PoolPart {
  std::uint32_t node_base = 0, node_end = 0;
  std::uint32_t triangle_base = 0, triangle_end = 0;
};

/// Of one that deforms, besides the nodes of both places, in the order of DeformingGeometry. Triangles and boxes come with the refit to
/// the shape that is asked for.
struct KeptDeforming {
  GeometryOptions options;
  std::array<BlasBuilder::Place, DeformingGeometry::places> places;
  std::vector<std::byte> order;
  std::vector<std::uint32_t> levels;
  float built_burden = 0.0f;
};

struct KeptGeometry {
  struct Piece {
    std::uint32_t base = 0;  ///< in elements of the pool
    std::vector<std::byte> bytes;
  };

  PoolPart part;
  std::shared_ptr<const TriangleMesh> mesh;
  std::vector<Piece> nodes;
  std::vector<std::uint32_t>
      leaf_order;  ///< numbers of the triangles in the order of the leaves; none of one that deforms
  shared::GeometryRecord record{};
  Bounds bounds;
  std::optional<KeptDeforming> deforming;
};

/// By index.
using KeptGeometries = std::vector<std::shared_ptr<const KeptGeometry>>;

}  // namespace rtstdb::accel
