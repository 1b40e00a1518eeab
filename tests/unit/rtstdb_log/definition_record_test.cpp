// Records of materials and lights: each property, what older programs wrote, and what no database wrote.

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/log/record.hpp"
#include "rtstdb/log/stored_row.hpp"

namespace rtstdb::log::test {
namespace {

using Bytes = std::vector<std::byte>;

template <class Value>
Bytes bytes_of(const LoggedDefinition<Value>& definition) {
  Bytes bytes(definition_bytes(definition));
  encode_definition(definition, bytes);
  return bytes;
}

/// Each with one property, or one channel, that differs from the default, at a limit where it can.
std::vector<Material> materials() {
  return {{},
          {.reflectance = 0.0},
          {.retro_gain = max_retro_gain},
          {.base_color{0.0, 0.8, 0.8}},
          {.base_color{0.8, 0.25, 0.8}},
          {.base_color{0.8, 0.8, 1.0}},
          {.metallic = 1.0},
          {.roughness = 0.0},
          {.emission_cdpm2{max_luminance_cdpm2, 0.0, 0.0}},
          {.emission_cdpm2{0.0, 0.5, 0.0}},
          {.emission_cdpm2{0.0, 0.0, 2.0}},
          {.transmission = 1.0},
          {.refractive_index = max_refractive_index}};
}

std::vector<Light> lights() {
  const Light sun{.kind = LightKind::directional, .illuminance_lx = 1e5, .angular_diameter_rad = 0.01};
  const Light lamp{.kind = LightKind::point, .intensity_cd = 100.0};
  const Light beam{
      .kind = LightKind::spot, .intensity_cd = 5.0, .inner_angle_rad = 0.25, .outer_angle_rad = 0.5};
  std::vector<Light> all{sun, lamp, beam, {.kind = LightKind::sky}};
  for (const auto member : {&Light::zenith_cdpm2, &Light::horizon_cdpm2, &Light::ground_cdpm2})
    for (int k = 0; k < 3; ++k) {
      all.push_back({.kind = LightKind::sky});
      (all.back().*member)[k] = max_luminance_cdpm2;
    }
  for (int k = 0; k < 3; ++k) {
    all.push_back(lamp);
    all.back().color[k] = 0.0;
  }
  return all;
}

template <class Value>
void expect_round_trip(const LoggedDefinition<Value>& definition, RecordKind kind,
                       LoggedDefinition<Value> Record::*member) {
  RecordDecoder decoder;
  ASSERT_EQ(decoder.decode(bytes_of(definition)), nullptr);
  EXPECT_EQ(decoder.record().kind, kind);
  const LoggedDefinition<Value>& back = decoder.record().*member;
  EXPECT_EQ(back.id, definition.id);
  EXPECT_EQ(back.name, definition.name);
  EXPECT_EQ(back.value, definition.value);
}

TEST(LogDefinition, EachPropertyRoundTrips) {
  for (const Material& material : materials()) {
    ASSERT_TRUE(validate_material(material).ok());
    expect_round_trip({{7}, "paint", material}, RecordKind::material, &Record::material);
  }
  for (const Light& light : lights()) {
    ASSERT_TRUE(validate_light(light).ok()) << validate_light(light).error().message;
    expect_round_trip({{0}, "lamp", light}, RecordKind::light, &Record::light);
  }
}

TEST(LogDefinition, NamesRoundTrip) {
  for (const std::size_t length : {0, 1, 7, 8, 9, 4096}) {
    const std::string name(length, 'x');
    expect_round_trip({{max_materials - 1}, name, Material{.roughness = 0.5}}, RecordKind::material,
                      &Record::material);
    expect_round_trip({{max_lights - 1}, name, Light{.intensity_cd = 1.0}}, RecordKind::light,
                      &Record::light);
  }
}

TEST(LogDefinition, DefaultPropertiesTakeNoBytes) {
  const std::size_t empty = bytes_of(LoggedMaterial{{7}, "", {}}).size();
  for (const Material& material : materials()) {
    const std::size_t properties = material == Material{} ? 0 : 1;
    EXPECT_EQ(bytes_of(LoggedMaterial{{7}, "", material}).size(),
              empty + properties * sizeof(StoredProperty));
  }
}

/// The bytes of a record with the numbers that programs before images knew: 1 reflectance, 2 retro_gain.
Bytes old_material_record() {
  struct OldRecord {
    std::uint16_t kind = 6, omitted_words = 0;
    std::uint32_t bytes = sizeof(OldRecord);
    std::uint32_t index = 1, properties = 2, name_bytes = 4, reserved = 0;
    std::uint32_t first = 1, reserved_of_first = 0;
    double reflectance = 0.25;
    std::uint32_t second = 2, reserved_of_second = 0;
    double retro_gain = 300.0;
    char name[8] = {'f', 'o', 'i', 'l'};
  };
  const OldRecord record;
  Bytes bytes(sizeof record);
  std::memcpy(bytes.data(), &record, sizeof record);
  return bytes;
}

TEST(LogDefinition, MaterialOfAnOlderProgramHasDefaultsForNewProperties) {
  RecordDecoder decoder;
  ASSERT_EQ(decoder.decode(old_material_record()), nullptr);
  const LoggedMaterial& material = decoder.record().material;
  EXPECT_EQ(material.value, (Material{.reflectance = 0.25, .retro_gain = 300.0}));
  EXPECT_EQ(material.name, "foil");
  EXPECT_EQ(bytes_of(material), old_material_record()) << "and is written with the same bytes";
}

TEST(LogDefinition, RowWithoutALightHasTheBytesOfOlderPrograms) {
  EntityRow row;
  row.material = {4095};
  Bytes bytes(row_bytes);
  const auto material_word = [&] {
    ByteWriter writer(bytes);
    put_row(writer, row);
    std::uint32_t word = 0;  // older programs have 32 bits for the material
    std::memcpy(&word, bytes.data() + 28, sizeof word);
    return word;
  };
  EXPECT_EQ(material_word(), 4095u);
  row.light = {0};
  EXPECT_GE(material_word(), max_materials) << "older programs refuse a row with a light";
  row.light = {max_lights - 1};
  EXPECT_GE(material_word(), max_materials);
}

/// The fault of a record with other bytes in its body.
class ChangedRecord {
 public:
  explicit ChangedRecord(Bytes bytes) : bytes_(std::move(bytes)) {}
  template <class Value>
  std::string refusal(std::size_t offset, Value value) const {
    Bytes changed = bytes_;
    std::memcpy(changed.data() + sizeof(RecordHeader) + offset, &value, sizeof value);
    RecordDecoder decoder;
    const char* fault = decoder.decode(changed);
    return fault != nullptr ? fault : "";
  }

 private:
  Bytes bytes_;
};

constexpr std::size_t first_property = sizeof(StoredDefinition);
constexpr std::size_t second_property = first_property + sizeof(StoredProperty);

TEST(LogDefinition, MaterialThatNoDatabaseWroteIsRefused) {
  const ChangedRecord record(
      bytes_of(LoggedMaterial{{7}, "abc", {.reflectance = 0.25, .retro_gain = 300.0}}));
  EXPECT_EQ(record.refusal(0, std::uint32_t{7}), "") << "unchanged";
  EXPECT_EQ(record.refusal(0, std::uint32_t{0}), "a material has invalid values") << "the default material";
  EXPECT_EQ(record.refusal(0, max_materials), "a material's index is beyond the limit");
  EXPECT_EQ(record.refusal(4, std::uint32_t{1u << 20}), "a material has too many properties");
  EXPECT_EQ(record.refusal(8, std::uint32_t{4097}), "a material's name is too long");
  EXPECT_EQ(record.refusal(8, std::uint32_t{9}), "a material's name is cut short");
  EXPECT_EQ(record.refusal(8, std::uint32_t{2}), "a material's name is not padded with zeros");
  EXPECT_EQ(record.refusal(12, std::uint32_t{1}), "a material has invalid values") << "it has no kind";
  EXPECT_EQ(record.refusal(second_property, std::uint32_t{99}),
            "a material has a property that this version of rtstdb does not know");
  EXPECT_EQ(record.refusal(second_property, std::uint32_t{1}),
            "a material's properties have invalid numbers");
  EXPECT_EQ(record.refusal(first_property + 8, 1.0), "a material has invalid values")
      << "the default is left out";
  EXPECT_EQ(record.refusal(first_property + 8, 1.5), "a material has invalid values");
  EXPECT_EQ(record.refusal(second_property + 8, 0.5), "a material has invalid values");
}

TEST(LogDefinition, LightThatNoDatabaseWroteIsRefused) {
  const ChangedRecord record(bytes_of(
      LoggedLight{{7}, "abc", {.kind = LightKind::spot, .intensity_cd = 5.0, .outer_angle_rad = 0.5}}));
  EXPECT_EQ(record.refusal(0, std::uint32_t{7}), "") << "unchanged";
  EXPECT_EQ(record.refusal(0, std::uint32_t{0}), "") << "no light exists in every database";
  EXPECT_EQ(record.refusal(0, max_lights), "a light's index is beyond the limit");
  EXPECT_EQ(record.refusal(4, std::uint32_t{1u << 20}), "a light has too many properties");
  EXPECT_EQ(record.refusal(8, std::uint32_t{4097}), "a light's name is too long");
  EXPECT_EQ(record.refusal(12, std::uint32_t{0}), "a light has invalid values") << "no kind";
  EXPECT_EQ(record.refusal(12, std::uint32_t{5}), "a light has invalid values") << "an unknown kind";
  EXPECT_EQ(record.refusal(12, std::uint32_t{1}), "a light has invalid values")
      << "a directional light has no intensity";
  EXPECT_EQ(record.refusal(second_property, std::uint32_t{99}),
            "a light has a property that this version of rtstdb does not know");
  EXPECT_EQ(record.refusal(second_property, std::uint32_t{1}), "a light's properties have invalid numbers");
  EXPECT_EQ(record.refusal(first_property + 4, std::uint32_t{1}),
            "a light's properties have invalid numbers");
  EXPECT_EQ(record.refusal(first_property + 8, 0.0), "a light has invalid values")
      << "the default is left out";
  EXPECT_EQ(record.refusal(first_property + 8, -1.0), "a light has invalid values");
  EXPECT_EQ(record.refusal(second_property + 8, 4.0), "a light has invalid values");
}

TEST(LogDefinition, TruncatedRecordIsRefused) {
  const Bytes bytes = bytes_of(LoggedLight{{7}, "abc", {.intensity_cd = 5.0}});
  for (std::uint32_t count = sizeof(RecordHeader); count < bytes.size(); count += 8) {
    Bytes cut(bytes.begin(), bytes.begin() + count);
    std::memcpy(cut.data() + 4, &count, sizeof count);  // the length in the header
    RecordDecoder decoder;
    EXPECT_NE(decoder.decode(cut), nullptr) << count;
  }
}

}  // namespace
}  // namespace rtstdb::log::test
