#pragma once
// A car's outer shape: a body of full length and width, and a cabin on it.

#include <string>

#include <rtstdb/geometry.hpp>

namespace hil::modules {

/// Full extents: length along x (front at +), width along y, height along z. The box of the mesh is centred
/// on the origin.
rtstdb::TriangleMesh make_car(const glm::dvec3& size_m);

/// The same for equal sizes and for no others: what cars share their geometry by.
std::string car_key(const glm::dvec3& size_m);

/// Height above the ground up to which the body reaches its full length: the sides below it are upright.
double body_height_m(const glm::dvec3& size_m) noexcept;

}  // namespace hil::modules
