#pragma once
// All geometry on the device: a pool of wide nodes (the BLAS of each geometry, one after the other), a pool
// of triangles in leaf order, pools of texels (distance fields, hulls, corner normals and colours), and a
// table of geometries. When a pool grows, it becomes another buffer; users that bound it compare generation()
// and bind again.
//
// For deforming geometry the table holds its state in the version that was shown last.
//
// Threads: one. show(), pin() and unpin() are called in the tick and do not allocate; the other functions are
// setup.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/accel/blas_builder.hpp"
#include "rtstdb/accel/deforming_geometry.hpp"
#include "rtstdb/accel/kept_geometry.hpp"
#include "rtstdb/accel/texel_pool.hpp"
#include "rtstdb/geometry/convex_parts.hpp"
#include "rtstdb/geometry/extents.hpp"
#include "rtstdb/store/row_source.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::accel {

class GeometryPool {
 public:
  static Result<GeometryPool> create(gpu::Device& device, std::uint32_t max_geometries, Submit& submit);
  /// Creates a pool with all geometries of another pool, whose device may be lost. `submit` has not begun.
  /// Errors: as add().
  static Result<GeometryPool> create_restored(gpu::Device& device, std::uint32_t max_geometries,
                                              const KeptGeometries& kept, Submit& submit);
  /// What create_restored() needs.
  const KeptGeometries& kept() const noexcept { return kept_; }

  /// Builds the BLAS of a mesh that has passed validate(), and keeps the mesh. Returns the geometry's index.
  /// Errors: capacity, out_of_memory, device_lost; the pool is then unchanged.
  /// `parts`: of geometry that consists of convex parts and does not deform; null: there are none.
  Result<std::uint32_t> add(gpu::Device& device, std::shared_ptr<const TriangleMesh> mesh, Submit& submit,
                            const GeometryOptions& options = {},
                            std::shared_ptr<const ConvexParts> parts = nullptr);

  /// Removes the geometry that was added last, with its field. It does not deform, and no row names it.
  void remove_last() noexcept;
  /// Copies the distance field of a geometry that does not deform and has none to the device. Slots that were
  /// made before are stale (shown()). `submit` has not begun. Errors: capacity, out_of_memory, device_lost;
  /// the geometry then has no field.
  Result<void> attach_field(gpu::Device& device, std::uint32_t geometry,
                            std::shared_ptr<const field::StoredField> field, Submit& submit);
  /// create_restored() will not restore the field of this geometry.
  void forget_field(std::uint32_t geometry) noexcept { kept_[geometry]->field.reset(); }

  /// Brings deforming geometry to its shapes in this version: refits shapes that are not on the device, and
  /// rebuilds trees whose cost_ratio has grown too far. `submit` has not begun. False: the device is lost.
  bool show(gpu::Device& device, const store::RowSource& rows, Submit& submit);
  /// Identifies the shapes that the table describes. It changes when another version with other shapes is
  /// shown, and when a shape moves to another place; data derived from the table is then stale.
  std::uint64_t shown() const noexcept { return shown_; }
  /// Keeps the shapes of this version, which is shown, in their places until unpin(). Calls nest. False: not
  /// pinned, since a geometry would be left without an unpinned place.
  bool pin(const store::RowSource& rows) noexcept;
  void unpin(const store::RowSource& rows) noexcept;
  /// How often shapes were brought to the device since the pool was created.
  struct Counts {
    std::uint64_t refits = 0, builds = 0;  ///< a build follows a refit of the same shape
  };
  Counts counts() const noexcept { return counts_; }

  const gpu::Buffer& nodes() const noexcept { return nodes_; }
  const gpu::Buffer& triangles() const noexcept { return triangles_; }
  const gpu::Buffer& geometries() const noexcept { return geometries_; }
  /// All distance fields (shaders/shared/field.h).
  const gpu::Buffer& fields() const noexcept { return fields_.buffer(); }
  /// All hulls of convex geometries (shaders/shared/contact.h).
  const gpu::Buffer& hulls() const noexcept { return hulls_.buffer(); }
  /// All corner normals and colours (shaders/shared/corner.h).
  const gpu::Buffer& attributes() const noexcept { return attributes_.buffer(); }
  /// A convex part of a geometry and its first texel.
  struct PooledHull {
    std::uint32_t texel = 0;
    const ConvexHull* hull = nullptr;
    const TriangleMesh* mesh = nullptr;
  };
  /// 0: contact queries search its triangles.
  std::uint32_t convex_parts(std::uint32_t geometry) const noexcept {
    return static_cast<std::uint32_t>(part_texels_[geometry].size());
  }
  PooledHull hull(std::uint32_t geometry, std::uint32_t part) const noexcept;
  /// The root of a geometry's BLAS. Of deforming geometry: of the shape that was shown last.
  std::uint32_t root(std::uint32_t geometry) const noexcept;
  /// Whether it bounds a body. Of deforming geometry: of the shape that was shown last.
  bool has_inside(std::uint32_t geometry) const noexcept;
  std::uint32_t count() const noexcept { return count_; }
  Bounds bounds(std::uint32_t geometry) const noexcept { return bounds_[geometry]; }
  std::uint32_t triangles_of(std::uint32_t geometry) const noexcept {
    return static_cast<std::uint32_t>(kept_[geometry]->mesh->triangles.size());
  }
  /// As it was added. Of deforming geometry: not its shape in a version.
  const TriangleMesh& mesh(std::uint32_t geometry) const noexcept { return *kept_[geometry]->mesh; }
  bool deforms(std::uint32_t geometry) const noexcept { return kept_[geometry]->deforming.has_value(); }
  /// Incremented whenever nodes(), triangles(), fields(), hulls() or attributes() becomes another buffer.
  std::uint32_t generation() const noexcept { return generation_; }
  /// False: binding deforming geometry to a grown pool failed for lack of memory, and show() fails from then
  /// on.
  bool is_whole() const noexcept { return std::ranges::all_of(deforming_, &DeformingGeometry::is_bound); }

 private:
  /// An empty pool with capacity for `kept` and a reserve.
  static Result<GeometryPool> create_with_capacity(gpu::Device& device, std::uint32_t max_geometries,
                                                   const KeptGeometries& kept, Submit& submit);
  Result<void> reserve(gpu::Device& device, const PoolPart& part, Submit& submit);
  /// Makes space for the fields, hulls, and corner normals and colours of `kept`.
  Result<void> reserve_texels_of(gpu::Device& device, const KeptGeometries& kept, Submit& submit);
  Result<void> check_capacity(std::uint32_t triangles) const;
  Result<PoolPart> add_still(gpu::Device& device, const TriangleMesh& mesh, const ConvexParts* parts,
                             Submit& submit);
  Result<PoolPart> add_deforming(gpu::Device& device, const TriangleMesh& mesh,
                                 const GeometryOptions& options, Submit& submit);
  /// Reads back what KeptGeometry holds of the geometry that was added last, before it is counted.
  Result<std::shared_ptr<KeptGeometry>> keep(gpu::Device& device, std::shared_ptr<const TriangleMesh> mesh,
                                             const GeometryOptions& options, const PoolPart& part,
                                             Submit& submit);
  Result<void> restore(gpu::Device& device, std::uint32_t index, const KeptGeometry& kept, Upload& upload);
  /// Writes a field behind the others. False: the device is lost.
  bool restore_field(std::uint32_t index, const field::StoredField& field, Upload& upload);
  Result<void> reserve_field_texels(gpu::Device& device, std::uint64_t texels, Submit& submit);
  Result<void> reserve_hull_texels(gpu::Device& device, std::uint64_t texels, Submit& submit);
  /// Returns the first texel of each hull.
  Result<std::vector<std::uint32_t>> add_hulls(gpu::Device& device, const ConvexParts& parts, Submit& submit);
  /// Writes hulls behind the others. False: the device is lost.
  bool restore_hulls(std::uint32_t index, const ConvexParts& parts, Upload& upload);
  Result<void> reserve_attribute_texels(gpu::Device& device, std::uint64_t texels, Submit& submit);
  /// Returns the first texel, or attributes_none.
  Result<std::uint32_t> add_attributes(gpu::Device& device, const TriangleMesh& mesh, bool deforms,
                                       Submit& submit);
  /// Writes corner normals and colours behind the others. False: the device is lost.
  bool restore_attributes(std::uint32_t index, const KeptGeometry& kept, Upload& upload);
  void set_attributes(std::uint32_t geometry, std::uint32_t texel) noexcept;
  Result<void> bind_deforming(gpu::Device& device);
  struct Refit {
    std::size_t geometry = 0, place = 0;
    Version shape = 0;
  };
  bool build(gpu::Device& device, DeformingGeometry& geometry, const Refit& refit,
             const store::RowSource& rows, Submit& submit);
  void write_record(std::uint32_t geometry, const Extents& extents, const BlasBuilder::Place& at,
                    std::uint32_t triangles, bool closed);

  BlasBuilder builder_;
  gpu::Buffer nodes_, triangles_, geometries_;
  TexelPool fields_{{.name = "field pool", .plural = "distance fields"}};
  TexelPool hulls_{{.name = "hull pool", .plural = "hulls of convex geometries", .is_float = true}};
  TexelPool attributes_{{.name = "attribute pool", .plural = "corner normals and colours"}};
  std::vector<std::uint32_t> attribute_texels_;          // by geometry
  std::vector<std::vector<std::uint32_t>> part_texels_;  // first texels of the hulls of each geometry
  std::uint32_t node_capacity_ = 0, node_count_ = 0;
  std::uint32_t triangle_capacity_ = 0, triangle_count_ = 0;
  std::uint64_t fields_attached_ = 0;
  std::uint32_t max_geometries_ = 0, count_ = 0;
  std::uint32_t generation_ = 0;
  std::vector<Bounds> bounds_;
  KeptGeometries kept_;
  RefitPasses refit_passes_;
  std::vector<DeformingGeometry> deforming_;
  std::vector<Refit> refits_;  // of the current call of show()
  std::uint64_t refit_count_ = 0, shown_ = 0;
  Counts counts_;
};

}  // namespace rtstdb::accel
