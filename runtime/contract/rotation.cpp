#include <cmath>
#include <string>

#include <hil/numbers.hpp>
#include <hil/rotation.hpp>

namespace hil::config {
namespace {

using Quaternion = std::array<double, 4>;

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// The rotation by the angle `record[field]` about one axis (1: x, 2: y, 3: z).
Quaternion turn(const Value& record, const std::string& field, std::size_t axis) {
  Quaternion quaternion{1.0, 0.0, 0.0, 0.0};
  if (!record.has(field)) return quaternion;
  const double half = record[field].number() / 2.0;
  quaternion[0] = std::cos(half);
  quaternion[axis] = std::sin(half);
  return quaternion;
}

}  // namespace

std::array<double, 4> read_rotation(const Value& rotation, Diagnostics& diagnostics) {
  constexpr double tolerance = 1e-3;  // permits components with three decimals
  if (!rotation.has("quaternion")) {
    return product(turn(rotation, "yaw", 3), product(turn(rotation, "pitch", 2), turn(rotation, "roll", 1)));
  }
  const Value& list = rotation["quaternion"];
  for (std::size_t i = 0; i < rotation.entries().size(); ++i) {
    const std::string& other = rotation.entries()[i].first;
    if (other == "quaternion") continue;
    diagnostics.add(rotation.key_place(i),
                    in_quotes(other) + " next to 'quaternion'; a rotation is one or the other");
  }
  Quaternion quaternion{};
  double squared = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    quaternion[i] = list.items()[i].number();
    squared += quaternion[i] * quaternion[i];
  }
  const double length = std::sqrt(squared);
  if (std::abs(length - 1.0) > tolerance) {
    diagnostics.add(list.place(),
                    "'quaternion' has the length " + format_number(length) + "; a rotation has length 1");
    return {1.0, 0.0, 0.0, 0.0};
  }
  for (double& part : quaternion)
    part /= length;
  return quaternion;
}

Schema rotation_schema() {
  const auto angle = Schema::quantity(Quantity::angle_rad, -1000.0, 1000.0);
  return Schema::record({
      Field::optional("yaw", angle, "The rotation about z, applied last."),
      Field::optional("pitch", angle, "The rotation about y, applied second."),
      Field::optional("roll", angle, "The rotation about x, applied first."),
      Field::optional("quaternion", Schema::list(Schema::number(-1.0, 1.0), 4, 4),
                      "The rotation as a unit quaternion [w, x, y, z], in place of the three angles."),
  });
}

}  // namespace hil::config
