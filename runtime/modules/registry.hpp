#pragma once
// The module types of the program (table.def). Threads: immutable.

#include <string>
#include <vector>

#include <hil/module.hpp>

namespace hil::modules {

/// By name.
const std::vector<ModuleType>& module_types();
/// Null: there is none of that name.
const ModuleType* find_module_type(const std::string& name);

}  // namespace hil::modules
