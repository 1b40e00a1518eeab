#include "rtstdb/query/ray/ray_coherence.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::query {
namespace {

constexpr std::size_t max_sampled_groups = 64;
constexpr float max_origin_distance_m = 0.01f;
/// The squared cosine of 0.04 rad.
constexpr double min_cosine_squared = 0.9984;

bool is_coherent_with(const Ray& ray, const Ray& first) noexcept {
  const glm::vec3 apart = glm::abs(ray.origin_m - first.origin_m);
  if (ray.carrier != first.carrier || std::max({apart.x, apart.y, apart.z}) > max_origin_distance_m)
    return false;
  // Directions have any length from 1e-15 to 1e15.
  const glm::dvec3 a(ray.direction);
  const glm::dvec3 b(first.direction);
  const double along = glm::dot(a, b);
  return along > 0.0 && along * along >= min_cosine_squared * glm::dot(a, a) * glm::dot(b, b);
}

bool is_coherent(std::span<const Ray> group) noexcept {
  return std::ranges::all_of(group.subspan(1),
                             [&](const Ray& ray) { return is_coherent_with(ray, group.front()); });
}

}  // namespace

bool are_coherent(std::span<const Ray> rays) noexcept {
  const std::size_t groups = rays.size() / rays_per_packet;
  const std::size_t sampled = std::min(groups, max_sampled_groups);
  std::size_t coherent = 0;
  for (std::size_t k = 0; k < sampled; ++k)
    coherent += is_coherent(rays.subspan(k * groups / sampled * rays_per_packet, rays_per_packet)) ? 1 : 0;
  return sampled != 0 && coherent * 8 >= sampled * 7;
}

}  // namespace rtstdb::query
