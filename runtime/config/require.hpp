#pragma once
// Misuse by a programmer stops the program with one line that says what and where, in release builds as well.

namespace hil::config {

/// The place is that of the caller. (std::source_location is beyond clang-tidy 14, which checks this house.)
[[noreturn]] void stop_on_misuse(const char* rule, const char* file = __builtin_FILE(),
                                 int line = __builtin_LINE());

inline void require(bool holds, const char* rule, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) {
  if (!holds) stop_on_misuse(rule, file, line);
}

}  // namespace hil::config
