#pragma once
// How much a test does: its short form in every run, less where a sanitizer takes twenty times as long, its long form with
// tools/test --long.

#include <cstdint>

namespace hil::torture {

constexpr std::uint64_t rounds(std::uint64_t short_form, [[maybe_unused]] std::uint64_t long_form) {
#if defined(HIL_TORTURE_LONG)
  (void)short_form;
  return long_form;
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return short_form / 10;
#else
  return short_form;
#endif
}

}  // namespace hil::torture
