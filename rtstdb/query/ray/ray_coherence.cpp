#include "rtstdb/query/ray/ray_coherence.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::query {
namespace {

constexpr std::size_t max_groups_seen = 64;
constexpr float eye_m = 0.01f;
/// Of the cosine of 0.04 rad.
constexpr double cosine_squared = 0.9984;

bool runs_beside(const Ray& ray, const Ray& first) noexcept {
  const glm::vec3 apart = glm::abs(ray.origin_m - first.origin_m);
  if (ray.carrier != first.carrier || std::max({apart.x, apart.y, apart.z}) > eye_m) return false;
  // Directions have any length from 1e-15 to 1e15.
  const glm::dvec3 a(ray.direction);
  const glm::dvec3 b(first.direction);
  const double along = glm::dot(a, b);
  return along > 0.0 && along * along >= cosine_squared * glm::dot(a, a) * glm::dot(b, b);
}

bool is_packet(std::span<const Ray> group) noexcept {
  return std::ranges::all_of(group.subspan(1),
                             [&](const Ray& ray) { return runs_beside(ray, group.front()); });
}

}  // namespace

bool are_coherent(std::span<const Ray> rays) noexcept {
  const std::size_t groups = rays.size() / rays_per_packet;
  const std::size_t seen = std::min(groups, max_groups_seen);
  std::size_t packets = 0;
  for (std::size_t k = 0; k < seen; ++k)
    packets += is_packet(rays.subspan(k * groups / seen * rays_per_packet, rays_per_packet)) ? 1 : 0;
  return seen != 0 && packets * 8 >= seen * 7;
}

}  // namespace rtstdb::query
