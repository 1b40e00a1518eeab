#pragma once
// Misuse of this room's interfaces ends the program, in release builds too: going on would put wrong values
// on a bus.

#include <cstdio>
#include <cstdlib>

namespace hil::io::modbus {

inline void require(bool holds, const char* what) noexcept {
  if (holds) return;
  std::fprintf(stderr, "hil::io::modbus: misuse: %s\n", what);
  std::abort();
}

}  // namespace hil::io::modbus
