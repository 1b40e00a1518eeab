#include "runtime/config/parts_file.hpp"

#include <algorithm>
#include <utility>

#include <hil/rotation.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/config/reading.hpp"
#include "runtime/config/world_limits.hpp"

namespace hil::config {
namespace {

constexpr std::int64_t max_segments = 4096;
constexpr std::int64_t max_repeats = 1'000'000;
constexpr std::size_t max_repeat_levels = 8;

std::uint32_t whole_in(const Value& record, const char* field) {
  return static_cast<std::uint32_t>(record[field].integer());
}

PartBody read_body(const Value& value, Diagnostics& diagnostics) {
  const std::string& kind = value.chosen();
  const Value& body = value[kind];
  if (kind == "box") return BoxPart{three_numbers(body)};
  if (kind == "cylinder") {
    const double radius_m = body["radius"].number();
    return ConePart{radius_m, radius_m, body["height"].number(), whole_in(body, "segments")};
  }
  if (kind == "cone") {
    return ConePart{body["radius"].number(), body["top_radius"].number(), body["height"].number(),
                    whole_in(body, "segments")};
  }
  if (kind == "sphere") return SpherePart{body["radius"].number(), whole_in(body, "subdivisions")};
  const RingPart ring{body["radius"].number(), body["tube_radius"].number(), whole_in(body, "segments"),
                      whole_in(body, "sides")};
  if (ring.tube_radius_m >= ring.radius_m) {
    diagnostics.add(body["tube_radius"].place(),
                    "'tube_radius' is not smaller than 'radius': the ring would have no hole");
  }
  return ring;
}

Part read_part(const Value& value, Diagnostics& diagnostics) {
  Part part{.body = read_body(value, diagnostics),
            .position_m = three_numbers(value["position"]),
            .rotation_wxyz = read_rotation(value["rotation"], diagnostics),
            .color = three_numbers(value["color"]),
            .repeat = {}};
  for (const Value& repeat : value["repeat"].items()) {
    const std::string& axis = repeat["axis"].text();
    part.repeat.push_back({.count = whole_in(repeat, "count"),
                           .step_m = three_numbers(repeat["step"]),
                           .turn_rad = repeat["turn"].number(),
                           .axis = static_cast<std::size_t>(axis.front() - 'x')});
  }
  return part;
}

}  // namespace

std::uint64_t triangles_of(const Part& part) noexcept {
  std::uint64_t triangles = 12;  // of a box
  if (const auto* cone = std::get_if<ConePart>(&part.body)) {
    triangles = std::uint64_t{cone->segments} * (cone->top_radius_m > 0.0 ? 4 : 2);
  } else if (const auto* sphere = std::get_if<SpherePart>(&part.body)) {
    triangles = std::uint64_t{20} << (2 * sphere->subdivisions);
  } else if (const auto* ring = std::get_if<RingPart>(&part.body)) {
    triangles = std::uint64_t{2} * ring->segments * ring->sides;
  }
  for (const PartRepeat& repeat : part.repeat)
    triangles = std::min(triangles * repeat.count, max_counted_triangles);
  return triangles;
}

Schema parts_file_schema() {
  const auto length = Schema::quantity(Quantity::length_m, 1e-6, max_coordinate_m);
  const auto point =
      Schema::list(Schema::quantity(Quantity::length_m, -max_coordinate_m, max_coordinate_m), 3, 3);
  const auto segments = Field::with_default("segments", Schema::integer(3, max_segments), "32",
                                            "The number of corners around the axis.");
  const auto repeat = Schema::record({
      Field::needed("count", Schema::integer(1, max_repeats), "The number of copies, the part included."),
      Field::with_default("step", point, "[0 m, 0 m, 0 m]", "The shift from one copy to the next."),
      Field::with_default("turn", Schema::quantity(Quantity::angle_rad, -1000.0, 1000.0), "0 deg",
                          "The rotation from one copy to the next about an axis of the shape's frame, "
                          "before the shift."),
      Field::with_default("axis", Schema::one_of({"x", "y", "z"}), "z", "The axis of the rotation."),
  });
  const auto part = Schema::exactly_one(
      {Field::optional("box", Schema::list(length, 3, 3), "The full sizes along x, y and z."),
       Field::optional(
           "cylinder",
           Schema::record({Field::needed("radius", length, "The radius."),
                           Field::needed("height", length, "The full height, along z."), segments}),
           "A cylinder along z."),
       Field::optional(
           "cone",
           Schema::record(
               {Field::needed("radius", length, "The radius at the lower end."),
                Field::with_default("top_radius", Schema::quantity(Quantity::length_m, 0.0, max_coordinate_m),
                                    "0 m", "The radius at the upper end; 0 m: a tip."),
                Field::needed("height", length, "The full height, along z."), segments}),
           "A cone or a truncated cone, along z."),
       Field::optional(
           "sphere",
           Schema::record_or("radius", {Field::needed("radius", length, "The radius."),
                                        Field::with_default("subdivisions", Schema::integer(0, 8), "3",
                                                            "20 * 4^subdivisions triangles.")}),
           "A sphere."),
       Field::optional(
           "ring",
           Schema::record({Field::needed("radius", length, "The radius of the middle of the tube."),
                           Field::needed("tube_radius", length, "The radius of the tube."), segments,
                           Field::with_default("sides", Schema::integer(3, max_segments), "16",
                                               "The number of corners around the tube.")}),
           "A ring about z: a torus.")},
      {Field::with_default("position", point, "[0 m, 0 m, 0 m]", "The part's middle in the shape's frame."),
       Field::with_default("rotation", rotation_schema(), "{}", "The rotation of the part. Left out: none."),
       Field::with_default(
           "color", Schema::color(1.0), "[1, 1, 1]",
           "A colour for images, by which the base colour of the material is multiplied: red, "
           "green and blue in linear light, or '#rrggbb' in sRGB."),
       Field::with_default("repeat", Schema::list(repeat, 0, max_repeat_levels), "[]",
                           "Copies of the part; a second entry copies all copies of the first one, and so "
                           "on.")});
  return Schema::record(
      {Field::needed("parts", Schema::list(part, 1), "The parts. Their order has no meaning.")});
}

std::optional<std::vector<Part>> load_parts(const std::string& path, std::uint64_t max_triangles,
                                            Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  const std::optional<Value> root = parse_file(path, parts_file_schema(), diagnostics);
  if (!root) return std::nullopt;
  std::vector<Part> parts;
  std::uint64_t triangles = 0;
  for (const Value& value : (*root)["parts"].items()) {
    parts.push_back(read_part(value, diagnostics));
    const std::uint64_t before = std::exchange(triangles, triangles + triangles_of(parts.back()));
    if (before > max_triangles || triangles <= max_triangles) continue;
    const char* const bound = triangles < max_counted_triangles ? "" : "at least ";
    diagnostics.add(value.place(), bound + std::to_string(triangles) +
                                       " triangles up to this part; at most " +
                                       std::to_string(max_triangles) + " are possible");
  }
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return parts;
}

}  // namespace hil::config
