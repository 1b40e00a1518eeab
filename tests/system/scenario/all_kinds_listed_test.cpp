// Whether all_kinds/ has every kind that the program has: a new one fails here until it is added there.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "runtime/expression/relation.hpp"
#include "tests/system/scenario/all_kinds.hpp"

namespace hil::scenario_test {
namespace {

using Names = std::set<std::string>;

constexpr const char* checked_sections[] = {"stimuli", "faults", "expectations"};

/// Keys as "faults.drop", and values of keys with a choice as "faults.wrong=counter".
Names listed_by_hil_keys() {
  const Ended ended = run_hil({"keys"});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  const std::regex key_line("( *)- `(\\w+)` \\((.*?)\\): .*"), choice("one of: ([a-z_, ]+)"), word("[a-z_]+");
  Names names;
  std::vector<std::string> path;
  std::istringstream lines(ended.output);
  for (std::string line; std::getline(lines, line);) {
    std::smatch key;
    if (!std::regex_match(line, key, key_line)) continue;
    path.resize(std::min(path.size(), static_cast<std::size_t>(key[1].length()) / 2));
    path.push_back(key[2]);
    if (std::ranges::find(checked_sections, path.front()) == std::end(checked_sections)) continue;
    std::string name = path.front();
    for (std::size_t i = 1; i < path.size(); ++i)
      name += "." + path[i];
    if (path.size() > 1) names.insert(name);
    const std::string type = key[3];
    std::smatch values;
    if (!std::regex_search(type, values, choice)) continue;
    const std::string list = values[1];
    for (std::sregex_iterator value(list.begin(), list.end(), word), end; value != end; ++value)
      names.insert(name + "=" + value->str());
  }
  return names;
}

void add_names(const YAML::Node& node, const std::string& path, Names& names) {
  if (node.IsScalar()) names.insert(path + "=" + node.Scalar());
  if (node.IsSequence()) {
    for (const YAML::Node& entry : node)
      add_names(entry, path, names);
  }
  if (!node.IsMap()) return;
  for (const auto& entry : node) {
    const std::string inner = path + "." + entry.first.Scalar();
    names.insert(inner);
    add_names(entry.second, inner, names);
  }
}

/// The entries of a section in all files of the scenario.
std::vector<YAML::Node> entries_of(const std::string& section) {
  std::vector<YAML::Node> entries;
  for (const char* file : {"signals.yaml", "devices.yaml", "space.yaml"}) {
    for (const YAML::Node& entry : YAML::LoadFile(all_kinds_file(file))[section])
      entries.push_back(entry);
  }
  return entries;
}

TEST(AllKindsListed, EveryKeyAndChoiceIsInTheScenario) {
  const Names listed = listed_by_hil_keys();
  for (const char* known : {"stimuli.sequence.sine.phase", "faults.wrong=counter", "expectations.fresh"})
    ASSERT_TRUE(listed.contains(known)) << known << " is not found in the output of hil keys";
  Names present;
  for (const char* section : checked_sections) {
    for (const YAML::Node& entry : entries_of(section))
      add_names(entry, section, present);
  }
  for (const std::string& name : listed)
    EXPECT_TRUE(present.contains(name)) << name << " is in no entry of all_kinds/*.yaml";
}

/// The faults of each kind of target, from the sentences of hil check on faults that targets do not have.
std::map<std::string, Names> effects_by_target() {
  const Folder folder;
  write_text(folder / "s.yaml", R"(scenario: wrong targets
duration: 1 s
faults:
  - {name: a, signal: x, drop: 1 %}
  - {name: b, message: x, offset: 1}
  - {name: c, device: x, drop: 1 %}
  - {name: d, process: x, drop: 1 %}
  - {name: e, task: x, drop: 1 %}
)");
  const Ended ended = run_hil({"check", folder / "s.yaml"});
  const std::string text = ended.output + ended.errors;
  const std::regex sentence("a (\\w+) has no fault '\\w+'; it has ([a-z_, ]+)"), word("[a-z_]+");
  std::map<std::string, Names> effects;
  for (std::sregex_iterator found(text.begin(), text.end(), sentence), end; found != end; ++found) {
    const std::string list = (*found)[2];
    for (std::sregex_iterator effect(list.begin(), list.end(), word); effect != end; ++effect) {
      if (effect->str() != "and") effects[(*found)[1]].insert(effect->str());
    }
  }
  EXPECT_EQ(effects.size(), 5u) << text;
  return effects;
}

TEST(AllKindsListed, EveryTargetHasEachOfItsFaults) {
  const std::map<std::string, Names> by_target = effects_by_target();
  Names present;  // as "message drop" and "can.car.EgoStatus drop"
  for (const YAML::Node& fault : entries_of("faults")) {
    for (const auto& [target, effects] : by_target) {
      if (!fault[target]) continue;
      for (const std::string& effect : effects) {
        if (!fault[effect]) continue;
        present.insert(target + " " + effect);
        present.insert(fault[target].Scalar() + " " + effect);
        if (effect == "stuck" && fault[effect].Scalar() != "last")
          present.insert(target + " stuck at a value");
        if (effect == "wrong") present.insert(fault[target].Scalar() + " " + fault[effect].Scalar());
      }
    }
  }
  for (const auto& [target, effects] : by_target) {
    for (const std::string& effect : effects)
      EXPECT_TRUE(present.contains(target + " " + effect)) << "no fault of a " << target << " has " << effect;
  }
  EXPECT_TRUE(present.contains("signal stuck at a value"));
  EXPECT_TRUE(present.contains("can.car.0x100 flip_bits")) << "a message by its identifier";
  // Messages in both directions.
  Names of_messages = by_target.at("message");
  of_messages.insert({"counter", "checksum"});
  for (const std::string& effect : of_messages) {
    for (const std::string message : {"can.car.EgoStatus", "can.car.BrakeCommand"})
      EXPECT_TRUE(present.contains(message + " " + effect)) << effect << " of " << message;
  }
}

TEST(AllKindsListed, EveryRelationOfBodiesIsATrigger) {
  std::string conditions;
  for (const YAML::Node& fault : entries_of("faults")) {
    for (const char* key : {"when", "while"})
      if (fault[key]) conditions += fault[key].Scalar() + "\n";
  }
  for (const expression::RelationFunction& function : expression::relation_functions())
    EXPECT_NE(conditions.find(std::string(function.name) + "("), std::string::npos) << function.name;
}

}  // namespace
}  // namespace hil::scenario_test
