#pragma once
// Checks options against the enumerators of their type.

#include <string>
#include <type_traits>

#include <rtstdb/result.hpp>

namespace rtstdb::query {

/// Errors: bad_input. `what` names the option in the message; `last` is the last enumerator, and the first is
/// 0.
template <class Enumerator>
Result<void> check_enumerator(const std::string& query, const char* what, Enumerator value, Enumerator last) {
  if (value <= last) return {};
  return Error{ErrorCode::bad_input, "query '" + query + "' has the " + what + " " +
                                         std::to_string(std::underlying_type_t<Enumerator>(value)) +
                                         ", which is none of the enumerators"};
}

}  // namespace rtstdb::query
