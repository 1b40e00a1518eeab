#pragma once
// A query prepared on an executor, without a database.

#include <memory>

#include "rtstdb/query/gpu_executor.hpp"

namespace rtstdb::test {

/// `Kind`: the class on the GPU side that make_query makes for these options.
template <class Kind, class Options>
Result<std::unique_ptr<Kind>> prepare_on(query::GpuExecutor& executor, const Options& options) {
  auto made = executor.prepare(&options);
  if (!made) return made.error();
  return std::unique_ptr<Kind>(static_cast<Kind*>(made.value().release()));
}

}  // namespace rtstdb::test
