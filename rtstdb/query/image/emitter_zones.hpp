#pragma once
// Divides the surface of a body that emits light into zones, from each of which real-time mode takes light
// with one shadow ray (shaders/query/image/image_light.comp).
//
// A body with at most as many flat sides as zones has each side in zones of its own. Otherwise sides
// whose normals and positions are near each other share zones. The division depends on the surface, not on
// the triangles that it is made of or their order.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shaders/shared/image.h"

namespace rtstdb::query {

/// Threads: one at a time. Allocates in its constructor alone.
class EmitterZones {
 public:
  /// `zones`: of a surface. `max_triangles`: of a mesh.
  EmitterZones(std::uint32_t zones, std::uint32_t max_triangles);

  /// Divides a mesh that is scaled along its axes. Zones that a surface without area does not need have the
  /// area 0. Misuse: more triangles than max_triangles, or another number of zones.
  void divide(std::span<const glm::uvec3> triangles, std::span<const glm::vec3> positions_m,
              const glm::dvec3& scale, std::span<shared::EmitterZone> zones,
              std::span<shared::EmitterPoint> points) noexcept;

 private:
  static constexpr std::size_t dimensions = 6;
  /// Position over the diameter of the body, then normal.
  using Feature = std::array<double, dimensions>;

  struct Corners {
    glm::dvec3 a, b, c;
  };
  struct Facet {
    Corners at;
    glm::dvec3 n;
    double area = 0.0;
  };
  /// A point that stands for a part of a triangle.
  struct Sample {
    std::array<float, dimensions> at;
    float area = 0.0f;
    float inset = 0.0f;  // from the nearest edge of the triangle, over the diameter of the body
    std::uint32_t side = 0;
  };
  /// Sums over samples, weighted by area.
  struct Moments {
    double area = 0.0;
    Feature first{};
    std::array<Feature, dimensions> second{};
    void add(const Sample& sample) noexcept;
    Feature mean() const noexcept;
    double covariance(std::size_t i, std::size_t j) const noexcept;
    /// How far the samples are from their mean.
    double spread() const noexcept;
    Feature main_axis(const Feature* across) const noexcept;
  };
  /// A zone, as a range of order_.
  struct Zone {
    std::uint32_t begin = 0, end = 0;
    Moments moments;
  };

  void read(std::span<const glm::uvec3> triangles, std::span<const glm::vec3> positions_m,
            const glm::dvec3& scale) noexcept;
  std::uint32_t find_sides() noexcept;
  void add_samples(const Facet& facet, std::uint32_t side) noexcept;
  Zone zone_of(std::uint32_t begin, std::uint32_t end) const noexcept;
  bool split(Zone& zone, Zone& rest) noexcept;
  shared::EmitterZone record_of(const Zone& zone) const noexcept;
  void set_points(const Zone& zone, std::span<shared::EmitterPoint> points) const noexcept;

  std::uint32_t zones_count_, samples_wanted_;
  double area_ = 0.0, diameter_ = 0.0;
  glm::dvec3 middle_{};
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> planes_;  // facets, by side
  std::vector<std::uint32_t> sides_;   // by facet
  std::vector<Sample> samples_;
  std::vector<std::uint32_t> order_;  // of samples, by zone
  std::vector<Zone> zones_;
};

}  // namespace rtstdb::query
