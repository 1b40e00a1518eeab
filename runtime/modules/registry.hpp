#pragma once
// The module types of the program: those of table.def, and those of the plug-ins that it has loaded.
//
// Threads: add_module_types before a run, on one thread; the rest any thread.

#include <deque>
#include <string>
#include <vector>

#include <hil/module.hpp>

namespace hil::modules {

/// Those of table.def by name, then those of plug-ins. References stay valid.
const std::deque<ModuleType>& module_types();
/// Misuse: a name that is taken.
void add_module_types(const std::vector<ModuleType>& types);
/// Null: there is none of that name.
const ModuleType* find_module_type(const std::string& name);

}  // namespace hil::modules
