#include "runtime/modules/vehicles/car_shape.hpp"

#include <cstdio>

namespace hil::modules {
namespace {

constexpr double body_share = 0.6;  // of the height
constexpr double cabin_length_share = 0.5;
constexpr double cabin_width_share = 0.85;
constexpr double cabin_setback_share = 0.08;

void add(rtstdb::TriangleMesh& mesh, const rtstdb::TriangleMesh& part, const glm::vec3& shift_m) {
  const auto base = static_cast<glm::uint>(mesh.positions_m.size());
  for (const glm::vec3& p : part.positions_m)
    mesh.positions_m.push_back(p + shift_m);
  for (const glm::uvec3& t : part.triangles)
    mesh.triangles.push_back(t + glm::uvec3(base));
}

}  // namespace

double body_height_m(const glm::dvec3& size_m) noexcept {
  return body_share * size_m.z;
}

std::string car_key(const glm::dvec3& size_m) {
  char key[96];
  std::snprintf(key, sizeof key, "car %a %a %a", size_m.x, size_m.y, size_m.z);  // hexadecimal: exact
  return key;
}

rtstdb::TriangleMesh make_car(const glm::dvec3& size_m) {
  const double body_m = body_height_m(size_m);
  const double cabin_m = size_m.z - body_m;
  rtstdb::TriangleMesh car;
  add(car, rtstdb::make_box({size_m.x, size_m.y, body_m}), glm::vec3(0.0, 0.0, 0.5 * (body_m - size_m.z)));
  add(car, rtstdb::make_box({cabin_length_share * size_m.x, cabin_width_share * size_m.y, cabin_m}),
      glm::vec3(-cabin_setback_share * size_m.x, 0.0, 0.5 * (size_m.z - cabin_m)));
  return car;
}

}  // namespace hil::modules
