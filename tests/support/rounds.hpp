#pragma once
// The size of a test: its short form in every run, its long form with tools/test --long, and a tenth of the
// short form with a sanitizer.

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace hil::tests {

/// True in the long form of a test; hil_test(... LONG) sets the variable.
inline bool is_long() {
  return std::getenv("HIL_TESTS_LONG") != nullptr;
}

inline std::uint64_t rounds(std::uint64_t short_form, std::uint64_t long_form) {
  if (is_long()) return long_form;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return std::max<std::uint64_t>(1, short_form / 10);
#else
  return short_form;
#endif
}

/// For a test without a long form.
inline std::uint64_t rounds(std::uint64_t count) {
  return rounds(count, count);
}

}  // namespace hil::tests
