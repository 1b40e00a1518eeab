#include "runtime/config/bus_section.hpp"

#include <algorithm>
#include <cctype>

#include "runtime/config/text_lists.hpp"

namespace hil::config {
namespace {

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

}  // namespace hil::config
