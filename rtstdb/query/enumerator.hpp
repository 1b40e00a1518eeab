#pragma once
// What prepare refuses: options that are none of the enumerators.

#include <string>
#include <type_traits>

#include <rtstdb/result.hpp>

namespace rtstdb::query {

/// `what`: as in "query 'x' has the late policy 9"; `last`: the last of the enumerators, which begin at zero.
template <class Enumerator>
Result<void> check_enumerator(const std::string& query, const char* what, Enumerator value, Enumerator last) {
  if (value <= last) return {};
  return Error{ErrorCode::bad_input, "query '" + query + "' has the " + what + " " +
                                         std::to_string(std::underlying_type_t<Enumerator>(value)) +
                                         ", which is none of the enumerators"};
}

}  // namespace rtstdb::query
