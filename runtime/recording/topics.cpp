#include "runtime/recording/topics.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace hil::recording {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view module_prefix = "module ";
/// Topics that are of no module.
constexpr std::array<std::string_view, 5> own_topics{"events", "misses", "variables", "stimuli", "faults"};

using Property = contribution::FrameMember;

McapTopic topic_of(const std::string& name, const std::vector<Property>& properties) {
  Json schema = Json::object();
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  schema["title"] = name;
  schema["type"] = "object";
  schema["properties"] = Json::object();
  for (const Property& property : properties) {
    Json& entry = schema["properties"][property.name];
    entry["type"] = property.type;
    if (!property.about.empty()) entry["description"] = property.about;
  }
  return {.name = "/" + name,
          .schema_name = "hil." + name,
          .schema = schema.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

/// The name of a signal's topic without '/', and that of its member.
std::pair<std::string, std::string> place_of(const signals::SignalInfo& info) {
  if (info.writer.starts_with(module_prefix)) {
    const std::string module = info.writer.substr(module_prefix.size());
    const bool is_taken = std::ranges::find(own_topics, module) != own_topics.end();
    return {is_taken ? "module." + module : module, info.name.substr(module.size() + 1)};
  }
  if (info.writer.starts_with("stimulus ")) return {"stimuli", info.name};
  if (!info.name.starts_with(info.writer + ".")) return {info.writer, info.name};  // variables, faults, ...
  const std::string rest = info.name.substr(info.writer.size() + 1);
  if (!info.arrives) return {info.writer, rest};
  const std::size_t dot = rest.rfind('.');
  if (dot == std::string::npos) return {info.name, "value"};
  return {info.writer + "." + rest.substr(0, dot), rest.substr(dot + 1)};
}

}  // namespace

std::vector<SignalTopic> signal_topics(const signals::SignalTable& table,
                                       std::span<const signals::SignalId> signals) {
  std::vector<SignalTopic> topics;
  std::vector<std::pair<std::string, std::vector<Property>>> described;
  std::map<std::string, std::size_t> index_of;
  for (const signals::SignalId signal : signals) {
    const signals::SignalInfo& info = table.info(signal);
    auto [topic, member] = place_of(info);
    const auto [found, is_new] = index_of.try_emplace(topic, topics.size());
    if (is_new) {
      topics.emplace_back();
      described.emplace_back(topic, std::vector<Property>{});
    }
    described[found->second].second.push_back({member, "number", info.unit});
    topics[found->second].members.push_back({signal, std::move(member)});
  }
  for (std::size_t i = 0; i < topics.size(); ++i)
    topics[i].topic = topic_of(described[i].first, described[i].second);
  return topics;
}

McapTopic frame_topic(const std::string& bus, const contribution::FrameFormat& format) {
  McapTopic topic = topic_of("frames/" + bus, format.members);
  topic.schema_name = format.schema_name;
  return topic;
}

McapTopic event_topic() {
  return topic_of("events", {{"time", "number", "run time in s"}, {"text", "string", ""}});
}

McapTopic miss_topic() {
  return topic_of("misses", {{"task", "string", ""},
                             {"tick", "number", "of the release"},
                             {"cause", "string", ""},
                             {"lateness", "number", "end minus deadline in s"}});
}

}  // namespace hil::recording
