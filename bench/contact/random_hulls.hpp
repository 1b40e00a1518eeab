#pragma once
// The bodies of the contact suite.

#include <glm/ext/vector_double3.hpp>

#include <random>
#include <vector>

#include <rtstdb/geometry.hpp>

namespace hil::bench {

inline constexpr int hull_count = 40;

glm::dvec3 random_direction(std::mt19937_64& engine);

/// hull_count hulls of 100 corners within a metre of the origin.
std::vector<rtstdb::TriangleMesh> random_hulls(std::mt19937_64& engine);

}  // namespace hil::bench
