#pragma once
// The nearest triangle by Embree's point query.

#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

struct PeerNearest {
  float distance_m = 0.0f;
  std::uint32_t triangle = 0;
};

class EmbreeNearest {
 public:
  /// Built with quality medium. The mesh must outlive this object.
  explicit EmbreeNearest(const rtstdb::TriangleMesh& mesh);
  ~EmbreeNearest();
  EmbreeNearest(const EmbreeNearest&) = delete;
  EmbreeNearest& operator=(const EmbreeNearest&) = delete;

  /// rtcPointQuery with an unbounded radius and a callback that tests one triangle.
  void nearest(std::span<const glm::vec3> points_m, std::span<PeerNearest> answers) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
