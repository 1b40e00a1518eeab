#include <algorithm>
#include <cctype>

#include "runtime/config/scenario_parts.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::config {
namespace {

void read_common(const Value& entry, UniqueNames& names, BusSection& section, ReaderContext& reading) {
  if (const std::optional<Word> name = word_in(entry, section.type->name_key)) {
    names.add(*name);
    reading.bus_names[section.type->key].push_back(name->text);
    section.name = *name;
  }
  if (entry.has("rate")) {
    if (const std::optional<std::uint32_t> ticks = ticks_between(entry["rate"], reading);
        ticks && reading.base) {
      section.every_ticks = *ticks;
      section.rate_hz = reading.base->hz / *ticks;
      section.period_ns = *ticks * reading.base->period_ns;
    }
  }
  if (!is_whole(entry)) return;
  section.may_be_lost = entry["may_be_lost"].boolean();
  if (entry.has("priority")) section.thread_priority = static_cast<int>(entry["priority"].integer());
}

std::vector<std::string> placeholders_of(std::span<const BusSectionType> types, bool with_condition) {
  std::vector<std::string> all;
  for (const BusSectionType& type : types) {
    if (!type.has_address) continue;
    const bool is_longer = with_condition && !type.run_time_condition.empty();
    all.push_back(type.placeholder() + (is_longer ? " " + type.run_time_condition : ""));
  }
  return all;
}

}  // namespace

std::string BusSection::full_name() const {
  return type->key + "." + name.text;
}

std::string BusSectionType::placeholder() const {
  std::string upper = name_key;
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
  return "{" + key + "." + upper + "}";
}

std::string address_placeholders(std::span<const BusSectionType> types) {
  return text_list(placeholders_of(types, false));
}

std::string all_placeholders(std::span<const BusSectionType> types) {
  std::vector<std::string> all = placeholders_of(types, false);
  all.push_back("{clock}");
  return text_list(all);
}

std::string run_time_placeholders(std::span<const BusSectionType> types) {
  std::vector<std::string> all = placeholders_of(types, true);
  all.insert(all.begin(), "{clock}");
  return text_list(all);
}

void read_buses(const Value& root, Scenario& scenario, ReaderContext& reading) {
  for (const BusSectionType& type : reading.types.buses) {
    const Value* const list = part_of(root, type.key);
    if (list == nullptr) continue;
    UniqueNames names(type.name_key, reading.diagnostics);
    const std::size_t first = scenario.buses.size();
    for (const Value& entry : list->items()) {
      std::unique_ptr<BusSection> section = type.create();
      section->type = &type;
      read_common(entry, names, *section, reading);
      section->read_entry(entry, reading);
      if (is_whole(entry)) scenario.buses.push_back(std::move(section));
    }
    if (type.check != nullptr) type.check(std::span(scenario.buses).subspan(first), reading.diagnostics);
  }
}

}  // namespace hil::config
