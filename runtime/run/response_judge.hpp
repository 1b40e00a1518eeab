#pragma once
// Judges that every request is answered in time.
//
// Every sample of the request signal is one request, known by its value and time; every sample of the reply
// signal is one reply. A request is answered by the first reply of its value that does not come before it. A
// reply passes over older requests: they stay unanswered. At most 65536 requests wait at once; beyond, the
// oldest counts as unanswered.
//
// An unanswered request can not be judged, and is counted apart, when the run ended before its time was over,
// or when the replying device was not connected (its signal `connected`) on a tick of that time. The
// expectation is not checked when fewer than `at_least` requests could be judged, or too small a share of
// those whose time was over.
//
// Samples of a CAN message are frames, each with its own time: two that come within one tick are two. Of
// other signals only the value at every tick is known; a sample is one that differs from the tick before (or from
// the signal's initial value), however often it was written.
//
// Requests and replies may become known in either order, since the thread that sends a request says so after
// the fact: a reply that nothing waited for is remembered (the newest 64) for a request that is older than
// itself.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/run/expectations.hpp"

namespace hil::run {

class ResponseJudge final : public Judge {
 public:
  /// `arrivals` outlives it. Keeps the times of the first `max_samples` answers, a million at most; all are
  /// judged.
  ResponseJudge(const config::Expectation& expectation, const config::Response& claim,
                const signals::SignalTable& table, const Arrivals& arrivals, std::uint64_t max_samples);

  void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
             std::int64_t time_ns) noexcept override;
  report::Expectation result(const Extent& extent) const override;
  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override;

 private:
  struct Known {
    double value = 0.0;
    std::int64_t time_ns = 0;
    bool disconnected = false;  ///< of a request: the replying device was, while its time ran
  };

  /// One side of the claim.
  struct Side {
    std::string name;
    signals::SignalId signal;
    bool one_by_one = false;  ///< every sample arrives; else the table shows the newest
    double last_value = 0.0;
    std::int64_t last_ns = 0;
  };
  template <typename Use>
  static void take(Side& side, const signals::SignalTable& table, std::span<const Arrival> arrived,
                   const Use& use) noexcept;

  const Known& waiting(std::size_t i) const noexcept { return pending_[(first_ + i) % pending_.size()]; }
  void add_request(Known request) noexcept;
  void take_reply(Known reply) noexcept;
  bool answer(Known reply) noexcept;
  void mark_disconnected(std::int64_t time_ns) noexcept;
  void give_up_first(std::size_t count) noexcept;
  void drop_first(std::size_t count) noexcept;
  void note_failure(std::int64_t time_ns) noexcept;
  bool is_list_whole() const noexcept { return answered_ == samples_ns_.size(); }
  struct Unanswered {
    std::uint64_t judged = 0;        ///< their time was over and the device could reply
    std::uint64_t disconnected = 0;  ///< the device was not connected
    std::uint64_t cut_off = 0;       ///< the run ended too early
  };
  Unanswered unanswered_by(std::int64_t end_ns) const;
  std::string figures(const Unanswered& unanswered) const;
  std::optional<std::int64_t> first_failure(std::int64_t end_ns) const;

  const std::string name_;
  const Arrivals& arrivals_;
  Coverage coverage_;
  std::optional<signals::SignalId> reply_connected_;
  Side requests_, replies_;
  const std::int64_t within_ns_;
  const std::uint64_t at_least_;
  std::vector<Known> pending_;  // a ring
  std::size_t first_ = 0, pending_count_ = 0;
  std::array<Known, 64> early_replies_;  // a ring; unused ones are older than any request
  std::size_t next_early_ = 0;
  std::uint64_t answered_ = 0, late_ = 0, given_up_ = 0, given_up_disconnected_ = 0;
  std::int64_t slowest_ns_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
  std::vector<std::int64_t> samples_ns_;
};

}  // namespace hil::run
