#include "bench/spatial/scene.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr float pi = std::numbers::pi_v<float>;

}  // namespace

glm::vec3 Random::direction() noexcept {
  const float z = between(-1.0f, 1.0f);
  const float turn = between(0.0f, 2.0f * pi);
  const float across = std::sqrt((std::max)(0.0f, 1.0f - z * z));
  return {across * std::cos(turn), across * std::sin(turn), z};
}

rtstdb::TriangleMesh lumpy_body(std::uint32_t rows, std::uint32_t columns, std::uint64_t seed) {
  Random random(seed);
  struct Lump {
    glm::vec3 axis;
    float frequency, height, phase;
  };
  std::vector<Lump> lumps;
  for (int i = 0; i < 12; ++i) {
    const float frequency = random.between(2.0f, 24.0f);
    lumps.push_back({random.direction(), frequency, 0.35f / frequency, random.between(0.0f, 2.0f * pi)});
  }
  const auto corner = [&](const glm::vec3& direction) {
    float radius = 0.9f;
    for (const Lump& lump : lumps)
      radius += lump.height * std::sin(lump.frequency * glm::dot(direction, lump.axis) + lump.phase);
    return direction * radius;
  };
  rtstdb::TriangleMesh mesh;
  mesh.positions_m.push_back(corner({0.0f, 0.0f, 1.0f}));
  for (std::uint32_t row = 1; row < rows; ++row) {
    const float down = pi * static_cast<float>(row) / static_cast<float>(rows);
    for (std::uint32_t column = 0; column < columns; ++column) {
      const float turn = 2.0f * pi * static_cast<float>(column) / static_cast<float>(columns);
      mesh.positions_m.push_back(
          corner({std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn), std::cos(down)}));
    }
  }
  mesh.positions_m.push_back(corner({0.0f, 0.0f, -1.0f}));
  const auto at = [&](std::uint32_t row, std::uint32_t column) {
    return 1 + (row - 1) * columns + column % columns;
  };
  const auto last = static_cast<std::uint32_t>(mesh.positions_m.size()) - 1;
  for (std::uint32_t column = 0; column < columns; ++column) {
    mesh.triangles.push_back({0, at(1, column), at(1, column + 1)});
    for (std::uint32_t row = 1; row + 1 < rows; ++row) {
      mesh.triangles.push_back({at(row, column), at(row + 1, column), at(row + 1, column + 1)});
      mesh.triangles.push_back({at(row, column), at(row + 1, column + 1), at(row, column + 1)});
    }
    mesh.triangles.push_back({at(rows - 1, column), last, at(rows - 1, column + 1)});
  }
  return mesh;
}

rtstdb::TriangleMesh body_in_bowl(std::uint32_t rows, std::uint64_t seed) {
  constexpr float size = 4.0f;
  constexpr float rim = 0.35f;  // of the bowl's radius, above its middle
  rtstdb::TriangleMesh mesh = lumpy_body(rows, rows, seed);
  const rtstdb::TriangleMesh ball = lumpy_body(rows, 3 * rows / 2, seed + 1);
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (const glm::vec3& position : ball.positions_m)
    mesh.positions_m.push_back(size * position);
  for (const glm::uvec3& triangle : ball.triangles) {
    const auto height = [&](std::uint32_t corner) { return ball.positions_m[corner].z; };
    if (std::max({height(triangle.x), height(triangle.y), height(triangle.z)}) < rim)
      mesh.triangles.push_back(triangle + first);
  }
  return mesh;
}

rtstdb::TriangleMesh bunny(bool tiny) {
  if (tiny) return lumpy_body(33, 32, 9);
  const char* const data = std::getenv("HIL_TEST_DATA");
  const auto path = std::filesystem::path(data == nullptr ? "" : data) / "meshes/stanford-bunny.obj";
  if (data != nullptr && std::filesystem::exists(path)) return must(rtstdb::load_mesh(path));
  std::fprintf(stderr, "no bunny in HIL_TEST_DATA, another body of its size\n");
  return lumpy_body(218, 160, 9);
}

rtstdb::TriangleMesh triangle_soup(std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  rtstdb::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec3 center = random.in_box(glm::vec3(2.0f));
    const float size = 0.5f * std::exp2(random.between(-8.0f, 0.0f));
    for (int corner = 0; corner < 3; ++corner)
      mesh.positions_m.push_back(center + size * random.in_box(glm::vec3(1.0f)));
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

std::vector<rtstdb::Ray> camera_rays(std::uint32_t width, std::uint32_t height) {
  std::vector<rtstdb::Ray> rays;
  rays.reserve(std::size_t{width} * height);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      rtstdb::Ray ray;
      ray.origin_m = {2.2f, 0.3f, 0.4f};
      const float right = (static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 0.5f;
      const float up = 0.5f - (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
      ray.direction = glm::normalize(glm::vec3(-1.0f, 1.3f * right, 1.3f * up));
      ray.lambda_max = 100.0f;
      rays.push_back(ray);
    }
  }
  return rays;
}

std::vector<rtstdb::Ray> scattered_rays(std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<rtstdb::Ray> rays(count);
  for (rtstdb::Ray& ray : rays) {
    ray.origin_m = random.in_box({2.1f, 2.1f, 1.05f});
    ray.direction = random.direction();
    ray.lambda_max = 100.0f;
  }
  return rays;
}

MovingBodies moving_bodies(std::uint32_t count, float half_m, std::uint64_t seed) {
  Random random(seed);
  MovingBodies bodies;
  bodies.meshes = {lumpy_body(33, 32, seed + 1), lumpy_body(41, 40, seed + 2), lumpy_body(49, 44, seed + 3),
                   lumpy_body(51, 50, seed + 4)};
  for (std::uint32_t i = 0; i < count; ++i) {
    rtstdb::EntityRow row;
    row.geometry = {i % 4};
    row.scale = glm::dvec3(1.0) + glm::dvec3(random.in_box(glm::vec3(0.5f)));
    row.motion.p_world_m = glm::dvec3(random.in_box(glm::vec3(half_m)));
    row.motion.q_world =
        glm::angleAxis(static_cast<double>(random.between(-pi, pi)), glm::dvec3(random.direction()));
    row.motion.v_world_mps = glm::dvec3(random.between(0.0f, 20.0f) * random.direction());
    row.motion.w_world_radps = glm::dvec3(random.between(0.0f, 5.0f) * random.direction());
    bodies.rows.push_back(row);
  }
  return bodies;
}

std::vector<rtstdb::Ray> timed_rays(std::uint32_t count, float half_m, float lambda_max,
                                    std::int64_t window_ns, std::uint64_t seed) {
  Random random(seed);
  std::vector<rtstdb::Ray> rays(count);
  for (rtstdb::Ray& ray : rays) {
    ray.origin_m = random.in_box(glm::vec3(half_m));
    ray.direction = random.direction();
    ray.lambda_max = lambda_max;
    ray.t = rtstdb::world_time_ns(
        static_cast<std::int64_t>(random.next() % static_cast<std::uint64_t>(window_ns + 1)));
  }
  return rays;
}

std::vector<rtstdb::EntityRow> strewn_boxes(std::uint32_t count, float half_m, std::uint64_t seed) {
  Random random(seed);
  std::vector<rtstdb::EntityRow> rows(count);
  for (rtstdb::EntityRow& row : rows) {
    row.scale = glm::dvec3(1.0) + glm::dvec3(random.in_box(glm::vec3(0.5f)));
    row.motion.p_world_m = glm::dvec3(random.in_box(glm::vec3(half_m)));
  }
  return rows;
}

}  // namespace hil::bench
