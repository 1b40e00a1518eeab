#pragma once
// The events of a run for its report: "light of the ego's road turns green". A module registers its kinds of
// events when it is configured. In the tick it notes a kind and a number; the text is made after the run.
//
// Threads: add_kind while configuring; note from any number of tick threads at once, without a lock.

#include <cstdint>
#include <string>
#include <utility>

namespace hil::modules {

class EventLog {
 public:
  struct Kind {
    std::uint32_t index = 0;
  };

  virtual ~EventLog() = default;
  /// The number of the event, with `decimals` decimals, replaces a "{}" in the text.
  virtual Kind add_kind(std::string text, int decimals) = 0;
  Kind add_kind(std::string text) { return add_kind(std::move(text), 1); }
  virtual void note(Kind kind, std::int64_t time_ns, double number) noexcept = 0;
  void note(Kind kind, std::int64_t time_ns) noexcept { note(kind, time_ns, 0.0); }
};

}  // namespace hil::modules
