#include "rtstdb/geometry/gltf_json.hpp"

#include <cmath>
#include <stdexcept>

namespace rtstdb::gltf {

void refuse(const std::string& fault) {
  throw std::runtime_error(fault);
}

std::string number(std::uint64_t value) {
  return std::to_string(value);
}

const Json* member(const Json& json, std::string_view name) {
  if (!json.is_object()) return nullptr;
  const auto found = json.find(name);
  return found != json.end() ? &*found : nullptr;
}

const Json::array_t& items(const Json* list) {
  static const Json::array_t none;
  return list != nullptr && list->is_array() ? list->get_ref<const Json::array_t&>() : none;
}

std::string text_of(const Json* json) {
  return json != nullptr && json->is_string() ? json->get<std::string>() : std::string();
}

std::uint64_t whole_number(const Json& value, std::string_view name, const std::string& place) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  constexpr double exact_to = 9007199254740992.0;  // 2^53; some files write 3.0 for 3
  const double real = value.is_number() ? value.get<double>() : -1.0;
  if (real < 0.0 || real > exact_to || real != std::floor(real))
    refuse(place + ": its " + std::string(name) + " is not a whole number");
  return static_cast<std::uint64_t>(real);
}

std::uint64_t whole_or(const Json& object, std::string_view name, std::uint64_t otherwise,
                       const std::string& place) {
  const Json* value = member(object, name);
  return value != nullptr ? whole_number(*value, name, place) : otherwise;
}

std::uint64_t whole(const Json& object, std::string_view name, const std::string& place) {
  if (member(object, name) == nullptr) refuse(place + " has no " + std::string(name));
  return whole_or(object, name, 0, place);
}

}  // namespace rtstdb::gltf
