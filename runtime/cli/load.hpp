#pragma once
// Loads a scenario file with the overrides of the command line and wires it. Mistakes and warnings go to
// stderr, all at once.

#include <cstddef>
#include <filesystem>
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

/// The folder of this program, in which those of a scenario are searched first.
std::filesystem::path program_folder();

/// Empty when there was a mistake; all mistakes have then been printed, and `mistakes`, if it is not null,
/// has them and the warnings, one line each.
std::optional<Loaded> load(const std::string& file, const std::vector<std::string>& overrides,
                           std::string* mistakes = nullptr);

/// The overrides of --add, then those of --set (config/overrides.hpp).
std::vector<std::string> with_additions(const std::vector<std::string>& additions,
                                        const std::vector<std::string>& overrides);

}  // namespace hil::cli
