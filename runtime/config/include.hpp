#pragma once
// The keys `include`, `add` and `set` of a scenario.
//
//   include: [plant.yaml, ../buses/car.yaml]        files with parts of a scenario, which may include others
//   set: {tasks.tank.parameters.level: 2 m}         changes values of the included files, as --set does
//   add: {tasks.tank.parameters.outputs.low: 1}     adds names that the scenario defines itself
//
// Entries of lists come one after the other, those of the included files first. Records and maps are joined.
// Where both have a value, that of the including file counts. Two included files that differ in a value are a
// mistake, unless the including file has it. A file is included once.

#include <memory>
#include <optional>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/plugins_section.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/contract/source_text.hpp"
#include "runtime/contract/tree.hpp"

namespace hil::config {

inline constexpr std::size_t max_included_files = 100;

/// The document in `source` with the files that it includes, without the three keys. Empty when there is a
/// mistake that leaves no tree to check. `path`: of the source, so that no file includes itself.
std::optional<TreeNode> build_tree_with_includes(const std::string& path,
                                                 const std::shared_ptr<const SourceText>& source,
                                                 const Schema& schema, TypesWithPlugins& types,
                                                 Diagnostics& diagnostics);

}  // namespace hil::config
