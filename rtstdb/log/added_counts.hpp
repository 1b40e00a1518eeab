#pragma once
// How many geometries, materials and lights there are. They are only ever added.
//
// Threads: plain data.

#include <cstddef>

namespace rtstdb::log {

struct AddedCounts {
  std::size_t geometries = 0;
  std::size_t materials = 0;  ///< without the default material
  std::size_t lights = 0;

  /// Whether everything that `part` counts is counted here too.
  bool contains(const AddedCounts& part) const noexcept {
    return part.geometries <= geometries && part.materials <= materials && part.lights <= lights;
  }
};

}  // namespace rtstdb::log
