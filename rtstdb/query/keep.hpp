#pragma once

#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::query {

/// Moves a result to where it belongs, or returns its error.
template <class T>
Result<void> keep(Result<T> made, T& where) {
  if (!made) return made.error();
  where = std::move(made).value();
  return {};
}

}  // namespace rtstdb::query
