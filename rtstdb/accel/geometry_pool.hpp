#pragma once
// All geometry on the device: one pool of wide nodes (one BLAS after the other), one of triangles in leaf order, one table of geometries. Setup only; a pool that grows is made anew, and
// whoever bound it binds again (generation).

#include <cstdint>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/blas_builder.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

class GeometryPool {
 public:
  static Result<GeometryPool> create(gpu::Device& device, std::uint32_t max_geometries, Submit& submit);

  /// Builds the BLAS. The mesh has passed validate. Errors: capacity, out_of_memory, device_lost; the pool is
  /// unchanged.
  Result<std::uint32_t> add(gpu::Device& device, const TriangleMesh& mesh, Submit& submit);

  const gpu::Buffer& nodes() const noexcept { return nodes_; }
  const gpu::Buffer& triangles() const noexcept { return triangles_; }
  const gpu::Buffer& geometries() const noexcept { return geometries_; }
  std::uint32_t count() const noexcept { return count_; }
  Bounds bounds(std::uint32_t geometry) const noexcept { return bounds_[geometry]; }
  /// Grows by one whenever nodes() or triangles() is another buffer than before.
  std::uint32_t generation() const noexcept { return generation_; }

 private:
  Result<void> reserve(gpu::Device& device, std::uint32_t nodes, std::uint32_t triangles, Submit& submit);

  BlasBuilder builder_;
  gpu::Buffer nodes_, triangles_, geometries_;
  std::uint32_t node_capacity_ = 0, node_count_ = 0;
  std::uint32_t triangle_capacity_ = 0, triangle_count_ = 0;
  std::uint32_t max_geometries_ = 0, count_ = 0;
  std::uint32_t generation_ = 0;
  std::vector<Bounds> bounds_;
};

}  // namespace rtstdb::accel
