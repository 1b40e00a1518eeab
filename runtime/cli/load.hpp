#pragma once
// Loads a scenario file with the overrides of the command line and wires it. Mistakes and warnings go to
// stderr, all at once.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/run/wiring.hpp"

namespace hil::cli {

struct Loaded {
  std::unique_ptr<const config::Scenario> scenario;  // the wiring points at it
  run::Wiring wiring;
  std::size_t warning_count = 0;
};

/// Empty when there was a mistake; all mistakes have then been printed.
std::optional<Loaded> load(const std::string& file, const std::vector<std::string>& overrides);

/// The overrides of --add, then those of --set (config/overrides.hpp).
std::vector<std::string> with_additions(const std::vector<std::string>& additions,
                                        const std::vector<std::string>& overrides);

}  // namespace hil::cli
