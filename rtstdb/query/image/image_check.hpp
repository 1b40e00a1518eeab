#pragma once
// What an image query may be prepared with, and what its cameras may be.

#include <optional>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::query {

/// Errors: those of prepare (rtstdb/image.hpp).
Result<void> check_image_options(const ImageQueryOptions& options);

/// What is wrong with a camera; `element` is its number. Widens `times` by those of the image.
std::optional<BadInput> check_camera(const Camera& camera, const ImageQueryOptions& options,
                                     std::uint32_t element, const RowSource& rows, TimeSpan& times) noexcept;

/// Half of both angles of view, as tangents. Pixels are square.
struct HalfTangents {
  double x = 0.0, y = 0.0;
};
HalfTangents half_tangents(const Camera& camera, const ImageQueryOptions& options) noexcept;

}  // namespace rtstdb::query
