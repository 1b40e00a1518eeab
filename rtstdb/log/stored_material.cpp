#include "rtstdb/log/stored_material.hpp"

#include <algorithm>
#include <array>

#include <rtstdb/limits.hpp>

namespace rtstdb::log {
namespace {

struct Property {
  MaterialProperty number;
  double Material::*member;
};
/// By ascending number.
constexpr std::array properties{Property{MaterialProperty::reflectance, &Material::reflectance},
                                Property{MaterialProperty::retro_gain, &Material::retro_gain}};

bool is_stored(const Material& material, const Property& property) noexcept {
  return material.*property.member != Material{}.*property.member;
}

std::uint32_t count_stored(const Material& material) noexcept {
  return static_cast<std::uint32_t>(
      std::ranges::count_if(properties, [&](const Property& one) { return is_stored(material, one); }));
}

const char* set_property(Material& material, const StoredProperty& stored) noexcept {
  const auto known = std::ranges::find(properties, stored.property, &Property::number);
  if (known == properties.end()) return "a material has a property that this version of rtstdb does not know";
  material.*known->member = stored.value;
  return nullptr;
}

}  // namespace

std::size_t stored_material_bytes(const LoggedMaterial& material) noexcept {
  return sizeof(StoredMaterial) + count_stored(material.material) * sizeof(StoredProperty) +
         round_up(material.name.size(), 8);
}

void put_material(ByteWriter& writer, const LoggedMaterial& material) noexcept {
  RTSTDB_ASSERT(material.name.size() <= max_name_bytes);
  writer.put(StoredMaterial{material.id.index, count_stored(material.material),
                            static_cast<std::uint32_t>(material.name.size()), 0});
  for (const Property& property : properties)
    if (is_stored(material.material, property))
      writer.put(StoredProperty{property.number, 0, material.material.*property.member});
  writer.put_bytes(std::as_bytes(std::span(material.name)));
  writer.pad_to(8);
}

const char* get_material(ByteReader& reader, LoggedMaterial& material) {
  StoredMaterial stored;
  if (!reader.get(stored)) return "a material is cut short";
  if (const char* fault = check_material_index(stored.index)) return fault;
  if (stored.index == 0 || stored.reserved != 0) return "a material has invalid values";
  if (stored.properties > max_material_properties) return "a material has too many properties";
  material.id = {stored.index};
  material.material = {};
  auto previous = MaterialProperty{};
  for (std::uint32_t k = 0; k < stored.properties; ++k) {
    StoredProperty property;
    if (!reader.get(property)) return "a material is cut short";
    if (property.property <= previous || property.reserved != 0)
      return "a material's properties have invalid numbers";
    previous = property.property;
    if (const char* fault = set_property(material.material, property)) return fault;
  }
  if (count_stored(material.material) != stored.properties || !validate(material.material))
    return "a material has invalid values";
  if (stored.name_bytes > max_name_bytes) return "a material's name is too long";
  std::span<const std::byte> name;
  if (!reader.get_bytes(stored.name_bytes, name)) return "a material's name is cut short";
  material.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return reader.skip_padding(8) ? nullptr : "a material's name is not padded with zeros";
}

const char* check_material_index(std::uint32_t index) noexcept {
  return index < max_materials ? nullptr : "a material's index is beyond the limit";
}

}  // namespace rtstdb::log
