#pragma once
// The messages of a recording as JSON.
//
// Threads: pure functions.

#include <cstdint>
#include <string>
#include <string_view>

namespace hil::recording {

/// The shortest digits that read back as the same double; null for what is no finite number.
void append_number(std::string& json, double value);
/// With quotes. Bytes that are no UTF-8 are replaced.
std::string json_text(std::string_view text);
/// Seconds as a JSON number, exact to the nanosecond.
std::string seconds(std::int64_t time_ns);

std::string event_message(std::int64_t time_ns, std::string_view text);
std::string miss_message(std::string_view task, std::uint64_t tick, std::string_view cause,
                         std::int64_t lateness_ns);

}  // namespace hil::recording
