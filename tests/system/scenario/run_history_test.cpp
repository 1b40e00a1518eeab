// Histories of runs: scans, killed runs, disks that fail, and the export.

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <sstream>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/two_blocks.hpp"

namespace hil::scenario_test {
namespace {

TEST(RunHistory, ScansAreThoseOfTheRun) {
  const Folder folder;
  const std::string out = folder / "out";
  const Ended run = run_hil(
      joined({{"run", crossing(), "--clock", "virtual", "--duration", "3 s", "--out", out}, few_beams()}));
  EXPECT_EQ(run.code, 1) << "too short for its answers: " << run.output << run.errors;
  const Json report = read_report(out);
  EXPECT_EQ(report["database_log"]["durability"], "async");
  EXPECT_EQ(report["database_log"]["durable_version"], report["database_log"]["latest_version"]);
  EXPECT_EQ(report["database_log"]["commits_in_gaps"], 0);

  // The digest of all answers of the scanner, computed again from the scans of the history.
  constexpr int columns = 96, rows = 24, steps = 100;
  std::uint64_t digest = 0xCBF29CE484222325ull;
  const auto add = [&](std::uint32_t word) { digest = (digest ^ word) * 0x100000001B3ull; };
  const Signals signals(out);
  std::size_t compared = 0, hits = 0;
  for (int sweep = 0; sweep < 3; ++sweep) {
    const std::string points = folder / "points.csv";
    const Json scan = answer({"history", out, "--json", "scan", "scanner", "--at",
                              std::to_string(sweep) + ".7s", "--points", points});
    EXPECT_EQ(scan["answers"][0]["begin_ns"], sweep * 1'000'000'000ll);
    EXPECT_EQ(scan["answers"][0]["beams"], columns * rows);
    std::map<std::pair<int, int>, std::vector<std::uint32_t>> seen;
    std::istringstream lines(read_text(points));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line,
              "time_ns,column,row,range_m,x_m,y_m,z_m,entity,index,generation,triangle,return,fraction,"
              "intensity_per_m2");
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      std::vector<std::string> cell(11);
      for (std::string& text : cell)
        std::getline(cells, text, ',');
      seen[{std::stoi(cell[1]), std::stoi(cell[2])}] = {1, std::bit_cast<std::uint32_t>(std::stof(cell[3])),
                                                        static_cast<std::uint32_t>(std::stoul(cell[8])),
                                                        static_cast<std::uint32_t>(std::stoul(cell[10]))};
    }
    hits += seen.size();
    EXPECT_EQ(scan["answers"][0]["hits"], seen.size());
    for (int step = 0; step < steps; ++step) {
      const auto first_beam = [&](int at) { return (at * columns * rows + steps - 1) / steps; };
      for (int beam = first_beam(step); beam < first_beam(step + 1); ++beam) {
        const auto hit = seen.find({beam / rows, beam % rows});
        if (hit == seen.end()) {
          add(0);
        } else {
          for (const std::uint32_t word : hit->second)
            add(word);
        }
      }
      const int ended = sweep * steps + step + 1;  // published at the deadline of the step
      const auto row = static_cast<std::size_t>(ended);
      if (row >= signals.rows()) continue;
      ASSERT_EQ(signals["scanner.digest"][row], static_cast<double>(digest >> 11))
          << sweep << ", step " << step;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 299u);
  EXPECT_GT(hits, 1000u);
}

TEST(RunHistory, IsReadDuringTheRunAndAfterAKill) {
  const Folder folder;
  write_text(folder / "two_blocks.yaml", two_blocks);
  const std::string out = folder / "out";
  Program run(hil({"run", folder / "two_blocks.yaml", "--clock", "realtime", "--duration", "3600 s", "--set",
                   "realtime.watchdog=30 s", "--out", out}));
  ASSERT_TRUE(eventually([&] {
    return std::filesystem::exists(out + "/signals.csv") && run_hil({"history", out, "info"}).code == 0;
  }));
  const auto expect_answer = [&](const char* when) {
    const Ended near = run_hil({"history", out, "near", "post", "--within", "50m", "--at", "1s"});
    EXPECT_EQ(near.code, 0) << when << near.errors;
    EXPECT_NE(near.output.find("block       16.000"), std::string::npos) << when << near.output;
    EXPECT_NE(near.errors.find("the run left no report, so it is unknown how long it continued"),
              std::string::npos)
        << when << near.errors;
  };
  expect_answer("running: ");
  run.signal(SIGKILL);
  run.wait();
  expect_answer("killed: ");
  const Ended info = run_hil({"history", out, "info"});
  EXPECT_NE(info.output.find("left no report"), std::string::npos) << info.output;
  EXPECT_EQ(run_hil({"db", "verify", out}).code, 0) << "a log may end after any group";
  const Ended exported = run_hil({"db", "export", out});
  EXPECT_EQ(exported.code, 0);
  EXPECT_NE(exported.errors.find("the log was not closed"), std::string::npos) << exported.errors;
}

TEST(RunHistory, IsAbsentAfterAVolatileRun) {
  const Folder folder;
  write_text(folder / "two_blocks.yaml", two_blocks);
  const std::string out = folder / "out";
  ASSERT_EQ(
      run_hil({"run", folder / "two_blocks.yaml", "--out", out, "--set", "world.durability=volatile"}).code,
      0);
  EXPECT_FALSE(std::filesystem::exists(out + "/database"));
  EXPECT_EQ(read_report(out)["database_log"]["durability"], "volatile");
  const Ended info = run_hil({"history", out, "info"});
  EXPECT_EQ(info.code, 4);
  EXPECT_NE(info.errors.find("world.durability: volatile"), std::string::npos) << info.errors;
}

/// The log's folder is removed, so that no file can be created there. A run that waits for the disk ends
/// early; another run completes. Both fail.
TEST(RunHistory, FailureOfTheDiskFailsTheRun) {
  for (const std::string mode : {"async", "group", "sync"}) {
    const Folder folder;
    const std::string out = folder / "out";
    Program run(hil(
        joined({{"run", crossing(), "--clock", "virtual", "--out", out, "--set", "world.durability=" + mode},
                few_beams()})));
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(out + "/world.json"); }));
    std::filesystem::rename(out + "/database", folder / "taken");
    std::filesystem::remove_all(folder / "taken");
    const Ended ended = run.wait();
    const Json report = read_report(out);
    const Json& log = report["database_log"];
    EXPECT_GT(log["faults"], 0) << mode;
    EXPECT_LT(log["durable_version"], log["latest_version"].get<std::uint64_t>() + (mode == "sync" ? 1 : 0))
        << mode;
    EXPECT_EQ(ended.code, 4) << mode << ended.output << ended.errors;
    if (mode == "async") {
      EXPECT_NE(ended.output.find("the world's history is on disk up to version"), std::string::npos)
          << ended.output;
    } else {
      EXPECT_NE(report["reason"].get<std::string>().find("the database's log refused"), std::string::npos)
          << report["reason"];
      EXPECT_GT(log["refused_transactions"], 0) << mode;
    }
  }
}

TEST(RunHistory, IsTheSameInEveryDurabilityMode) {
  const Folder folder;
  std::map<std::string, std::string> exported;
  for (const std::string mode : {"async", "group", "sync"}) {
    const std::string out = folder / mode;
    const Ended run = run_hil(joined({{"run", crossing(), "--clock", "virtual", "--duration", "1 s", "--out",
                                       out, "--set", "world.durability=" + mode},
                                      few_beams()}));
    ASSERT_EQ(run.code, 1) << run.output << run.errors;
    const Json log = read_report(out)["database_log"];
    EXPECT_EQ(log["durability"], mode);
    EXPECT_EQ(log["durable_version"], log["latest_version"]);
    const Ended ended = run_hil({"db", "export", out});
    EXPECT_EQ(ended.code, 0) << ended.errors;
    exported[mode] = ended.output;
    EXPECT_EQ(run_hil({"db", "verify", out}).code, 0);
  }
  EXPECT_GT(exported["async"].size(), 100'000u);
  EXPECT_EQ(exported["async"], exported["group"]);
  EXPECT_EQ(exported["async"], exported["sync"]);
}

TEST(RunHistory, ExportHasEveryCommitInOrder) {
  const Folder folder;
  const std::string out = folder / "out";
  ASSERT_EQ(run_hil(joined({{"run", crossing(), "--clock", "virtual", "--duration", "1 s", "--out", out},
                            few_beams()}))
                .code,
            1);
  const std::string file = folder / "export.jsonl";
  ASSERT_EQ(run_hil({"db", "export", out, "--out", file}).code, 0);
  EXPECT_EQ(run_hil({"db", "export", out}).output, read_text(file));
  std::map<std::string, Json> rows;  // by entity
  std::uint64_t commits = 0, version = 0;
  std::size_t triangles = 0;
  std::istringstream lines(read_text(file));
  for (std::string line; std::getline(lines, line);) {
    const Json json = Json::parse(line);
    if (json["line"] == "geometry") triangles += json["triangles"].size();
    if (json["line"] != "commit") continue;
    ++commits;
    EXPECT_GT(json["version"].get<std::uint64_t>(),
              std::exchange(version, json["version"].get<std::uint64_t>()));
    for (const Json& write : json["writes"]) {
      Json& row = rows[write["entity"].dump()];
      if (write.contains("row")) row = write["row"];
      if (write.contains("motion")) row["motion"] = write["motion"];
    }
  }
  EXPECT_GT(triangles, 100u);
  const Json info = answer({"db", "info", out, "--json"});
  EXPECT_EQ(info["commits"], commits);
  EXPECT_EQ(info["last"]["version"], version);
  const Json entities = answer({"history", out, "--json", "entities", "--at", "1s"});
  ASSERT_EQ(entities["answers"][0]["entities"].size(), rows.size());
  for (const Json& entity : entities["answers"][0]["entities"]) {
    const Json& motion = rows[Json{entity["index"], entity["generation"]}.dump()]["motion"];
    const double dt_s = 1.0 - motion["valid_from_ns"].get<double>() * 1e-9;
    for (int axis = 0; axis < 3; ++axis) {
      const double at_m =
          motion["p_world_m"][axis].get<double>() + motion["v_world_mps"][axis].get<double>() * dt_s;
      EXPECT_NEAR(entity["p_world_m"][axis].get<double>(), at_m, 1e-9) << entity;
    }
  }
  EXPECT_EQ(run_hil({"db", "export", out, "--out", folder / "no/such/folder"}).code, 4);
  // With and without data in the buffer at the end, whose write fails too.
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--no-meshes"}}) {
    const Ended full = run_hil(joined({{"db", "export", out, "--out", "/dev/full"}, more}));
    EXPECT_EQ(full.code, 4);
    EXPECT_EQ(full.errors, "hil db export: /dev/full can not be written: No space left on device\n");
  }
}

/// The file has no colour and a texture.
TEST(RunHistory, ExportHasTheNormalsOfMeshFiles) {
  const Folder folder;
  write_text(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 -4\nf 1/1/1 2/1/1 3\n");
  write_text(folder / "s.yaml",
             "scenario: a\nduration: 10 ms\nclock: virtual\nworld:\n  entities:\n"
             "    - {name: a, shape: {file: a.obj}}\n    - {name: b, shape: {box: [1 m, 1 m, 1 m]}}\n");
  const std::string warning =
      folder / "s.yaml" + std::string(":6:31: warning: mesh file '") + (folder / "a.obj") +
      "' has textures, which are ignored; 'material' gives the surface of an entity\n";
  const Ended checked = run_hil({"check", folder / "s.yaml"});
  EXPECT_EQ(checked.code, 0) << checked.output;
  EXPECT_EQ(checked.errors,
            warning + (folder / "s.yaml") +
                std::string(": warning: the scenario has no expectations, so a run checks nothing\n"));
  EXPECT_TRUE(checked.output.ends_with("no mistakes, 2 warnings\n")) << checked.output;
  const std::string out = folder / "out";
  const Ended run = run_hil({"run", folder / "s.yaml", "--out", out, "--set", "world.durability=async"});
  EXPECT_NE(run.errors.find(warning), std::string::npos) << run.errors;
  std::map<std::string, Json> geometries;
  std::istringstream lines(run_hil({"db", "export", out}).output);
  for (std::string line; std::getline(lines, line);) {
    const Json json = Json::parse(line);
    if (json["line"] == "geometry") geometries[json["name"]] = json;
  }
  EXPECT_EQ(geometries["a"]["corner_normals"], Json::parse("[[[0,0,-1],[0,0,-1],[0,0,1]]]"));
  EXPECT_FALSE(geometries["a"].contains("corner_colors"));
  EXPECT_FALSE(geometries["b"].contains("corner_normals"));
  EXPECT_EQ(geometries["b"]["triangles"].size(), 12u);
}

}  // namespace
}  // namespace hil::scenario_test
