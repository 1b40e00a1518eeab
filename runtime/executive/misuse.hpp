#pragma once
// Contracts between programmers. A broken one stops the program with a line that says what was broken, in
// every build: a runtime that goes on after that would report numbers that mean nothing.

#include <cstdio>
#include <cstdlib>

namespace hil::executive {

inline void require(bool held, const char* contract) noexcept {
  if (held) return;
  std::fprintf(stderr, "hil: misuse of the executive: %s\n", contract);
  std::abort();
}

}  // namespace hil::executive
