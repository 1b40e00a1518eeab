#include "runtime/config/overrides.hpp"

#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using test::can_of;
using test::modbus_of;
using test::ScenarioFolder;

Scenario load_with(const std::vector<std::string>& overrides) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  std::optional<Scenario> scenario = files.load(test::scenario_text, diagnostics, overrides);
  if (!scenario) throw std::runtime_error(diagnostics.to_text());
  return std::move(*scenario);
}

std::string mistakes_with(const std::vector<std::string>& overrides) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  EXPECT_FALSE(files.load(test::scenario_text, diagnostics, overrides));
  return diagnostics.to_text();
}

TEST(Overrides, ReplaceValuesOfTheFile) {
  EXPECT_EQ(load_with({"seed=9"}).seed, 9U);
  EXPECT_EQ(load_with({"duration=9 s"}).duration_ticks, 9000U);
  EXPECT_EQ(load_with({"realtime.priority=3"}).realtime.priority, 3);
  EXPECT_FALSE(load_with({"realtime={lock_memory: false}"}).realtime.lock_memory);
  EXPECT_EQ(load_with({"realtime.cpus=[3]"}).realtime.cpus, std::vector<int>{3});
}

TEST(Overrides, AddValuesThatTheFileLacks) {
  EXPECT_FALSE(load_with({"dut.enabled=false"}).processes[0].enabled);
  EXPECT_EQ(load_with({"world.queue_capacity=8"}).world.queue_capacity, 8U);
  EXPECT_EQ(load_with({"tasks.traffic.inputs.more=ego.speed"}).tasks[0].inputs[1].port.text, "more");
}

TEST(Overrides, CreateMissingSections) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  const auto scenario = files.load("scenario: least\n", diagnostics, {"realtime.priority=7", "world.gpu=1"});
  ASSERT_TRUE(scenario) << diagnostics.to_text();
  EXPECT_EQ(scenario->realtime.priority, 7);
  EXPECT_EQ(scenario->world.gpu, "1");
}

TEST(Overrides, FindListEntriesByNameAndIndex) {
  EXPECT_EQ(load_with({"tasks.scanner.parameters.columns=96"}).tasks[1].parameters["columns"].integer(), 96);
  EXPECT_EQ(load_with({"tasks.1.parameters.columns=97"}).tasks[1].parameters["columns"].integer(), 97);
  EXPECT_EQ(can_of(load_with({"can.bench.device=virtual"}), 1).interface, "");
  EXPECT_EQ(modbus_of(load_with({"modbus.plc.device=h:1502"}), 0).port, 1502);
  EXPECT_EQ(load_with({"world.entities.pole.scale=3"}).world.entities[1].scale, 3.0);
  EXPECT_EQ(can_of(load_with({"can.car.send.EgoStatus.signals.Speed=5"}), 0).send[0].signals.size(), 2U);
  EXPECT_EQ(load_with({"expectations.it answers.response.within=9 ms"}).expectations.size(), 11U);
  EXPECT_EQ(load_with({"realtime.cpus.1=5"}).realtime.cpus, (std::vector<int>{0, 5}));
}

TEST(Overrides, ExpandAShortForm) {
  EXPECT_EQ(can_of(load_with({"can.car.receive.BrakeCommand.timeout=30 ms"}), 0).receive[0].timeout_ns,
            30'000'000);
}

TEST(Overrides, DuplicatePathIsAMistakeWithBothValues) {
  EXPECT_EQ(mistakes_with({"seed=1", "seed=2"}),
            "--set seed:1:1: 'seed' is given twice: '1' and '2'; give it once\n");
}

TEST(Overrides, UnknownPathIsAMistakeWithTheNearestName) {
  EXPECT_EQ(mistakes_with({"dut.enabld=false"}),
            "--set dut.enabld:1:5: there is no 'dut.enabld'; did you mean 'dut.enabled'?\n");
  EXPECT_EQ(mistakes_with({"dutt.enabled=false"}),
            "--set dutt.enabled:1:1: there is no 'dutt'; did you mean 'dut'?\n");
  EXPECT_EQ(mistakes_with({"tasks.scaner.rate=1 Hz"}),
            "--set tasks.scaner.rate:1:7: there is no 'tasks.scaner'; did you mean 'tasks.scanner'?\n");
  EXPECT_EQ(mistakes_with({"processes.pcl.enabled=true"}),
            "--set processes.pcl.enabled:1:11: there is no 'processes.pcl'; did you mean 'processes.plc'?\n");
  EXPECT_EQ(
      mistakes_with({"tasks.scanner.parameters.colums=96"}),
      "--set tasks.scanner.parameters.colums:1:26: there is no 'tasks.scanner.parameters.colums'; did you "
      "mean 'tasks.scanner.parameters.columns'?\n");
  EXPECT_EQ(mistakes_with({"tasks.2.rate=1 Hz"}),
            "--set tasks.2.rate:1:7: there is no entry 2; the list has 2 entries, counted from 0\n");
  EXPECT_EQ(mistakes_with({"seed.x=1"}), "--set seed.x:1:6: 'seed' has no keys, so there is no 'seed.x'\n");
}

TEST(Overrides, BadValueHasItsPlaceAfterTheEqualsSign) {
  EXPECT_EQ(mistakes_with({"dut.enabled=no"}),
            "--set dut.enabled:1:13: 'enabled': 'no' is not a boolean; write true or false (yes, no, on and "
            "off are none)\n");
  EXPECT_EQ(mistakes_with({"tasks.scanner.parameters.columns=9999"}),
            "--set tasks.scanner.parameters.columns:1:34: 'columns': 9999 is out of range; it can be from 1 "
            "to 4096\n");
  EXPECT_EQ(mistakes_with({"realtime.cpus=[0, x]"}),
            "--set realtime.cpus:1:19: entry 1 of 'cpus': 'x' is not a whole number\n");
  EXPECT_EQ(
      mistakes_with({"duration=7"}),
      "--set duration:1:10: 'duration': '7' has no unit; a duration is written in s, ms, us, ns, min\n");
  EXPECT_EQ(mistakes_with({"seed="}), "--set seed:1:1: the text is empty; a document has keys and values\n");
  EXPECT_EQ(mistakes_with({"tasks.traffic.rate=300 Hz"}).substr(0, 31), "--set tasks.traffic.rate:1:20: ");
}

TEST(Overrides, ConstantOutOfRangeHasItsPlaceAfterTheEqualsSign) {
  EXPECT_EQ(
      mistakes_with({"modbus.plc.write.detector=70000"}),
      "--set modbus.plc.write.detector:1:27: 'detector': 70000 is out of range; the register takes 0 to "
      "65535\n");
}

TEST(Overrides, RenamedKeyIsAMistakeWithTheNewName) {
  EXPECT_EQ(mistakes_with({"modbus.plc.start_limit=1 s"}),
            "--set modbus.plc.start_limit:1:12: there is no 'modbus.plc.start_limit'; it was renamed to "
            "'modbus.plc.start_timeout'\n");
}

TEST(Overrides, EntryOfAMissingListIsAMistake) {
  const ScenarioFolder files;
  for (const char* text : {"scenario: least\n", "scenario: least\ncan:\ntasks:\n"}) {
    Diagnostics diagnostics;
    EXPECT_FALSE(files.load(text, diagnostics, {"can.car.device=virtual"}));
    EXPECT_NE(
        diagnostics.to_text().find("--set can.car.device:1:5: there is no CAN bus 'car', since the file "
                                   "has no list 'can'\n"),
        std::string::npos)
        << diagnostics.to_text();
    Diagnostics of_tasks;
    EXPECT_FALSE(files.load(text, of_tasks, {"tasks.scanner.rate=1 Hz"}));
    EXPECT_NE(of_tasks.to_text().find("there is no 'tasks.scanner', since the file has no list 'tasks'\n"),
              std::string::npos)
        << of_tasks.to_text();
  }
}

TEST(Overrides, FindABusByTheNameKeyOfItsType) {
  const Schema entry = Schema::record(
      {Field::needed("mast", Schema::name(), "."), Field::optional("height", Schema::integer(0, 9), ".")});
  const Schema schema = Schema::record({Field::needed("semaphore", Schema::list(entry), ".")});
  const std::vector<BusSectionType> types{{.key = "semaphore",
                                           .about = "The semaphores.",
                                           .name_key = "mast",
                                           .noun = "semaphore",
                                           .plural = "semaphores",
                                           .entry = entry}};
  Diagnostics diagnostics;
  const auto source =
      source_of_text("f.yaml", "semaphore: [{mast: hill, height: 1}, {mast: bay}]", diagnostics);
  std::optional<TreeNode> tree = build_tree(source, diagnostics);
  ASSERT_TRUE(tree) << diagnostics.to_text();
  const std::vector<std::string> overrides{"semaphore.bay.height=4"};
  apply_overrides(*tree, schema, overrides, {.buses = types}, diagnostics);
  EXPECT_TRUE(diagnostics.empty()) << diagnostics.to_text();
  const TreeNode* const height = tree->find("semaphore")->items.at(1).find("height");
  ASSERT_NE(height, nullptr);
  EXPECT_EQ(height->scalar, "4");
}

TEST(Overrides, MalformedOverrideIsAMistake) {
  EXPECT_EQ(mistakes_with({"seed"}), "--set seed:1:1: expected path=value, as in dut.enabled=false\n");
  EXPECT_EQ(mistakes_with({"=5"}), "--set :1:1: a word is missing in the path ''\n");
  EXPECT_EQ(mistakes_with({"realtime..priority=5"}),
            "--set realtime..priority:1:10: a word is missing in the path 'realtime..priority'\n");
  EXPECT_NE(mistakes_with({"seed=[1"}).find("--set seed:1:"), std::string::npos);
  EXPECT_NE(mistakes_with({"seed=\x01"}).find("--set seed:1:6: the control character 0x01"),
            std::string::npos);
}

TEST(Overrides, MistakesAreReportedWithThoseOfTheFile) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  EXPECT_FALSE(
      files.load(test::with_change("seed: 7", "sed: 7"), diagnostics, {"dut.enabld=false", "clock=wall"}));
  EXPECT_EQ(diagnostics.count(), 3U) << diagnostics.to_text();
}

TEST(Overrides, AmbiguousNameRequiresTheIndex) {
  const Schema schema = Schema::record(
      {Field::needed("l",
                     Schema::list(Schema::record({Field::needed("name", Schema::name(), "."),
                                                  Field::optional("n", Schema::integer(0, 9), ".")})),
                     ".")});
  Diagnostics diagnostics;
  const std::vector<std::string> by_name{"l.a.n=1"};
  EXPECT_FALSE(parse_text("f.yaml", "l: [{name: a}, {name: a}]", schema, diagnostics, by_name));
  EXPECT_NE(diagnostics.to_text().find("--set l.a.n:1:3: more than one entry is called 'a'"),
            std::string::npos);
  Diagnostics none;
  const std::vector<std::string> by_index{"l.1.n=4"};
  const auto value = parse_text("f.yaml", "l: [{name: a}, {name: a}]", schema, none, by_index);
  ASSERT_TRUE(value) << none.to_text();
  EXPECT_EQ((*value)["l"].items()[1]["n"].integer(), 4);
}

TEST(Overrides, FollowAChoice) {
  const Schema schema = Schema::record({Field::needed(
      "m",
      Schema::choice("type", {{"a", Schema::record({Field::optional("x", Schema::integer(0, 9), ".")})},
                              {"b", Schema::record({Field::optional("y", Schema::integer(0, 9), ".")})}}),
      ".")});
  Diagnostics diagnostics;
  const std::vector<std::string> good{"m.x=3"};
  const auto value = parse_text("f.yaml", "m: {type: a}", schema, diagnostics, good);
  ASSERT_TRUE(value) << diagnostics.to_text();
  EXPECT_EQ((*value)["m"]["x"].integer(), 3);
  const std::vector<std::string> bad{"m.y=3"};
  EXPECT_FALSE(parse_text("f.yaml", "m: {type: a}", schema, diagnostics, bad));
  EXPECT_EQ(diagnostics.to_text(), "--set m.y:1:3: there is no 'm.y'; known here: type, x\n");
}

}  // namespace
}  // namespace hil::config
