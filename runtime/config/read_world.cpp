#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include <hil/numbers.hpp>
#include <hil/rotation.hpp>

#include "runtime/config/section_readers.hpp"
#include "runtime/config/world_limits.hpp"

namespace hil::config {
namespace {

/// In small letters, with the dot.
std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& letter : extension) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return extension;
}

FileShape read_mesh_file(const Value& value, Diagnostics& diagnostics) {
  const Value& path = value["path"];
  const std::string extension = extension_of(path.text());
  constexpr std::array<std::string_view, 5> known{".obj", ".stl", ".ply", ".gltf", ".glb"};
  if (std::find(known.begin(), known.end(), extension) == known.end()) {
    diagnostics.add(path.place(),
                    "'path': a mesh is read from obj, stl, ply, gltf or glb, not from " +
                        (extension.empty() ? "a file without an extension" : in_quotes(extension)));
  }
  return FileShape{path.text(), value["scale"].number(), path.place()};
}

FileShape read_convex_parts(const Value& value, Diagnostics& diagnostics) {
  FileShape file = read_mesh_file(value, diagnostics);
  if (extension_of(file.path) == ".stl")
    diagnostics.add(file.place,
                    "'convex_parts': triangles of an STL file share no corners, so it is not known which of "
                    "them make a convex piece; use obj, ply, gltf or glb");
  return file;
}

Shape read_shape(const Value& shape, Diagnostics& diagnostics) {
  const std::string& kind = shape.chosen();
  const Value& value = shape[kind];
  if (kind == "box") return BoxShape{three_numbers(value)};
  if (kind == "cylinder") return CylinderShape{value["radius"].number(), value["height"].number()};
  if (kind == "sphere") return SphereShape{value["radius"].number()};
  if (kind == "rectangle") return RectangleShape{{value.items()[0].number(), value.items()[1].number()}};
  if (kind == "parts") return PartsShape{value.text(), value.place()};
  return read_mesh_file(value, diagnostics);
}

SolidShape read_solid(const Value& value, Diagnostics& diagnostics) {
  const Value& shape = value["shape"];
  SolidShape solid{.kind = shape.chosen(),
                   .position_m = three_numbers(value["position"]),
                   .rotation_wxyz = read_rotation(value["rotation"], diagnostics)};
  const Value& sizes = shape[solid.kind];
  if (solid.kind == "box") {
    solid.size_m = three_numbers(sizes);
    return solid;
  }
  solid.radius_m = sizes["radius"].number();
  if (solid.kind != "sphere") solid.height_m = sizes["height"].number();
  return solid;
}

/// Of an entity without a mask (scenario_schema.cpp).
constexpr const char* default_layer = "static";

std::uint32_t read_mask(const WorldEntity& entity, Layers& layers, bool are_listed,
                        Diagnostics& diagnostics) {
  std::uint32_t bits = 0;
  for (const Word& layer : entity.mask) {
    const std::optional<std::uint32_t> bit = are_listed ? layers.bit(layer.text) : layers.add(layer.text);
    if (bit) {
      bits |= *bit;
    } else if (are_listed) {
      const std::string note =
          layer.text == default_layer ? ", which is that of an entity without a 'mask'" : "";
      diagnostics.add(layer.place, "unknown layer " + in_quotes(layer.text) + note +
                                       suggestion(layer.text, layers.names()));
    } else {
      diagnostics.add(layer.place, "the layer " + in_quotes(layer.text) + " is one too many; there can be " +
                                       std::to_string(Layers::capacity));
    }
  }
  return bits;
}

double length(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

/// Checks the lengths of the vectors; the schema has checked their components.
void check_rates(const Value& value, const WorldEntity& entity, Diagnostics& diagnostics) {
  const auto check = [&](const char* field, double rate, double largest, const char* unit) {
    if (rate <= largest) return;
    diagnostics.add(value[field].place(), in_quotes(field) + " is " + format_number(rate) + " " + unit +
                                              " in all; at most " + format_number(largest) + " " + unit +
                                              " is possible");
  };
  check("velocity", length(entity.velocity_mps), max_speed_mps, "m/s");
  check("angular_velocity", length(entity.angular_velocity_radps), max_angular_rate_radps, "rad/s");
}

/// Checks the position at the end of the run, which is known since the velocity is constant.
void check_path(const Value& value, const WorldEntity& entity, std::int64_t duration_ns,
                Diagnostics& diagnostics) {
  if (length(entity.velocity_mps) > max_speed_mps) return;
  const double duration_s = static_cast<double>(duration_ns) * 1e-9;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double end_m = entity.position_m[axis] + entity.velocity_mps[axis] * duration_s;
    if (std::abs(end_m) <= max_coordinate_m) continue;
    diagnostics.add(value["velocity"].place(), "'velocity' takes the entity out of the world: its " +
                                                   std::string(1, "xyz"[axis]) + " is " +
                                                   format_number(end_m) + " m at the end of the run, and " +
                                                   format_number(max_coordinate_m) + " m is the farthest");
    return;
  }
}

/// The largest size of the shape; 0 for a file, whose size is known when it is read.
double largest_size_m(const Shape& shape) {
  if (const auto* box = std::get_if<BoxShape>(&shape))
    return *std::max_element(box->size_m.begin(), box->size_m.end());
  if (const auto* cylinder = std::get_if<CylinderShape>(&shape))
    return std::max(cylinder->radius_m, cylinder->height_m);
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) return sphere->radius_m;
  if (const auto* rectangle = std::get_if<RectangleShape>(&shape))
    return std::max(rectangle->size_m[0], rectangle->size_m[1]);
  return 0.0;
}

void check_scale(const WorldEntity& entity, Diagnostics& diagnostics) {
  const double size_m = largest_size_m(entity.shape);
  if (size_m * entity.scale <= max_coordinate_m) return;
  diagnostics.add(entity.scale_place, "'scale' makes " + format_number(size_m * entity.scale) + " m of " +
                                          format_number(size_m) + " m; the largest size is " +
                                          format_number(max_coordinate_m) + " m");
}

/// `known`: of read_materials() or read_lights().
void check_known(const std::optional<Word>& name, const char* noun, const KnownNames& known,
                 Diagnostics& diagnostics) {
  if (!name || !known || std::ranges::count(*known, name->text) > 0) return;
  diagnostics.add(name->place, std::string("unknown ") + noun + " " + in_quotes(name->text) +
                                   suggestion(name->text, *known));
}

/// An entity without a shape is a light alone.
void check_shapeless(const Value& value, const WorldEntity& entity, Diagnostics& diagnostics) {
  if (entity.is_body()) return;
  if (!entity.light)
    diagnostics.add(value.place(), "missing key 'shape' (The form and size of the entity), or 'light'");
  for (const char* key : {"field", "convex_parts", "solid", "material"}) {
    if (value.has(key))
      diagnostics.add(value[key].place(), in_quotes(key) + " belongs to a 'shape', which the entity lacks");
  }
}

DistanceField read_field(const Value& value, Diagnostics& diagnostics) {
  if (value.has("error") && value.has("cell")) {
    diagnostics.add(value["cell"].place(),
                    "'cell' and 'error' determine each other; only one of them can be given");
  }
  return {.error_m = value.has("error") ? value["error"].number() : 0.0,
          .cell_m = value.has("cell") ? value["cell"].number() : 0.0,
          .sign = value["sign"].text(),
          .max_bytes = static_cast<std::uint64_t>(value["max_bytes"].integer())};
}

WorldEntity read_entity(const Value& value, Diagnostics& diagnostics) {
  WorldEntity entity;
  entity.name = word_of(value["name"]);
  if (value.has("shape")) {
    entity.shape = read_shape(value["shape"], diagnostics);
    entity.shape_place = value["shape"].place();
  }
  entity.position_m = three_numbers(value["position"]);
  entity.rotation_wxyz = read_rotation(value["rotation"], diagnostics);
  entity.velocity_mps = three_numbers(value["velocity"]);
  entity.angular_velocity_radps = three_numbers(value["angular_velocity"]);
  entity.scale = value["scale"].number();
  entity.scale_place = value["scale"].place();
  if (value.has("field")) entity.field = read_field(value["field"], diagnostics);
  if (value.has("convex_parts")) entity.convex_parts = read_convex_parts(value["convex_parts"], diagnostics);
  if (value.has("solid")) {
    entity.solid = read_solid(value["solid"], diagnostics);
    entity.solid_place = value["solid"].place();
    if (entity.convex_parts)
      diagnostics.add(entity.solid_place, "an entity has either 'solid' or 'convex_parts'");
  }
  entity.material = word_in(value, "material");
  entity.light = word_in(value, "light");
  check_shapeless(value, entity, diagnostics);
  for (const Value& layer : value["mask"].items())
    entity.mask.push_back(word_of(layer));
  check_rates(value, entity, diagnostics);
  check_scale(entity, diagnostics);
  return entity;
}

/// Expressions name bodies, regions and beams.
void check_word(const Word& name, const char* noun, Diagnostics& diagnostics) {
  if (is_reserved_word(name.text))
    diagnostics.add(name.place, in_quotes(name.text) + " is a word of the expression language; give the " +
                                    noun + " another name");
}

/// The names that entities may use.
struct OpticalNames {
  KnownNames materials, lights;
};

void read_entities(const Value& list, const OpticalNames& known, Scenario& scenario, ReaderContext& reading) {
  World& world = scenario.world;
  UniqueNames names("entity", reading.diagnostics);
  for (const Value& value : list.items()) {
    if (const std::optional<Word> name = word_in(value, "name")) names.add(*name);
    if (!is_whole(value)) continue;
    WorldEntity entity = read_entity(value, reading.diagnostics);
    check_word(entity.name, "entity", reading.diagnostics);
    check_known(entity.material, "material", known.materials, reading.diagnostics);
    check_known(entity.light, "light", known.lights, reading.diagnostics);
    check_path(value, entity, scenario.duration_ns, reading.diagnostics);
    entity.mask_bits = read_mask(entity, world.layers, world.layers_are_listed, reading.diagnostics);
    world.entities.push_back(std::move(entity));
  }
  if (list.items().size() > world.max_entities && world.max_entities > 0) {
    reading.diagnostics.add(list.place(), std::to_string(list.items().size()) +
                                              " entities, but max_entities is " +
                                              std::to_string(world.max_entities));
  }
}

void read_regions(const Value& list, World& world, Diagnostics& diagnostics) {
  UniqueNames names("region", diagnostics);
  for (const Value& value : list.items()) {
    if (const std::optional<Word> name = word_in(value, "name")) names.add(*name);
    if (!is_whole(value)) continue;
    check_word(word_of(value["name"]), "region", diagnostics);
    world.regions.push_back({.name = word_of(value["name"]),
                             .center_m = three_numbers(value["center"]),
                             .size_m = three_numbers(value["size"]),
                             .heading_rad = value["heading"].number(),
                             .whole = value["whole"].boolean(),
                             .carrier = word_in(value, "carrier")});
  }
}

void read_beams(const Value& list, World& world, Diagnostics& diagnostics) {
  UniqueNames names("beam", diagnostics);
  for (const Value& value : list.items()) {
    if (const std::optional<Word> name = word_in(value, "name")) names.add(*name);
    if (!is_whole(value)) continue;
    check_word(word_of(value["name"]), "beam", diagnostics);
    world.beams.push_back({.name = word_of(value["name"]),
                           .origin_m = three_numbers(value["origin"]),
                           .azimuth_rad = value["azimuth"].number(),
                           .elevation_rad = value["elevation"].number(),
                           .range_m = value["range"].number(),
                           .carrier = word_in(value, "carrier")});
  }
}

/// A limit of the time for which the end of a run waits for a view.
constexpr std::uint64_t max_view_points = std::uint64_t{1} << 26;

void check_view(const Value& value, const WorldView& view, Diagnostics& diagnostics) {
  constexpr double min_distance_m = 1e-3;
  constexpr double max_half_tangent = 999.0;  // as of a camera
  const std::array<double, 3>& from = view.position_m;
  const std::array<double, 3>& to = view.look_at_m;
  if (length({to[0] - from[0], to[1] - from[1], to[2] - from[2]}) < min_distance_m)
    diagnostics.add(value["look_at"].place(),
                    "'look_at' is 'position', so the view has no direction; give another point");
  const double half_height = std::tan(0.5 * view.field_of_view_rad) * view.height / view.width;
  if (half_height > max_half_tangent)
    diagnostics.add(value["field_of_view"].place(),
                    "'field_of_view' is horizontal: the vertical one of these pixels is " +
                        format_number(2.0 * std::atan(half_height) * 180.0 / std::numbers::pi) +
                        " deg; at most 179.88 deg are possible: use fewer rows or a smaller angle");
  const std::uint64_t points = std::uint64_t{view.width} * view.height * view.samples;
  if (points > max_view_points)
    diagnostics.add(value["resolution"].place(),
                    "the view has " + std::to_string(points) +
                        " points (pixels times samples), for which the end of the "
                        "run would have to wait; at most " +
                        std::to_string(max_view_points) + " are possible: take a finer image by hil history");
}

void read_views(const Value& list, World& world, Diagnostics& diagnostics) {
  UniqueNames names("view", diagnostics);
  for (const Value& value : list.items()) {
    if (const std::optional<Word> name = word_in(value, "name")) names.add(*name);
    if (!is_whole(value)) continue;
    WorldView view{.name = word_of(value["name"]),
                   .carrier = word_in(value, "carrier"),
                   .position_m = three_numbers(value["position"]),
                   .look_at_m = three_numbers(value["look_at"]),
                   .width = static_cast<std::uint32_t>(value["resolution"].items()[0].integer()),
                   .height = static_cast<std::uint32_t>(value["resolution"].items()[1].integer()),
                   .field_of_view_rad = value["field_of_view"].number(),
                   .is_path_traced = value["mode"].text() == "path_traced",
                   .samples = 0,
                   .bounces = static_cast<std::uint32_t>(value["bounces"].integer()),
                   .exposure_value = {},
                   .layers = {}};
    view.samples = value.has("samples") ? static_cast<std::uint32_t>(value["samples"].integer())
                                        : default_view_samples(view.is_path_traced);
    if (value.has("exposure_value")) view.exposure_value = value["exposure_value"].number();
    if (value.has("layers"))
      for (const Value& layer : value["layers"].items())
        view.layers.push_back(word_of(layer));
    check_view(value, view, diagnostics);
    world.views.push_back(std::move(view));
  }
}

Durability durability_of(const std::string& word) {
  if (word == "volatile") return Durability::none;
  if (word == "group") return Durability::group;
  return word == "sync" ? Durability::sync : Durability::async;
}

void read_log(const Value& value, World& world) {
  if (value.has("durability")) world.durability = durability_of(value["durability"].text());
  if (value.has("flush_interval")) world.flush_interval_ns = value["flush_interval"].duration_ns();
  if (value.has("log_ring_bytes"))
    world.log_ring_bytes = static_cast<std::uint64_t>(value["log_ring_bytes"].integer());
}

std::uint32_t count_in(const Value& record, const std::string& field) {
  return record.has(field) ? static_cast<std::uint32_t>(record[field].integer()) : 0;
}

}  // namespace

std::optional<std::uint32_t> Layers::bit(std::string_view name) const noexcept {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (names_[i] == name) return std::uint32_t{1} << i;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> Layers::add(std::string_view name) {
  if (const std::optional<std::uint32_t> known = bit(name)) return known;
  if (names_.size() == capacity) return std::nullopt;
  names_.emplace_back(name);
  return bit(name);
}

void read_world(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const value = part_of(root, "world");
  if (value == nullptr) return;
  World& world = scenario.world;
  if (value->has("gpu")) {
    world.gpu = (*value)["gpu"].text();
  }
  world.max_entities = count_in(*value, "max_entities");
  world.max_geometries = count_in(*value, "max_geometries");
  world.retained_changes = count_in(*value, "retained_changes");
  world.queue_capacity = count_in(*value, "queue_capacity");
  if (value->has("chunk")) world.chunk_ns = (*value)["chunk"].duration_ns();
  read_log(*value, world);
  UniqueNames layer_names("layer", reading.diagnostics);
  const Value* const layers = part_of(*value, "layers");
  if (layers != nullptr) {
    for (const Value& layer : layers->items()) {
      layer_names.add(word_of(layer));
      world.layers.add(layer.text());
    }
  }
  world.layers_are_listed = layers != nullptr && (!layers->items().empty() || !is_whole(*layers));
  const OpticalNames names{
      .materials = read_materials(part_of(*value, "materials"), world, reading.diagnostics),
      .lights = read_lights(part_of(*value, "lights"), world, reading.diagnostics)};
  if (const Value* const entities = part_of(*value, "entities")) {
    read_entities(*entities, names, scenario, reading);
  }
  if (const Value* const regions = part_of(*value, "regions"))
    read_regions(*regions, world, reading.diagnostics);
  if (const Value* const beams = part_of(*value, "beams")) read_beams(*beams, world, reading.diagnostics);
  if (const Value* const views = part_of(*value, "views")) read_views(*views, world, reading.diagnostics);
}

}  // namespace hil::config
