// The keys `include` and `set` of scenarios.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "runtime/config/scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::config {
namespace {

class Includes : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
    return path.string();
  }

  /// The scenario in the file; `mistakes` is empty if there is one.
  std::optional<Scenario> load(const std::string& path, const std::vector<std::string>& overrides = {}) {
    const SchemaOfModules modules{
        {"gain", Schema::record({Field::with_default("factor", Schema::number(0.0, 10.0), "1", "."),
                                 Field::optional("file", Schema::file(), ".")})}};
    Diagnostics diagnostics;
    auto scenario = load_scenario(path, overrides, {.modules = modules, .buses = {}}, diagnostics);
    mistakes = diagnostics.to_text();
    for (std::size_t at = 0; (at = mistakes.find(folder_.path().string() + "/")) != std::string::npos;)
      mistakes.erase(at, folder_.path().string().size() + 1);
    return scenario;
  }

  std::string mistakes;

 private:
  tests::TemporaryFolder folder_;
};

constexpr const char* plant =
    "base_rate: 1 kHz\nduration: 2 s\nvariables: {limit: 1 m}\n"
    "tasks: [{module: plant, type: gain, rate: 1 kHz, parameters: {factor: 2}}]\n";

TEST_F(Includes, EntriesOfListsComeFirst) {
  write("plant.yaml", plant);
  const auto scenario = load(write("main.yaml",
                                   "scenario: whole\ninclude: [plant.yaml]\nduration: 3 s\n"
                                   "variables: {other: 2 m}\n"
                                   "tasks: [{module: last, type: gain, rate: 100 Hz}]\n"));
  ASSERT_TRUE(scenario) << mistakes;
  EXPECT_EQ(scenario->name, "whole");
  EXPECT_EQ(scenario->base_rate_hz, 1000.0);
  EXPECT_EQ(scenario->duration_ns, 3'000'000'000) << "the including file's value counts";
  ASSERT_EQ(scenario->tasks.size(), 2U);
  EXPECT_EQ(scenario->tasks[0].module.text, "plant");
  EXPECT_EQ(scenario->tasks[1].module.text, "last");
  ASSERT_EQ(scenario->variables.size(), 2U);
}

TEST_F(Includes, AreRelativeToTheFileThatNamesThem) {
  write("parts/plant.yaml", std::string("include: inner/more.yaml\n") + plant);
  write("parts/inner/more.yaml",
        "tasks: [{module: more, type: gain, rate: 1 kHz, parameters: {file: data.txt}}]\n");
  const std::string data = write("parts/inner/data.txt", "x");
  const auto scenario = load(write("main.yaml", "scenario: whole\ninclude: [parts/plant.yaml]\n"));
  ASSERT_TRUE(scenario) << mistakes;
  ASSERT_EQ(scenario->tasks.size(), 2U);
  EXPECT_EQ(scenario->tasks[0].parameters["file"].text(), data);
}

TEST_F(Includes, SetChangesWhatIsIncluded) {
  write("plant.yaml", plant);
  const std::string main = write("main.yaml",
                                 "scenario: whole\ninclude: [plant.yaml]\n"
                                 "set: {tasks.plant.parameters.factor: 3, variables.limit: 5 m}\n");
  auto scenario = load(main);
  ASSERT_TRUE(scenario) << mistakes;
  EXPECT_EQ(scenario->tasks[0].parameters["factor"].number(), 3.0);
  EXPECT_EQ(scenario->variables[0].expression->text(), "5 m");
  scenario = load(main, {"tasks.plant.parameters.factor=4"});
  ASSERT_TRUE(scenario) << mistakes;
  EXPECT_EQ(scenario->tasks[0].parameters["factor"].number(), 4.0) << "the command line counts most";
}

TEST_F(Includes, MistakesHaveTheirPlaces) {
  write("plant.yaml", plant);
  write("slow.yaml", "base_rate: 100 Hz\n");
  write("circle.yaml", "include: [main.yaml]\n");
  write("list.yaml", "[1, 2]\n");
  write("broken.yaml", "tasks: [\n");
  write("wrong.yaml", "tasks: [{module: a, type: gain, rate: 3 Hz}]\n");
  const std::string begin = "scenario: s\n";
  const struct {
    std::string text, mistake;
  } all[] = {
      {"include: [none.yaml]\nset: {tasks.a.rate: 1 Hz}",
       "main.yaml:2:11: 'include': there is no file 'none.yaml'\n"},
      {"include: [plant.yaml, slow.yaml]",
       "slow.yaml:1:12: this differs from plant.yaml:1; write the value that counts into the including "
       "file\n"},
      {"include: [plant.yaml, plant.yaml]",
       "main.yaml:2:23: 'include': 'plant.yaml' is part of this scenario already; a file is included once\n"},
      {"include: [circle.yaml]",
       "circle.yaml:1:11: 'include': 'main.yaml' is part of this scenario already; a file is included "
       "once\n"},
      {"include: [list.yaml]", "main.yaml:2:11: 'include': 'list.yaml' has no keys of a scenario\n"},
      {"include: {a: b}", "main.yaml:2:10: 'include': expected a list of files\n"},
      {"include: [[a]]", "main.yaml:2:11: 'include': expected the name of a file\n"},
      {"include: [plant.yaml]\nset: [a]", "main.yaml:3:6: 'set': expected paths with values"},
      {"include: [plant.yaml]\nset: {tasks.plnt.rate: 1 Hz}",
       "main.yaml:3:13: there is no 'tasks.plnt'; did you mean 'tasks.plant'?\n"},
      {"include: [plant.yaml]\nset: {tasks..rate: 1 Hz}",
       "main.yaml:3:13: a word is missing in the path 'tasks..rate'\n"},
      {"include: [plant.yaml]\nset: {variables.limt: 1 m}",
       "main.yaml:3:17: there is no 'variables.limt'; did you mean 'variables.limit'?\n"},
      {"include: [wrong.yaml]", "wrong.yaml:1:39: 'rate'"},
      {"include: [plant.yaml, wrong.yaml]\ntasks: [{module: plant, type: gain, rate: 1 kHz}]",
       "main.yaml:3:18: the module 'plant' is given twice; first in line 4 of plant.yaml"},
  };
  for (const auto& one : all) {
    EXPECT_FALSE(load(write("main.yaml", begin + one.text + "\n")));
    EXPECT_NE(mistakes.find(one.mistake), std::string::npos) << one.text << "\n" << mistakes;
  }
  load(write("main.yaml", begin + "include: [broken.yaml]\n"));
  EXPECT_EQ(mistakes.find("broken.yaml:"), 0U) << mistakes;
  load(write("main.yaml", begin), {"include=[plant.yaml]"});
  EXPECT_NE(mistakes.find("--set include:1:9: 'include' can not be set on the command line"),
            std::string::npos)
      << mistakes;
}

TEST_F(Includes, ADifferenceIsNoneWhereTheIncludingFileDecides) {
  write("plant.yaml", plant);
  write("slow.yaml", "base_rate: 500 Hz\nduration: 2 s\n");
  const auto scenario =
      load(write("main.yaml", "scenario: s\nbase_rate: 1 kHz\ninclude: [plant.yaml, slow.yaml]\n"));
  ASSERT_TRUE(scenario) << mistakes;
  EXPECT_EQ(scenario->base_rate_hz, 1000.0);
}

}  // namespace
}  // namespace hil::config
