#include "runtime/report/report_json.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>

#include "hostile_text.hpp"
#include "runtime/report/file_checksum.hpp"
#include "runtime/report/text_safety.hpp"
#include "sample_record.hpp"

namespace hil::report {
namespace {

using Json = nlohmann::json;

/// The JSON has this dotted path; in a list each entry has it, and there is at least one.
void expect_path(const Json& json, const std::string& path, const std::string& whole) {
  if (json.is_array()) {
    ASSERT_FALSE(json.empty()) << whole << ": the sample has no entry to look at";
    for (const Json& entry : json)
      expect_path(entry, path, whole);
    return;
  }
  if (path.empty()) return;
  const std::size_t dot = path.find('.');
  const std::string key = path.substr(0, dot);
  ASSERT_TRUE(json.contains(key)) << whole;
  expect_path(json.at(key), dot == std::string::npos ? "" : path.substr(dot + 1), whole);
}

TEST(ReportJson, HasEveryDocumentedKey) {
  const Json json = Json::parse(report_json(test::full_record()));
  std::istringstream paths(R"(
    schema_version scenario verdict exit_code clock ticks period_ns realtime.scheduler
    realtime.locked_memory realtime.degraded gpu.device gpu.driver tasks.name tasks.rate_hz tasks.runs
    tasks.warmup_runs tasks.deadline_misses tasks.overruns tasks.skipped tasks.wake_latency_ns.p50
    tasks.wake_latency_ns.p99 tasks.wake_latency_ns.p999 tasks.wake_latency_ns.max tasks.wall_ns.p50
    tasks.wall_ns.p99 tasks.wall_ns.p999 tasks.wall_ns.max tasks.cpu_ns.p50 tasks.cpu_ns.p99
    tasks.cpu_ns.p999 tasks.cpu_ns.max tasks.blocked_ns.p50 tasks.blocked_ns.p99 tasks.blocked_ns.p999
    tasks.blocked_ns.max tasks.slack_ns.min tasks.slack_ns.p50 tasks.misses transactions.submitted
    transactions.committed transactions.late transactions.missed transactions.refused transactions.conflicts
    transactions.firm_late_commits transactions.hard_misses scheduler.promised scheduler.kept
    scheduler.predicted_over_actual.median scheduler.reservations.broken scheduler.not_reserved
    database_log.durability database_log.durable_version database_log.bytes
    database_log.ring_high_water_bytes database_log.commits_in_gaps database_log.faults can.bus can.driver
    can.rx can.tx can.dropped can.errors can.send_errors can.wrong_kind can.saturated can.refused_values
    can.dropped_releases can.log_dropped can.lost_arrivals can.fault_dropped_tx can.fault_dropped_rx
    can.fault_corrupted can.fault_delayed can.other_lengths.message can.other_lengths.longer
    can.other_lengths.shorter modbus.unit modbus.requests modbus.replies modbus.timeouts modbus.errors
    modbus.role modbus.exceptions.code modbus.exceptions.count modbus.saturated_outputs
    modbus.saturated_inputs modbus.not_a_number_outputs modbus.not_a_number_inputs modbus.superseded
    modbus.stale modbus.connections modbus.refused_connections modbus.replaced_connections
    modbus.dropped_connections expectations.name expectations.passed expectations.detail scenario.name
    scenario.file seed overrides started_at processes.name processes.exit processes.ended_early_at_ns)");
  for (std::string path; paths >> path;) {
    if (path == "tasks.misses") continue;  // empty for a task without misses; checked below
    expect_path(json, path, path);
  }
  for (const char* key : {"tick", "cause", "lateness_ns"}) {
    ASSERT_FALSE(json.at("tasks").at(0).at("misses").empty());
    expect_path(json.at("tasks").at(0).at("misses"), key, key);
  }
  EXPECT_EQ(json.at("schema_version"), schema_version);
  EXPECT_EQ(json.at("verdict"), "failed");
  EXPECT_EQ(json.at("tasks").at(0).at("misses").at(0).at("lateness_ns"), 402'113);
}

TEST(WorldJson, IsReadBackToTheSameBytes) {
  WorldRecord world;
  world.scenario = "crossing";
  world.period_ns = 1'000'000;
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
  refused_with(changed, "schema_version is 1; this program reads 9");
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
