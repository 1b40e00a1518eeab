// Runs with plug-ins: two in one run, what their modules contribute, and modules that fail.

#include <gtest/gtest.h>

#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

const Environment plugin_path{{"HIL_PLUGIN_PATH", HIL_BINARY_DIR "/tests/plugins"}};

/// `parameters`: of the pump, in its second line.
std::string pumps(const std::string& parameters) {
  return "scenario: pumps\nplugins: [pump, docking]\nclock: virtual\nduration: 2 s\ntasks:\n"
         "  - module: feed\n    type: pump\n    rate: 10 Hz\n    inputs: {speed: motor.speed}\n"
         "    parameters: {" +
         parameters +
         "}\n  - module: motor\n    type: block\n    rate: 10 Hz\n"
         "    parameters: {outputs: {speed: {value: 2 Hz}}}\n"
         "expectations:\n  - {name: it delivers, eventually: feed.flow > 5 l/s}\n";
}

Ended run_pumps(const ScenarioFolder& scenario, const std::vector<std::string>& more = {}) {
  return run_hil(joined({{"run", scenario.folder / "s.yaml", "--out", scenario.folder / "out"}, more}),
                 plugin_path);
}

TEST(PluginRun, AModuleOfAPluginContributesAllThatAModuleCan) {
  const ScenarioFolder scenario(pumps("flow: 3"));
  const Ended ended = run_pumps(scenario);
  ASSERT_EQ(ended.code, 0) << ended.output << ended.errors;
  const std::string out = scenario.folder / "out";
  const auto report = read_report(out);
  ASSERT_EQ(report["plugins"].size(), 2U);
  EXPECT_EQ(report["plugins"][0]["name"], "pumps");
  EXPECT_EQ(report["plugins"][0]["version"], "1.2.3");
  EXPECT_EQ(report["plugins"][0]["path"], HIL_BINARY_DIR "/tests/plugins/pump.so");
  EXPECT_EQ(report["plugins"][0]["hash"].get<std::string>().size(), 16U);
  EXPECT_EQ(report["plugins"][1]["name"], "docking");
  EXPECT_EQ(report["lists"]["pumps"][0]["flow"], 3.0);
  ASSERT_EQ(report["sections"].size(), 1U);
  EXPECT_EQ(report["sections"][0]["title"], "Pumps");
  EXPECT_EQ(report["sections"][0]["plots"][0]["bars"], true);
  EXPECT_EQ(report["top_view"]["tracks"][0]["name"], "feed");
  EXPECT_NE(events_in_ms(report).find("pump feed delivers"), std::string::npos);
  EXPECT_EQ(read_text(out + "/files/feed.csv"), "speed,flow\n1,3.000000\n");
  EXPECT_EQ(read_text(out + "/files/feed-0.bin").size(), sizeof(double));
  EXPECT_TRUE(std::filesystem::exists(out + "/files/feed-1000.bin"));
  const std::string page = read_text(out + "/report.html");
  EXPECT_NE(page.find("Flow of feed"), std::string::npos);
  EXPECT_NE(page.find("Plug-in pumps"), std::string::npos);
  EXPECT_EQ(run_hil({"report", out}).code, 0) << "without the plug-in";
}

TEST(PluginRun, AThrowInAStepEndsTheRun) {
  const ScenarioFolder scenario(pumps("throws_at: 5"));
  const Ended ended = run_pumps(scenario);
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  const auto report = read_report(scenario.folder / "out");
  ASSERT_FALSE(report["failures"].empty());
  EXPECT_EQ(report["failures"][0],
            "module feed (plug-in pumps) threw in its step of tick 500: the pump is dry; its outputs are "
            "unknown from then on, and the run ended");
  EXPECT_EQ(report["ticks"], 501);
  EXPECT_TRUE(std::isnan(Signals(scenario.folder / "out")["feed.flow"].back()));
}

TEST(PluginRun, ASignalInAStepNamesTheModule) {
  const ScenarioFolder scenario(pumps("crashes_at: 5"));
  const Ended ended = run_pumps(scenario);
  EXPECT_NE(ended.code, 0);
  EXPECT_NE(ended.errors.find("hil: module feed (plug-in pumps): its step ended by SIGSEGV\n"),
            std::string::npos)
      << ended.errors;
}

TEST(PluginRun, MistakesOfItsParametersHaveTheirPlaces) {
  const ScenarioFolder scenario(pumps("flow: 3000"));
  const Ended ended = run_hil({"check", scenario.folder / "s.yaml"}, plugin_path);
  EXPECT_EQ(ended.code, 2);
  EXPECT_NE(ended.errors.find("s.yaml:10:24: 'flow': 3000 is out of range"), std::string::npos)
      << ended.errors;
  const Ended set = run_pumps(ScenarioFolder(pumps("flow: 3")), {"--set", "tasks.feed.parameters.flow=x"});
  EXPECT_EQ(set.code, 2);
  EXPECT_NE(set.errors.find("'flow'"), std::string::npos) << set.errors;
}

TEST(PluginRun, PluginsThatCanNotBeLoadedAreMistakesWithTheirPlaces) {
  const auto check = [](const std::string& plugin) {
    const ScenarioFolder scenario("scenario: s\nplugins:\n  - " + plugin + "\n");
    const Ended ended = run_hil({"check", scenario.folder / "s.yaml"}, plugin_path);
    EXPECT_EQ(ended.code, 2) << ended.output;
    EXPECT_NE(ended.errors.find("s.yaml:3:5: "), std::string::npos) << ended.errors;
    EXPECT_EQ(ended.errors.find('\n'), ended.errors.size() - 1) << "one sentence: " << ended.errors;
    return ended.errors;
  };
  EXPECT_NE(check("nothing").find("there is no plug-in 'nothing' (nothing.so) in "), std::string::npos);
  EXPECT_NE(check("other_abi").find("it was compiled for 'hil 0.0"), std::string::npos);
  EXPECT_NE(check("no_entry").find("it has no function hil_plugin_types"), std::string::npos);
  EXPECT_NE(check("undefined").find("undefined symbol"), std::string::npos);
  EXPECT_NE(check("same_name").find("the module type 'block' is one of hil"), std::string::npos);
  EXPECT_NE(check("./s.yaml").find("it is no ELF file"), std::string::npos);
  const ScenarioFolder scenario("scenario: s\n");
  const Ended set = run_hil({"check", scenario.folder / "s.yaml", "--set", "plugins=[pump]"}, plugin_path);
  EXPECT_EQ(set.code, 2);
  EXPECT_NE(set.errors.find("'plugins' can not be set on the command line"), std::string::npos) << set.errors;
}

TEST(PluginRun, DoctorAndKeysKnowPlugins) {
  const Ended keys = run_hil({"keys", "--plugin", "pump"}, plugin_path);
  EXPECT_EQ(keys.code, 0) << keys.errors;
  EXPECT_NE(keys.output.find("# Parameters of module type `pump`"), std::string::npos);
  EXPECT_EQ(run_hil({"keys"}, plugin_path).output.find("`pump`"), std::string::npos);
  const Ended wrong = run_hil({"keys", "--plugin", "nothing"}, plugin_path);
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.errors.find("hil keys: there is no plug-in 'nothing'"), std::string::npos) << wrong.errors;
}

TEST(NewScenario, RunsAtOnce) {
  const Folder folder;
  const std::string line = "cd '" + folder.path().string() + "' && '" + built("hil") + "' ";
  const auto shell = [&](const std::string& words) {
    Program program({"sh", "-c", line + words});
    return program.wait();
  };
  ASSERT_EQ(shell("new scenario pond").code, 0);
  const Ended ended = shell("run pond.yaml --out out");
  EXPECT_EQ(ended.code, 0) << ended.output << ended.errors;
  EXPECT_EQ(read_report(folder / "out")["verdict"], "passed");
  const Ended again = shell("new scenario pond");
  EXPECT_EQ(again.code, 2);
  EXPECT_EQ(again.errors, "hil new: pond.yaml is there already\n");
  EXPECT_EQ(shell("new module 9lives").code, 2);
  EXPECT_EQ(shell("new module ../x").code, 2);
  EXPECT_EQ(shell("new module lag").output, "lag/CMakeLists.txt\nlag/lag.cpp\nlag/lag.yaml\n");
}

}  // namespace
}  // namespace hil::scenario_test
