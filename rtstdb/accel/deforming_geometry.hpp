#pragma once
// A geometry with moving vertices and fixed triangles. It has two places in the pools, each large enough for
// any tree over its triangles, and each holds one shape (the vertex positions of one version). So a query of
// an older version finds its shape while a newer one is on the device. A third shape replaces the one that
// was shown longest ago.
//
// A refit brings a shape into a place: the topology of the tree stays, the triangles are written with their
// new corners, and the boxes are recomputed level by level from the deepest. The refit also computes the
// tree's cost by the surface area heuristic and an estimate of the least cost that any tree over this shape
// can have. Their ratio is the tree's cost_ratio. The caller rebuilds a tree whose cost_ratio has grown too
// far since it was built. The cost alone would not do: a tree that was built over large, scattered triangles
// has a high cost from the start and would then never be rebuilt.
//
// Threads: one. create() and bind() are setup; the other functions are called in the tick and do not
// allocate.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/accel/blas_builder.hpp"
#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

/// The passes of a refit.
struct RefitPasses {
  static Result<RefitPasses> create(gpu::Device& device);
  gpu::Pipeline triangles, nodes;
};

class DeformingGeometry {
 public:
  static constexpr std::size_t places = 2;

  /// The pool elements that one place needs. Places begin at multiples of `alignment`.
  struct Capacity {
    std::uint32_t nodes = 0, triangles = 0;
  };
  static constexpr std::uint32_t alignment = 16;
  static Capacity capacity_for(std::uint32_t triangles) noexcept;

  /// Errors: capacity (the size of a storage binding), out_of_memory, device_lost.
  static Result<DeformingGeometry> create(gpu::Device& device, GeometryId id, const TriangleMesh& mesh,
                                          const GeometryOptions& options,
                                          const std::array<BlasBuilder::Place, places>& at);
  /// Binds the passes to the pools. Call again whenever a pool has become another buffer.
  Result<void> bind(gpu::Device& device, const RefitPasses& passes, const gpu::Buffer& nodes,
                    const gpu::Buffer& triangles);

  /// False after a bind() that failed.
  bool is_bound() const noexcept { return static_cast<bool>(places_[places - 1].nodes_pass); }

  GeometryId id() const noexcept { return id_; }
  const std::vector<glm::uvec3>& triangles() const noexcept { return triangles_; }
  std::size_t position_count() const noexcept { return position_count_; }

  // Access to a place into which a tree has been built: its position, leaf order and levels.
  BlasBuilder::Place at(std::size_t place) const noexcept { return places_[place].at; }
  const gpu::Buffer& order(std::size_t place) const noexcept { return places_[place].order; }
  void adopt_tree(std::size_t place, std::span<const std::uint32_t> levels) noexcept;
  /// Also takes over `built_cost_ratio` of a tree that was built on another device.
  void adopt_tree(std::size_t place, std::span<const std::uint32_t> levels, float built_cost_ratio) noexcept;
  /// The tree's cost_ratio when it was built.
  float built_cost_ratio(std::size_t place) const noexcept { return places_[place].built_cost_ratio; }

  /// Returns the place of this shape and marks it as shown; `places` when no place holds it.
  std::size_t find(Version shape) noexcept;
  /// Returns the unpinned place that was shown longest ago, whose shape is lost.
  std::size_t evict_oldest() noexcept;
  /// Keeps this shape, which has a place, until unpin(). Calls nest. False: not pinned, since no place would
  /// be left for other shapes.
  bool pin(Version shape) noexcept;
  void unpin(Version shape) noexcept;
  /// Copies positions to the device and determines whether the mesh is closed in this shape.
  void upload(std::span<const glm::vec3> positions_m);
  void record_refit(std::size_t place, const RefitPasses& passes, gpu::Recorder& recorder) const;
  /// Takes the results of the refit, which has finished, and marks the place as holding and showing this
  /// shape.
  void finish_refit(std::size_t place, Version shape, std::uint64_t refit_number);
  /// Whether the tree's cost_ratio calls for a rebuild.
  bool needs_rebuild(std::size_t place) const noexcept;

  struct Shown {
    BlasBuilder::Place at;
    Bounds bounds;
    bool closed = false;
    std::uint64_t refit_number = 0;  ///< number of the refit that brought the shape there
  };
  Shown shown() const noexcept;

 private:
  struct Held {
    BlasBuilder::Place at;
    gpu::Buffer order;
    gpu::Bindings triangles_pass, nodes_pass;
    std::vector<std::uint32_t> levels;  // first node of each level, then the number of nodes
    bool tree_is_new = true;
    // See the top of this file.
    float cost_ratio = 0.0f, built_cost_ratio = 0.0f;
    bool holds_shape = false;
    Version shape = 0;
    Shown shown;
    std::uint64_t last_shown = 0;
    std::uint32_t pins = 0;
  };
  Held* holder_of(Version shape) noexcept;

  GeometryId id_;
  std::vector<glm::uvec3> triangles_;
  std::size_t position_count_ = 0;
  ClosedShapes closed_shapes_;
  bool uploaded_closed_ = false;
  float rebuild_growth_ = 0.0f;
  std::array<Held, places> places_;
  std::size_t shown_place_ = 0;
  std::uint64_t shows_ = 0;
  gpu::Buffer positions_, boxes_, root_readback_;
};

}  // namespace rtstdb::accel
