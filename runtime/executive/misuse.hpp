#pragma once
// Assertions of programming contracts. A violation stops the program in every build with a message that names
// it, since a runtime that continued would report meaningless numbers.

#include <cstdio>
#include <cstdlib>

namespace hil::executive {

inline void require(bool held, const char* contract) noexcept {
  if (held) return;
  std::fprintf(stderr, "hil: misuse of the executive: %s\n", contract);
  std::abort();
}

}  // namespace hil::executive
