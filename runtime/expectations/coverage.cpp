#include "runtime/expectations/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "runtime/expectations/time_text.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::expectations {
namespace {

/// Rounded down, so that a share below a limit is never printed as the limit.
std::string percent_text(double share) {
  char text[48];
  std::snprintf(text, sizeof text, "%g %%", std::floor(share * 1000.0 + 1e-9) / 10.0);
  return text;
}

}  // namespace

Coverage::Coverage(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
                   const Arrivals& arrivals, const config::Expectation& expectation)
    : arrivals_(nullptr), min_share_(expectation.coverage) {
  const auto add = [&](const std::vector<signals::SignalId>& added, bool is_of_window) {
    for (const signals::SignalId signal : added) {
      const signals::SignalInfo& info = table.info(signal);
      signals_.push_back({.signal = signal,
                          .name = info.name,
                          .arrives = info.arrives,
                          .timeout_ns = info.timeout_ns,
                          .is_of_window = is_of_window});
      if (arrivals.keeps(signal)) arrivals_ = &arrivals;
    }
  };
  add(signals, false);
  if (expectation.window)
    for (const auto* condition : {&expectation.window->after, &expectation.window->until})
      if (*condition) add(signals::signals_in(**condition, table), true);
  intervals_.reserve(max_intervals);
  causes_.resize(max_intervals * signals_.size());
}

void Coverage::check(const signals::SignalTable& table, signals::Instant instant, bool evaluated) noexcept {
  if (instant.is_tick) check_tick(table, instant.time_ns, evaluated, false);
}

void Coverage::check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                              bool in_gap) noexcept {
  if (in_gap && !unplaced_ns_) unplaced_ns_ = instant.time_ns;
  if (instant.is_tick) check_tick(table, instant.time_ns, false, true);
}

void Coverage::check_tick(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated,
                          bool of_window) noexcept {
  if (evaluated) ++evaluated_ticks_;
  if (!evaluated) note_not_evaluated(time_ns);
  for (std::size_t i = 0; i < signals_.size(); ++i) {
    SignalCoverage& signal = signals_[i];
    const bool is_known = table.is_known(signal.signal);
    const bool may_be_cause = !evaluated && signal.is_of_window == of_window;
    if (is_known && !std::isnan(table.value(signal.signal))) {
      signal.was_known = true;
    } else if (may_be_cause) {
      ++signal.ticks_not_evaluated;
      if (is_listed_) causes_[(intervals_.size() - 1) * signals_.size() + i] = true;
    }
    if (is_known)
      signal.stale_since_ns.reset();
    else if (signal.arrives)
      note_stale(signal, i, time_ns, !may_be_cause);
  }
  was_evaluated_ = evaluated;
  last_tick_ns_ = time_ns;
}

void Coverage::note_stale(SignalCoverage& signal, std::size_t index, std::int64_t time_ns,
                          bool evaluated) noexcept {
  if (!signal.stale_since_ns) signal.stale_since_ns = time_ns;
  const std::int64_t begin_ns = *signal.stale_since_ns;
  if (evaluated || signal.timeout_ns == 0 || time_ns - begin_ns <= signal.timeout_ns) return;
  if (!stale_interval_) stale_interval_ = StaleInterval{index, begin_ns, time_ns};
  if (stale_interval_->signal == index && stale_interval_->begin_ns == begin_ns)
    stale_interval_->end_ns = time_ns;
}

void Coverage::note_not_evaluated(std::int64_t time_ns) noexcept {
  if (was_evaluated_) {
    is_listed_ = intervals_.size() < max_intervals;
    if (is_listed_) intervals_.push_back({time_ns, time_ns});
  }
  if (is_listed_) intervals_.back().end_ns = time_ns;
}

std::uint64_t Coverage::evaluated_ticks(const std::optional<PendingBegin>& oldest_pending) const noexcept {
  return oldest_pending ? std::min(oldest_pending->evaluated_before, evaluated_ticks_) : evaluated_ticks_;
}

std::vector<report::NotEvaluated> Coverage::not_evaluated(
    const Extent& extent, const std::optional<PendingBegin>& oldest_pending) const {
  std::vector<report::NotEvaluated> all;
  for (std::size_t k = 0; k < intervals_.size(); ++k) {
    all.push_back({.begin_ns = intervals_[k].begin_ns, .end_ns = intervals_[k].end_ns, .signals = {}});
    for (std::size_t i = 0; i < signals_.size(); ++i)
      if (causes_[k * signals_.size() + i]) all.back().signals.push_back(signals_[i].name);
  }
  if (!oldest_pending || last_tick_ns_ < oldest_pending->time_ns) return all;
  // The ticks from its begin on are one interval.
  const std::int64_t period_ns = extent.period_ns;
  const std::int64_t begin_ns = (oldest_pending->time_ns + period_ns - 1) / period_ns * period_ns;
  report::NotEvaluated open{.begin_ns = begin_ns, .end_ns = last_tick_ns_, .signals = {}};
  while (!all.empty() && all.back().end_ns >= begin_ns) {
    for (const std::string& signal : all.back().signals)
      if (std::ranges::find(open.signals, signal) == open.signals.end()) open.signals.push_back(signal);
    open.begin_ns = std::min(open.begin_ns, all.back().begin_ns);
    all.pop_back();
  }
  if (all.size() < max_intervals) all.push_back(std::move(open));
  return all;
}

bool Coverage::suffices(std::uint64_t part, std::uint64_t whole) const noexcept {
  constexpr double rounding = 1e-9;
  return part > 0 && static_cast<double>(part) + rounding >= min_share_ * static_cast<double>(whole);
}

std::string Coverage::share_text(std::uint64_t part, std::uint64_t whole, const std::string& what) const {
  if (part == 0) return "none of " + std::to_string(whole) + " " + what;
  return std::to_string(part) + " of " + std::to_string(whole) + " " + what + " (" +
         percent_text(static_cast<double>(part) / static_cast<double>(whole)) +
         "), less than its coverage of " + report::shortest(min_share_ * 100.0) + " %";
}

std::string Coverage::unplaced_text() const {
  if (!unplaced_ns_) return "";
  return "it was unknown whether " + instant_text(*unplaced_ns_) +
         " is in its window, and the result depends on it";
}

std::string Coverage::shortfall(std::uint64_t covered_ticks,
                                const std::optional<PendingBegin>& oldest_pending) const {
  if (covered_ticks == 0) return "the run had no tick";
  std::string text;
  const auto add = [&](const std::string& reason) { text += (text.empty() ? "" : "; ") + reason; };
  const std::uint64_t evaluated = evaluated_ticks(oldest_pending);
  if (!suffices(evaluated, covered_ticks)) {
    add("evaluated on " + share_text(evaluated, covered_ticks, "ticks"));
    if (oldest_pending && evaluated != evaluated_ticks_)
      text += ", since what began at " + instant_text(oldest_pending->time_ns) + " was open at the end";
  }
  for (const SignalCoverage& signal : signals_)
    if (!signal.was_known && signal.ticks_not_evaluated > 0)
      add(signal.name + " was never known, on " +
          counted(signal.ticks_not_evaluated, "tick that it decides", "ticks that it decides"));
  if (stale_interval_) {
    const SignalCoverage& signal = signals_[stale_interval_->signal];
    add(signal.name + " was not fresh from " + instant_text(stale_interval_->begin_ns) + " to " +
        instant_text(stale_interval_->end_ns) + ", longer than its time-out of " +
        instant_text(signal.timeout_ns));
  }
  if (unplaced_ns_) add(unplaced_text());
  if (arrivals_ != nullptr && arrivals_->lost() > 0) add(arrivals_->lost_text());
  return text;
}

}  // namespace hil::expectations
