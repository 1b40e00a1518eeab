#include "rtstdb/query/image/specular_albedo.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <rtstdb/result.hpp>

#include "shaders/shared/image.h"

namespace rtstdb::query {
namespace {

/// Directions of microfacets for each entry of the table.
constexpr std::uint32_t samples_a_side = 24;
constexpr double min_cosine = 1e-3;

double smith_lambda(const glm::dvec3& direction, double alpha) {
  const double tangent_squared =
      (direction.x * direction.x + direction.y * direction.y) / std::max(direction.z * direction.z, 1e-12);
  return 0.5 * (std::sqrt(1.0 + alpha * alpha * tangent_squared) - 1.0);
}

/// Chooses a visible microfacet as surface.glsl does.
glm::dvec3 visible_microfacet(const glm::dvec3& toward, double alpha, double u, double v) {
  const glm::dvec3 stretched = glm::normalize(glm::dvec3(alpha * toward.x, alpha * toward.y, toward.z));
  const double angle = 2.0 * std::numbers::pi * u;
  const double z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
  const double sine = std::sqrt(std::clamp(1.0 - z * z, 0.0, 1.0));
  const glm::dvec3 h = glm::dvec3(sine * std::cos(angle), sine * std::sin(angle), z) + stretched;
  return glm::normalize(glm::dvec3(alpha * h.x, alpha * h.y, h.z));
}

glm::vec4 terms(double cosine, double roughness) {
  const glm::dvec3 toward(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
  const double alpha = std::max(roughness * roughness, 1e-4);
  double scale = 0.0, offset = 0.0;
  for (std::uint32_t k = 0; k < samples_a_side * samples_a_side; ++k) {
    const std::uint32_t column = k % samples_a_side, row = k / samples_a_side;
    const double u = (column + 0.5) / samples_a_side;
    // More samples near v = 1, where the few microfacets are that are turned far from the surface: their
    // reflections lead into it.
    const double rest = 1.0 - (row + 0.5) / samples_a_side;
    const double v = 1.0 - rest * rest;
    const double weight = 2.0 * rest;
    const glm::dvec3 h = visible_microfacet(toward, alpha, u, v);
    const glm::dvec3 to = 2.0 * glm::dot(toward, h) * h - toward;
    if (to.z <= 0.0) continue;
    const double outward = 1.0 + smith_lambda(toward, alpha);
    const double visible = outward / (outward + smith_lambda(to, alpha));
    const double grazing = std::pow(std::clamp(1.0 - glm::dot(toward, h), 0.0, 1.0), 5.0);
    scale += weight * (1.0 - grazing) * visible;
    offset += weight * grazing * visible;
  }
  constexpr double count = samples_a_side * samples_a_side;
  return {static_cast<float>(scale / count), static_cast<float>(offset / count), 0.0f, 0.0f};
}

}  // namespace

void write_specular_albedo(std::span<glm::vec4> table) noexcept {
  constexpr std::uint32_t side = shared::image_albedo_side;
  RTSTDB_ASSERT(table.size() == side * side, "the table does not have image_albedo_side squared entries");
  constexpr double last = side - 1;
  for (std::uint32_t row = 0; row < side; ++row)
    for (std::uint32_t column = 0; column < side; ++column)
      table[row * side + column] = terms(std::max(column / last, min_cosine), row / last);
}

}  // namespace rtstdb::query
