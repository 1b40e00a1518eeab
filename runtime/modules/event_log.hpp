#pragma once
// The events of a run for its report: "light of the ego's road turns green". A module registers its kinds of
// events when it is configured. In the tick it notes a kind and a number; the text is made after the run.
//
// Threads: add_kind while configuring; note from any number of tick threads at once, without a lock; events
// and lost after the run.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/contribution/contribution.hpp"

namespace hil::modules {

class EventLog {
 public:
  struct Kind {
    std::uint32_t index = 0;
  };
  struct Event {
    std::int64_t time_ns = 0;
    std::string text;
  };

  /// Keeps the first `capacity` events and counts the others.
  explicit EventLog(std::size_t capacity = contribution::max_listed_events);

  /// The number of the event, with `decimals` decimals, replaces a "{}" in the text.
  Kind add_kind(std::string text, int decimals = 1);

  void note(Kind kind, std::int64_t time_ns, double number = 0.0) noexcept;

  /// By time, events of one instant in the order of their kinds: the list does not depend on the order in
  /// which threads noted them.
  std::vector<Event> events() const;
  /// The number of events that were not kept.
  std::uint64_t lost() const noexcept;

 private:
  struct Entry {
    std::int64_t time_ns = 0;
    std::uint32_t kind = 0;
    double number = 0.0;
  };
  struct KindText {
    std::string text;
    int decimals = 1;
  };
  std::vector<KindText> kinds_;
  std::vector<Entry> entries_;
  std::atomic<std::uint64_t> noted_{0};
};

}  // namespace hil::modules
