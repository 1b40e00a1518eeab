#pragma once
// Turns exhausted memory during a setup call into an Error that names what did not fit.

#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include <rtstdb/result.hpp>

namespace rtstdb {

/// The message is "WHAT 'NAME'WHY", or "WHATWHY" without a name. If that can not be allocated, it is "out of
/// memory".
inline Error out_of_memory(std::string_view what, std::string_view name, std::string_view why) noexcept {
  try {
    std::string sentence(what);
    if (!name.empty()) sentence.append(" '").append(name).append("'");
    return {ErrorCode::out_of_memory, sentence.append(why)};
  } catch (const std::bad_alloc&) {
    return {ErrorCode::out_of_memory, "out of memory"};
  }
}

/// Executes `work`; returns an Error if memory runs out or no thread can be created.
template <class Value, class Work>
Result<Value> catch_out_of_memory(std::string_view what, std::string_view name, const Work& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(what, name, " does not fit into memory");
  } catch (const std::system_error&) {
    return out_of_memory(what, name, ": no thread can be created");
  }
}

}  // namespace rtstdb
