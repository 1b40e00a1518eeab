#pragma once
// The order in which named expressions that read each other are computed.
//
// Threads: pure functions.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <hil/diagnostics.hpp>

#include "runtime/config/expression.hpp"

namespace hil::expression {

struct Definition {
  config::Word name;
  std::optional<config::Expression> expression;  ///< empty: it has a mistake, which is reported already
};

/// The indices of the definitions, each after those that its expression reads. Left out: those that read
/// themselves, by way of others too, each circle with one mistake at the name that comes first in the file;
/// and those without an expression.
std::vector<std::size_t> definition_order(std::span<const Definition> definitions,
                                          config::Diagnostics& diagnostics);

}  // namespace hil::expression
