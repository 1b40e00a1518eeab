#pragma once
// Work on all processors.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace rtstdb::test {

/// Calls visit(i) for each i below `count`, from as many threads as there are processors. Returns after the
/// last call.
template <class Visit>
void for_each_in_parallel(std::size_t count, const Visit& visit) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++)
      visit(i);
  };
  std::vector<std::jthread> threads;
  for (unsigned k = 1; k < std::thread::hardware_concurrency(); ++k)
    threads.emplace_back(work);
  work();
}

}  // namespace rtstdb::test
