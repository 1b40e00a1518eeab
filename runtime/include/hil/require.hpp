#pragma once
// Misuse by a programmer stops the program with one line that says what and where, also in release builds.

namespace hil::config {

/// The place is that of the caller. (clang-tidy 14 does not know std::source_location.)
[[noreturn]] void stop_on_misuse(const char* rule, const char* file = __builtin_FILE(),
                                 int line = __builtin_LINE());

inline void require(bool holds, const char* rule, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) {
  if (!holds) stop_on_misuse(rule, file, line);
}

}  // namespace hil::config
