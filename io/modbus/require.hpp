#pragma once
// Misuse of this library ends the program, in release builds too, since continuing would put wrong values on
// a bus.

#include <cstdio>
#include <cstdlib>

namespace hil::io::modbus {

inline void require(bool holds, const char* what) noexcept {
  if (holds) return;
  std::fprintf(stderr, "hil::io::modbus: misuse: %s\n", what);
  std::abort();
}

}  // namespace hil::io::modbus
