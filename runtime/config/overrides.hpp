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
// The value is YAML. A key of the schema, or an input of a module, can be set where the file leaves it out.
// Entries of lists, and other names that the user chooses, must be in the file. A path that is set twice is a
// mistake.

#include <span>
#include <string>

#include "runtime/config/bus_section.hpp"
#include "runtime/config/diagnostics.hpp"
#include "runtime/config/schema.hpp"
#include "runtime/config/tree.hpp"

namespace hil::config {

/// Each override that can not be applied is a mistake and changes nothing; the others are applied. `buses`:
/// the types of bus of a scenario; empty for another document.
void apply_overrides(TreeNode& root, const Schema& schema, std::span<const std::string> overrides,
                     std::span<const BusSectionType> buses, Diagnostics& diagnostics);

/// The same for the key `set` of a scenario (include.hpp): paths with their values.
void apply_settings(TreeNode& root, const Schema& schema, const TreeNode& settings,
                    std::span<const BusSectionType> buses, Diagnostics& diagnostics);

}  // namespace hil::config
