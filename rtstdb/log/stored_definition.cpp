#include "rtstdb/log/stored_definition.hpp"

#include <algorithm>
#include <array>

namespace rtstdb::log {
namespace {

/// A number that a definition has besides its kind: a member, or a component of one.
template <class Value>
struct Property {
  constexpr Property(std::uint32_t property_number, double Value::*member)
      : number(property_number), scalar(member) {}
  constexpr Property(std::uint32_t property_number, glm::dvec3 Value::*member, int member_component)
      : number(property_number), vector(member), component(member_component) {}
  double& in(Value& value) const noexcept {
    return scalar != nullptr ? value.*scalar : (value.*vector)[component];
  }
  double in(const Value& value) const noexcept {
    return scalar != nullptr ? value.*scalar : (value.*vector)[component];
  }
  bool is_stored(const Value& value) const noexcept { return in(value) != in(Value{}); }

  std::uint32_t number;
  double Value::*scalar = nullptr;
  glm::dvec3 Value::*vector = nullptr;
  int component = 0;
};

struct Faults {
  const char *cut_short, *index_beyond_limit, *invalid_values, *too_many_properties, *invalid_numbers,
      *unknown_property, *long_name, *cut_name, *bad_padding;
};

template <class Value>
struct Form;

template <>
struct Form<Material> {
  /// By ascending number. A number is never used again for another property.
  static constexpr std::array properties{
      Property{1, &Material::reflectance},       Property{2, &Material::retro_gain},
      Property{3, &Material::base_color, 0},     Property{4, &Material::base_color, 1},
      Property{5, &Material::base_color, 2},     Property{6, &Material::metallic},
      Property{7, &Material::roughness},         Property{8, &Material::emission_cdpm2, 0},
      Property{9, &Material::emission_cdpm2, 1}, Property{10, &Material::emission_cdpm2, 2},
      Property{11, &Material::transmission},     Property{12, &Material::refractive_index}};
  static constexpr Faults faults{"a material is cut short",
                                 "a material's index is beyond the limit",
                                 "a material has invalid values",
                                 "a material has too many properties",
                                 "a material's properties have invalid numbers",
                                 "a material has a property that this version of rtstdb does not know",
                                 "a material's name is too long",
                                 "a material's name is cut short",
                                 "a material's name is not padded with zeros"};
  static std::uint32_t kind_of(const Material& /*material*/) noexcept { return 0; }
  static bool set_kind(Material& /*material*/, std::uint32_t kind) noexcept { return kind == 0; }
  static bool is_valid(const Material& material) { return validate_material(material).ok(); }
};

template <>
struct Form<Light> {
  /// As of materials.
  static constexpr std::array properties{
      Property{1, &Light::color, 0},          Property{2, &Light::color, 1},
      Property{3, &Light::color, 2},          Property{4, &Light::illuminance_lx},
      Property{5, &Light::intensity_cd},      Property{6, &Light::inner_angle_rad},
      Property{7, &Light::outer_angle_rad},   Property{8, &Light::angular_diameter_rad},
      Property{9, &Light::zenith_cdpm2, 0},   Property{10, &Light::zenith_cdpm2, 1},
      Property{11, &Light::zenith_cdpm2, 2},  Property{12, &Light::horizon_cdpm2, 0},
      Property{13, &Light::horizon_cdpm2, 1}, Property{14, &Light::horizon_cdpm2, 2},
      Property{15, &Light::ground_cdpm2, 0},  Property{16, &Light::ground_cdpm2, 1},
      Property{17, &Light::ground_cdpm2, 2},  Property{18, &Light::p_m, 0},
      Property{19, &Light::p_m, 1},           Property{20, &Light::p_m, 2}};
  static constexpr Faults faults{"a light is cut short",
                                 "a light's index is beyond the limit",
                                 "a light has invalid values",
                                 "a light has too many properties",
                                 "a light's properties have invalid numbers",
                                 "a light has a property that this version of rtstdb does not know",
                                 "a light's name is too long",
                                 "a light's name is cut short",
                                 "a light's name is not padded with zeros"};
  // The enumerators of LightKind in the log.
  static constexpr std::array kinds{LightKind::directional, LightKind::point, LightKind::spot,
                                    LightKind::sky};
  static std::uint32_t kind_of(const Light& light) noexcept {
    return static_cast<std::uint32_t>(std::ranges::find(kinds, light.kind) - kinds.begin()) + 1;
  }
  static bool set_kind(Light& light, std::uint32_t kind) noexcept {
    if (kind == 0 || kind > kinds.size()) return false;
    light.kind = kinds[kind - 1];
    return true;
  }
  static bool is_valid(const Light& light) { return validate_light(light).ok(); }
};

template <class Value>
std::uint32_t count_stored(const Value& value) noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      Form<Value>::properties, [&](const Property<Value>& one) { return one.is_stored(value); }));
}

/// False: the property is unknown.
template <class Value>
bool set_property(Value& value, const StoredProperty& stored) noexcept {
  const auto& properties = Form<Value>::properties;
  const auto known = std::ranges::find(properties, stored.property, &Property<Value>::number);
  if (known == properties.end()) return false;
  known->in(value) = stored.value;
  return true;
}

template <class Value>
const char* get_properties(ByteReader& reader, std::uint32_t count, Value& value) {
  constexpr const Faults& faults = Form<Value>::faults;
  std::uint32_t previous = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    StoredProperty property;
    if (!reader.get(property)) return faults.cut_short;
    if (property.property <= previous || property.reserved != 0) return faults.invalid_numbers;
    previous = property.property;
    if (!set_property(value, property)) return faults.unknown_property;
  }
  return count_stored(value) == count && Form<Value>::is_valid(value) ? nullptr : faults.invalid_values;
}

}  // namespace

template <class Value>
std::size_t stored_definition_bytes(const LoggedDefinition<Value>& definition) noexcept {
  return sizeof(StoredDefinition) + count_stored(definition.value) * sizeof(StoredProperty) +
         round_up(definition.name.size(), 8);
}

template <class Value>
void put_definition(ByteWriter& writer, const LoggedDefinition<Value>& definition) noexcept {
  RTSTDB_ASSERT(definition.name.size() <= max_name_bytes, "the name is longer than max_name_bytes");
  writer.put(StoredDefinition{definition.id.index, count_stored(definition.value),
                              static_cast<std::uint32_t>(definition.name.size()),
                              Form<Value>::kind_of(definition.value)});
  for (const Property<Value>& property : Form<Value>::properties)
    if (property.is_stored(definition.value))
      writer.put(StoredProperty{property.number, 0, property.in(definition.value)});
  writer.put_bytes(std::as_bytes(std::span(definition.name)));
  writer.pad_to(8);
}

template <class Value>
const char* get_definition(ByteReader& reader, LoggedDefinition<Value>& definition) {
  using Kind = store::DefinitionKind<Value>;
  constexpr const Faults& faults = Form<Value>::faults;
  StoredDefinition stored;
  if (!reader.get(stored)) return faults.cut_short;
  if (stored.index >= Kind::capacity) return faults.index_beyond_limit;
  definition.id = {stored.index};
  definition.value = {};
  if (stored.index < Kind::first_added || !Form<Value>::set_kind(definition.value, stored.kind))
    return faults.invalid_values;
  if (stored.properties > max_definition_properties) return faults.too_many_properties;
  if (const char* fault = get_properties(reader, stored.properties, definition.value)) return fault;
  if (stored.name_bytes > max_name_bytes) return faults.long_name;
  std::span<const std::byte> name;
  if (!reader.get_bytes(stored.name_bytes, name)) return faults.cut_name;
  definition.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return reader.skip_padding(8) ? nullptr : faults.bad_padding;
}

template std::size_t stored_definition_bytes(const LoggedMaterial&) noexcept;
template std::size_t stored_definition_bytes(const LoggedLight&) noexcept;
template void put_definition(ByteWriter&, const LoggedMaterial&) noexcept;
template void put_definition(ByteWriter&, const LoggedLight&) noexcept;
template const char* get_definition(ByteReader&, LoggedMaterial&);
template const char* get_definition(ByteReader&, LoggedLight&);

const char* check_material_index(std::uint32_t index) noexcept {
  return index < max_materials ? nullptr : Form<Material>::faults.index_beyond_limit;
}

const char* check_light_index(std::uint32_t index) noexcept {
  const bool possible = index < max_lights || !LightId{index}.valid();
  return possible ? nullptr : Form<Light>::faults.index_beyond_limit;
}

}  // namespace rtstdb::log
