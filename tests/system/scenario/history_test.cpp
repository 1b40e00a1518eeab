// Queries to the world of a completed run, and damaged or incomplete logs.

#include <gtest/gtest.h>

#include <map>

#include "runtime/report/file_checksum.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/two_blocks.hpp"

namespace hil::scenario_test {
namespace {

class History : public testing::Test {
 protected:
  History() {
    write_text(folder_ / "two_blocks.yaml", two_blocks);
    const Ended run = run_hil({"run", folder_ / "two_blocks.yaml", "--out", out()});
    EXPECT_EQ(run.code, 0) << run.output << run.errors;
  }
  std::string out() const { return folder_ / "out"; }
  Json query(const std::vector<std::string>& words) {
    return answer(joined({{"history", out(), "--json"}, words}));
  }
  /// The error text of a command that is refused.
  std::string refusal(const std::vector<std::string>& words, int code = 2) {
    const Ended ended = run_hil(joined({{"history", out()}, words}));
    EXPECT_EQ(ended.code, code) << ended.output << ended.errors;
    EXPECT_EQ(ended.output, "");
    return ended.errors;
  }

  Folder folder_;
};

double block_x_m(const Json& one) {
  return 20.0 - 3.0 * one["time_ns"].get<double>() * 1e-9;
}

TEST_F(History, DistancesFollowTheMotion) {
  const Json near =
      query({"near", "post", "--within", "50m", "--at", "0s", "--until", "4s", "--every", "80ms"});
  ASSERT_EQ(near["answers"].size(), 51u);
  for (const Json& one : near["answers"]) {
    ASSERT_EQ(one["neighbors"].size(), 1u) << one;
    EXPECT_EQ(one["neighbors"][0]["name"], "block");
    EXPECT_NEAR(one["neighbors"][0]["distance_m"].get<double>(), block_x_m(one) - 1.0, 1e-4);
    EXPECT_NEAR(one["neighbors"][0]["v_relative_mps"][0].get<double>(), -3.0, 1e-5);
  }
  // Its distance is 10 m at (20 - 1 - 10) / 3 s.
  const Json crossing =
      query({"near", "post", "--within", "10m", "--at", "2.99s", "--until", "3.01s", "--every", "20ms"});
  EXPECT_EQ(crossing["answers"][0]["found"], 0);
  EXPECT_EQ(crossing["answers"][1]["found"], 1);
}

TEST_F(History, RaysAndRegionsFollowTheMotion) {
  const Json ray = query({"ray", "--origin", "0,0.1,0.23", "--direction", "2,0,0", "--layers", "moving",
                          "--hits", "2", "--at", "0s", "--until", "4s", "--every", "500ms"});
  ASSERT_EQ(ray["answers"].size(), 9u);
  for (const Json& one : ray["answers"]) {
    ASSERT_EQ(one["hits"].size(), 2u);
    EXPECT_NEAR(one["hits"][0]["distance_m"].get<double>(), block_x_m(one) - 1.0, 1e-4);
    EXPECT_NEAR(one["hits"][1]["distance_m"].get<double>(), block_x_m(one) + 1.0, 1e-4);
    EXPECT_EQ(one["hits"][0]["n_world"][0], -1.0);
  }
  const auto in_box = [&](const std::string& at, const std::vector<std::string>& more) {
    return query(joined({{"region", "--box", "12,0,0,2,2,2", "--at", at}, more}))["answers"][0]["entities"]
        .size();
  };
  // The block's faces are at 19 - 3 t and 21 - 3 t, the box's at 11 and 13.
  EXPECT_EQ(in_box("1.99s", {}), 0u);
  EXPECT_EQ(in_box("2.01s", {}), 1u);
  EXPECT_EQ(in_box("3.33s", {}), 1u);
  EXPECT_EQ(in_box("3.34s", {}), 0u);
  EXPECT_EQ(in_box("2.01s", {"--inside"}), 0u);
  EXPECT_EQ(in_box("2.01s", {"--layers", "fixed"}), 0u);
  // In the block's frame the post is 20 - 3 t away.
  EXPECT_EQ(query({"region", "--sphere", "-17,0,0,0.1", "--carried-by", "block", "--layers", "fixed", "--at",
                   "1s"})["answers"][0]["entities"]
                .size(),
            1u);
}

TEST_F(History, EntitiesHaveTheirPastMotion) {
  const Json json = query({"entities", "--at", "2.5s"});
  const Json& entities = json["answers"][0]["entities"];
  ASSERT_EQ(entities.size(), 2u);
  EXPECT_EQ(entities[0]["name"], "post");
  EXPECT_EQ(entities[1]["name"], "block");
  EXPECT_NEAR(entities[1]["p_world_m"][0].get<double>(), 12.5, 1e-9);
  EXPECT_EQ(entities[1]["v_world_mps"][0], -3.0);
}

TEST_F(History, WrongQueriesAreRefusedWithTheReason) {
  const std::pair<std::vector<std::string>, const char*> refusals[] = {
      {{"near", "pst", "--at", "1s"}, "no entity 'pst'; did you mean 'post'?"},
      {{"near", "7.1", "--at", "1s"}, "'7.1' does not exist at that time"},
      {{"near", "post", "--at", "4.001s"}, "the time 4.001 s lies after the end of the run at 4 s"},
      {{"near", "post", "--at", "-1s"}, "the time -1 s lies before the beginning of the run at 0 s"},
      {{"near", "post", "--at", "1"}, "no unit"},
      {{"near", "post", "--at", "1s", "--until", "2s"}, "need each other"},
      {{"near", "post", "--at", "1s", "--until", "2s", "--every", "0s"}, "is not above zero"},
      {{"near", "post", "--at", "1s", "--known-at", "2s"}, "is after --at"},
      {{"near", "post", "--at", "0s", "--until", "4s", "--every", "1ns"}, "at most 1000000 run times"},
      {{"near", "post", "--at", "1s", "--layers", "movin"}, "did you mean 'moving'?"},
      {{"near", "post", "--at", "1s", "--within", "-1m"}, "is negative"},
      {{"near", "post", "--at", "1s", "--within", "101km"}, "no world is larger"},
      {{"near", "post", "--at", "1s", "--from", "nan,0,0"}, "--from: not every number is finite"},
      {{"near", "post", "--at", "1s", "--until", "5s", "--every", "3s"}, "the end of the run at 4 s"},
      {{"near", "post", "--at", "9223372036.8s"}, "is longer than any run"},
      {{"region", "--at", "1s"}, "give one of --sphere and --box"},
      {{"region", "--sphere", "0,0,0,-1", "--at", "1s"}, "--sphere: a size of -1.000000 m is negative"},
      {{"region", "--box", "0,0,0,1,-2,1", "--at", "1s"}, "--box: a size of -2.000000 m is negative"},
      {{"ray", "--origin", "0,0,0", "--direction", "0,0,0", "--at", "1s"}, "is the zero vector"},
      {{"ray", "--origin", "0,0,0", "--direction", "1,nan,0", "--at", "1s"}, "not every number is finite"},
      {{"ray", "--origin", "0,0,0", "--direction", "1,0,0", "--range", "-5m", "--at", "1s"}, "is negative"},
      {{"scan", "lidar", "--at", "1s"}, "no scanner 'lidar'"},
  };
  for (const auto& [words, reason] : refusals) {
    const std::string error = refusal(words);
    EXPECT_NE(error.find(reason), std::string::npos) << error;
  }
  EXPECT_NE(refusal({"near", "post", "--at", "1s", "--gpu", "no such device"}, 5).find("no such device"),
            std::string::npos);
  EXPECT_EQ(run_hil({"history", folder_ / "nothing", "info"}).code, 4);
  EXPECT_EQ(run_hil({"history", out()}).code, 2) << "a command is missing";
}

/// Also of lengths that single precision can not represent.
TEST_F(History, DirectionMayHaveAnyLength) {
  for (const char* direction : {"1e-40,0,0", "1e-25,0,0", "1e300,0,0"}) {
    const Json ray = query(
        {"ray", "--origin", "0,0.1,0.23", "--direction", direction, "--layers", "moving", "--at", "1s"});
    EXPECT_NEAR(ray["answers"][0]["hits"][0]["distance_m"].get<double>(), 16.0, 1e-4) << direction;
  }
}

TEST_F(History, TimesThatTheLogLacksAreRefused) {
  Json report = read_report(out());
  report.erase("checksum");
  const Json durable = report["database_log"]["durable_version"];
  const auto write_report = [&] { write_text(out() + "/report.json", report::with_checksum(report.dump())); };
  report["database_log"]["latest_version"] = 7;
  write_report();
  EXPECT_NE(refusal({"near", "post", "--at", "1s"}).find("the run continued to version 7"),
            std::string::npos);
  EXPECT_EQ(run_hil({"history", out(), "near", "post", "--at", "0s"}).code, 0)
      << "the world of this time is known";
  report["database_log"]["durable_version"] = 7;
  write_report();
  const Ended verified = run_hil({"db", "verify", out()});
  EXPECT_EQ(verified.code, 4);
  EXPECT_NE(verified.output.find("according to the run's report version 7 was on disk"), std::string::npos)
      << verified.output;
  EXPECT_NE(refusal({"near", "post", "--at", "0s"}, 4).find(" to 7 are missing"), std::string::npos);
  report["database_log"]["durable_version"] = durable;
  report["ticks"] = 0xFFFF'FFFF'FFFF'FFFFull;
  write_report();
  EXPECT_NE(refusal({"near", "post", "--at", "1s"}, 4).find("report.json"), std::string::npos);
  std::filesystem::remove(out() + "/report.json");
  std::filesystem::create_directory(out() + "/report.json");
  EXPECT_NE(refusal({"near", "post", "--at", "1s"}, 4).find("it is no file"), std::string::npos);
}

TEST_F(History, WrongNamesAndScannersAreRefused) {
  Json whole = Json::parse(read_text(out() + "/world.json"));
  whole.erase("checksum");
  const Json scanner = {{"name", "lidar"},        {"carrier_index", 0},    {"carrier_generation", 1},
                        {"mount_m", {0, 0, 0}},   {"columns", 8},          {"rows", 2},
                        {"horizontal_rad", 1},    {"vertical_rad", 1},     {"elevation_rad", 0},
                        {"left_to_right", true},  {"range_m", 50},         {"mask", 3},
                        {"ignore_motion", false}, {"first_sweep_ns", 0},   {"sweep_ns", 1'000'000'000},
                        {"step_ns", 10'000'000},  {"divergence_rad", 0},   {"returns_per_beam", 1},
                        {"fast_beams", false},    {"threshold_per_m2", 0}, {"range_noise_m", 0},
                        {"noise_seed", 0}};
  const auto with = [&](const std::string& key, const Json& value) {
    Json world = whole;
    world["scanners"] = Json::array({scanner});
    if (!key.empty()) world["scanners"][0][key] = value;
    write_text(out() + "/world.json", report::with_checksum(world.dump()));
  };
  with("", {});
  EXPECT_EQ(run_hil({"history", out(), "scan", "lidar", "--at", "1s"}).code, 0);
  const std::vector<std::pair<std::string, Json>> wrong{{"columns", 0},
                                                        {"columns", 4'000'000'000u},
                                                        {"rows", 0},
                                                        {"sweep_ns", 0},
                                                        {"sweep_ns", -5},
                                                        {"step_ns", 0},
                                                        {"step_ns", -1},
                                                        {"step_ns", 9'223'372'036'854'775'807},
                                                        {"first_sweep_ns", -1},
                                                        {"range_m", nullptr},
                                                        {"horizontal_rad", 1e300},
                                                        {"mount_m", {0, 0, nullptr}}};
  for (const auto& [key, value] : wrong) {
    with(key, value);
    EXPECT_NE(refusal({"scan", "lidar", "--at", "1s"}, 4).find("world.json"), std::string::npos)
        << key << value;
  }
  Json world = whole;
  world["database_id"] = "0000000000000001";
  write_text(out() + "/world.json", report::with_checksum(world.dump()));
  EXPECT_NE(refusal({"entities", "--at", "1s"}, 4).find("the names of database 0000000000000001"),
            std::string::npos);
  std::filesystem::remove(out() + "/world.json");
  EXPECT_NE(refusal({"entities", "--at", "1s"}, 4).find("before its first tick"), std::string::npos);
}

TEST_F(History, MissingGeometryIsReported) {
  std::filesystem::remove(out() + "/database/geometry.0000000001");
  EXPECT_NE(refusal({"near", "post", "--at", "1s"}, 4).find("geometry.0000000001"), std::string::npos);
  EXPECT_EQ(run_hil({"db", "verify", out()}).code, 4);
}

TEST_F(History, MissingLogIsReported) {
  for (const auto& file : std::filesystem::directory_iterator(out() + "/database"))
    if (!file.path().filename().string().starts_with("geometry")) std::filesystem::remove(file.path());
  const Ended ended = run_hil({"db", "verify", out()});
  EXPECT_EQ(ended.code, 4);
  EXPECT_NE(ended.errors.find("no log segment"), std::string::npos) << ended.errors;
}

TEST_F(History, SecondRunInTheFolderBeginsANewLog) {
  const Json before = answer({"db", "info", out(), "--json"});
  ASSERT_EQ(run_hil({"run", folder_ / "two_blocks.yaml", "--out", out()}).code, 0);
  const Json after = answer({"db", "info", out(), "--json"});
  EXPECT_NE(before["database_id"], after["database_id"]);
  EXPECT_EQ(before["commits"], after["commits"]);
}

TEST_F(History, DamagedLogIsRefusedUnlessSalvaged) {
  const std::string segment = out() + "/database/segment.0000000001";
  const Json whole = answer({"db", "verify", out(), "--json"});
  EXPECT_TRUE(whole["whole"].get<bool>());
  std::string bytes = read_text(segment);
  bytes[600] = static_cast<char>(bytes[600] ^ 1);  // the first group begins at 512
  write_text(segment, bytes);
  for (const char* command : {"info", "verify"}) {
    const Ended ended = run_hil({"db", command, out()});
    EXPECT_EQ(ended.code, 4);
    EXPECT_NE(ended.output.find("segment.0000000001, offset 512"), std::string::npos) << ended.output;
  }
  EXPECT_EQ(run_hil({"history", out(), "near", "post", "--at", "1s"}).code, 4);
  EXPECT_EQ(run_hil({"db", "export", out()}).code, 4);
  const Ended salvaged = run_hil({"history", out(), "--salvage", "info"});
  EXPECT_EQ(salvaged.code, 0) << salvaged.errors;
  EXPECT_NE(salvaged.output.find("damaged"), std::string::npos) << salvaged.output;
}

/// Cut at the end of a group, in the middle of a group, and filled with zeros.
TEST_F(History, LogWithoutItsEndIsRefusedByEveryCommand) {
  const std::string segment = out() + "/database/segment.0000000001";
  const std::string whole = read_text(segment);
  const Json info = answer({"db", "info", out(), "--json"});
  ASSERT_TRUE(info["closed"].get<bool>());
  EXPECT_EQ(run_hil({"db", "export", out()}).errors, "") << "a closed log has no warnings";
  std::string zeros = whole;
  std::fill(zeros.begin() + 1024, zeros.end(), '\0');
  for (const auto& [name, bytes] : std::map<std::string, std::string>{
           {"shorter", whole.substr(0, 1024)}, {"within a group", whole.substr(0, 700)}, {"zeros", zeros}}) {
    write_text(segment, bytes);
    for (const std::string& directory : {out(), out() + "/database", out() + "/database/"}) {
      const std::string copy = folder_ / "copy.jsonl";
      const Ended exported = run_hil({"db", "export", directory, "--out", copy});
      EXPECT_EQ(exported.code, 4) << name;
      EXPECT_FALSE(std::filesystem::exists(copy)) << "no partial export";
      EXPECT_NE(exported.errors.find("--salvage"), std::string::npos) << name << ": " << exported.errors;
      EXPECT_EQ(run_hil({"history", directory, "info"}).code, 4) << name;
      EXPECT_EQ(run_hil({"db", "verify", directory}).code, 4) << name;
      EXPECT_EQ(run_hil({"db", "info", directory}).code, 4) << name;
      const Ended salvaged = run_hil({"db", "export", directory, "--salvage"});
      EXPECT_EQ(salvaged.code, 0) << name;
      EXPECT_NE(salvaged.errors.find(" missing"), std::string::npos) << name << ": " << salvaged.errors;
      EXPECT_EQ(run_hil({"history", directory, "--salvage", "info"}).code, 0) << name;
    }
  }
  // Without a report only the length of the file shows it.
  std::filesystem::remove(out() + "/report.json");
  write_text(segment, whole.substr(0, 1024));
  const Ended exported = run_hil({"db", "export", out()});
  EXPECT_EQ(exported.code, 4);
  EXPECT_NE(exported.errors.find("segment.0000000001, offset "), std::string::npos) << exported.errors;
  EXPECT_NE(exported.errors.find("its end was cut off"), std::string::npos) << exported.errors;
  write_text(segment, zeros);
  const Ended killed = run_hil({"db", "export", out()});
  EXPECT_EQ(killed.code, 0) << killed.errors;
  EXPECT_NE(killed.errors.find("the log was not closed"), std::string::npos) << killed.errors;
}

TEST_F(History, ChangedReportAndNamesAreRefused) {
  const std::string report = read_text(out() + "/report.json");
  const std::string world = read_text(out() + "/world.json");
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& changed : {with(report, "\"completed\"", "\"failed\""),
                                     report.substr(0, report.size() / 2), report.substr(0, 0)}) {
    write_text(out() + "/report.json", changed);
    for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
             {"report", out()}, {"history", out(), "info"}, {"db", "export", out()}}) {
      const Ended ended = run_hil(words);
      EXPECT_EQ(ended.code, 4) << words[0];
      EXPECT_NE(ended.errors.find("/report.json: "), std::string::npos) << ended.errors;
      EXPECT_NE(ended.errors.find("take an unchanged copy"), std::string::npos) << ended.errors;
    }
    const Ended verified = run_hil({"db", "verify", out()});
    EXPECT_EQ(verified.code, 4);
    EXPECT_NE(verified.output.find("/report.json: "), std::string::npos) << verified.output;
    const Ended salvaged = run_hil({"history", out(), "--salvage", "near", "post", "--at", "1s"});
    EXPECT_EQ(salvaged.code, 0) << salvaged.errors;
    EXPECT_NE(salvaged.errors.find("/report.json: "), std::string::npos) << salvaged.errors;
  }
  write_text(out() + "/report.json", report);
  EXPECT_EQ(run_hil({"report", out()}).code, 0);
  write_text(out() + "/world.json", with(world, "\"post\"", "\"past\""));
  EXPECT_NE(refusal({"near", "post", "--at", "1s"}, 4).find("/world.json: its checksum is"),
            std::string::npos);
  const Ended salvaged = run_hil({"history", out(), "--salvage", "entities", "--at", "1s"});
  EXPECT_EQ(salvaged.code, 0) << salvaged.errors;
  EXPECT_NE(salvaged.errors.find("have no names"), std::string::npos) << salvaged.errors;
}

}  // namespace
}  // namespace hil::scenario_test
