#include "runtime/run/reaction_judge.hpp"

#include <algorithm>

#include "runtime/report/quantities.hpp"

namespace hil::run {
namespace {

constexpr std::uint64_t max_open = 65'536;
constexpr std::uint64_t max_kept_samples = 1'000'000;

std::string ascii_time(std::int64_t time_ns) {
  return report::to_ascii(report::chosen_time(time_ns));
}

}  // namespace

ReactionJudge::ReactionJudge(const config::Expectation& expectation, const config::Reaction& claim,
                             const signals::SignalTable& table, std::uint64_t max_samples,
                             const expression::CompileOptions& options)
    : name_(expectation.name),
      conditions_{{claim.when, table, options},
                  {claim.then, table, {.period_ns = options.period_ns, .seed = ~options.seed}}},
      coverage_(signals_of(conditions_), table, expectation.coverage),
      within_ns_(claim.within_ns),
      at_least_(claim.at_least),
      // A condition becomes true at most on each second tick.
      open_(std::min(max_open, static_cast<std::uint64_t>(claim.within_ns / options.period_ns) / 2 + 2)) {
  samples_ns_.reserve(std::min(max_samples, max_kept_samples));
}

void ReactionJudge::begin(std::int64_t time_ns) noexcept {
  if (end_ - first_ == open_.size()) {
    ++first_;
    ++not_judged_;
  }
  open_[end_++ % open_.size()] = {.begin_ns = time_ns};
}

void ReactionJudge::complete_all(std::int64_t time_ns) noexcept {
  for (; first_ != end_; ++first_) {
    const std::int64_t took_ns = time_ns - oldest().begin_ns;
    ++in_time_;
    if (in_time_ == 1 || took_ns > slowest_ns_) {
      slowest_ns_ = took_ns;
      slowest_begin_ns_ = oldest().begin_ns;
    }
    if (samples_ns_.size() < samples_ns_.capacity()) samples_ns_.push_back(took_ns);
  }
}

void ReactionJudge::end_before(std::int64_t time_ns) noexcept {
  for (; first_ != end_ && oldest().begin_ns + within_ns_ < time_ns; ++first_) {
    if (oldest().was_unknown) {
      ++not_judged_;
      continue;
    }
    ++late_;
    if (!first_failure_ns_) first_failure_ns_ = oldest().begin_ns + within_ns_;
  }
}

void ReactionJudge::check(const signals::SignalTable& table, std::span<const Arrival> /*arrived*/,
                          std::int64_t time_ns) noexcept {
  const Truth when = conditions_[0].truth(table, time_ns);
  const Truth then = conditions_[1].truth(table, time_ns);
  if (when == Truth::yes && last_when_ != Truth::yes) begin(time_ns);
  last_when_ = when;
  end_before(time_ns);  // the time of some may have ended in ticks that were skipped
  coverage_.check(table, time_ns, when != Truth::unknown && (then != Truth::unknown || first_ == end_));
  if (then == Truth::yes) {
    complete_all(time_ns);
    return;
  }
  if (then == Truth::unknown) {
    for (std::uint64_t i = first_; i != end_; ++i)
      open_[i % open_.size()].was_unknown = true;
  }
  end_before(time_ns + 1);
}

report::Expectation ReactionJudge::result(const Extent& extent) const {
  const std::string claim = "when " + conditions_[0].text() + " then " + conditions_[1].text() + " within " +
                            ascii_time(within_ns_);
  const std::uint64_t judged = in_time_ + late_;
  std::string figures =
      std::to_string(in_time_) + " of " + report::counted(judged, "reaction", "reactions") + " in time";
  if (in_time_ > 0)
    figures += ", the slowest after " + ascii_time(slowest_ns_) + ", at " +
               report::to_ascii(report::instant(slowest_begin_ns_));
  const std::uint64_t not_judged = not_judged_ + (end_ - first_);
  if (not_judged > 0) figures += "; " + std::to_string(not_judged) + " not judged";
  report::Expectation result{.name = name_,
                             .result = report::ExpectationResult::not_checked,
                             .detail = claim + ": " + figures,
                             .first_failure_ns = first_failure_ns_,
                             .evaluated_ticks = coverage_.evaluated_ticks(),
                             .covered_ticks = extent.ticks};
  const std::string shortfall = coverage_.shortfall(extent.ticks);
  if (late_ > 0) {
    result.result = report::ExpectationResult::failed;
  } else if (judged < at_least_) {
    result.detail += "; at least " + std::to_string(at_least_) + " have to be judged";
  } else if (!shortfall.empty()) {
    result.detail += ", and " + shortfall;
  } else {
    result.result = report::ExpectationResult::held;
  }
  return result;
}

std::optional<report::ResponseTime> ReactionJudge::response_times(std::int64_t /*end_ns*/) const {
  const bool has_all = in_time_ == samples_ns_.size();
  return report::ResponseTime{
      .name = has_all ? name_ : name_ + " (the first " + std::to_string(samples_ns_.size()) + ")",
      .limit_ns = within_ns_,
      .samples_ns = samples_ns_,
      .unanswered = late_,
      .not_judged = not_judged_ + (end_ - first_)};
}

}  // namespace hil::run
