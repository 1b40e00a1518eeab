#pragma once
// The queries that are prepared and not yet destroyed, so that all can be connected again, and their shaders
// compiled, when what they are connected to has changed: in setup, not in the tick that asks them next.
//
// Threads: any. A query is destroyed by its owner's thread while the database's may be connecting it.

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
  /// Calls `each` with every query until it returns false; none is destroyed meanwhile.
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
