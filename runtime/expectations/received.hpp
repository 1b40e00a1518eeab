#pragma once
// What arrives from a device under one name: a signal, or the signals of a message.
//
// Threads: find_received on the one that wires or opens the run.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/expression.hpp"
#include "runtime/expectations/judge.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

struct Received {
  std::vector<signals::SignalId> signals;    ///< at least one
  std::optional<signals::SignalId> fresh{};  ///< of a message: its state
  std::int64_t timeout_ns = 0;               ///< 0: none

  /// The signal that is 1 while it is fresh; of a signal that is no part of a message, the signal.
  signals::SignalId state() const noexcept { return fresh.value_or(signals.front()); }
  bool is_fresh(const signals::SignalTable& table) const noexcept;
  /// Run time of the newest value; far in the past before the first one.
  std::int64_t newest_ns(const signals::SignalTable& table) const noexcept;
};

/// Empty: nothing of this name is received. A name that is a message and a signal is the message.
std::optional<Received> find_received(const std::string& name, const signals::SignalTable& table);

/// Adds the mistake of a name that find_received does not find. `is_message`: signals are no candidates.
void check_received(const config::Word& name, bool is_message, const ClaimCheck& check);

}  // namespace hil::expectations
