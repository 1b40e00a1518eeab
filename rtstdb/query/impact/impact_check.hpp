#pragma once
// What an impact query may be prepared with, and what its searches may be.

#include <optional>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// Errors: capacity.
Result<void> check_impact_options(const ImpactQueryOptions& options);

std::optional<BadInput> check_impact_search(const ImpactSearch& search, std::uint32_t element,
                                            const RowSource& rows, TimeSpan& times) noexcept;

}  // namespace rtstdb::query
