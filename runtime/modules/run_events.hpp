#pragma once
// The events that modules, stimuli and faults note in a run, for its report.
//
// Threads: those of hil/event_log.hpp; events and lost after the run.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include <hil/contribution.hpp>
#include <hil/event_log.hpp>

namespace hil::modules {

class RunEvents final : public EventLog {
 public:
  struct Event {
    std::int64_t time_ns = 0;
    std::string text;
  };

  /// Keeps the first `capacity` events and counts the others.
  explicit RunEvents(std::size_t capacity = contribution::max_listed_events);

  using EventLog::add_kind;
  Kind add_kind(std::string text, int decimals) override;
  using EventLog::note;
  void note(Kind kind, std::int64_t time_ns, double number) noexcept override;

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
