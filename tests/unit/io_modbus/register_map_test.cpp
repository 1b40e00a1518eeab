#include "io/modbus/register_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "registers.hpp"

namespace hil::io::modbus {
namespace {

using test::entry;

std::vector<std::string> mistakes_of(RegisterEntry one, Role role = Role::client) {
  return mistakes_in(RegisterMap{{std::move(one)}}, role);
}

TEST(RegisterMap, ValidMapHasNoMistakes) {
  const RegisterMap map{{entry("a", Table::holding, 0, ValueType::u32, true),
                         entry("b", Table::holding, 2, ValueType::f64, true),
                         entry("c", Table::holding, 65535, ValueType::u16, false),
                         entry("d", Table::input, 0, ValueType::i16, false),
                         entry("e", Table::coil, 0, ValueType::boolean, true),
                         entry("f", Table::discrete_input, 0, ValueType::boolean, false)}};
  EXPECT_EQ(mistakes_in(map, Role::client), std::vector<std::string>{});
  EXPECT_EQ(map.find("d"), &map.entries[3]);
  EXPECT_EQ(map.find("missing"), nullptr);
}

struct Case {
  const char* what;
  std::function<void(RegisterEntry&)> change;
  Role role;
  const char* sentence;
};

TEST(RegisterMap, ReportsEachMistakeWithItsValues) {
  const std::vector<Case> cases{
      {"no name", [](RegisterEntry& e) { e.name.clear(); }, Role::client,
       "register 1 (without a name): a register needs a name"},
      {"bits", [](RegisterEntry& e) { e.table = Table::coil; }, Role::client,
       "register speed: the table coil holds single bits, not u32; its type has to be bool"},
      {"end", [](RegisterEntry& e) { e.address = 65535; }, Role::client,
       "register speed: a u32 at address 65535 ends beyond the last address, 65535"},
      {"input", [](RegisterEntry& e) { e.table = Table::input; }, Role::client,
       "register speed: a client can not write the table input; only coil and holding can be written"},
      {"server input",
       [](RegisterEntry& e) {
         e.table = Table::input;
         e.writable = false;
       },
       Role::server,
       "register speed: no client can write the table input, so hil can not read it as a server; only coil "
       "and holding "
       "can be written"},
      {"scale", [](RegisterEntry& e) { e.scale = 0.0; }, Role::client,
       "register speed: scale is 0; it has to be a finite number other than 0"},
      {"offset", [](RegisterEntry& e) { e.offset = std::numeric_limits<double>::infinity(); }, Role::client,
       "register speed: offset is inf; it has to be a finite number"},
      {"range",
       [](RegisterEntry& e) {
         e.minimum = 3.0;
         e.maximum = 2.5;
       },
       Role::client, "register speed: minimum 3 is not at or below maximum 2.5"},
      {"safe", [](RegisterEntry& e) { e.safe_value = -1.0; }, Role::client,
       "register speed: safe value -1 does not fit between minimum -inf and maximum inf and into the type "
       "u32"}};
  for (const Case& one : cases) {
    RegisterEntry changed = entry("speed", Table::holding, 10, ValueType::u32, true);
    one.change(changed);
    EXPECT_EQ(mistakes_of(changed, one.role), std::vector<std::string>{one.sentence}) << one.what;
  }
}

TEST(RegisterMap, NamesTheEntriesThatARequestTouches) {
  const RegisterMap map{{entry("a", Table::holding, 10, ValueType::u32, true),
                         entry("b", Table::holding, 12, ValueType::u16, true),
                         entry("c", Table::input, 11, ValueType::u16, false),
                         entry("d", Table::holding, 13, ValueType::u16, true),
                         entry("e", Table::holding, 20, ValueType::u16, true)}};
  EXPECT_EQ(text_of({true, Table::holding, 11, 1}, map), "writing a (holding 11)");
  EXPECT_EQ(text_of({false, Table::holding, 11, 3}, map), "reading a, b, d (holding 11..13)");
  EXPECT_EQ(text_of({false, Table::holding, 0, 100}, map), "reading a, b, d and 1 more (holding 0..99)");
  EXPECT_EQ(text_of({false, Table::input, 0, 12}, map), "reading c (input 0..11)");
  EXPECT_EQ(text_of({false, Table::holding, 14, 6}, map), "reading holding 14..19");
  EXPECT_EQ(text_of({true, Table::holding, 65535, 2}, map), "writing holding 65535..65536");
}

TEST(RegisterMap, RefusesNan) {
  for (double RegisterEntry::*field : {&RegisterEntry::scale, &RegisterEntry::offset, &RegisterEntry::minimum,
                                       &RegisterEntry::maximum, &RegisterEntry::safe_value}) {
    RegisterEntry changed = entry("speed", Table::holding, 10, ValueType::u32, true);
    changed.*field = std::nan("");
    EXPECT_EQ(mistakes_of(changed).size(), 1U);
  }
}

TEST(RegisterMap, ReportsRepeatedNamesAndOverlaps) {
  const RegisterMap map{{entry("a", Table::holding, 10, ValueType::u32, true),
                         entry("b", Table::holding, 11, ValueType::u16, true),
                         entry("a", Table::input, 11, ValueType::u16, false)}};
  const std::vector<std::string> expected{"register a: the name is used twice, by entries 1 and 3",
                                          "register b (holding 11) overlaps register a (holding 10..11)"};
  EXPECT_EQ(mistakes_in(map, Role::client), expected);
}

TEST(RegisterMap, OverlapsAreFoundExactlyWhenTwoEntriesShareAnAddress) {
  std::mt19937 random(5);
  const std::array types{ValueType::u16, ValueType::u32, ValueType::u64};
  int with = 0;
  for (int round = 0; round < 2000; ++round) {
    RegisterMap map;
    for (std::size_t i = 0; i < 5; ++i) {
      map.entries.push_back(entry(test::numbered("r", i), random() % 2 == 0 ? Table::holding : Table::input,
                                  static_cast<std::uint16_t>(random() % 24), types[random() % types.size()],
                                  false));
    }
    bool shared = false;
    for (std::size_t a = 0; a < map.entries.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const RegisterEntry& x = map.entries[a];
        const RegisterEntry& y = map.entries[b];
        for (int i = 0; i < width_of(x.type); ++i) {
          shared = shared || (x.table == y.table && x.address + i >= y.address &&
                              x.address + i < y.address + width_of(y.type));
        }
      }
    }
    with += shared ? 1 : 0;
    ASSERT_EQ(!mistakes_in(map, Role::client).empty(), shared) << "round " << round;
  }
  EXPECT_GT(with, 100);
  EXPECT_LT(with, 1990);
}

}  // namespace
}  // namespace hil::io::modbus
