#include "runtime/expectations/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "runtime/report/quantities.hpp"

namespace hil::expectations {
namespace {

std::string seconds(std::int64_t time_ns) {
  return report::to_ascii(report::instant(time_ns));
}

/// Rounded down, so that a share below a limit is never printed as the limit.
std::string percent_text(double share) {
  char text[48];
  std::snprintf(text, sizeof text, "%g %%", std::floor(share * 1000.0 + 1e-9) / 10.0);
  return text;
}

}  // namespace

Coverage::Coverage(const std::vector<signals::SignalId>& signals, const signals::SignalTable& table,
                   double min_share)
    : min_share_(min_share) {
  for (const signals::SignalId signal : signals) {
    const signals::SignalInfo& info = table.info(signal);
    if (info.arrives) watched_.push_back({signal, info.name, info.timeout_ns, std::nullopt});
  }
}

void Coverage::check(const signals::SignalTable& table, std::int64_t time_ns, bool evaluated) noexcept {
  if (evaluated) ++evaluated_ticks_;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    Watched& watched = watched_[i];
    if (table.read(watched.signal).fresh) {
      watched.stale_since_ns.reset();
      continue;
    }
    if (!watched.stale_since_ns) watched.stale_since_ns = time_ns;
    const std::int64_t begin_ns = *watched.stale_since_ns;
    if (evaluated || watched.timeout_ns == 0 || time_ns - begin_ns <= watched.timeout_ns) continue;
    if (!stale_interval_) stale_interval_ = StaleInterval{i, begin_ns, time_ns};
    if (stale_interval_->watched == i && stale_interval_->begin_ns == begin_ns)
      stale_interval_->end_ns = time_ns;
  }
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

std::string Coverage::shortfall(std::uint64_t covered_ticks) const {
  if (covered_ticks == 0) return "the run had no tick";
  std::string text;
  if (!suffices(evaluated_ticks_, covered_ticks))
    text = "evaluated on " + share_text(evaluated_ticks_, covered_ticks, "ticks");
  if (!stale_interval_) return text;
  const Watched& watched = watched_[stale_interval_->watched];
  return text + (text.empty() ? "" : "; ") + watched.name + " was not fresh from " +
         seconds(stale_interval_->begin_ns) + " to " + seconds(stale_interval_->end_ns) +
         ", longer than its time-out of " + seconds(watched.timeout_ns);
}

}  // namespace hil::expectations
