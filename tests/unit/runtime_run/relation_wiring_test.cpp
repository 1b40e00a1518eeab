// Relations of bodies in the expressions of a scenario: the task that computes them, and mistakes.

#include <gtest/gtest.h>

#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::run {
namespace {

constexpr const char* two_boxes = R"yaml(scenario: two boxes
base_rate: 1 kHz
duration: 1 s
world:
  layers: [body]
  entities:
    - {name: rock, shape: {box: [1 m, 1 m, 1 m]}, mask: [body]}
    - {name: cart, shape: {box: [1 m, 1 m, 1 m]}, position: [9 m, 0 m, 0 m], mask: [body]}
  regions: [{name: gate, center: [0 m, 0 m, 0 m], size: [2 m, 2 m, 2 m]}]
tasks:
  - {module: plant, type: block, rate: 1 kHz, inputs: {x: gap}, parameters: {inputs: {x: m}, outputs: {y: x}}}
variables:
  gap: distance(rock, cart)
expectations:
  - {name: free, never: "contact(rock, cart) or inside(cart, gate)"}
)yaml";

class RelationWiring : public test::WiringFixture {
 protected:
  std::string mistakes(const std::string& from, const std::string& to) {
    EXPECT_FALSE(wired(changed(from, to, two_boxes))) << to;
    std::string text = diagnostics_.to_text();
    for (std::size_t at; (at = text.find("scenario.yaml")) != std::string::npos;)
      text.erase(0, at + std::string("scenario.yaml:").size());
    return text;
  }
};

TEST_F(RelationWiring, ATaskAtTheEndOfEachTickIsAdded) {
  const auto wiring = wired(two_boxes);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  ASSERT_EQ(scenario_->tasks.size(), 2u);
  const config::TaskSection& task = scenario_->tasks[1];
  EXPECT_EQ(task.module.text, "relations");
  EXPECT_EQ(task.every_ticks, 1u);
  EXPECT_EQ(task.deadline_ns, 1'000'000);
  EXPECT_TRUE(task.thread.empty());
  ASSERT_EQ(wiring->modules.size(), 2u);
  EXPECT_EQ(wiring->modules[1].section, &task);
  ASSERT_EQ(wiring->modules[1].links.outputs.size(), 3u);
  const char* const names[] = {"distance(rock, cart)", "contact(rock, cart)", "inside(cart, gate)"};
  for (std::size_t i = 0; i < 3; ++i) {
    const signals::SignalInfo& info = wiring->signals.info(wiring->modules[1].links.outputs[i]);
    EXPECT_EQ(info.name, names[i]);
    EXPECT_EQ(info.writer, "module relations");
    const modules::Port& port = wiring->modules[1].module->ports().outputs[i];
    EXPECT_EQ(port.name, names[i]);
    EXPECT_EQ(port.unit, info.unit);
    EXPECT_FALSE(port.about.empty());
  }
}

TEST_F(RelationWiring, ATaskOfTheTypeComputesThem) {
  const auto wiring = wired(
      changed("tasks:\n", "tasks:\n  - {module: space, type: spatial_relations, rate: 100 Hz}\n", two_boxes));
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(scenario_->tasks.size(), 2u);
  EXPECT_EQ(wiring->modules[0].links.outputs.size(), 3u);
  EXPECT_EQ(wiring->signals.info(wiring->modules[0].links.outputs[0]).writer, "module space");
}

TEST_F(RelationWiring, InputsAndPlotsNameThem) {
  const std::string text =
      changed("inputs: {x: gap},", "inputs: {x: 'distance( cart,rock )'},", two_boxes) +
      "plots: [{title: far, signals: ['distance(cart, rock)', 'time_to_impact(rock, cart)']}]\n";
  const auto wiring = wired(text);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  EXPECT_EQ(wiring->modules[1].links.outputs.size(), 5u);
  const auto signal = wiring->signals.find("distance(cart, rock)");
  ASSERT_TRUE(signal);
  EXPECT_EQ(wiring->modules[0].links.inputs[0].signal, *signal);
  EXPECT_EQ(wiring->signals.find("distance( cart,rock )"), signal)
      << "a reader may look it up as it is written";
}

TEST_F(RelationWiring, AnInstantIsASignalOfSeconds) {
  const std::string text = changed("inside(cart, gate)", "crossed_at(cart, gate) > 5 s", two_boxes);
  const auto wiring = wired(text);
  ASSERT_TRUE(wiring) << diagnostics_.to_text();
  const auto signal = wiring->signals.find("crossed_at(cart, gate)");
  ASSERT_TRUE(signal);
  EXPECT_EQ(wiring->signals.info(*signal).unit, "s");
  EXPECT_NE(
      diagnostics_.to_text().find("15:60: warning: crossed_at(cart, gate) is never known: no task writes"),
      std::string::npos)
      << diagnostics_.to_text();
  ASSERT_TRUE(
      wired(changed("tasks:\n",
                    "tasks:\n  - {module: fly, type: free_body, rate: 1 kHz, parameters: {body: cart, "
                    "mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]}}\n",
                    text)))
      << diagnostics_.to_text();
  EXPECT_EQ(diagnostics_.to_text().find("never known"), std::string::npos) << diagnostics_.to_text();
  EXPECT_NE(mistakes("inside(cart, gate)", "crossed_at(cart, gate)").find("15:"), std::string::npos)
      << "an instant is no condition";
  EXPECT_EQ(mistakes("inside(cart, gate)", "crossed_at(cart, gait) > 5 s"),
            "15:66: there is no region 'gait' in world.regions; did you mean 'gate'?\n");
}

TEST_F(RelationWiring, FirmTransactionsNeedATaskThatOnlyReads) {
  const auto with = [](const std::string& task) {
    return changed("tasks:\n", "tasks:\n  - {module: m, rate: 1 kHz, transactions: firm, " + task + "}\n",
                   two_boxes);
  };
  ASSERT_TRUE(wired(with("type: spatial_relations"))) << diagnostics_.to_text();
  EXPECT_TRUE(scenario_->tasks[0].firm_at.has_value());
  EXPECT_TRUE(task_parameters(*scenario_, scenario_->tasks[0]).firm);
  EXPECT_FALSE(task_parameters(*scenario_, scenario_->tasks[1]).firm);
  ASSERT_TRUE(wired(changed("firm", "soft", with("type: spatial_relations"))));
  EXPECT_FALSE(scenario_->tasks[0].firm_at.has_value());
  const auto refusal = [&](const std::string& task) {
    EXPECT_FALSE(wired(with(task))) << task;
    const std::string text = diagnostics_.to_text();
    const std::size_t at = text.find("scenario.yaml:");
    return at == std::string::npos ? text : text.substr(at + std::string("scenario.yaml:").size());
  };
  EXPECT_EQ(
      refusal("type: free_body, parameters: {body: cart, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2]}"),
      "11:44: 'transactions: firm' is for tasks that only read the world; module m of type free_body "
      "writes to it, so leave the key out\n");
  EXPECT_EQ(refusal("type: block, parameters: {outputs: {y: 1}}"),
            "11:44: 'transactions: firm' is for tasks that only read the world; module m of type block does "
            "not use it, so leave the key out\n");
}

TEST_F(RelationWiring, WithoutRelationsNoTaskIsAdded) {
  const std::string text = changed("  - {name: free, never: \"contact(rock, cart) or inside(cart, gate)\"}\n",
                                   "  - {name: free, never: plant.y > 1 m}\n",
                                   changed("gap: distance(rock, cart)", "gap: 1 m", two_boxes));
  ASSERT_TRUE(wired(text)) << diagnostics_.to_text();
  EXPECT_EQ(scenario_->tasks.size(), 1u);
  ASSERT_TRUE(wired(
      changed("tasks:\n", "tasks:\n  - {module: space, type: spatial_relations, rate: 1 kHz}\n", text)));
  EXPECT_NE(
      diagnostics_.to_text().find("no expression reads a relation of bodies, as distance(a, b), so module "
                                  "space computes nothing"),
      std::string::npos)
      << diagnostics_.to_text();
}

TEST_F(RelationWiring, MistakesHaveTheirPlaces) {
  EXPECT_EQ(mistakes("size: [2 m, 2 m, 2 m]", "size: [2 m, 2 m, 2 m], carrier: cart"),
            "15:56: 'cart' carries this region, so the relation never changes; name another body\n");
  EXPECT_EQ(mistakes("name: rock", "name: then"),
            "7:14: 'then' is a word of the expression language; give the entity another name\n");
  EXPECT_EQ(mistakes("distance(rock, cart)", "distance(rock, cart + 1)"),
            "13:28: 'distance' takes names: (body, other)\n");
  EXPECT_EQ(mistakes("distance(rock, cart)", "distance(rock, crat)"),
            "13:23: there is no body 'crat'; did you mean 'cart'?\n");
  EXPECT_EQ(mistakes("inside(cart, gate)", "inside(cart, gait)"),
            "15:62: there is no region 'gait' in world.regions; did you mean 'gate'?\n");
  EXPECT_EQ(mistakes("inside(cart, gate)", "sees(ahead, cart)"),
            "15:54: there is no beam 'ahead' in world.beams\n");
  EXPECT_EQ(mistakes("size: [2 m, 2 m, 2 m]", "size: [2 m, 2 m, 2 m], carrier: wall"),
            "9:83: there is no body 'wall'; known here: rock, cart\n");
  EXPECT_EQ(
      mistakes("module: plant", "module: relations"),
      "11:14: the name 'relations' is that of the task that computes the relations of bodies; give this "
      "module another name\n");
  EXPECT_EQ(
      mistakes("tasks:\n",
               "tasks:\n  - {module: space, type: spatial_relations, rate: 1 kHz}\n  - {module: "
               "again, type: spatial_relations, rate: 1 kHz}\n"),
      "12:14: the task of module space computes the relations of bodies already; a scenario has one such "
      "task\n");
  EXPECT_EQ(mistakes("tasks:\n",
                     "tasks:\n  - {module: space, type: spatial_relations, rate: 1 kHz, inputs: {x: gap}}\n"),
            "11:68: module space has no inputs\n");
  EXPECT_EQ(
      mistakes("outputs: {y: x}", "outputs: {y: 'distance(rock, cart)'}"),
      "11:108: 'distance(rock, cart)' is known only to variables, stimuli, faults and expectations of a "
      "scenario; give it to a variable there\n");
  EXPECT_EQ(mistakes("inputs: {x: gap},", "inputs: {x: '2 * distance(rock, cart)'},"),
            "11:59: '2 * distance(rock, cart)' is no signal; a computed value is the signal of one of the "
            "'variables'\n");
}

}  // namespace
}  // namespace hil::run
