#pragma once
// The counters of a Modbus client.
//
// Threads: the device's thread and the tick add, any thread reads.

#include <atomic>
#include <cstdint>
#include <numeric>

#include "io/modbus/exception_tally.hpp"
#include "io/modbus/value_watch.hpp"

namespace hil::io::modbus {

/// Counted since construction. reconnects: connections after the first.
struct ClientCounters {
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;   ///< replies, including exceptions
  std::uint64_t timeouts = 0;  ///< requests without a complete reply in time
  std::uint64_t errors = 0;    ///< exceptions, closed connections and invalid replies
  std::uint64_t exceptions = 0;
  ExceptionCounts by_code{};  ///< the exceptions, by code
  FirstRefusedRequests first_refused{};
  std::uint64_t reconnects = 0;
  /// A value that is not a number leaves the register at the value written before, or at the safe value.
  ValueCounters values{};
  std::uint64_t superseded_releases = 0;
  std::uint64_t stale_inputs = 0;  ///< how often an input grew older than max_age
};

struct ClientTally {
  std::atomic<std::uint64_t> requests{0}, replies{0}, timeouts{0}, errors{0}, connects{0}, superseded{0};
  ExceptionTally exceptions;

  /// Without the counters of values and of stale inputs.
  ClientCounters counts() const noexcept {
    constexpr auto relaxed = std::memory_order_relaxed;
    const std::uint64_t connected = connects.load(relaxed);
    ClientCounters counters;
    counters.requests = requests.load(relaxed);
    counters.replies = replies.load(relaxed);
    counters.timeouts = timeouts.load(relaxed);
    counters.errors = errors.load(relaxed);
    counters.by_code = exceptions.counts();
    counters.first_refused = exceptions.first_requests();
    counters.exceptions = std::accumulate(counters.by_code.begin(), counters.by_code.end(), std::uint64_t{0});
    counters.reconnects = connected > 0 ? connected - 1 : 0;
    counters.superseded_releases = superseded.load(relaxed);
    return counters;
  }
};

}  // namespace hil::io::modbus
