#pragma once
// Misuse of this library ends the program in every build, since a wrong frame on a bus is worse than no
// program.

#include <cstdio>
#include <cstdlib>

namespace hil::io::can {

inline void require(bool condition, const char* rule, const char* file = __builtin_FILE(),
                    int line = __builtin_LINE()) noexcept {
  if (condition) return;
  std::fprintf(stderr, "%s:%d: misuse: %s\n", file, line, rule);
  std::abort();
}

}  // namespace hil::io::can
