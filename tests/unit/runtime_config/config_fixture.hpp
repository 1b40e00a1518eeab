#pragma once
// Diagnostics of runtime/config as assertions.

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include <hil/diagnostics.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/config/scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::config::test {

/// Whether there is exactly one mistake, at this place, and its text contains `words`.
inline ::testing::AssertionResult is_only_mistake(const Diagnostics& diagnostics, std::uint32_t line,
                                                  std::uint32_t column, std::string_view words) {
  if (diagnostics.count() == 1) {
    const Mistake& mistake = diagnostics.mistakes()[0];
    if (mistake.place.line == line && mistake.place.column == column &&
        mistake.message.find(words) != std::string::npos) {
      return ::testing::AssertionSuccess();
    }
  }
  return ::testing::AssertionFailure() << "expected one mistake at " << line << ":" << column << " with \""
                                       << words << "\", but there are " << diagnostics.count() << ":\n"
                                       << diagnostics.to_text();
}

/// Whether there is a mistake at this place whose text contains `words`.
inline ::testing::AssertionResult has_mistake(const Diagnostics& diagnostics, std::uint32_t line,
                                              std::uint32_t column, std::string_view words) {
  for (const Mistake& mistake : diagnostics.mistakes()) {
    if (mistake.place.line == line && mistake.place.column == column &&
        mistake.message.find(words) != std::string::npos) {
      return ::testing::AssertionSuccess();
    }
  }
  return ::testing::AssertionFailure()
         << "no mistake at " << line << ":" << column << " with \"" << words << "\" in:\n"
         << diagnostics.to_text();
}

}  // namespace hil::config::test
