#pragma once
// What the queries have in common for LatePolicy: what prepare refuses, and how many places answers need.

#include <cstddef>
#include <string>

#include <rtstdb/query.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb::query {

inline Result<void> check_late(const std::string& name, LatePolicy late) {
  if (late <= LatePolicy::partial) return {};
  return Error{ErrorCode::bad_input, "query '" + name + "' has the late policy " +
                                         std::to_string(static_cast<unsigned>(late)) +
                                         ", which is none of the enumerators"};
}

/// Where those of before have to stay, others are written elsewhere.
constexpr std::size_t places_of_answers(LatePolicy late) noexcept {
  return late == LatePolicy::last_good ? 2 : 1;
}

}  // namespace rtstdb::query
