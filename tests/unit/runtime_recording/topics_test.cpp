#include "runtime/recording/topics.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace hil::recording {
namespace {

std::vector<SignalTopic> topics_of(const std::vector<signals::SignalInfo>& infos) {
  signals::SignalTable table;
  std::vector<signals::SignalId> all;
  for (const signals::SignalInfo& info : infos)
    all.push_back(table.add(info));
  return signal_topics(table, all);
}

std::string outline(const std::vector<SignalTopic>& topics) {
  std::string text;
  for (const SignalTopic& topic : topics) {
    text += topic.topic.name + ":";
    for (const SignalTopic::Member& member : topic.members)
      text += " " + member.name + "=" + std::to_string(member.signal.index);
    text += "\n";
  }
  return text;
}

TEST(SignalTopics, EachWriterHasOne) {
  const std::string text = outline(topics_of({
      {.name = "plant.level", .unit = "m", .writer = "module plant"},
      {.name = "scanner.object0.x", .unit = "m", .writer = "module scanner"},
      {.name = "plant.flow", .unit = "l/s", .writer = "module plant"},
      {.name = "can.car.EgoStatus.Counter", .unit = "", .writer = "can.car", .arrives = true},
      {.name = "can.car.Brake.Force", .unit = "N", .writer = "can.car", .arrives = true},
      {.name = "can.car.Brake.On", .unit = "", .writer = "can.car", .arrives = true},
      {.name = "can.car.connected", .unit = "", .writer = "can.car"},
      {.name = "can.car.Brake.fresh", .unit = "", .writer = "can.car"},
      {.name = "modbus.plc.light", .unit = "", .writer = "modbus.plc", .arrives = true},
      {.name = "modbus.plc.light.fresh", .unit = "", .writer = "modbus.plc"},
      {.name = "stimulus.step", .unit = "", .writer = "stimuli"},
      {.name = "plant.inflow", .unit = "l/s", .writer = "stimulus step"},
      {.name = "fault.stuck", .unit = "", .writer = "faults"},
      {.name = "plant.level.faulted", .unit = "m", .writer = "faults"},
      {.name = "distance", .unit = "m", .writer = "variables"},
  }));
  EXPECT_EQ(text,
            "/plant: level=0 flow=2\n"
            "/scanner: object0.x=1\n"
            "/can.car.EgoStatus: Counter=3\n"
            "/can.car.Brake: Force=4 On=5\n"
            "/can.car: connected=6 Brake.fresh=7\n"
            "/modbus.plc.light: value=8\n"
            "/modbus.plc: light.fresh=9\n"
            "/stimuli: stimulus.step=10 plant.inflow=11\n"
            "/faults: fault.stuck=12 plant.level.faulted=13\n"
            "/variables: distance=14\n");
}

TEST(SignalTopics, ModulesWithNamesOfOtherTopicsAreApart) {
  std::vector<signals::SignalInfo> infos;
  for (const char* name : {"events", "misses", "variables", "stimuli", "faults"})
    infos.push_back({.name = std::string(name) + ".x", .unit = "", .writer = std::string("module ") + name});
  infos.push_back({.name = "x", .unit = "", .writer = "variables"});
  EXPECT_EQ(outline(topics_of(infos)),
            "/module.events: x=0\n/module.misses: x=1\n/module.variables: x=2\n/module.stimuli: x=3\n"
            "/module.faults: x=4\n/variables: x=5\n");
}

TEST(SignalTopics, SchemasHaveTheUnitsOfTheirMembers) {
  const auto topics = topics_of({{.name = "plant.level", .unit = "m", .writer = "module plant"},
                                 {.name = "plant.on", .unit = "", .writer = "module plant"},
                                 {.name = "plant.temp",
                                  .unit = "\xB0"
                                          "C",
                                  .writer = "module plant"}});
  ASSERT_EQ(topics.size(), 1U);
  EXPECT_EQ(topics[0].topic.schema_name, "hil.plant");
  const auto schema = nlohmann::json::parse(topics[0].topic.schema);
  EXPECT_EQ(schema["type"], "object");
  EXPECT_EQ(schema["properties"]["level"], (nlohmann::json{{"type", "number"}, {"description", "m"}}));
  EXPECT_EQ(schema["properties"]["on"], (nlohmann::json{{"type", "number"}}));
  EXPECT_EQ(schema["properties"]["temp"]["description"],
            "\xEF\xBF\xBD"
            "C")
      << "bytes that are no UTF-8";
}

}  // namespace
}  // namespace hil::recording
