#include "runtime/config/optics_section.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/world_limits.hpp"

namespace hil::config {
namespace {

/// The smallest illuminance and intensity of a light.
constexpr double min_light = 1e-6;

Schema share_schema() {
  return Schema::number(0.0, 1.0);
}

/// One number for a white light, or one with a colour.
Schema luminance_schema() {
  return Schema::record_or(
      "luminance",
      {Field::needed("luminance", Schema::quantity(Quantity::luminance_cdpm2, 0.0, max_luminance_cdpm2),
                     "The luminance of a channel that is 1 in the colour."),
       Field::with_default("color", Schema::color(1.0), "[1, 1, 1]", "The colour of the light.")});
}

Field light_color_field() {
  return Field::with_default("color", Schema::color(max_light_color), "[1, 1, 1]",
                             "The colour of the light, by which its value is multiplied in each channel.");
}

Field intensity_field(const char* about) {
  return Field::needed("intensity",
                       Schema::quantity(Quantity::luminous_intensity_cd, min_light, max_intensity_cd), about);
}

Field light_position_field() {
  return Field::with_default(
      "position",
      Schema::list(Schema::quantity(Quantity::length_m, -max_coordinate_m, max_coordinate_m), 3, 3),
      "[0 m, 0 m, 0 m]",
      "Where the light is in the frame of its entity. In a body: in front of its surface, which hides it "
      "otherwise.");
}

Field name_field() {
  return Field::needed("name", Schema::name(), "The light's name, unique in the world.");
}

/// Luminance times colour; black without the field.
std::array<double, 3> luminance_in(const Value& record, const char* field) {
  if (!record.has(field)) return {};
  const Value& value = record[field];
  std::array<double, 3> channels = three_numbers(value["color"]);
  for (double& channel : channels)
    channel *= value["luminance"].number();
  return channels;
}

WorldMaterial read_material(const Value& value, Diagnostics& /*diagnostics*/) {
  return {.name = word_of(value["name"]),
          .reflectance = value["reflectance"].number(),
          .retro_gain = value.has("retro_gain") ? value["retro_gain"].number() : 0.0,
          .base_color = three_numbers(value["base_color"]),
          .metallic = value["metallic"].number(),
          .roughness = value["roughness"].number(),
          .emission_cdpm2 = luminance_in(value, "emission"),
          .transmission = value["transmission"].number(),
          .refractive_index = value["refractive_index"].number()};
}

void check_color(const Value& color, Diagnostics& diagnostics) {
  if (std::ranges::all_of(three_numbers(color), [](double channel) { return channel == 0.0; }))
    diagnostics.add(color.place(), "'color' is 0 in all channels; one has to be above 0");
}

void check_spot(const Value& value, Diagnostics& diagnostics) {
  const double inner_rad = value["inner_angle"].number(), outer_rad = value["outer_angle"].number();
  if (inner_rad <= outer_rad) return;
  const Unit degrees{"deg", std::numbers::pi, 180};
  diagnostics.add(value["inner_angle"].place(), "'inner_angle' is " + format_quantity(inner_rad, degrees) +
                                                    "; at most the 'outer_angle', " +
                                                    format_quantity(outer_rad, degrees) + ", is possible");
}

WorldLight read_light(const Value& value, Diagnostics& diagnostics) {
  WorldLight light;
  light.name = word_of(value["name"]);
  light.kind = value.chosen();
  if (light.kind == "sky") {
    light.zenith_cdpm2 = luminance_in(value, "zenith");
    light.horizon_cdpm2 = luminance_in(value, "horizon");
    light.ground_cdpm2 = luminance_in(value, "ground");
    return light;
  }
  check_color(value["color"], diagnostics);
  light.color = three_numbers(value["color"]);
  if (light.kind == "directional") {
    light.illuminance_lx = value["illuminance"].number();
    light.angular_diameter_rad = value["angular_diameter"].number();
    return light;
  }
  light.intensity_cd = value["intensity"].number();
  light.position_m = three_numbers(value["position"]);
  if (light.kind == "spot") {
    check_spot(value, diagnostics);
    light.inner_angle_rad = value["inner_angle"].number();
    light.outer_angle_rad = value["outer_angle"].number();
  }
  return light;
}

template <class Entry>
KnownNames read_all(const Value* list, const char* noun, std::vector<Entry>& entries,
                    Entry (*read)(const Value&, Diagnostics&), Diagnostics& diagnostics) {
  std::vector<std::string> all;
  if (list == nullptr) return all;
  UniqueNames names(noun, diagnostics);
  bool all_are_known = true;
  for (const Value& value : list->items()) {
    if (const std::optional<Word> name = word_in(value, "name")) {
      all_are_known = all_are_known && std::ranges::count(all, name->text) == 0;
      names.add(*name);
      all.push_back(name->text);
    } else {
      all_are_known = false;
    }
    if (is_whole(value)) entries.push_back(read(value, diagnostics));
  }
  if (!all_are_known) return std::nullopt;
  return all;
}

}  // namespace

Schema material_schema() {
  return Schema::record({
      Field::needed("name", Schema::name(), "The material's name, unique in the world."),
      Field::with_default("reflectance", share_schema(), "1",
                          "The share of a laser scanner's light that the matt surface scatters back."),
      Field::optional("retro_gain", Schema::number(1.0, max_retro_gain),
                      "A retro-reflector: how many times as much light it returns toward the source as a "
                      "matt surface of the same reflectance, at any angle. Left out: no retro-reflector."),
      Field::with_default("base_color", Schema::color(1.0), "[0.8, 0.8, 0.8]",
                          "In images: the share of light that the matt surface scatters, and the colour of "
                          "what a metal reflects."),
      Field::with_default("metallic", share_schema(), "0", "In images: 1 for a metal, 0 for none."),
      Field::with_default("roughness", share_schema(), "1",
                          "In images: from 0 for a mirror to 1 for the roughest surface."),
      Field::optional("emission", luminance_schema(),
                      "In images: the light that the surface emits in all directions. Left out: none."),
      Field::with_default("transmission", share_schema(), "0",
                          "In images: the share of light that passes through the surface, of what it does "
                          "not reflect."),
      Field::with_default("refractive_index", Schema::number(1.0, max_refractive_index), "1.5",
                          "In images: the refractive index of what is behind the surface."),
  });
}

Schema light_schema() {
  const Schema angle = Schema::quantity(Quantity::angle_rad, 0.0, max_spot_angle_rad);
  std::vector<std::pair<std::string, Schema>> kinds;
  kinds.emplace_back(
      "directional",
      Schema::record(
          {name_field(),
           Field::needed("illuminance",
                         Schema::quantity(Quantity::illuminance_lx, min_light, max_illuminance_lx),
                         "The illuminance of a surface perpendicular to the light, which shines along x of "
                         "its entity from infinitely far away."),
           light_color_field(),
           Field::with_default("angular_diameter",
                               Schema::quantity(Quantity::angle_rad, 0.0, max_angular_diameter_rad), "0 deg",
                               "The diameter of the disc that the light comes from. 0 deg: shadows are "
                               "sharp.")}));
  kinds.emplace_back(
      "point",
      Schema::record({name_field(), intensity_field("The luminous intensity, equal in all directions."),
                      light_color_field(), light_position_field()}));
  kinds.emplace_back(
      "spot",
      Schema::record(
          {name_field(),
           intensity_field("The luminous intensity around x of its entity, within the inner angle."),
           light_color_field(), light_position_field(),
           Field::with_default("inner_angle", angle, "0 deg",
                               "The full angle of the cone with the full intensity."),
           Field::needed("outer_angle",
                         Schema::quantity(Quantity::angle_rad, min_spot_angle_rad, max_spot_angle_rad),
                         "The full angle of the cone outside of which the intensity is 0.")}));
  kinds.emplace_back(
      "sky", Schema::record(
                 {name_field(),
                  Field::needed("zenith", luminance_schema(),
                                "The light from straight above, along z of its entity."),
                  Field::needed("horizon", luminance_schema(),
                                "The light from the horizon. Above it, the light changes with the sine of "
                                "the elevation."),
                  Field::optional("ground", luminance_schema(),
                                  "The light from below the horizon. Left out: none.")}));
  return Schema::choice("kind", std::move(kinds));
}

KnownNames read_materials(const Value* list, World& world, Diagnostics& diagnostics) {
  return read_all(list, "material", world.materials, read_material, diagnostics);
}

KnownNames read_lights(const Value* list, World& world, Diagnostics& diagnostics) {
  return read_all(list, "light", world.lights, read_light, diagnostics);
}

}  // namespace hil::config
