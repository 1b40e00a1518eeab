#pragma once
// What happened in a run, for its report: "light of the ego's road turns green". Kinds are registered while
// the run is configured; in the tick a kind and a number are noted, and the text is made after the run.
//
// Threads: add_kind while configuring; note from any number of tick threads at once, without a lock; the rest
// after the run.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

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

  /// At most `capacity` events are kept, the first ones; further ones are counted.
  explicit EventLog(std::size_t capacity = 4096);

  /// A "{}" in the text is replaced by the number noted, with `decimals` digits.
  Kind add_kind(std::string text, int decimals = 1);

  void note(Kind kind, std::int64_t time_ns, double number = 0.0) noexcept;

  /// By time; events of one instant in the order of their kinds, so that the list does not depend on which
  /// thread was first.
  std::vector<Event> events() const;
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
