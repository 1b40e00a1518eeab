#pragma once
// What a module records of itself in world.json, for the history of the run: plain structs as records, and
// back. A struct names its properties once, in a function
//
//     template <class Self, class Visit> static void each_property(Self& self, Visit&& visit)
//
// that calls visit(key, member) for each of them, in the order of the file. `Self` may be const.
//
// Threads: pure functions. They allocate.

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace hil::contribution {

struct Property {
  std::string key;
  std::variant<bool, std::int64_t, double, std::vector<double>, std::string> value;
};

/// What a module records of itself, for the history of the run or in its report.
struct ModuleRecord {
  std::string list;  ///< the key of the list that holds the record: "scanners"
  std::string name;  ///< of the module in the scenario
  std::vector<Property> properties;
};

}  // namespace hil::contribution

namespace hil::modules {

/// A sentence that begins with "world.json" and names the property of a module's record that is missing, has
/// another type, or is beyond the limits of the module's parameters.
class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// `noun`: what the record is of, as "scanner".
[[noreturn]] inline void refuse_record(const char* noun, const std::string& name, const std::string& fault) {
  throw RecordError(std::string("world.json: ") + noun + " '" + name + "': " + fault);
}

using PropertyValue = decltype(contribution::Property::value);

template <class Member>
concept WholeNumber = std::is_integral_v<Member> && !std::same_as<Member, bool>;

inline bool take(const PropertyValue& value, bool& member) {
  const bool* const given = std::get_if<bool>(&value);
  if (given != nullptr) member = *given;
  return given != nullptr;
}

inline bool take(const PropertyValue& value, WholeNumber auto& member) {
  const std::int64_t* const given = std::get_if<std::int64_t>(&value);
  if (given == nullptr || !std::in_range<std::remove_reference_t<decltype(member)>>(*given)) return false;
  member = static_cast<std::remove_reference_t<decltype(member)>>(*given);
  return true;
}

inline bool take(const PropertyValue& value, double& member) {
  if (const std::int64_t* const whole = std::get_if<std::int64_t>(&value)) {
    member = static_cast<double>(*whole);
    return true;
  }
  const double* const given = std::get_if<double>(&value);
  if (given != nullptr) member = *given;
  return given != nullptr;
}

template <std::size_t size>
bool take(const PropertyValue& value, std::array<double, size>& member) {
  const auto* const given = std::get_if<std::vector<double>>(&value);
  if (given == nullptr || given->size() != size) return false;
  std::copy(given->begin(), given->end(), member.begin());
  return true;
}

template <class Member>
PropertyValue property_value(const Member& member) {
  if constexpr (WholeNumber<Member>) {
    return static_cast<std::int64_t>(member);
  } else if constexpr (std::same_as<Member, bool> || std::same_as<Member, double>) {
    return member;
  } else {
    return std::vector<double>(member.begin(), member.end());
  }
}

/// `list`: the key of world.json whose list holds the record.
template <class Record>
contribution::ModuleRecord properties_of(const Record& record, const char* list, const std::string& name) {
  contribution::ModuleRecord written{.list = list, .name = name, .properties = {}};
  Record::each_property(record, [&](const char* key, const auto& member) {
    written.properties.push_back({key, property_value(member)});
  });
  return written;
}

/// Throws RecordError for a property that is missing or has a value of another type or range.
template <class Record>
Record record_of(const contribution::ModuleRecord& written, const char* noun) {
  Record record;
  Record::each_property(record, [&](const char* key, auto& member) {
    const auto found = std::ranges::find(written.properties, key, &contribution::Property::key);
    if (found == written.properties.end())
      refuse_record(noun, written.name, std::string("property '") + key + "' is missing");
    if (!take(found->value, member))
      refuse_record(noun, written.name,
                    std::string("property '") + key + "' has a value of another type or range");
  });
  return record;
}

}  // namespace hil::modules
