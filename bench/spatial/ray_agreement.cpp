#include "bench/spatial/ray_agreement.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hil::bench {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
/// Relative error of lambda.
constexpr double lambda_tolerance = 1e-4;
/// Near its origin a ray may be off by as much as the surface is away: a factor of sideways_m.
constexpr double steepness = 5.0;
/// The largest fraction of rays that may graze an edge and give different results.
constexpr double max_differences = 1e-4;

/// Lambda, or infinite; both sides of the surface count.
double lambda_at(const rtstdb::TriangleMesh& mesh, std::uint32_t triangle, const PreciseRay& ray) {
  const glm::uvec3 corners = mesh.triangles[triangle];
  const glm::dvec3 a(mesh.positions_m[corners.x]), b(mesh.positions_m[corners.y]),
      c(mesh.positions_m[corners.z]);
  const glm::dvec3 across = glm::cross(ray.direction, c - a);
  const double determinant = glm::dot(b - a, across);
  if (determinant == 0.0) return infinite;
  const glm::dvec3 from_a = ray.origin_m - a;
  const double u = glm::dot(from_a, across) / determinant;
  const glm::dvec3 along = glm::cross(from_a, b - a);
  const double v = glm::dot(ray.direction, along) / determinant;
  if (u < 0.0 || v < 0.0 || u + v > 1.0) return infinite;
  return glm::dot(c - a, along) / determinant;
}

/// Zero when both agree, otherwise the difference that needs an explanation.
double difference(const JudgedHit& a, const JudgedHit& b, double sideways_m) {
  if (a.hit != b.hit) return infinite;
  if (!a.hit) return 0.0;
  const double apart = std::abs(static_cast<double>(a.lambda) - static_cast<double>(b.lambda));
  const double tolerance = std::max(lambda_tolerance * static_cast<double>(b.lambda), steepness * sideways_m);
  return apart <= tolerance ? 0.0 : apart;
}

class Count {
 public:
  explicit Count(const std::string& name) : name_(name) {}
  void add(bool hit, bool differs) {
    ++rays_;
    hits_ += hit ? 1 : 0;
    differences_ += differs ? 1 : 0;
  }
  void demand() const {
    const double hit_share = share(hits_);
    if (share(differences_) > max_differences || hit_share < 0.2 || hit_share > 0.8) {
      throw std::runtime_error(
          name_ + ": " + std::to_string(differences_) + " of " + std::to_string(rays_) +
          " rays are answered otherwise by the peer; share that hits: " + std::to_string(hit_share));
    }
  }

 private:
  double share(std::size_t of) const { return static_cast<double>(of) / static_cast<double>(rays_); }
  std::string name_;
  std::size_t rays_ = 0, hits_ = 0, differences_ = 0;
};

std::string describe(const JudgedHit& hit) {
  if (!hit.hit) return "a miss";
  return "lambda " + std::to_string(hit.lambda) + ", entity " + std::to_string(hit.instance) + ", triangle " +
         std::to_string(hit.triangle);
}

[[noreturn]] void refuse(const std::string& name, std::size_t ray, const JudgedHit& ours,
                         const JudgedHit& theirs) {
  throw std::runtime_error(name + ": ray " + std::to_string(ray) + " gives " + describe(ours) +
                           ", and the peer says " + describe(theirs) + "; it grazes nothing there");
}

/// The nearer hit is the one that the other side missed.
void explain(const Agreement& agreement, std::size_t ray, const JudgedHit& ours, const JudgedHit& theirs,
             double apart) {
  const bool ours_is_nearer = ours.hit && (!theirs.hit || ours.lambda < theirs.lambda);
  const double doubt = agreement.doubt(ray, ours_is_nearer ? ours : theirs, agreement.sideways_m);
  if (doubt < apart) refuse(agreement.name, ray, ours, theirs);
}

}  // namespace

PreciseRay precise(const rtstdb::Ray& ray) {
  return {glm::dvec3(ray.origin_m), glm::dvec3(ray.direction)};
}

double lambda_doubt(const rtstdb::TriangleMesh& mesh, std::uint32_t triangle, const PreciseRay& ray,
                    double sideways_m) {
  const double straight = lambda_at(mesh, triangle, ray);
  if (straight == infinite) return infinite;
  const glm::dvec3 forward = glm::normalize(ray.direction);
  const glm::dvec3 other = std::abs(forward.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, other));
  const glm::dvec3 up = glm::cross(forward, right);
  double doubt = 0.0;
  for (const glm::dvec3& aside : {right, -right, up, -up}) {
    const double moved = lambda_at(mesh, triangle, {ray.origin_m + sideways_m * aside, ray.direction});
    doubt = std::max(doubt, std::abs(moved - straight));
  }
  return doubt;
}

JudgedHit judged(const PeerHit& hit) {
  return {hit.lambda >= 0.0f, hit.lambda, hit.instance, hit.triangle};
}

JudgedHit judged(const rtstdb::RayHit& hit) {
  if (hit.status == rtstdb::HitStatus::incomplete) throw std::runtime_error("a ray's search was cut short");
  return {hit.status == rtstdb::HitStatus::hit, hit.lambda, hit.entity.index, hit.triangle};
}

void demand_same_closest(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                         std::span<const PeerHit> theirs) {
  Count count(agreement.name);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const JudgedHit our_hit = judged(ours[i]), their_hit = judged(theirs[i]);
    const double apart = difference(our_hit, their_hit, agreement.sideways_m);
    if (apart > 0.0) explain(agreement, i, our_hit, their_hit, apart);
    count.add(our_hit.hit, apart > 0.0);
  }
  count.demand();
}

void demand_same_any(const Agreement& agreement, std::span<const rtstdb::RayHit> ours,
                     std::span<const PeerHit> theirs, std::span<const rtstdb::RayHit> ours_closest,
                     std::span<const PeerHit> theirs_closest) {
  Count count(agreement.name);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const JudgedHit our_hit = judged(ours[i]), their_hit = judged(theirs[i]);
    const bool differs = our_hit.hit != their_hit.hit;
    if (differs) {
      const JudgedHit our_closest = judged(ours_closest[i]), their_closest = judged(theirs_closest[i]);
      const JudgedHit& claimed = our_closest.hit ? our_closest : their_closest;
      if (!claimed.hit || agreement.doubt(i, claimed, agreement.sideways_m) < infinite)
        refuse(agreement.name, i, our_hit, their_hit);
    }
    count.add(our_hit.hit, differs);
  }
  count.demand();
}

}  // namespace hil::bench
