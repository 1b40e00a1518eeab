#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using buses::modbus::load_register_map;
using io::modbus::Role;
using test::is_only_mistake;
using tests::TemporaryFolder;

Diagnostics mistakes_of(const std::string& text, Role role = Role::client) {
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  EXPECT_FALSE(load_register_map(folder.write("map.yaml", text), role, diagnostics)) << text;
  return diagnostics;
}

TEST(RegisterMapFile, IsReadAsWritten) {
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  const auto map =
      load_register_map(folder.write("map.yaml", test::register_map_text), Role::client, diagnostics);
  ASSERT_TRUE(map) << diagnostics.to_text();
  ASSERT_EQ(map->entries.size(), 5U);
  const io::modbus::RegisterEntry& time = map->entries[1];
  EXPECT_EQ(time.name, "time_ms");
  EXPECT_EQ(time.table, io::modbus::Table::holding);
  EXPECT_EQ(time.address, 10);
  EXPECT_EQ(time.type, io::modbus::ValueType::u32);
  EXPECT_EQ(time.order, io::modbus::ByteOrder::cdab);
  EXPECT_EQ(time.unit, "ms");
  EXPECT_TRUE(time.writable);
  const io::modbus::RegisterEntry& light = map->entries[3];
  EXPECT_EQ(light.table, io::modbus::Table::input);
  EXPECT_EQ(light.type, io::modbus::ValueType::i16);
  EXPECT_EQ(light.scale, 0.5);
  EXPECT_EQ(light.offset, -1.0);
  EXPECT_EQ(light.minimum, -2.0);
  EXPECT_EQ(light.maximum, 9.0);
  EXPECT_FALSE(light.writable);
  EXPECT_EQ(map->entries[4].type, io::modbus::ValueType::boolean);
  EXPECT_EQ(map->entries[4].table, io::modbus::Table::discrete_input);
}

TEST(RegisterMapFile, AcceptsEveryTypeAndWordOrder) {
  const TemporaryFolder folder;
  for (const char* type : {"u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"}) {
    for (const char* order : {"ABCD", "CDAB", "BADC", "DCBA"}) {
      Diagnostics diagnostics;
      const auto map = load_register_map(
          folder.write(
              "map.yaml",
              std::string("registers: [{name: r, table: holding, address: 0x10, access: read, type: ") +
                  type + ", word_order: " + order + "}]"),
          Role::client, diagnostics);
      ASSERT_TRUE(map) << diagnostics.to_text();
      EXPECT_EQ(io::modbus::to_text(map->entries[0].type), type);
      EXPECT_EQ(io::modbus::to_text(map->entries[0].order), order);
      EXPECT_EQ(map->entries[0].address, 16);
    }
  }
}

TEST(RegisterMapFile, MistakesHavePlaces) {
  const std::tuple<const char*, std::uint32_t, const char*> mistakes[] = {
      {"{name: a, table: holding, address: 9, type: u16, access: read}", 10,
       "'a' is given twice; first in line 2"},
      {"{name: b, table: holding, address: 1, type: u16, access: read}", 3, "overlaps"},
      {"{name: b, table: input, address: 1, type: u16, access: write}", 3, "can not write the table input"},
      {"{name: b, table: coil, address: 1, type: u16, access: write}", 3, "single bits"},
      {"{name: b, table: input, address: 70000, type: u16, access: read}", 36, "from 0 to 65535"},
      {"{name: b, table: input, address: 1, type: u17, access: read}", 45, "did you mean"},
  };
  for (const auto& [entry, column, words] : mistakes)
    EXPECT_TRUE(is_only_mistake(
        mistakes_of("registers:\n- {name: a, table: holding, address: 0, type: u32, access: write}\n- " +
                    std::string(entry) + "\n"),
        3, column, words));
  EXPECT_TRUE(is_only_mistake(mistakes_of("registers: []\n"), 1, 12, "at least 1"));
}

TEST(RegisterMapFile, IsCheckedForItsRole) {
  const std::string text = "registers: [{name: a, table: input, address: 0, type: u16, access: read}]\n";
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  EXPECT_TRUE(load_register_map(folder.write("map.yaml", text), Role::client, diagnostics))
      << diagnostics.to_text();
  EXPECT_TRUE(is_only_mistake(mistakes_of(text, Role::server), 1, 13, "no client can write the table input"));
}

}  // namespace
}  // namespace hil::config
