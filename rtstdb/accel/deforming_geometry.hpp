#pragma once
// A geometry whose corners move while its triangles stay. It has two places in the pools, each with room for
// any tree of its triangles, and each holds one shape: a query that reads an older version finds that shape
// while the newer one is there too, and a third takes the place that was shown longest ago.
//
// A shape comes into a place by a refit: the tree that stands there stays, its triangles are written where
// their corners are now, and its boxes are made anew level by level, the deepest first. What the tree costs a
// ray by the surface area heuristic comes out of the same passes, and what its triangles by themselves would.
// Where the first has grown too much beside the second since the tree was built, the caller builds another one
// into the same room. By the cost alone, a tree that was built over large triangles strewn about would be kept
// for whatever they come to be next.
//
// Threads: one. create and bind are setup; the rest is the tick's and does not allocate.

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

  /// What one place needs in the pools, in their elements; places begin at multiples of `alignment`.
  struct Room {
    std::uint32_t nodes = 0, triangles = 0;
  };
  static constexpr std::uint32_t alignment = 16;
  static Room room_for(std::uint32_t triangles) noexcept;

  /// Errors: capacity (what a storage binding holds), out_of_memory, device_lost.
  static Result<DeformingGeometry> create(gpu::Device& device, GeometryId id, const TriangleMesh& mesh,
                                          const GeometryOptions& options,
                                          const std::array<BlasBuilder::Place, places>& at);
  /// Connects to the pools; again whenever one is another buffer.
  Result<void> bind(gpu::Device& device, const RefitPasses& passes, const gpu::Buffer& nodes,
                    const gpu::Buffer& triangles);

  /// False after a bind that failed.
  bool is_bound() const noexcept { return static_cast<bool>(places_[places - 1].nodes_pass); }

  GeometryId id() const noexcept { return id_; }
  const std::vector<glm::uvec3>& triangles() const noexcept { return triangles_; }
  std::size_t position_count() const noexcept { return position_count_; }

  // A tree has been built and stands in the pools: its order of triangles and its levels.
  BlasBuilder::Place at(std::size_t place) const noexcept { return places_[place].at; }
  const gpu::Buffer& order(std::size_t place) const noexcept { return places_[place].order; }
  void adopt_tree(std::size_t place, std::span<const std::uint32_t> levels) noexcept;
  /// The same of a tree that stood on another device, where it had built_burden.
  void adopt_tree(std::size_t place, std::span<const std::uint32_t> levels, float built_burden) noexcept;
  /// What the tree cost when it was built, over about the least that its shape did then.
  float built_burden(std::size_t place) const noexcept { return places_[place].built_burden; }

  /// The place of that shape, which is shown from now on; `places` when it has none.
  std::size_t find(Version shape) noexcept;
  /// The place that was shown longest ago, of those that are not pinned. What it held is gone.
  std::size_t take_place() noexcept;
  /// Until unpin that shape, which has a place, stays there. Calls nest. False: it is not pinned, since no place would be left for others.
  bool pin(Version shape) noexcept;
  void unpin(Version shape) noexcept;
  /// Copies positions to where the device reads them, and looks whether the geometry is closed there.
  void upload(std::span<const glm::vec3> positions_m);
  void record_refit(std::size_t place, const RefitPasses& passes, gpu::Recorder& recorder) const;
  /// Takes up what the refit left; it is done. The place holds that shape and is shown from now on.
  void note_refit(std::size_t place, Version shape, std::uint64_t placing);
  /// Whether the tree has become so dear that another one should be built.
  bool wants_build(std::size_t place) const noexcept;

  struct Shown {
    std::uint32_t root = 0;
    Bounds bounds;
    bool closed = false;
    std::uint64_t placing = 0;  ///< number of the refit that brought it there
  };
  Shown shown() const noexcept;

 private:
  struct Held {
    BlasBuilder::Place at;
    gpu::Buffer order;
    gpu::Bindings triangles_pass, nodes_pass;
    std::vector<std::uint32_t> levels;  // first node of each, then the number of nodes
    bool tree_is_new = true;
    // What the tree costs a ray over about the least that its shape does, now and when it was built.
    float burden = 0.0f, built_burden = 0.0f;
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
