#pragma once
// Judges whether every request is answered in time.
//
// Each arrival of the request signal is a request with a value and a time; each arrival of the reply signal
// is a reply. Where the device of a signal keeps no arrivals, or it has none, a change of the value from one
// tick to the next, or from the initial value, counts as one. The first reply of a request's value at or
// after its time answers the request. Older requests without an answer then count as unanswered. At most
// 65536 requests are pending; beyond that the oldest counts as unanswered.
//
// An unanswered request is not judged, and counted separately, when the run ended before its time limit, or
// when the replying device was not connected (its signal `connected`) on a tick before its time limit. The
// expectation is not checked when fewer than `at_least` requests were judged, or too small a share of those
// whose time limit passed.
//
// A reply may become known before its request, since the sending thread reports a frame after it is sent:
// the newest 64 replies without a request are kept for requests that are older than they are.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

/// Each change of `request` (on a bus that keeps all values: each value) is answered by one of `reply` to the
/// same value within the time.
struct Response {
  config::Word request;
  config::Word reply;
  std::int64_t within_ns = 0;
  std::uint64_t at_least = 1;  ///< with fewer judged requests, not checked
};

class ResponseJudge final : public Judge {
 public:
  /// Keeps the times of the first million answers. Further ones are judged, too.
  ResponseJudge(const Response& claim, const JudgeContext& context);

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override;
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override;
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override;
  report::Expectation result(const Extent& extent) const override;
  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override;

 private:
  struct Reply {
    double value = 0.0;
    std::int64_t time_ns = 0;
  };
  struct Request : Reply {
    std::uint64_t evaluated_before = 0;  ///< evaluated ticks before it
    bool is_judged = true;               ///< it came in the window
    bool disconnected = false;           ///< the replying device was not connected before its time limit
  };

  /// The request signal or the reply signal.
  struct Side {
    std::string name;
    signals::SignalId signal;
    bool has_arrivals = false;  ///< all arrivals are known; else only the value at every tick
    double last_value = 0.0;
    std::int64_t last_ns = 0;
  };
  /// Takes the requests and the replies of this instant. Returns whether there was a request.
  bool take(const signals::SignalTable& table, signals::Instant instant, bool is_judged) noexcept;
  /// What came on a side at this instant.
  std::optional<Reply> arrived_at(Side& side, const signals::SignalTable& table,
                                  signals::Instant instant) const noexcept;
  /// The value of a side without arrivals at this tick, if it changed.
  static std::optional<Reply> change_of(Side& side, const signals::SignalTable& table) noexcept;

  const Request& waiting(std::size_t i) const noexcept { return pending_[(first_ + i) % pending_.size()]; }
  void add_request(Request request) noexcept;
  void take_reply(Reply reply) noexcept;
  bool answer(Reply reply) noexcept;
  void mark_disconnected(std::int64_t time_ns) noexcept;
  void count_first_as_unanswered(std::size_t count) noexcept;
  void drop_first(std::size_t count) noexcept;
  void note_failure(std::int64_t time_ns) noexcept;
  bool has_all_times() const noexcept { return answered_ == times_ns_.size(); }
  struct Unanswered {
    std::uint64_t judged = 0;        ///< the time limit passed and the device was connected
    std::uint64_t disconnected = 0;  ///< the device was not connected
    std::uint64_t cut_off = 0;       ///< the run ended before the time limit
  };
  Unanswered unanswered_by(std::int64_t end_ns) const;
  /// The begin of the oldest request whose time limit is after the end.
  std::optional<PendingBegin> oldest_pending(std::int64_t end_ns) const;
  std::string figures(const Unanswered& unanswered) const;
  std::optional<std::int64_t> first_failure(std::int64_t end_ns) const;

  const std::string name_;
  const Arrivals& arrivals_;
  Coverage coverage_;
  std::optional<signals::SignalId> reply_connected_;
  Side requests_, replies_;
  const std::int64_t within_ns_;
  const std::uint64_t at_least_;
  std::vector<Request> pending_;  // a ring
  std::size_t first_ = 0, pending_count_ = 0;
  std::array<Reply, 64> early_replies_;  // a ring; unused ones are older than any request
  std::size_t next_early_ = 0;
  bool was_checked_ = false;  ///< an instant of the window
  std::uint64_t answered_ = 0, late_ = 0, unanswered_ = 0, unanswered_disconnected_ = 0;
  std::int64_t slowest_ns_ = 0, slowest_request_ns_ = 0;
  std::optional<std::int64_t> first_failure_ns_;
  std::vector<std::int64_t> times_ns_;
};

void check_claim(const Response& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Response& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Response& claim, const JudgeContext& context);
PlotContent plot_content_of(const Response& claim, const signals::SignalTable& table);

config::ExpectationKind response_kind();

}  // namespace hil::expectations
