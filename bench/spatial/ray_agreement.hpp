#pragma once
// Checks that two sides give equal results for rays. Both compute in single precision, so a result may depend
// on the last bit where a ray grazes an edge. Every difference must be explained by that, or the bench ends.

#include <functional>
#include <span>
#include <string>

#include <rtstdb/geometry.hpp>
#include <rtstdb/query.hpp>

#include "bench/spatial/embree_hit.hpp"

namespace hil::bench {

struct PreciseRay {
  glm::dvec3 origin_m{0.0};
  glm::dvec3 direction{0.0};
};
PreciseRay precise(const rtstdb::Ray& ray);

/// The change of lambda when the ray is moved sideways by `sideways_m`, in double precision; infinite if the
/// moved ray misses the triangle.
double lambda_doubt(const rtstdb::TriangleMesh& mesh, std::uint32_t triangle, const PreciseRay& ray,
                    double sideways_m);

/// One result of either side.
struct JudgedHit {
  bool hit = false;
  float lambda = 0.0f;
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
};
JudgedHit judged(const PeerHit& hit);
/// `instance` is the entity's index, since the bench creates entities in order.
JudgedHit judged(const rtstdb::RayHit& hit);

struct Agreement {
  std::string name;  ///< the figure's
  /// The rounding error of a point's position; directions have unit length.
  double sideways_m = 0.0;
  /// lambda_doubt of a result of ray `ray`.
  std::function<double(std::size_t ray, const JudgedHit& claimed, double sideways_m)> doubt;
};

/// Throws std::runtime_error if a difference is not explained, if there are too many, or if fewer than 20 %
/// or more than 80 % of the rays hit.
void demand_same_closest(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                         std::span<const PeerHit> theirs);
/// The same for results that only say whether a ray hits; `ours_closest` and `theirs_closest` are the closest
/// hits of the same rays and identify the triangles.
void demand_same_any(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                     std::span<const PeerHit> theirs, std::span<const rtstdb::RayHit> ours_closest,
                     std::span<const PeerHit> theirs_closest);

}  // namespace hil::bench
