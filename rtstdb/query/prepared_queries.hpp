#pragma once
// The queries that are prepared and not yet destroyed. When buffers that they are bound to change, setup
// binds all of them again and has their kernels compiled, so that the tick does not.
//
// Threads: any. The owner's thread may destroy a query while the engine thread binds it.

#include <algorithm>
#include <mutex>
#include <vector>

namespace rtstdb::query {

class GpuQuery;

class PreparedQueries {
 public:
  void join(GpuQuery& query) {
    const std::scoped_lock lock(mutex_);
    queries_.push_back(&query);
  }
  void leave(GpuQuery& query) noexcept {
    const std::scoped_lock lock(mutex_);
    std::erase(queries_, &query);
  }
  bool empty() noexcept {
    const std::scoped_lock lock(mutex_);
    return queries_.empty();
  }
  /// Calls `each` with every query until it returns false. No query is destroyed during the call.
  template <class Each>
  void visit(const Each& each) {
    const std::scoped_lock lock(mutex_);
    (void)std::ranges::all_of(queries_, [&](GpuQuery* query) { return each(*query); });
  }

 private:
  std::mutex mutex_;
  std::vector<GpuQuery*> queries_;
};

}  // namespace rtstdb::query
