#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using test::has_mistake;
using test::is_only_mistake;
using test::ScenarioFolder;
using test::with_change;

/// A text in which '@' marks the expected place of the mistake: it precedes the character.
struct Marked {
  std::string text;
  std::uint32_t line = 1;
  std::uint32_t column = 1;
};

Marked marked(std::string text) {
  const std::size_t at = text.find('@');
  if (at == std::string::npos || text.find('@', at + 1) != std::string::npos) {
    throw std::runtime_error("not one mark in: " + text);
  }
  Marked result{text.erase(at, 1)};
  for (std::size_t i = 0; i < at; ++i) {
    result.column = text[i] == '\n' ? 1 : result.column + 1;
    result.line += text[i] == '\n' ? 1 : 0;
  }
  return result;
}

/// Whether the scenario has exactly one mistake, at the mark, whose text contains `words`.
::testing::AssertionResult is_refused(const std::string& marked_text, std::string_view words) {
  const Marked scenario = marked(marked_text);
  const ScenarioFolder files;
  Diagnostics diagnostics;
  if (files.load(scenario.text, diagnostics))
    return ::testing::AssertionFailure() << "accepted: " << marked_text;
  return is_only_mistake(diagnostics, scenario.line, scenario.column, words);
}

/// A change of the good scenario, with the mark, and words of the mistake that it makes.
struct Change {
  std::string from, to;
  std::string_view words;
};

void expect_refused(std::initializer_list<Change> changes) {
  for (const auto& [from, to, words] : changes)
    EXPECT_TRUE(is_refused(with_change(from, to), words)) << to;
}

void expect_accepted(const std::string& text) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  EXPECT_TRUE(files.load(text, diagnostics)) << diagnostics.to_text();
}

TEST(ScenarioMistakes, WrongKeysAndWordsAreReported) {
  expect_refused({
      {"seed: 7", "@sed: 7", "unknown key 'sed'; did you mean 'seed'?"},
      {"scenario: everything\n", "\n@", "missing key 'scenario'"},
      {"clock: realtime", "clock: @virtal", "did you mean 'virtual'?"},
  });
}

/// The executive keeps a priority below the base thread free for the tasks' threads.
TEST(ScenarioMistakes, WrongPrioritiesAreReported) {
  expect_refused({
      {"priority: 42", "priority: @1", "from 2 to 98"},
      {"priority: 42", "priority: @99", "from 2 to 98"},
      {"priority: 55", "priority: @0", "from 1 to 98"},
  });
  expect_accepted(with_change("priority: 42", "priority: 2"));
  expect_accepted(with_change("priority: 55", "priority: 1"));
}

TEST(ScenarioMistakes, OneNameInTwoFilesIsReportedWithBothFiles) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  EXPECT_FALSE(files.load(test::scenario_text, diagnostics, {"tasks.traffic.module=scanner"}));
  ASSERT_EQ(diagnostics.count(), 1U) << diagnostics.to_text();
  EXPECT_NE(diagnostics.to_text().find(
                "the module 'scanner' is given twice; first in line 1 of --set tasks.traffic.module"),
            std::string::npos)
      << diagnostics.to_text();
}

TEST(ScenarioMistakes, WrongPlotsAreReported) {
  const std::string begin = "scenario: s\nduration: 5 s\nplots:\n  - ";
  for (const auto& [entry, words] : std::initializer_list<std::pair<std::string, std::string_view>>{
           {"{title: A, signals: @[]}", "at least"},
           {"@{signals: [x.a]}", "missing key 'title'"},
           {"{title: A, signals: [x.a, @x.a]}", "'x.a' is in the plot twice"},
           {"{title: A, signals: [x.a], from: @5 s}", "5 s is not before the end of the run"},
           {"{title: A, signals: [x.a], from: @4999.5 ms}", "is after the last tick of the run, at 4999 ms"},
           {"{title: A, signals: [x.a], until: @6 s}", "6 s is after the end of the run, which takes 5 s"},
           {"{title: A, signals: [x.a], from: @3 s, until: 3 s}", "3 s is not before 'until', 3 s"},
           {"{title: A, signals: [x.a], from: 1100 us, until: @1200 us}",
            "before the first tick from 'from' on, 2 ms"}})
    EXPECT_TRUE(is_refused(begin + entry + "\n", words)) << entry;
  expect_accepted("scenario: s\nduration: 5 s\nplots: [{title: A, signals: [x.a], from: 4 s, until: 5 s}]\n");
}

TEST(ScenarioMistakes, WrongRatesAreReported) {
  expect_refused({
      {"base_rate: 1 kHz", "base_rate: @1.0000001 kHz", "no whole number of nanoseconds"},
      {"rate: 100 Hz\n    offset", "rate: @300 Hz\n    offset",
       "'rate': 300 Hz does not divide the base rate; the nearest that do are 333.333333333 Hz (1 kHz / 3) "
       "and 250 Hz (1 kHz / 4)"},
      {"rate: 20 Hz", "rate: @2 kHz", "2 kHz is above the base rate of 1 kHz"},
      {"rate: 50 Hz", "rate: @70 Hz", "does not divide"},
      {"duration: 10 s", "duration: @10.0005 s",
       "10000.5 ms is no multiple of the base period of 1 ms; the nearest are 10 s and 10001 ms"},
  });
  // The suggested values are accepted.
  expect_accepted("scenario: a\ntasks: [{module: m, type: vehicles, rate: 333.333333333 Hz}]\n");
  expect_accepted("scenario: a\nbase_rate: 3.000000003 Hz\nduration: 333333333 ns\n");
}

TEST(ScenarioMistakes, WrongTimingOfTasksIsReported) {
  expect_refused({
      {"offset: 2 ms", "offset: @10 ms", "less than the task's period of 10 ms"},
      {"offset: 2 ms", "offset: @1500 us", "the nearest are 1 ms and 2 ms"},
      {"deadline: 10 ms", "deadline: @11 ms", "longer than the task's period of 10 ms"},
      {"deadline: 10 ms", "deadline: @9.5 ms", "a thread of its own"},
      {"budget: 8 ms", "budget: @12 ms", "longer than the deadline of 10 ms"},
      {"overrun: queue", "overrun: @queu", "did you mean 'queue'?"},
      {"    thread: scanner\n    deadline: 10 ms\n    budget: 8 ms\n    overrun: queue",
       "    overrun: @abort", "abort needs a thread of its own"},
  });
  // On the base thread a deadline needs to be no multiple of the base period.
  expect_accepted("scenario: a\ntasks: [{module: m, type: vehicles, rate: 100 Hz, deadline: 700 us}]\n");
}

TEST(ScenarioMistakes, WrongModulesAreReported) {
  expect_refused({
      {"type: laser_scanner", "type: @laser_scaner",
       "unknown type of module 'laser_scaner'; did you mean 'laser_scanner'?"},
      {"columns: 140", "columns: 140, @colums: 140", "unknown key 'colums'; did you mean 'columns'?"},
      {"{columns: 140, range", "@{range", "missing key 'columns' (Columns of the scan.)"},
      {"range: 80 m", "range: @80 kg", "a length is written in m, cm, mm, km"},
      {"module: scanner", "module: @traffic", "the module 'traffic' is given twice; first in line 27"},
      {"request: can.car.BrakeCommand.Dec", "request: @can..car.Dec", "is not a signal's name"},
  });
}

TEST(ScenarioMistakes, WrongWorldsAreReported) {
  expect_refused({
      {"name: sheet", "name: @ball", "the entity 'ball' is given twice; first in line 22"},
      {"sphere: 1 m}", "sphere: 1 m, @box: [1 m, 1 m, 1 m]}", "'box' next to 'sphere'"},
      {"[2 m, 3 m]", "[2 m, @0 m]", "out of range"},
      {"[0, 0, 0, 1]", "@[0, 0, 0, 0]", "the length 0; a rotation has length 1"},
      {"{yaw: 90 deg}", "{@yaw: 90 deg, quaternion: [1, 0, 0, 0]}", "'yaw' next to 'quaternion'"},
      {"path: house.obj", "path: @map.yaml", "obj, stl, ply, gltf or glb, not from '.yaml'"},
      {"path: house.obj", "path: @hous.obj", "there is no such file"},
      {"sphere: 1 m}, rot", "sphere: 1 m}, convex_parts: @house.stl, rot",
       "'convex_parts': triangles of an STL file share no corners"},
  });
  EXPECT_TRUE(is_refused(with_change("entities:\n    - {name: ground", "entities:\n    @- {name: ground",
                                     with_change("max_entities: 100", "max_entities: 4")),
                         "5 entities, but max_entities is 4"));
}

TEST(ScenarioMistakes, MotionBeyondTheLimitsOfTheWorldIsReported) {
  expect_refused({
      {"[36 km/h, 0 m/s, 0 m/s]", "@[80000 m/s, 80000 m/s, 0 m/s]",
       "'velocity' is 113137.08499 m/s in all; at most 100000 m/s is possible"},
      {"[0 deg/s, 0 deg/s, 180 deg/s]", "@[9000 rad/s, 9000 rad/s, 0 deg/s]",
       "'angular_velocity' is 12727.9"},
      {"[36 km/h, 0 m/s, 0 m/s]", "@[0 m/s, -10001 m/s, 0 m/s]", "its y is -100010 m at the end of the run"},
      {"scale: 2\n", "scale: @20000\n", "'scale' makes 120000 m of 6 m; the largest size is 100000 m"},
  });
  expect_accepted(with_change("[36 km/h, 0 m/s, 0 m/s]", "[0 m/s, -9999 m/s, 0 m/s]"));
}

TEST(ScenarioMistakes, WrongLayersAreReported) {
  const std::string listed = with_change("max_entities: 100", "layers: [static, grund]");
  const std::string one_ground = with_change("mask: [static, ground]", "mask: [static]", listed);
  EXPECT_TRUE(is_refused(with_change("mask: [ground]", "mask: [@ground]", one_ground),
                         "unknown layer 'ground'; did you mean 'grund'?"));
  EXPECT_TRUE(is_refused(with_change("[static, grund]", "[static, ground, @static]", listed),
                         "the layer 'static' is given twice"));
  std::string many = "scenario: many\nworld:\n  entities:\n";
  for (int i = 0; i < 33; ++i) {
    const std::string n = std::to_string(i);
    many.append("    - {name: e").append(n).append(", shape: {sphere: 1 m}, mask: [");
    many.append(i == 32 ? "@layer" : "layer").append(n).append("]}\n");
  }
  EXPECT_TRUE(is_refused(many, "the layer 'layer32' is one too many; there can be 32"));
}

TEST(ScenarioMistakes, WrongMaterialsAndFieldsAreReported) {
  const std::string listed = with_change(
      "max_entities: 100", "materials: [{name: paint, reflectance: 0.3}, {name: retro, retro_gain: 300}]");
  const auto changed = [&](const std::string& from, const std::string& to) {
    return with_change(from, to, listed);
  };
  expect_accepted(changed("scale: 2\n", "material: retro\n"));
  EXPECT_TRUE(is_refused(changed("scale: 2\n", "material: @retr\n"),
                         "unknown material 'retr'; did you mean 'retro'?"));
  EXPECT_TRUE(is_refused(with_change("scale: 2\n", "material: @paint\n"), "unknown material 'paint'"));
  EXPECT_TRUE(is_refused(changed("name: retro", "name: @paint"), "the material 'paint' is given twice"));
  EXPECT_TRUE(is_refused(changed("reflectance: 0.3", "reflectance: @1.5"), "out of range"));
  EXPECT_TRUE(is_refused(changed("retro_gain: 300", "retro_gain: @0.5"), "out of range"));
  expect_accepted(changed("scale: 2\n", "field: {error: 1 cm, sign: ray_ratio}\n"));
  EXPECT_TRUE(is_refused(changed("scale: 2\n", "field: {error: 1 cm, cell: @1 cm}\n"),
                         "'cell' and 'error' determine each other"));
  EXPECT_TRUE(is_refused(changed("scale: 2\n", "field: {sign: @odd}\n"), "is not one of: automatic"));
  EXPECT_TRUE(is_refused(changed("scale: 2\n", "field: {max_bytes: @0}\n"), "out of range"));
  EXPECT_TRUE(is_refused(changed("{name: paint, ", "@{"), "missing key 'name'"));
  // The only mistake: the entity's material may be the one whose name is wrong.
  const std::string used = changed("scale: 2\n", "material: retro\n");
  EXPECT_TRUE(
      is_refused(with_change("{name: retro", "{name: @paint", used), "the material 'paint' is given twice"));
  EXPECT_TRUE(is_refused(with_change("{name: retro, ", "@{", used), "missing key 'name'"));
}

TEST(ScenarioMistakes, WrongCanBusesAreReported) {
  expect_refused({
      {"\"socketcan:vcan0\"", "@vcan0", "did you mean 'socketcan:vcan0'?"},
      {"device: virtual", "device: @virtul", "did you mean 'virtual'?"},
      {"\"socketcan:vcan0\"", "@\"socketcan:a_name_much_too_long\"", "1 to 15 characters"},
  });
  EXPECT_TRUE(is_refused(with_change("bus: bench", "bus: @car", with_change("/{can.bench}", "")),
                         "the bus 'car' is given twice; first in line 45"));
  expect_refused({
      {"period: 20 ms", "period: @15 ms",
       "no multiple of the bus's period of 10 ms; the nearest are 10 ms and 20 ms"},
      {"offset: 10 ms", "offset: @20 ms", "less than the message's period of 20 ms"},
      {"Mode: 3}", "Mode: @1e999}", "'1e999' is too large"},
      {"Mode: 3}", "@Counter: 3}", "hil writes 'Counter' (the counter); leave it out of 'signals'"},
      {"Mode: 3}", "Mode: 3, @Checksum: 5}", "hil writes"},
      {"message: Status", "message: @BrakeCommand", "the received message 'BrakeCommand' is given twice"},
      {"drop: 0.25", "drop: @25", "from 0 to 1"},
      {"rate: 50 Hz}", "rate: 50 Hz, faults: @{drop: 1}}", "only a virtual bus"},
  });
  EXPECT_TRUE(is_refused(with_change("\"socketcan:vcan0\"", "@\"socketcan:vcan0\"",
                                     with_change("clock: realtime", "clock: virtual")),
                         "'clock: virtual' needs 'device: virtual'"));
}

TEST(ScenarioMistakes, BusesOnOneInterfaceAreReported) {
  expect_refused({
      {"  - {bus: bench,",
       "  - {bus: bank, device: 'socketcan:can1', database: crossing.dbc, rate: 50 Hz}\n  - {bus: tank, "
       "device: 'socketcan:can2', database: crossing.dbc, rate: 50 Hz}\n  - {bus: rank, device: "
       "@'socketcan:can1', database: crossing.dbc, rate: 50 Hz}\n  - {bus: bench,",
       "the bus 'bank' is already on 'can1'"},
  });
}

TEST(ScenarioMistakes, ServersOnOnePortAreReported) {
  const auto servers = [](const std::string& first, const std::string& second) {
    return "scenario: two\nmodbus:\n  - {unit: a, role: server, registers: served.yaml, rate: 1 Hz, device: "
           "'" +
           first + "'}\n  - {unit: b, role: server, registers: served.yaml, rate: 1 Hz, device: " + second +
           "}\n";
  };
  EXPECT_TRUE(is_refused(servers("127.0.0.1:1502", "@'127.0.0.1:1502'"), "'a' already listens on port 1502"));
  EXPECT_TRUE(is_refused(servers("[::]:1502", "@'127.0.0.1:1502'"), "'a' already listens on port 1502"));
  for (const char* other : {"'127.0.0.2:1502'", "'127.0.0.1:1503'", "'127.0.0.1:auto'"})
    expect_accepted(servers("127.0.0.1:1502", other));
}

TEST(ScenarioMistakes, ClientOfAServerOfTheScenarioNeedsRealTime) {
  const auto pair = [](const char* clock, const char* server, const char* client) {
    return std::string("scenario: pair\nclock: ") + clock +
           "\nmodbus:\n  - {unit: a, role: server, registers: served.yaml, rate: 1 Hz, device: '" + server +
           "'}\n  - {unit: b, registers: map.yaml, rate: 1 Hz, device: " + client + "}\n";
  };
  const std::string fault = "the unit 'a' of this scenario listens there; under 'clock: virtual'";
  EXPECT_TRUE(is_refused(pair("virtual", "127.0.0.1:1502", "@'127.0.0.1:1502'"), fault));
  EXPECT_TRUE(is_refused(pair("virtual", "127.0.0.1:1502", "@'localhost:1502'"), fault));
  EXPECT_TRUE(is_refused(pair("virtual", "0.0.0.0:1502", "@'127.0.0.1:1502'"), fault));
  expect_accepted(pair("realtime", "127.0.0.1:1502", "'127.0.0.1:1502'"));
  expect_accepted(pair("virtual", "127.0.0.1:1502", "'127.0.0.1:1503'"));
  expect_accepted(pair("virtual", "127.0.0.1:1502", "'127.0.0.2:1502'"));
  expect_accepted(pair("virtual", "0.0.0.0:1502", "'192.168.0.9:1502'"));
}

TEST(ScenarioMistakes, WrongModbusUnitsAreReported) {
  expect_refused({
      {"127.0.0.1:auto", "@127.0.0.1", "is not HOST:PORT"},
      {"127.0.0.1:auto", "@127.0.0.1:70000", "from 1 to 65535"},
      {"127.0.0.1:auto", "@::1:502", "is not HOST:PORT"},
      {"[light, demand]", "[@ligth, demand]", "unknown register 'ligth'; did you mean 'light'?"},
      {"[light, demand]", "[light, @light]", "is given twice"},
      {"[light, demand]", "[@detector]", "'detector' is written, not read"},
      {"{detector: detectors.ego}", "{@light: detectors.ego}", "'light' is read, not written"},
      {"{detector: detectors.ego}", "{@alive: detectors.ego}", "hil writes 'alive' (run_time or heartbeat)"},
      {"heartbeat: alive", "heartbeat: @time_ms",
       "the register 'time_ms' is already written with the run's time"},
      {"registers: map.yaml", "registers: @nap.yaml", "there is no such file"},
      {"max_age: 2 s", "@start_limit: 2 s", "unknown key 'start_limit'; it was renamed to 'start_timeout'"},
  });
}

TEST(ScenarioMistakes, ConstantsOutOfARegistersRangeAreReported) {
  expect_refused({
      {"{detector: detectors.ego}", "{detector: @70000}",
       "'detector': 70000 is out of range; the register takes 0 to 65535"},
      {"{detector: detectors.ego}", "{detector: @-1}", "out of range"},
      {"{detector: detectors.ego}", "{detector: @1 kHz}",
       "'detector': '1 kHz' is neither a signal nor a number"},
      {"max_age: 2 s", "max_gap: @1999", "from 0 to 1998"},
      {"max_age: 2 s", "max_clients: @0", "from 1 to 1000"},
  });
}

/// A wrong port is one mistake: it is not reported as a port that no process uses.
TEST(ScenarioMistakes, WrongPortIsOneMistake) {
  for (const char* port : {"70000", "0", "-1", "x"}) {
    EXPECT_TRUE(is_refused("scenario: a\nmodbus: [{unit: u, device: @\"127.0.0.1:" + std::string(port) +
                               "\", registers: map.yaml, rate: 10 Hz}]\n",
                           "is neither from 1 to 65535 nor auto"));
  }
}

TEST(ScenarioMistakes, MistakesOfRegisterMapsHavePlacesInTheirFile) {
  const ScenarioFolder files;
  files.folder().write("map.yaml",
                       std::string(test::register_map_text) + "  - {name: more, table: holding}\n");
  Diagnostics diagnostics;
  EXPECT_FALSE(files.load(test::scenario_text, diagnostics));
  ASSERT_EQ(diagnostics.count(), 3U) << diagnostics.to_text();
  for (const Mistake& mistake : diagnostics.mistakes()) {
    EXPECT_EQ(mistake.place.file, (files.folder().path() / "map.yaml").string());
  }
  EXPECT_TRUE(has_mistake(diagnostics, 7, 5, "missing key 'address'"));
}

TEST(ScenarioMistakes, WrongProcessesAreReported) {
  expect_refused({
      {"\"{can.car}\"", "\"x@{can.cat}\"", "there is no CAN bus 'cat'; did you mean 'car'?"},
      {"/{can.bench}", "/@{can.bench", "this '{' has no '}'"},
      {"/{can.bench}", "/@{tcp.x}", "'{tcp.x}' is not a placeholder"},
      {"  plc:\n", "  @dut:\n", "'dut' has a section of its own"},
      {"[plc, \"{modbus.plc}\"]", "@[]", "at least 1"},
  });
  EXPECT_TRUE(
      is_refused("scenario: a\nmodbus: [{unit: u, device: @\"h:auto\", registers: map.yaml, rate: 10 Hz}]\n",
                 "a process whose command contains {modbus.u}"));
}

TEST(ScenarioMistakes, WrongExpectationsAreReported) {
  expect_refused({
      {"collision.ego > 0", "collision.ego >@", "the expression ends"},
      {"name: it stops", "name: @alive", "the expectation 'alive' is given twice"},
      {"eventually: \"ego.speed == 0\", by: 9 s", "always: \"ego.speed == 0\", by: @9 s",
       "'by' belongs to 'eventually', not to 'always'"},
      {"within: 50 ms", "within: @50", "no unit"},
      {"by: 9 s", "by: @1000 s", "1000 s is after the end of the run, which takes 10 s"},
      {"reply: can.car.BrakeCommand.AnswerTo", "reply: @can.car.Objects.Counter",
       "'can.car.Objects.Counter' is the request itself"},
  });
  EXPECT_TRUE(
      is_refused("scenario: a\nexpectations: [@{name: nothing}]\n", "exactly one of these keys is needed"));
}

TEST(ScenarioMistakes, InOneSectionHideNoneInOthers) {
  const std::tuple<const char*, const char*, const char*> changes[] = {
      {"seed: 7", "seed: @-7", "out of range"},
      {"gpu: llvmpipe", "@gpus: llvmpipe", "did you mean 'gpu'?"},
      {"{name: ground", "{@about: nothing, name: ground", "unknown key 'about'"},
      {"rate: 100 Hz\n    offset", "rate: @300 Hz\n    offset", "does not divide"},
      {"range: 80 m", "range: @80 km", "out of range; it can be from 0.0001 km to 0.5 km"},
      {"database: crossing.dbc\n", "database: @missing.dbc\n", "there is no such file"},
      {"Mode: 3", "Mode: @1e999", "too large"},
      {"[light, demand]", "[light, @demnd]", "did you mean 'demand'?"},
      {"\"{can.car}\"", "\"@{can.cra}\"", "did you mean 'car'?"},
      {"ego.speed < 50", "ego.speed <@< 50", "found '<'"},
  };
  std::string text = test::scenario_text;
  for (const auto& [from, to, words] : changes)
    text = with_change(from, to, text);
  std::string without_marks = text;
  std::erase(without_marks, '@');
  const ScenarioFolder files;
  Diagnostics diagnostics;
  EXPECT_FALSE(files.load(without_marks, diagnostics));
  EXPECT_EQ(diagnostics.count(), std::size(changes)) << diagnostics.to_text();
  for (const auto& [from, to, words] : changes) {
    // The text with the mark of this change only.
    std::string one_mark;
    const std::string marked_change = to;
    const std::size_t place = text.find(marked_change) + marked_change.find('@');
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '@' || i == place) one_mark += text[i];
    }
    const Marked expected = marked(one_mark);
    EXPECT_TRUE(has_mistake(diagnostics, expected.line, expected.column, words));
  }
}

TEST(ScenarioMistakes, UnreadableFilesAreReported) {
  const tests::TemporaryFolder folder;
  Diagnostics missing;
  EXPECT_FALSE(load_scenario((folder.path() / "none.yaml").string(), {}, {}, missing));
  EXPECT_TRUE(is_only_mistake(missing, 0, 0, "there is no such file"));
  Diagnostics unnamed;
  EXPECT_FALSE(load_scenario("", {}, {}, unnamed));
  EXPECT_EQ(unnamed.to_text(), "'': the name of a file is needed, not an empty text\n");
  Diagnostics directory;
  EXPECT_FALSE(load_scenario(folder.path().string(), {}, {}, directory));
  EXPECT_TRUE(is_only_mistake(directory, 0, 0, "is a directory"));
  Diagnostics device;
  EXPECT_FALSE(load_scenario("/dev/zero", {}, {}, device));
  EXPECT_TRUE(is_only_mistake(device, 0, 0, "is not a regular file"));
  Diagnostics empty;
  EXPECT_FALSE(load_scenario(folder.write("empty.yaml", ""), {}, {}, empty));
  EXPECT_TRUE(is_only_mistake(empty, 1, 1, "the text is empty; a document has keys and values"));
}

}  // namespace
}  // namespace hil::config
