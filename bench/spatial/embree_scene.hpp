#pragma once
// One static mesh in Embree.

#include <memory>
#include <span>

#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

#include "bench/spatial/embree_hit.hpp"

namespace hil::bench {

class EmbreeScene {
 public:
  /// Built with quality medium: binned SAH, Embree's default.
  explicit EmbreeScene(const rtstdb::TriangleMesh& mesh);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  std::size_t bytes() const;

  /// rtcIntersect1. hits.size() == rays.size().
  void closest(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const;
  /// rtcOccluded1: lambda is 0 for a hit.
  void any(std::span<const rtstdb::Ray> rays, std::span<PeerHit> hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
