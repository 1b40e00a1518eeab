#pragma once
// Splits double precision into single precision and a remainder, for records of the device.
//
// Pure; no allocation.

#include <glm/vec3.hpp>

namespace rtstdb::query {

/// The value minus its rounding to single precision. Both together have 48 bits of the value.
template <int size>
glm::vec<size, float> remainder_of(const glm::vec<size, double>& value) noexcept {
  using Single = glm::vec<size, float>;
  return Single(value - glm::vec<size, double>(Single(value)));
}

}  // namespace rtstdb::query
