#pragma once
// What a ray query refuses: options when it is prepared, rays when a transaction is submitted.

#include <optional>
#include <span>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// Errors: bad_input for an unknown mode or faces; capacity.
Result<void> check_ray_options(const RayQueryOptions& options);

/// What is wrong with a ray; `element` is its number. `ignore_motion`: the ray's time does not matter.
std::optional<BadInput> check_ray(const Ray& ray, std::uint32_t element, bool ignore_motion,
                                  const RowSource& rows) noexcept;

/// Whether everything of a ray but its time and its carrier is valid. Without branches, for long batches.
bool is_valid_ray(const Ray& ray) noexcept;

}  // namespace rtstdb::query
