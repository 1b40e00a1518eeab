#pragma once
// What the host keeps of each geometry to restore it on another device: its nodes byte for byte and its leaf
// order. A copy is faster than a build, and an identical tree gives identical results even for searches that
// end early.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/deforming_geometry.hpp"
#include "rtstdb/field/stored_field.hpp"
#include "rtstdb/geometry/convex_parts.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

/// The range of a geometry in the pools, in their elements.
struct PoolPart {
  std::uint32_t node_base = 0, node_end = 0;
  std::uint32_t triangle_base = 0, triangle_end = 0;
};

/// For deforming geometry: the data besides the nodes of both places, in the order of DeformingGeometry.
/// Triangles and boxes come with the next refit.
struct KeptDeforming {
  GeometryOptions options;
  std::array<BlasBuilder::Place, DeformingGeometry::places> places;
  std::vector<std::byte> order;
  std::vector<std::uint32_t> levels;
  float built_cost_ratio = 0.0f;
};

struct KeptGeometry {
  struct Piece {
    std::uint32_t base = 0;  ///< in elements of the pool
    std::vector<std::byte> bytes;
  };

  PoolPart part;
  std::shared_ptr<const TriangleMesh> mesh;
  std::vector<Piece> nodes;
  std::vector<std::uint32_t> leaf_order;  ///< triangle indices in leaf order; empty for deforming geometry
  shared::GeometryRecord record{};
  Bounds bounds;
  std::optional<KeptDeforming> deforming;
  std::shared_ptr<const field::StoredField> field;  ///< null: none
  std::shared_ptr<const ConvexParts> parts;         ///< null: it does not consist of convex parts
};

/// By geometry index.
using KeptGeometries = std::vector<std::shared_ptr<KeptGeometry>>;

}  // namespace rtstdb::accel
