#pragma once
// Misuse by a programmer stops the program with one line that says what and where, in release builds as well.

#include <source_location>

namespace hil::config {

[[noreturn]] void stop_on_misuse(const char* rule, const std::source_location& where);

inline void require(bool holds, const char* rule,
                    const std::source_location& where = std::source_location::current()) {
  if (!holds) stop_on_misuse(rule, where);
}

}  // namespace hil::config
