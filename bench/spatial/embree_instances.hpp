#pragma once
// Moving, rotating instances in Embree: motion blur over one time window.

#include <memory>
#include <span>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

#include "bench/spatial/embree_hit.hpp"

namespace hil::bench {

struct Window {
  rtstdb::WorldTime begin{}, end{};
};

/// Uses two time steps. Embree moves the origin linearly and rotates along the shortest great arc, which
/// equals the motion of a row that rotates by less than half a turn.
class EmbreeInstances {
 public:
  /// A row's geometry index is that of its mesh.
  EmbreeInstances(std::span<const rtstdb::TriangleMesh> meshes, std::span<const rtstdb::EntityRow> rows,
                  const Window& window);
  ~EmbreeInstances();
  EmbreeInstances(const EmbreeInstances&) = delete;
  EmbreeInstances& operator=(const EmbreeInstances&) = delete;

  /// Excluding the meshes.
  std::size_t bytes() const;

  /// rtcIntersect1, each ray at its own time in the window.
  void closest(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
