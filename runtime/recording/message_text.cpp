#include "runtime/recording/message_text.hpp"

#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>

namespace hil::recording {

void append_number(std::string& json, double value) {
  if (!std::isfinite(value)) {
    json += "null";
    return;
  }
  char digits[32];
  json.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::string json_text(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string seconds(std::int64_t time_ns) {
  const bool is_negative = time_ns < 0;
  const auto bits = static_cast<std::uint64_t>(time_ns);
  const std::uint64_t size = is_negative ? 0U - bits : bits;
  const std::string decimals = std::to_string(size % 1'000'000'000U);
  std::string text;
  if (is_negative) text += '-';
  text += std::to_string(size / 1'000'000'000U);
  text += '.';
  text.append(9 - decimals.size(), '0');
  text += decimals;
  return text;
}

std::string event_message(std::int64_t time_ns, std::string_view text) {
  return std::string("{\"time\":") + seconds(time_ns) + ",\"text\":" + json_text(text) + "}";
}

std::string miss_message(std::string_view task, std::uint64_t tick, std::string_view cause,
                         std::int64_t lateness_ns) {
  return std::string("{\"task\":") + json_text(task) + ",\"tick\":" + std::to_string(tick) +
         ",\"cause\":" + json_text(cause) + ",\"lateness\":" + seconds(lateness_ns) + "}";
}

}  // namespace hil::recording
