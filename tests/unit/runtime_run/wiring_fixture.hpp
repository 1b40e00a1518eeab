#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "runtime/config/scenario.hpp"
#include "runtime/run/wiring.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run::test {

/// Wires scenarios in a folder of the test, and keeps the diagnostics of the last one.
class WiringFixture : public ::testing::Test {
 protected:
  /// Empty when the scenario is refused.
  std::optional<Wiring> wired(const std::string& text) {
    diagnostics_ = {};
    auto loaded =
        config::load_scenario(folder_.write("scenario.yaml", text), {}, scenario_types(), diagnostics_);
    is_loaded_ = loaded.has_value();
    if (!loaded) return std::nullopt;
    scenario_ = std::make_unique<config::Scenario>(std::move(*loaded));
    return wire(*scenario_, diagnostics_);
  }
  /// The text with `from`, which it contains, replaced by `to`.
  static std::string changed(const std::string& from, const std::string& to, std::string text) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("not in the text: " + from);
    return text.replace(at, from.size(), to);
  }

  const tests::TemporaryFolder folder_;
  config::Diagnostics diagnostics_;
  bool is_loaded_ = false;  ///< a refused scenario was refused by its wiring
  std::unique_ptr<config::Scenario> scenario_;
};

}  // namespace hil::run::test
