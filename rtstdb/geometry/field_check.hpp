#pragma once
// Adds the wrong member of a row or of a query's element to a BadInput, with its value and its limits.
// Neither allocates nor blocks.

#include <glm/ext/quaternion_double.hpp>
#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <rtstdb/transaction.hpp>

namespace rtstdb {

/// The names of a vector's components, such as "scale.x".
using VectorFields = std::array<std::string_view, 3>;
/// The names of a quaternion's components, w first.
using QuaternionFields = std::array<std::string_view, 4>;

struct FieldLimits {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

inline BadInput with_field(BadInput bad, std::string_view field, double value,
                           const FieldLimits& limits = {}) noexcept {
  bad.field = field;
  bad.value = value;
  bad.lowest = limits.lowest;
  bad.highest = limits.highest;
  return bad;
}

/// Adds a duration, in seconds.
inline BadInput with_duration(const BadInput& bad, std::string_view field, Nanoseconds value,
                              Nanoseconds lowest, Nanoseconds highest) noexcept {
  const auto seconds = [](Nanoseconds duration) { return static_cast<double>(duration.count()) * 1e-9; };
  BadInput with =
      with_field(bad, field, seconds(value), {.lowest = seconds(lowest), .highest = seconds(highest)});
  with.unit = "s";
  return with;
}

/// Adds the first component that is not a finite number between the limits; z if x and y are.
inline BadInput with_field(const BadInput& bad, const VectorFields& fields, const glm::dvec3& v,
                           const FieldLimits& limits = {}) noexcept {
  std::size_t k = 0;
  const auto good = [&](double x) { return std::isfinite(x) && x >= limits.lowest && x <= limits.highest; };
  while (k < 2 && good(v[static_cast<int>(k)]))
    ++k;
  return with_field(bad, fields[k], v[static_cast<int>(k)], limits);
}

inline BadInput with_field(const BadInput& bad, const QuaternionFields& fields,
                           const glm::dquat& q) noexcept {
  if (!std::isfinite(q.w)) return with_field(bad, fields[0], q.w);
  return with_field(bad, VectorFields{fields[1], fields[2], fields[3]}, {q.x, q.y, q.z});
}

}  // namespace rtstdb
