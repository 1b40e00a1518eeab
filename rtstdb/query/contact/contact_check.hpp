#pragma once
// What a contact query may be prepared with, and what its searches may be.

#include <optional>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// Errors: capacity.
Result<void> check_contact_options(const ContactQueryOptions& options);

/// ContactQueryOptions::max_candidates with its default applied. The options have been checked.
std::uint32_t candidates_of(const ContactQueryOptions& options) noexcept;

/// ContactQueryOptions::max_surface_pairs with its default applied. The options have been checked.
std::uint32_t surface_pairs_of(const ContactQueryOptions& options) noexcept;

/// unknown_entity, or no_geometry.
std::optional<BadInput> check_body(EntityId entity, std::uint32_t element, const RowSource& rows) noexcept;

std::optional<BadInput> check_contact_search(const ContactSearch& search, std::uint32_t element,
                                             const RowSource& rows, TimeSpan& times) noexcept;

}  // namespace rtstdb::query
