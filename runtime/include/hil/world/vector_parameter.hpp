#pragma once
// A parameter that is a list of three numbers, as a vector.

#include <glm/ext/vector_double3.hpp>

#include <hil/schema.hpp>

namespace hil::modules {

/// Misuse: a list whose schema does not promise three numbers.
inline glm::dvec3 vector_of(const config::Value& list) {
  return {list.items()[0].number(), list.items()[1].number(), list.items()[2].number()};
}

}  // namespace hil::modules
