// The registered types of bus and their descriptions.

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>
#include <string>
#include <vector>

#include "runtime/buses/bus.hpp"
#include "runtime/contract/schema_node.hpp"
#include "runtime/report/report_json.hpp"

namespace hil::buses {
namespace {

TEST(BusTypes, HaveTheNamesOfTheirFoldersEachOnce) {
  std::vector<std::string> keys;
  for (const BusType& type : bus_types())
    keys.push_back(type.section.key);
  const std::vector<std::string> folders{
#define BUS(folder) #folder,
#include "runtime/buses/table.def"
#undef BUS
  };
  EXPECT_EQ(keys, folders);
  EXPECT_EQ(std::set(folders.begin(), folders.end()).size(), folders.size());
}

TEST(BusTypes, DescribeThemselvesCompletely) {
  for (const BusType& type : bus_types()) {
    const config::BusSectionType& section = type.section;
    for (const std::string& word : {section.about, section.noun, section.plural, type.title})
      EXPECT_FALSE(word.empty()) << section.key;
    for (const char* key : {section.name_key.c_str(), "rate", "may_be_lost"})
      EXPECT_NE(section.entry.node().field(key), nullptr) << section.key << " lacks " << key;
    ASSERT_NE(section.create, nullptr);
    EXPECT_NE(section.create(), nullptr);
    EXPECT_NE(type.wire, nullptr);
    EXPECT_FALSE(type.columns.empty()) << section.key;
  }
}

TEST(BusTypes, HaveKeysThatNoOtherPartOfTheReportUses) {
  const auto report = nlohmann::json::parse(report::report_json({}));
  for (const BusType& type : bus_types())
    EXPECT_FALSE(report.contains(type.section.key)) << type.section.key;
}

TEST(BusTypes, AreFoundByTheirSections) {
  ASSERT_EQ(section_types().size(), bus_types().size());
  for (std::size_t i = 0; i < bus_types().size(); ++i) {
    const auto section = section_types()[i].create();
    section->type = &section_types()[i];
    EXPECT_EQ(&type_of(*section), &bus_types()[i]);
  }
}

}  // namespace
}  // namespace hil::buses
