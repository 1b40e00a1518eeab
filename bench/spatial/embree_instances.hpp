#pragma once
// Moving, turning instances in Embree: motion blur over one window of time.

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

/// Two time steps: Embree moves the origin on a line and turns along the shortest great arc, which is what a
/// row does while it turns less than half a turn.
class EmbreeInstances {
 public:
  /// A row's geometry index is that of its mesh.
  EmbreeInstances(std::span<const rtstdb::TriangleMesh> meshes, std::span<const rtstdb::EntityRow> rows,
                  const Window& window);
  ~EmbreeInstances();
  EmbreeInstances(const EmbreeInstances&) = delete;
  EmbreeInstances& operator=(const EmbreeInstances&) = delete;

  /// Without the meshes.
  std::size_t bytes() const;

  /// rtcIntersect1, each ray at its own time of the window.
  void closest(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
