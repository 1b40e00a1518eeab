#include <cmath>
#include <numbers>

#include "runtime/expectations/every_tick.hpp"
#include "runtime/expectations/response_judge.hpp"
#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using buses::can::CanSection;
using buses::can::SentMessage;
using buses::modbus::ModbusSection;
using test::can_of;
using test::modbus_of;
using test::scenario_text;
using test::ScenarioFolder;
using test::with_change;

class ScenarioFile : public ::testing::Test {
 protected:
  void SetUp() override {
    scenario_ = files_.load(test::scenario_text, diagnostics_);
    ASSERT_TRUE(scenario_) << diagnostics_.to_text();
  }
  const Scenario& scenario() const { return *scenario_; }
  std::string path(const std::string& name) const { return (files_.folder().path() / name).string(); }

 private:
  ScenarioFolder files_;
  Diagnostics diagnostics_;
  std::optional<Scenario> scenario_;
};

TEST_F(ScenarioFile, GeneralSettingsAreRead) {
  EXPECT_EQ(scenario().file, path("scenario.yaml"));
  EXPECT_EQ(scenario().name, "everything");
  EXPECT_EQ(scenario().about, "uses every part of the language");
  EXPECT_EQ(scenario().base_rate_hz, 1000.0);
  EXPECT_EQ(scenario().base_period_ns, 1'000'000);
  EXPECT_EQ(scenario().duration_ns, 10'000'000'000);
  EXPECT_EQ(scenario().duration_ticks, 10'000U);
  EXPECT_EQ(scenario().clock, ClockKind::realtime);
  EXPECT_EQ(scenario().seed, 7U);
  EXPECT_EQ(scenario().realtime.scheduler, Scheduler::other);
  EXPECT_EQ(scenario().realtime.priority, 42);
  EXPECT_FALSE(scenario().realtime.lock_memory);
  EXPECT_EQ(scenario().realtime.cpus, (std::vector<int>{0, 1}));
  EXPECT_EQ(scenario().realtime.watchdog_ns, 250'000'000);
}

TEST_F(ScenarioFile, WorldIsRead) {
  const World& world = scenario().world;
  EXPECT_EQ(world.gpu, "llvmpipe");
  EXPECT_EQ(world.max_entities, 100U);
  EXPECT_EQ(world.max_geometries, 1024U);
  EXPECT_EQ(world.retained_changes, 65536U);
  EXPECT_EQ(world.queue_capacity, 256U);
  EXPECT_EQ(world.layers.names(), (std::vector<std::string>{"ground", "static"}));
  ASSERT_EQ(world.entities.size(), 5U);
  EXPECT_EQ(world.entities[0].mask_bits, 1U);
  EXPECT_EQ(world.entities[1].mask_bits, 2U);
  EXPECT_EQ(world.entities[2].mask_bits, 3U);
  EXPECT_EQ(std::get<BoxShape>(world.entities[0].shape).size_m, (std::array{400.0, 300.0, 0.2}));
  EXPECT_EQ(std::get<CylinderShape>(world.entities[1].shape).height_m, 6.0);
  EXPECT_EQ(std::get<SphereShape>(world.entities[2].shape).radius_m, 1.0);
  EXPECT_EQ(std::get<RectangleShape>(world.entities[3].shape).size_m, (std::array{2.0, 3.0}));
  EXPECT_EQ(std::get<FileShape>(world.entities[4].shape).path, path("house.obj"));
  EXPECT_EQ(std::get<FileShape>(world.entities[4].shape).scale, 0.001);
  const WorldEntity& pole = world.entities[1];
  EXPECT_EQ(pole.velocity_mps, (std::array{10.0, 0.0, 0.0}));
  EXPECT_DOUBLE_EQ(pole.angular_velocity_radps[2], std::numbers::pi);
  EXPECT_EQ(pole.scale, 2.0);
  EXPECT_NEAR(pole.rotation_wxyz[0], std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(pole.rotation_wxyz[3], std::sqrt(0.5), 1e-15);
  EXPECT_EQ(world.entities[2].rotation_wxyz, (std::array{0.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(world.entities[0].rotation_wxyz, (std::array{1.0, 0.0, 0.0, 0.0}));
}

TEST_F(ScenarioFile, TasksAreRead) {
  ASSERT_EQ(scenario().tasks.size(), 2U);
  const TaskSection& traffic = scenario().tasks[0];
  EXPECT_EQ(traffic.module.text, "traffic");
  EXPECT_EQ(traffic.type.text, "vehicles");
  EXPECT_EQ(traffic.every_ticks, 1U);
  EXPECT_EQ(traffic.deadline_ns, 1'000'000);
  EXPECT_EQ(traffic.budget_ns, 0);
  EXPECT_EQ(traffic.thread, "");
  EXPECT_EQ(traffic.parameters["cars"].integer(), 3);
  ASSERT_EQ(traffic.inputs.size(), 1U);
  EXPECT_EQ(traffic.inputs[0].port.text, "brake_request");
  EXPECT_EQ(traffic.inputs[0].signal.text, "can.car.BrakeCommand.Deceleration");
  EXPECT_EQ(traffic.inputs[0].port.place, (Place{path("scenario.yaml"), 32, 7}));
  EXPECT_EQ(traffic.inputs[0].signal.place, (Place{path("scenario.yaml"), 32, 22}));
  const TaskSection& scanner = scenario().tasks[1];
  EXPECT_EQ(scanner.every_ticks, 10U);
  EXPECT_EQ(scanner.rate_hz, 100.0);
  EXPECT_EQ(scanner.offset_ticks, 2U);
  EXPECT_EQ(scanner.deadline_ns, 10'000'000);
  EXPECT_EQ(scanner.budget_ns, 8'000'000);
  EXPECT_EQ(scanner.overrun, Overrun::queue);
  EXPECT_EQ(scanner.warmup_runs, 5U);
  EXPECT_EQ(scanner.thread, "scanner");
  EXPECT_EQ(scanner.parameters["range"].number(), 80.0);
}

TEST_F(ScenarioFile, CanBusesAreRead) {
  ASSERT_EQ(sections_of<CanSection>(scenario().buses).size(), 2U);
  const CanSection& car = can_of(scenario(), 0);
  EXPECT_TRUE(car.is_virtual());
  EXPECT_EQ(car.database, path("crossing.dbc"));
  EXPECT_EQ(car.every_ticks, 10U);
  EXPECT_EQ(car.bits_per_second, 500'000.0);
  EXPECT_EQ(car.thread_priority, 55);
  ASSERT_EQ(car.send.size(), 1U);
  const SentMessage& sent = car.send[0];
  EXPECT_EQ(sent.message.text, "EgoStatus");
  EXPECT_EQ(sent.period_ns, 20'000'000);
  EXPECT_EQ(sent.offset_ns, 10'000'000);
  EXPECT_EQ(sent.counter->text, "Counter");
  EXPECT_EQ(sent.checksum->text, "Checksum");
  ASSERT_EQ(sent.signals.size(), 2U);
  EXPECT_EQ(std::get<Word>(sent.signals[0].source).text, "traffic.ego_speed");
  EXPECT_EQ(std::get<double>(sent.signals[1].source), 3.0);
  ASSERT_EQ(sent.safe.size(), 1U);
  EXPECT_EQ(std::get<double>(sent.safe[0].value), -1.5);
  ASSERT_EQ(car.receive.size(), 2U);
  EXPECT_EQ(car.receive[0].message.text, "BrakeCommand");
  EXPECT_FALSE(car.receive[0].timeout_ns);
  EXPECT_EQ(car.receive[1].timeout_ns, 1'000'000'000);
  EXPECT_EQ(std::get<double>(car.receive[1].safe[0].value), 4.0);
  EXPECT_EQ(car.faults.drop, 0.25);
  EXPECT_EQ(car.faults.corrupt, 0.125);
  EXPECT_EQ(car.faults.delay_ns, 3'000'000);
  EXPECT_EQ(can_of(scenario(), 1).interface, "vcan0");
  EXPECT_FALSE(can_of(scenario(), 1).is_virtual());
}

TEST_F(ScenarioFile, ModbusUnitsAreRead) {
  ASSERT_EQ(sections_of<ModbusSection>(scenario().buses).size(), 1U);
  const ModbusSection& plc = modbus_of(scenario(), 0);
  EXPECT_EQ(plc.name.text, "plc");
  EXPECT_EQ(plc.role, io::modbus::Role::client);
  EXPECT_EQ(plc.host, "127.0.0.1");
  EXPECT_FALSE(plc.port);
  EXPECT_EQ(plc.every_ticks, 50U);
  EXPECT_EQ(plc.timeout_ns, 500'000'000);
  EXPECT_EQ(plc.max_age_ns, 2'000'000'000);
  EXPECT_EQ(plc.unit_id, 1);
  EXPECT_EQ(plc.run_time_entry->text, "time_ms");
  EXPECT_EQ(plc.heartbeat_entry->text, "alive");
  ASSERT_EQ(plc.write.size(), 1U);
  EXPECT_EQ(plc.write[0].entry.text, "detector");
  EXPECT_EQ(std::get<Word>(plc.write[0].source).text, "detectors.ego");
  ASSERT_EQ(plc.read.size(), 2U);
  ASSERT_EQ(plc.registers.entries.size(), 5U);
  EXPECT_EQ(plc.registers.find("time_ms")->order, io::modbus::ByteOrder::cdab);
}

TEST_F(ScenarioFile, ModbusClientKeepsTheRegistersThatAreUsed) {
  const auto names_after = [](const std::string& from, const std::string& to) {
    Diagnostics diagnostics;
    const ScenarioFolder files;
    const auto changed = files.load(with_change(from, to), diagnostics);
    std::vector<std::string> names;
    if (!changed) return names;
    for (const io::modbus::RegisterEntry& entry : modbus_of(*changed, 0).registers.entries)
      names.push_back(entry.name);
    std::sort(names.begin(), names.end());
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names_after("read: [light, demand]", "read: [light]"),
            (Names{"alive", "detector", "light", "time_ms"}));
  EXPECT_EQ(names_after("    read: [light, demand]\n", ""),
            (Names{"alive", "demand", "detector", "light", "time_ms"}));
  EXPECT_EQ(names_after("    write: {detector: detectors.ego}\n", ""),
            (Names{"alive", "demand", "light", "time_ms"}));
}

TEST_F(ScenarioFile, ModbusLimitsAreRead) {
  EXPECT_EQ(modbus_of(scenario(), 0).max_gap, 0);
  EXPECT_EQ(modbus_of(scenario(), 0).max_clients, 64U);
  Diagnostics diagnostics;
  const ScenarioFolder files;
  const auto other =
      files.load(with_change("{detector: detectors.ego}",
                             "{detector: 12}\n    max_gap: 20\n    max_clients: 3\n    unit_id: 250"),
                 diagnostics);
  ASSERT_TRUE(other) << diagnostics.to_text();
  EXPECT_EQ(std::get<double>(modbus_of(*other, 0).write[0].source), 12.0);
  EXPECT_EQ(modbus_of(*other, 0).max_gap, 20);
  EXPECT_EQ(modbus_of(*other, 0).max_clients, 3U);
  EXPECT_EQ(modbus_of(*other, 0).unit_id, 250);
}

/// A period of 50 ms and a time-out of 500 ms: values are up to 550 ms old without a fault.
TEST_F(ScenarioFile, MaxAgeBelowPeriodAndTimeoutIsAWarning) {
  const auto warnings = [](const std::string& from, const std::string& to) {
    Diagnostics diagnostics;
    const ScenarioFolder files;
    EXPECT_TRUE(files.load(with_change(from, to), diagnostics)) << diagnostics.to_text();
    return diagnostics.warnings();
  };
  EXPECT_TRUE(warnings("max_age: 2 s", "max_age: 550 ms").empty());
  const auto found = warnings("max_age: 2 s", "max_age: 549 ms");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(
      found[0].message,
      "'max_age' of 549 ms is less than one period of 'rate' (50 ms) and 'timeout' (500 ms) together: values "
      "grow stale although the unit replies in time; set 'max_age' to 550 ms or more, or read more often");
  EXPECT_GT(found[0].place.line, 0U);
  EXPECT_EQ(warnings("rate: 20 Hz\n    max_age: 2 s", "rate: 1 Hz").size(), 1U) << "the default age is 1 s";
  EXPECT_EQ(warnings("max_age: 2 s", "timeout: 5 s").size(), 1U);
}

TEST_F(ScenarioFile, ProcessesAreRead) {
  ASSERT_EQ(scenario().processes.size(), 2U);
  const ProcessSection& dut = scenario().processes[0];
  EXPECT_EQ(dut.name.text, "dut");
  EXPECT_TRUE(dut.enabled);
  EXPECT_TRUE(dut.safe_on_exit);
  ASSERT_EQ(dut.command.size(), 4U);
  const auto address_of = [](const std::string& section, const std::string& name) {
    return "<" + section + "|" + name + ">";
  };
  EXPECT_EQ(dut.command[0].expand(address_of), "controller");
  EXPECT_EQ(dut.command[2].expand(address_of), "<can|car>");
  EXPECT_EQ(dut.command[3].expand(address_of), "--map=<modbus|plc>/<can|bench>");
  const ProcessSection& plc = scenario().processes[1];
  EXPECT_EQ(plc.name.text, "plc");
  EXPECT_FALSE(plc.enabled);
  EXPECT_FALSE(plc.safe_on_exit);
  EXPECT_EQ(plc.start_timeout_ns, 3'000'000'000);
}

template <class Data>
const Data& claimed(const Expectation& expectation) {
  return dynamic_cast<const expectations::ClaimOf<Data>&>(*expectation.claim).data;
}

TEST_F(ScenarioFile, ExpectationsAreRead) {
  ASSERT_EQ(scenario().expectations.size(), 11U);
  const auto& never = claimed<expectations::Never>(scenario().expectations[0]);
  ASSERT_EQ(never.condition.nodes().size(), 3U);
  EXPECT_EQ(never.condition.nodes()[0].word.text, "collision.ego");
  EXPECT_EQ(never.condition.nodes()[0].word.place, (Place{path("scenario.yaml"), 84, 34}));
  EXPECT_EQ(claimed<expectations::Eventually>(scenario().expectations[2]).by_ns, 9'000'000'000);
  const auto& response = claimed<expectations::Response>(scenario().expectations[3]);
  EXPECT_EQ(response.request.text, "can.car.Objects.Counter");
  EXPECT_EQ(response.reply.text, "can.car.BrakeCommand.AnswerTo");
  EXPECT_EQ(response.within_ns, 50'000'000);
  EXPECT_EQ(response.at_least, 10U);
}

TEST_F(ScenarioFile, ExpectationsHaveWindows) {
  EXPECT_FALSE(scenario().expectations[0].window);
  const auto& window = scenario().expectations[4].window;
  ASSERT_TRUE(window && window->after && window->until);
  EXPECT_EQ(window->from_ns, 1'000'000'000);
  EXPECT_EQ(window->to_ns, 9'000'000'000);
  EXPECT_EQ(window->after->text(), "ego.demand > 0");
  EXPECT_EQ(window->until->text(), "ego.speed == 0");
  EXPECT_EQ(scenario().expectations[5].coverage, 0.8);
}

TEST(ScenarioDefaults, ApplyToAScenarioOfOneLine) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  const auto scenario = files.load("scenario: least\n", diagnostics);
  ASSERT_TRUE(scenario) << diagnostics.to_text();
  EXPECT_EQ(scenario->base_period_ns, 1'000'000);
  EXPECT_EQ(scenario->duration_ticks, 10'000U);
  EXPECT_EQ(scenario->clock, ClockKind::realtime);
  EXPECT_EQ(scenario->seed, 1U);
  EXPECT_EQ(scenario->realtime.scheduler, Scheduler::fifo);
  EXPECT_EQ(scenario->world.gpu, "auto");
  EXPECT_EQ(scenario->world.chunk_ns, 1'000'000);
  EXPECT_EQ(scenario->world.durability, Durability::async);
  EXPECT_EQ(scenario->world.flush_interval_ns, 10'000'000);
  EXPECT_EQ(scenario->world.log_ring_bytes, 16U << 20);
  EXPECT_TRUE(scenario->tasks.empty());
  EXPECT_TRUE(scenario->processes.empty());
}

TEST(ScenarioRecording, HasItsSignalsFramesAndSize) {
  const ScenarioFolder files;
  const auto load = [&](const std::string& section) {
    Diagnostics diagnostics;
    const auto scenario = files.load("scenario: s\n" + section, diagnostics);
    EXPECT_TRUE(scenario) << diagnostics.to_text();
    return scenario ? scenario->recording : std::nullopt;
  };
  EXPECT_FALSE(load(""));
  EXPECT_FALSE(load("recording: false"));
  EXPECT_FALSE(load("recording: {enabled: false, max_size: 2 MiB}"));
  for (const char* section : {"recording: true", "recording: {}"}) {
    const auto all = load(section);
    ASSERT_TRUE(all);
    ASSERT_EQ(all->signals.size(), 1U);
    EXPECT_EQ(all->signals[0].text, "*");
    EXPECT_TRUE(all->frames);
    EXPECT_EQ(all->max_bytes, std::uint64_t{1} << 30);
  }
  const auto some = load("recording: {signals: [plant.*, a.b], frames: false, max_size: 1.5 MiB}");
  ASSERT_TRUE(some);
  ASSERT_EQ(some->signals.size(), 2U);
  EXPECT_EQ(some->signals[0].text, "plant.*");
  EXPECT_EQ(some->signals[1].text, "a.b");
  EXPECT_FALSE(some->frames);
  EXPECT_EQ(some->max_bytes, 1'572'864U);
  EXPECT_EQ(load("recording: {max_size: 1048576 B, signals: []}")->max_bytes, 1'048'576U);
}

TEST(ScenarioPlots, HaveSignalsAndAPartOfTheRun) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  const auto scenario = files.load(
      "scenario: s\nplots:\n  - {title: A, signals: [x.a, x.b]}\n"
      "  - {title: B, signals: [x.a], from: 1 s, until: 2 s}\n",
      diagnostics);
  ASSERT_TRUE(scenario) << diagnostics.to_text();
  ASSERT_EQ(scenario->plots.size(), 2U);
  EXPECT_EQ(scenario->plots[0].title, "A");
  EXPECT_EQ(scenario->plots[0].signals.size(), 2U);
  EXPECT_FALSE(scenario->plots[0].from_ns);
  EXPECT_FALSE(scenario->plots[0].until_ns);
  EXPECT_EQ(scenario->plots[1].from_ns, 1'000'000'000);
  EXPECT_EQ(scenario->plots[1].until_ns, 2'000'000'000);
}

TEST(ScenarioDefaults, PermitNoLoss) {
  const ScenarioFolder files;
  const auto load = [&](const std::string& text) {
    Diagnostics diagnostics;
    auto scenario = files.load(text, diagnostics);
    EXPECT_TRUE(scenario) << diagnostics.to_text();
    return std::move(scenario).value();
  };
  const Scenario strict = load(scenario_text);
  EXPECT_DOUBLE_EQ(strict.realtime.max_lost, 0.05);
  EXPECT_DOUBLE_EQ(strict.expectations[0].coverage, 0.95);
  EXPECT_FALSE(can_of(strict, 0).may_be_lost || modbus_of(strict, 0).may_be_lost ||
               strict.processes[0].may_be_lost);
  EXPECT_FALSE(strict.processes[0].free_running);
  const Scenario lenient = load(
      with_change("watchdog: 250 ms", "watchdog: 250 ms, max_lost: 12.5 %",
                  with_change("never: \"collision.ego > 0\"", "never: \"collision.ego > 0\", coverage: 50 %",
                              with_change("    rate: 20 Hz\n", "    rate: 20 Hz\n    may_be_lost: true\n"))));
  EXPECT_DOUBLE_EQ(lenient.realtime.max_lost, 0.125);
  EXPECT_DOUBLE_EQ(lenient.expectations[0].coverage, 0.5);
  EXPECT_TRUE(modbus_of(lenient, 0).may_be_lost);
}

TEST(ScenarioDefaults, RefuseProcessesOutOfStepWithTheVirtualClock) {
  const ScenarioFolder files;
  const auto mistakes = [&](const std::string& command, const std::string& more = "") {
    Diagnostics diagnostics;
    files.load(
        "scenario: stepped\nclock: virtual\n"
        "can: [{bus: car, database: crossing.dbc, rate: 100 Hz}]\n"
        "modbus:\n"
        "  - {unit: plc, device: \"127.0.0.1:auto\", registers: map.yaml, rate: 20 Hz, run_time: time_ms}\n"
        "  - {unit: io, device: \"127.0.0.1:auto\", registers: map.yaml, rate: 20 Hz}\n"
        "processes:\n"
        "  ports: {command: [ports, \"{modbus.plc}\", \"{modbus.io}\"]}\n"
        "  tool: {command: [tool" +
            command + "]" + more + "}\n",
        diagnostics);
    return diagnostics.to_text();
  };
  EXPECT_EQ(mistakes(", \"{clock}\""), "");
  EXPECT_EQ(mistakes(", \"{can.car}\""), "");
  EXPECT_EQ(mistakes(", \"{modbus.plc}\""), "");
  EXPECT_EQ(mistakes("", ", free_running: true"), "");
  EXPECT_EQ(mistakes("", ", enabled: false"), "");
  for (const char* command : {"", ", --fast", ", \"{modbus.io}\""}) {
    const std::string text = mistakes(command);
    EXPECT_NE(text.find(":9:3: 'clock: virtual': the process 'tool' can not keep step with the run"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("'free_running: true'"), std::string::npos) << text;
  }
}

TEST(ScenarioDefaults, OfDurabilityCanBeChanged) {
  const ScenarioFolder files;
  const auto world = [&](const std::string& words) {
    Diagnostics diagnostics;
    const auto scenario = files.load("scenario: kept\nworld: " + words + "\n", diagnostics);
    return scenario ? std::optional(scenario->world) : std::nullopt;
  };
  EXPECT_EQ(world("{durability: volatile}")->durability, Durability::none);
  EXPECT_EQ(world("{durability: group}")->durability, Durability::group);
  EXPECT_EQ(world("{durability: sync}")->durability, Durability::sync);
  EXPECT_EQ(world("{flush_interval: 0 ms}")->flush_interval_ns, 0);
  EXPECT_EQ(world("{log_ring_bytes: 4096}")->log_ring_bytes, 4096U);
  EXPECT_EQ(world("{chunk: 0 ms}")->chunk_ns, 0);
  EXPECT_EQ(world("{chunk: 250 us}")->chunk_ns, 250'000);
  for (const char* refused :
       {"{durability: on}", "{flush_interval: 2 min}", "{log_ring_bytes: 4095}", "{chunk: -1 ms}"})
    EXPECT_FALSE(world(refused)) << refused;
}

TEST(ScenarioDefaults, RotateRollFirstAndYawLast) {
  const ScenarioFolder files;
  Diagnostics diagnostics;
  const auto scenario = files.load(
      "scenario: turned\nworld:\n  entities:\n"
      "    - {name: e, shape: {sphere: 1 m}, rotation: {yaw: 90 deg, roll: 90 deg}}\n",
      diagnostics);
  ASSERT_TRUE(scenario) << diagnostics.to_text();
  // Yaw * roll: half-angle products; the other order would have the y part negative.
  const auto& q = scenario->world.entities[0].rotation_wxyz;
  EXPECT_NEAR(q[0], 0.5, 1e-15);
  EXPECT_NEAR(q[1], 0.5, 1e-15);
  EXPECT_NEAR(q[2], 0.5, 1e-15);
  EXPECT_NEAR(q[3], 0.5, 1e-15);
}

TEST(Layers, AreAtMost32) {
  Layers layers;
  for (int i = 0; i < 32; ++i)
    EXPECT_EQ(layers.add("layer" + std::to_string(i)), std::uint32_t{1} << i);
  EXPECT_EQ(layers.add("one_more"), std::nullopt);
  EXPECT_EQ(layers.add("layer31"), 0x80000000U);
  EXPECT_EQ(layers.bit("one_more"), std::nullopt);
}

}  // namespace
}  // namespace hil::config
