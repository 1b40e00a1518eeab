#include "bench/spatial/embree_nearest.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/spatial/embree_handles.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t points_per_chunk = 1024;

float squared(const glm::vec3& v) {
  return glm::dot(v, v);
}

/// From a point, given relative to the edge's begin, to the edge.
glm::vec3 to_edge(const glm::vec3& from_begin, const glm::vec3& edge) {
  const float along = std::clamp(glm::dot(from_begin, edge) / squared(edge), 0.0f, 1.0f);
  return from_begin - along * edge;
}

/// The plane is nearest if the point projects into the triangle, otherwise one of the edges.
float squared_distance(const glm::vec3& point, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::vec3 ab = b - a, bc = c - b, ca = a - c;
  const glm::vec3 from_a = point - a, from_b = point - b, from_c = point - c;
  const glm::vec3 normal = glm::cross(ab, -ca);
  const bool over = glm::dot(glm::cross(normal, ab), from_a) >= 0.0f &&
                    glm::dot(glm::cross(normal, bc), from_b) >= 0.0f &&
                    glm::dot(glm::cross(normal, ca), from_c) >= 0.0f;
  if (over) {
    const float height = glm::dot(normal, from_a);
    return height * height / squared(normal);
  }
  return std::min({squared(to_edge(from_a, ab)), squared(to_edge(from_b, bc)), squared(to_edge(from_c, ca))});
}

struct Search {
  const rtstdb::TriangleMesh* mesh = nullptr;
  PeerNearest best;
};

bool look_at_triangle(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<Search*>(arguments->userPtr);
  const auto& positions = search.mesh->positions_m;
  const glm::uvec3 corners = search.mesh->triangles[arguments->primID];
  const glm::vec3 point(arguments->query->x, arguments->query->y, arguments->query->z);
  const float distance_m =
      std::sqrt(squared_distance(point, positions[corners.x], positions[corners.y], positions[corners.z]));
  if (distance_m >= arguments->query->radius) return false;
  arguments->query->radius = distance_m;
  search.best = {distance_m, arguments->primID};
  return true;  // the radius has changed
}

}  // namespace

struct EmbreeNearest::Impl {
  const rtstdb::TriangleMesh* mesh = nullptr;
  EmbreeDevice device = open_embree();
  EmbreeSceneHandle scene;
};

EmbreeNearest::EmbreeNearest(const rtstdb::TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  impl_->mesh = &mesh;
  impl_->scene = embree_mesh_scene(impl_->device.get(), mesh, RTC_BUILD_QUALITY_MEDIUM);
}

EmbreeNearest::~EmbreeNearest() = default;

void EmbreeNearest::nearest(std::span<const glm::vec3> points_m, std::span<PeerNearest> answers) const {
  over_chunks(points_m.size(), points_per_chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      RTCPointQuery query;
      query.x = points_m[i].x;
      query.y = points_m[i].y;
      query.z = points_m[i].z;
      query.time = 0.0f;
      query.radius = std::numeric_limits<float>::infinity();
      Search search{impl_->mesh, {}};
      rtcPointQuery(impl_->scene.get(), &query, &context, look_at_triangle, &search);
      answers[i] = search.best;
    }
  });
}

}  // namespace hil::bench
