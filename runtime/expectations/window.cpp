#include "runtime/expectations/window.hpp"

#include <algorithm>
#include <utility>

#include <hil/quantity.hpp>

#include "runtime/expectations/time_text.hpp"
#include "runtime/expectations/watched_condition.hpp"

namespace hil::expectations {
namespace {

class WindowedJudge final : public Judge {
 public:
  WindowedJudge(std::unique_ptr<Judge> judge, const JudgeContext& context)
      : judge_(std::move(judge)),
        name_(context.expectation.name),
        from_ns_(context.expectation.window->from_ns.value_or(0)),
        to_ns_(context.expectation.window->to_ns) {
    const config::WindowSection& window = *context.expectation.window;
    if (window.after) after_.emplace(*window.after, context.table, with_seed(context, 1));
    if (window.until) until_.emplace(*window.until, context.table, with_seed(context, 2));
  }

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override {
    move_to(table, instant);
    if (doubt_ != nullptr) {
      judge_->check_unplaced(table, instant, doubt_->was_known());
      if (instant.is_tick && !opened_ns_) ++unplaced_ticks_before_;
    } else if (is_open_)
      judge_->check(table, instant);
    else
      judge_->skip(table, instant);
  }
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool /*in_gap*/) noexcept override {
    check(table, instant);
  }

  bool judged_in_last_check() const noexcept override { return is_open_ && judge_->judged_in_last_check(); }
  report::Expectation result(const Extent& extent) const override {
    if (!opened_ns_) {
      return {.name = name_,
              .result = report::ExpectationResult::not_checked,
              .detail = "its window did not open" + reason(extent)};
    }
    const Extent inside = extent_of_window(extent);
    report::Expectation result = judge_->result(inside);
    result.detail +=
        "; in the window from " + instant_text(*opened_ns_) + " to " + instant_text(inside.end_ns);
    const bool is_cut = to_ns_ && !closed_ns_ && extent.end_ns < *to_ns_;
    if (is_cut && result.result == report::ExpectationResult::held) {
      result.result = report::ExpectationResult::not_checked;
      result.detail += ", and the run ended before the end of the window at " + instant_text(*to_ns_);
    }
    return result;
  }
  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override {
    return judge_->response_times(end_of_window(end_ns));
  }

 private:
  void move_to(const signals::SignalTable& table, signals::Instant instant) noexcept {
    const std::int64_t time_ns = instant.time_ns;
    const Truth after = after_ ? after_->truth(table, instant) : Truth::yes;
    const Truth until = until_ ? until_->truth(table, instant) : Truth::no;
    const bool was_open = opened_ns_.has_value();
    const bool is_past = to_ns_ && time_ns > *to_ns_;
    if (!was_open && after == Truth::yes && time_ns >= from_ns_ && !is_past) opened_ns_ = time_ns;
    if (opened_ns_ && !closed_ns_ && (is_past || (was_open && until == Truth::yes))) closed_ns_ = time_ns;
    is_open_ = opened_ns_ && !closed_ns_;
    doubt_ = nullptr;
    if (is_open_ && was_open && until == Truth::unknown) doubt_ = &*until_;
    if (!opened_ns_ && after == Truth::unknown && time_ns >= from_ns_ && !is_past) doubt_ = &*after_;
  }
  static expression::CompileOptions with_seed(const JudgeContext& context, std::uint64_t number) {
    return {.period_ns = context.options.period_ns, .seed = context.options.seed ^ (number << 32)};
  }
  std::string reason(const Extent& extent) const {
    if (extent.end_ns <= from_ns_)
      return ": the run ended at " + instant_text(extent.end_ns) + ", before " + instant_text(from_ns_);
    const std::string by = to_ns_ ? " up to " + instant_text(std::min(*to_ns_, extent.end_ns)) : "";
    if (!after_) return ": no tick of the run is in it";
    return ": '" + after_->text() + "' was not true" +
           (from_ns_ > 0 ? " from " + instant_text(from_ns_) + " on" : "") + by;
  }
  std::int64_t end_of_window(std::int64_t end_ns) const {
    if (to_ns_) end_ns = std::min(end_ns, *to_ns_);
    return closed_ns_ ? std::min(end_ns, *closed_ns_) : end_ns;
  }
  /// Its ticks are those that were due, also where the run skipped them or ended before.
  Extent extent_of_window(const Extent& extent) const {
    const auto ticks_before = [&](std::int64_t time_ns) {
      return static_cast<std::uint64_t>((time_ns + extent.period_ns - 1) / extent.period_ns);
    };
    std::uint64_t end = extent.ticks;
    if (to_ns_) end = std::min(end, ticks_before(*to_ns_ + 1));
    if (closed_ns_) end = std::min(end, ticks_before(*closed_ns_));
    const std::uint64_t begin = ticks_before(*opened_ns_);
    return {.end_ns = end_of_window(extent.end_ns),
            .ticks = end - std::min(begin, end) + unplaced_ticks_before_,
            .period_ns = extent.period_ns,
            .begin_ns = *opened_ns_,
            .ticks_before = unplaced_ticks_before_};
  }

  const std::unique_ptr<Judge> judge_;
  const std::string name_;
  const std::int64_t from_ns_;
  const std::optional<std::int64_t> to_ns_;
  std::optional<WatchedCondition> after_, until_;
  std::optional<std::int64_t> opened_ns_, closed_ns_;
  bool is_open_ = false;                     ///< at the last instant
  const WatchedCondition* doubt_ = nullptr;  ///< its unknown truth decides whether the last instant is inside
  std::uint64_t unplaced_ticks_before_ = 0;  ///< the ticks with a doubt before the window opened
};

}  // namespace

void check_within(const config::Value& within, const config::Value& entry,
                  const config::ClaimContext& context) {
  const bool has_limits = entry.has("between");
  std::int64_t available_ns = context.duration_ns;
  if (has_limits) {
    const std::vector<config::Value>& limits = entry["between"].items();
    available_ns = limits[1].duration_ns() - limits[0].duration_ns();
  }
  if (available_ns <= 0 || within.duration_ns() < available_ns) return;
  context.diagnostics.add(within.place(), "'within': " + config::format_duration(within.duration_ns()) +
                                              " is as long as the " + (has_limits ? "window" : "run") +
                                              ", which takes " + config::format_duration(available_ns) +
                                              ", so nothing could be late");
}

std::unique_ptr<Judge> make_windowed_judge(std::unique_ptr<Judge> judge, const JudgeContext& context) {
  return std::make_unique<WindowedJudge>(std::move(judge), context);
}

}  // namespace hil::expectations
