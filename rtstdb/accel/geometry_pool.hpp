#pragma once
// All geometry on the device: one pool of wide nodes (one BLAS after the other), one of triangles in leaf order, one table of geometries. A pool that grows is made anew, and
// whoever bound it binds again (generation).
//
// The table says of geometry that deforms what it is in the version that was shown last.
//
// Threads: one. show is the tick's and does not allocate; the rest is setup.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/blas_builder.hpp"
#include "rtstdb/accel/deforming_geometry.hpp"
#include "rtstdb/accel/kept_geometry.hpp"
#include "rtstdb/geometry/extents.hpp"
#include "rtstdb/store/row_source.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

class Upload;

class GeometryPool {
 public:
  static Result<GeometryPool> create(gpu::Device& device, std::uint32_t max_geometries, Submit& submit);
  /// With all that another pool had, whose device may be gone. `submit` is not begun. Errors: as add.
  static Result<GeometryPool> create_again(gpu::Device& device, std::uint32_t max_geometries,
                                           const KeptGeometries& kept, Submit& submit);
  /// What brings it all to another device.
  const KeptGeometries& kept() const noexcept { return kept_; }

  /// Builds the BLAS. The mesh has passed validate, and is kept. Errors: capacity, out_of_memory, device_lost; the pool is
  /// unchanged.
  Result<std::uint32_t> add(gpu::Device& device, std::shared_ptr<const TriangleMesh> mesh, Submit& submit,
                            const GeometryOptions& options = {});

  /// Brings geometry that deforms to its shapes in that version: those that are not on the device yet are refitted
  /// there, and built where that has become too dear. `submit` is not begun. False: the device is lost.
  bool show(gpu::Device& device, const store::RowSource& rows, Submit& submit);
  /// Differs from what it was when another version was shown, or the same one, and any shape has come to another
  /// place since; what was made of the table then is stale. Otherwise the same for the same version.
  std::uint64_t shown() const noexcept { return shown_; }
  /// Until unpin the shapes of that version, which is shown, stay where they are, and others come to other places. Calls nest. False: they are
  /// not pinned, since all places of a geometry but one hold others that are.
  bool pin(const store::RowSource& rows) noexcept;
  void unpin(const store::RowSource& rows) noexcept;
  /// How shapes came to the device since the pool was made.
  struct Counts {
    std::uint64_t refits = 0, builds = 0;  ///< a build comes after a refit of the same shape
  };
  Counts counts() const noexcept { return counts_; }

  const gpu::Buffer& nodes() const noexcept { return nodes_; }
  const gpu::Buffer& triangles() const noexcept { return triangles_; }
  const gpu::Buffer& geometries() const noexcept { return geometries_; }
  std::uint32_t count() const noexcept { return count_; }
  Bounds bounds(std::uint32_t geometry) const noexcept { return bounds_[geometry]; }
  /// Grows by one whenever nodes() or triangles() is another buffer than before.
  std::uint32_t generation() const noexcept { return generation_; }
  /// False: there was no memory to connect what deforms to a pool that had grown, and nothing can be shown any more.
  bool is_whole() const noexcept { return std::ranges::all_of(deforming_, &DeformingGeometry::is_bound); }

 private:
  /// Room for what ends there, and for some more.
  static Result<GeometryPool> create_with_room(gpu::Device& device, std::uint32_t max_geometries,
                                               const PoolPart& used, Submit& submit);
  Result<void> reserve(gpu::Device& device, const PoolPart& part, Submit& submit);
  Result<void> check_room(std::uint32_t triangles) const;
  Result<PoolPart> add_still(gpu::Device& device, const TriangleMesh& mesh, Submit& submit);
  Result<PoolPart> add_deforming(gpu::Device& device, const TriangleMesh& mesh,
                                 const GeometryOptions& options, Submit& submit);
  /// The geometry that was added last, which is not counted yet.
  Result<std::shared_ptr<const KeptGeometry>> keep(gpu::Device& device,
                                                   std::shared_ptr<const TriangleMesh> mesh,
                                                   const GeometryOptions& options, const PoolPart& part,
                                                   Submit& submit);
  Result<void> bring_back(gpu::Device& device, std::uint32_t index, const KeptGeometry& kept, Upload& upload);
  Result<void> bind_deforming(gpu::Device& device);
  struct Placing {
    std::size_t geometry = 0, place = 0;
    Version shape = 0;
  };
  bool build(gpu::Device& device, DeformingGeometry& geometry, const Placing& placing,
             const store::RowSource& rows, Submit& submit);
  void write_record(std::uint32_t geometry, const Extents& extents, std::uint32_t root, bool closed);

  BlasBuilder builder_;
  gpu::Buffer nodes_, triangles_, geometries_;
  std::uint32_t node_capacity_ = 0, node_count_ = 0;
  std::uint32_t triangle_capacity_ = 0, triangle_count_ = 0;
  std::uint32_t max_geometries_ = 0, count_ = 0;
  std::uint32_t generation_ = 0;
  std::vector<Bounds> bounds_;
  KeptGeometries kept_;
  RefitPasses refit_passes_;
  std::vector<DeformingGeometry> deforming_;
  std::vector<Placing> placings_;  // of one call of show
  std::uint64_t placing_count_ = 0, shown_ = 0;
  Counts counts_;
};

}  // namespace rtstdb::accel
