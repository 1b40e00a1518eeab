#pragma once
// The shape of a car: a body of full length and width, and a cabin on it.

#include <string>

#include <rtstdb/geometry.hpp>

namespace hil::modules {

/// Full extents: length along x (front at +), width along y, height along z. The box of the mesh is centred
/// on the origin.
rtstdb::TriangleMesh make_car(const glm::dvec3& size_m);

/// The key for World::shared_geometry: equal only for equal sizes.
std::string car_key(const glm::dvec3& size_m);

/// Height of the body, below the cabin. The sides of the body are upright.
double body_height_m(const glm::dvec3& size_m) noexcept;

}  // namespace hil::modules
