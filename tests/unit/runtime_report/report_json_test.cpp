#include "runtime/report/report_json.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "hostile_text.hpp"
#include "runtime/report/file_checksum.hpp"
#include "runtime/report/text_safety.hpp"
#include "sample_record.hpp"
#include "tests/paths.h"

namespace hil::report {
namespace {

using Json = nlohmann::json;

/// All keys of the JSON, at any depth.
void add_keys(const Json& json, std::set<std::string>& keys) {
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) keys.insert(key);
    if (value.is_structured()) add_keys(value, keys);
  }
}

/// The words in backquotes of a chapter of a document in Markdown.
std::set<std::string> words_in_backquotes(const std::filesystem::path& file, const std::string& chapter) {
  std::ifstream lines(file);
  std::set<std::string> words;
  bool is_in_chapter = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) is_in_chapter = line == "## " + chapter;
    if (!is_in_chapter) continue;
    static const std::regex word("`([a-z][a-z0-9_]*)`");
    for (std::sregex_iterator at(line.begin(), line.end(), word), end; at != end; ++at)
      words.insert((*at)[1]);
  }
  return words;
}

TEST(ReportJson, HasTheDocumentedKeysAndNoOthers) {
  const std::string text = report_json(test::full_record());
  const Json json = Json::parse(text);
  std::set<std::string> keys;
  add_keys(json, keys);
  const std::set<std::string> documented =
      words_in_backquotes(HIL_SOURCE_DIR "/docs/guide/report.md", "report.json");
  ASSERT_GT(documented.size(), 100U);
  const std::set<std::string> values{"null",        "passed",     "completed",   "failed",  "timing_broken",
                                     "io_failed",   "gpu_failed", "interrupted", "refused", "held",
                                     "not_checked", "eventually", "response",    "max_age", "group",
                                     "sync",        "may_be_lost"};
  for (const std::string& word : documented) {
    if (!values.contains(word)) {
      EXPECT_TRUE(keys.contains(word)) << word << " is documented, but no key of the file";
    }
  }
  for (const std::string& key : keys)
    EXPECT_TRUE(documented.contains(key)) << key << " is not documented";
  EXPECT_EQ(json.at("schema_version"), schema_version);
  EXPECT_EQ(json.at("verdict"), "failed");
  EXPECT_EQ(json.at("tasks").at(0).at("misses").at(0).at("lateness_ns"), 402'113);
}

TEST(ReportJson, ListsOfModulesKeepTheirValues) {
  RunRecord record;
  record.lists = {{.list = "pumps",
                   .name = "p",
                   .properties = {{"on", true},
                                  {"starts", std::int64_t{-3}},
                                  {"flow", 0.25},
                                  {"unknown", not_known},
                                  {"position_m", std::vector<double>{1.0, -2.5}},
                                  {"state", std::string("running")}}},
                  {.list = "valves", .name = "v", .properties = {}},
                  {.list = "pumps", .name = "q", .properties = {}}};
  const std::string text = report_json(record);
  const auto lists = nlohmann::ordered_json::parse(text).at("lists");
  EXPECT_EQ(lists.dump(),
            R"({"pumps":[{"name":"p","on":true,"starts":-3,"flow":0.25,"unknown":null,)"
            R"("position_m":[1.0,-2.5],"state":"running"},{"name":"q"}],"valves":[{"name":"v"}]})");
  EXPECT_EQ(report_json(parse_report(text)), text);
  const std::string damaged = std::string(text).replace(text.find("\"lists\": {"), 10, "\"lists\": [");
  EXPECT_THROW(parse_report(damaged), ReportError);
}

TEST(WorldJson, IsReadBackToTheSameBytes) {
  WorldRecord world;
  world.scenario = "crossing";
  world.period_ns = 1'000'000;
  world.plugins = {{"pumps", "1.2.3", "/opt/hil/plugins/pumps.so", "00ff00ff00ff00ff"}};
  world.layers = {"ground", "vehicle"};
  world.entities = {{"house", 0, 1}, {"traffic.ego", 11, 3}};
  const std::vector<double> mount_m{1.5, -0.1, 0.85};
  world.modules = {{.list = "scanners",
                    .name = "scanner",
                    .properties = {{"mount_m", mount_m},
                                   {"columns", std::int64_t{480}},
                                   {"horizontal_rad", 2.44346},
                                   {"range_m", 120.0},
                                   {"ignore_motion", true}}},
                   {.list = "cameras", .name = "front", .properties = {}}};
  for (const WorldRecord& record : {WorldRecord{}, world}) {
    const std::string first = world_json(record);
    EXPECT_EQ(world_json(parse_world(first)), first);
  }
  const WorldRecord read = parse_world(world_json(world));
  ASSERT_EQ(read.modules.size(), 2U);
  EXPECT_EQ(read.modules[0].list, "scanners");
  EXPECT_EQ(read.modules[0].name, "scanner");
  ASSERT_EQ(read.modules[0].properties.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(read.modules[0].properties[i].key, world.modules[0].properties[i].key);
    EXPECT_EQ(read.modules[0].properties[i].value, world.modules[0].properties[i].value) << "to the bit";
  }
  EXPECT_EQ(read.modules[1].list, "cameras");
  std::string changed = world_json(world);
  changed.replace(changed.find("crossing"), 8, "Crossing");
  EXPECT_THROW(parse_world(changed), ReportError);
  try {
    parse_world(R"({"schema_version": 0})");
    FAIL() << "another version";
  } catch (const ReportError& error) {
    EXPECT_NE(std::string(error.what()).find("world.json: schema_version is 0"), std::string::npos)
        << error.what();
  }
}

TEST(ReportJson, IsReadBackToTheSameBytes) {
  for (const RunRecord& record : {RunRecord{}, test::full_record()}) {
    const std::string first = report_json(record);
    EXPECT_EQ(report_json(parse_report(first)), first);
  }
}

TEST(ReportJson, KeepsTheExtremeValuesOfEveryType) {
  RunRecord record;
  record.seed = std::numeric_limits<std::uint64_t>::max();
  record.duration_ns = std::numeric_limits<std::int64_t>::min();
  record.exit_code = std::numeric_limits<int>::min();
  record.expectations = {{"never", ExpectationResult::held, "", std::nullopt},
                         {"at zero", ExpectationResult::not_checked, "", 0}};
  const RunRecord again = parse_report(report_json(record));
  EXPECT_EQ(again.seed, record.seed);
  EXPECT_EQ(again.duration_ns, record.duration_ns);
  EXPECT_EQ(again.exit_code, record.exit_code);
  EXPECT_FALSE(again.expectations.at(0).first_failure_ns.has_value());
  EXPECT_EQ(again.expectations.at(1).first_failure_ns, 0);
  EXPECT_EQ(again.expectations.at(1).result, ExpectationResult::not_checked);
}

TEST(ReportJson, WritesNanAndInfinityAsNull) {
  RunRecord record = test::full_record();
  const auto load_of = [](RunRecord& of) -> double& {
    for (contribution::BusField& field : of.buses.at(0).buses.at(0).fields) {
      if (field.key == "bus_load_mean") return std::get<double>(field.value);
    }
    throw std::logic_error("no bus_load_mean");
  };
  load_of(record) = not_known;
  record.sections.at(0).pictures.at(0).dimensions.at(0).length_m = HUGE_VAL;
  record.top_view->scan_points.at(0).x_m = -HUGE_VAL;
  const std::string text = report_json(record);
  const Json json = Json::parse(text);
  EXPECT_TRUE(json.at("can").at(0).at("bus_load_mean").is_null());
  const Json picture = json.at("sections").at(0).at("pictures").at(0);
  EXPECT_TRUE(picture.at("dimensions").at(0).at("length_m").is_null());
  EXPECT_TRUE(json.at("top_view").at("scan_points").at(0).at(0).is_null());
  RunRecord again = parse_report(text);
  EXPECT_TRUE(std::isnan(load_of(again)));
  EXPECT_EQ(report_json(parse_report(text)), text);
}

TEST(ReportJson, KeepsBusesOfATypeThatTheProgramDoesNotHave) {
  RunRecord record;
  record.buses = {{.list_key = "semaphore",
                   .title = "Semaphores",
                   .name_key = "mast",
                   .columns = {{"mast", "Mast"}, {"signs", "Signs", true}},
                   .buses = {{.name = "hill",
                              .fields = {{"signs", std::uint64_t{3}}, {"share", 0.5}},
                              .faults = {{2, "2 signs were lost in fog"}},
                              .remarks = {{1, "1 sign was repeated"}}}}}};
  const RunRecord again = parse_report(report_json(record));
  EXPECT_EQ(report_json(again), report_json(record));
  ASSERT_EQ(again.buses.size(), 1U);
  EXPECT_EQ(again.buses[0].columns[1].title, "Signs");
  ASSERT_EQ(again.buses[0].buses.size(), 1U);
  const BusRecord& mast = again.buses[0].buses[0];
  EXPECT_EQ(mast.name, "hill");
  EXPECT_EQ(std::get<std::uint64_t>(mast.find("signs")->value), 3U);
  EXPECT_EQ(std::get<double>(mast.find("share")->value), 0.5);
  EXPECT_EQ(mast.faults.at(0).text, "2 signs were lost in fog");
  EXPECT_EQ(mast.remarks.at(0).count, 1U);
}

TEST(ReportJson, RoundsPointsToATenthOfAMillimetre) {
  RunRecord record = test::full_record();
  record.top_view->scan_points = {{1.23456789, -0.00001, 0.0, 0.123456789, 0.0, 3.0, 1}};
  const RunRecord again = parse_report(report_json(record));
  EXPECT_DOUBLE_EQ(again.top_view->scan_points.at(0).x_m, 1.2346);
  EXPECT_DOUBLE_EQ(again.top_view->scan_points.at(0).azimuth_rad, 0.123457);
  EXPECT_FALSE(std::signbit(again.top_view->scan_points.at(0).y_m));
}

TEST(ReportJson, KeepsHostileText) {
  RunRecord record;
  for (const std::string& text : test::hostile_texts())
    record.events.push_back({0, text});
  const std::string written = report_json(record);
  EXPECT_EQ(valid_utf8(written), written);
  const RunRecord again = parse_report(written);
  ASSERT_EQ(again.events.size(), record.events.size());
  for (std::size_t index = 0; index < record.events.size(); ++index) {
    EXPECT_EQ(again.events[index].text, valid_utf8(record.events[index].text));
  }
  EXPECT_EQ(report_json(again), written);
}

TEST(ReportJson, HasShortLines) {
  std::istringstream lines(report_json(test::full_record()));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    EXPECT_LE(line.size(), 260U) << line.substr(0, 80);
  EXPECT_GT(count, 500U);
}

std::string refusal(const std::string& text) {
  try {
    parse_report(text);
  } catch (const ReportError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ParseReport, RefusesWithThePlace) {
  const std::string good = report_json(test::full_record());
  Json json = Json::parse(good);
  json.erase("checksum");
  const auto refused_with = [&](const Json& changed, const char* expected) {
    const std::string error = refusal(with_checksum(changed.dump()));
    EXPECT_NE(error.find(expected), std::string::npos) << error;
  };
  EXPECT_NE(refusal("{\"a\": ").find("not JSON at byte"), std::string::npos);
  EXPECT_NE(refusal("").find("not JSON"), std::string::npos);
  EXPECT_NE(refusal("[1e999]").find("out of range"), std::string::npos);
  EXPECT_NE(refusal("[]").find("the file is array, not an object"), std::string::npos);
  EXPECT_NE(refusal("{}").find("schema_version is missing"), std::string::npos);

  Json changed = json;
  changed["schema_version"] = 1;
  refused_with(changed,
               ("schema_version is 1; this program reads " + std::to_string(schema_version)).c_str());
  changed = json;
  changed["tasks"][1]["wall_ns"].erase("p50");
  refused_with(changed, "tasks[1].wall_ns.p50 is missing");
  changed = json;
  changed["tasks"][1]["runs"] = -1;
  refused_with(changed, "tasks[1].runs is number, not an integer that fits");
  changed = json;
  changed["exit_code"] = 1e3;
  refused_with(changed, "exit_code is number, not an integer");
  changed = json;
  changed["verdict"] = "excellent";
  refused_with(changed, "verdict is string, not a verdict");
  changed = json;
  changed["top_view"]["shapes"][0]["drawn_as"] = 3;
  refused_with(changed, "top_view.shapes[0].drawn_as is number, not a layer");
  changed = json;
  changed["top_view"]["scan_points"][0] = {1, 2};
  refused_with(changed, "top_view.scan_points[0] is array, not a list of 7");
}

TEST(ParseReport, IgnoresUnknownKeys) {
  Json json = Json::parse(report_json(test::full_record()));
  json["of_the_future"] = {1, 2, 3};
  json.erase("checksum");
  EXPECT_EQ(refusal(with_checksum(json.dump())), "accepted");
}

TEST(ParseReport, RefusesEveryTruncation) {
  const std::string whole = report_json(RunRecord{});
  for (std::size_t length = 0; length < whole.size(); ++length) {
    ASSERT_NE(refusal(whole.substr(0, length)), "accepted") << length;
  }
}

TEST(ParseReport, RefusesEveryChangedByte) {
  const std::string whole = report_json(RunRecord{});
  ASSERT_EQ(refusal(whole), "accepted");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = changed[at] == '1' ? '2' : '1';
    ASSERT_NE(refusal(changed), "accepted") << at;
  }
  std::string passed = report_json(test::full_record());
  passed.replace(passed.find("\"failed\""), 8, "\"passed\"");
  EXPECT_NE(refusal(passed).find("report.json: its checksum is xxh3:"), std::string::npos) << refusal(passed);
  EXPECT_NE(refusal(passed).find("it was damaged or changed after the run; take an unchanged copy"),
            std::string::npos)
      << refusal(passed);
  Json without = Json::parse(report_json(RunRecord{}));
  without.erase("checksum");
  EXPECT_NE(refusal(without.dump()).find("it does not end with its checksum"), std::string::npos);
}

}  // namespace
}  // namespace hil::report
