#pragma once
// Misuse of this room's interfaces ends the program, in every build: a wrong frame on a bus is worse than no
// program.

#include <cstdio>
#include <cstdlib>
#include <source_location>

namespace hil::io::can {

inline void require(bool condition, const char* rule,
                    std::source_location place = std::source_location::current()) noexcept {
  if (condition) return;
  std::fprintf(stderr, "%s:%u: misuse: %s\n", place.file_name(), static_cast<unsigned>(place.line()), rule);
  std::abort();
}

}  // namespace hil::io::can
