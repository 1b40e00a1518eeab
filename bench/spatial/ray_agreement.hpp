#pragma once
// Whether two sides answer rays alike. Both compute in single precision, so an answer may hang on the last
// bit where a ray grazes an edge: each difference has to be explained by that, or the bench ends.

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

/// By how much lambda changes when the ray is moved sideways by `sideways_m`, in double precision; infinite
/// when it then misses the triangle.
double lambda_doubt(const rtstdb::TriangleMesh& mesh, std::uint32_t triangle, const PreciseRay& ray,
                    double sideways_m);

/// One answer of either side.
struct JudgedHit {
  bool hit = false;
  float lambda = 0.0f;
  std::uint32_t instance = 0;
  std::uint32_t triangle = 0;
};
JudgedHit judged(const PeerHit& hit);
/// `instance` is the entity's index: the bench creates them in order.
JudgedHit judged(const rtstdb::RayHit& hit);

struct Agreement {
  std::string name;  ///< the figure's
  /// How far rounding may put a point from where it should be; directions are of unit length.
  double sideways_m = 0.0;
  /// lambda_doubt of an answer of ray `ray` to that ray.
  std::function<double(std::size_t ray, const JudgedHit& claimed, double sideways_m)> doubt;
};

/// Throws std::runtime_error when one difference is not explained, when too many are there, or when not
/// between 20 % and 80 % of the rays hit.
void demand_same_closest(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                         std::span<const PeerHit> theirs);
/// The same for answers that only say whether; `ours_closest` and `theirs_closest` answered the same rays and
/// tell which triangle a difference is about.
void demand_same_any(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                     std::span<const PeerHit> theirs, std::span<const rtstdb::RayHit> ours_closest,
                     std::span<const PeerHit> theirs_closest);

}  // namespace hil::bench
