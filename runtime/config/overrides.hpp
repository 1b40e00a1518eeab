#pragma once
// The command line's --set path=value changes the document before it is checked, so that the same rules apply
// to its values. Their mistakes have places of the form "--set dut.enabled:1:COLUMN", where columns count in
// "path=value".
//
//   dut.enabled=false                          keys joined by dots
//   tasks.scanner.parameters.columns=96        an entry of a list: by its name, module or message, of a bus
//                                              by its name_key (bus_section.hpp),
//   can.car.receive.BrakeCommand.timeout=1 s   or by its text when it is a bare word,
//   world.entities.0.mask=[static]             or by its index, from 0
//
// The value is YAML. A key of the schema, or a name that something else checks, as an input of a module,
// can be set where the file leaves it out. Entries of lists, and names that only the file defines, must be
// in the file. A path that begins with a plus, as "+tasks.tank.parameters.outputs.low", may add such a
// name. A path that is set twice is a mistake.

#include <span>
#include <string>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/contract/tree.hpp"

namespace hil::config {

/// Each override that can not be applied is a mistake and changes nothing; the others are applied. `types`:
/// of a scenario; without any for another document.
void apply_overrides(TreeNode& root, const Schema& schema, std::span<const std::string> overrides,
                     const ScenarioTypes& types, Diagnostics& diagnostics);

/// The keys of a scenario (include.hpp) that have paths with their values.
enum class SettingsKey : std::uint8_t {
  set,
  add,  ///< may add names that only the file defines
};
void apply_settings(TreeNode& root, const Schema& schema, const TreeNode& settings, SettingsKey key,
                    const ScenarioTypes& types, Diagnostics& diagnostics);

}  // namespace hil::config
