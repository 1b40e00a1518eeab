#include "runtime/run/loss_watch.hpp"

#include <algorithm>
#include <utility>

namespace hil::run {

LossWatch::LossWatch(std::vector<Subject> subjects) {
  for (Subject& subject : subjects)
    watched_.push_back({.subject = std::move(subject), .disconnected_since_ns = {}, .first_check_ns = {}});
}

bool LossWatch::is_loss(const Watched& watched, std::int64_t until_ns) noexcept {
  const std::int64_t timeout_ns = watched.subject.device->loss_timeout_ns();
  return watched.disconnected_since_ns && timeout_ns > 0 &&
         until_ns - *watched.disconnected_since_ns > timeout_ns;
}

bool LossWatch::never_answered(const Watched& watched) noexcept {
  const io::Device& device = *watched.subject.device;
  return device.loss_timeout_ns() > 0 && watched.acting_faults == 0 && watched.first_check_ns &&
         !watched.has_answered && !device.has_answered();
}

void LossWatch::set_fault(std::size_t subject, const std::string& name, bool active) noexcept {
  Watched& watched = watched_[subject];
  active ? ++watched.acting_faults : --watched.acting_faults;
  if (active) watched.fault = &name;
}

/// Keeps the loss that has ended, if it is one.
void LossWatch::keep(Watched& watched, std::int64_t end_ns) noexcept {
  if (!is_loss(watched, end_ns)) return;
  if (watched.kept_count < watched.kept.size()) {
    watched.kept[watched.kept_count++] = {*watched.disconnected_since_ns, end_ns, watched.cause};
  } else {
    ++watched.not_kept;
  }
}

void LossWatch::check(std::int64_t time_ns) noexcept {
  outputs_must_be_safe_ = false;
  for (Watched& watched : watched_) {
    if (!watched.first_check_ns) watched.first_check_ns = time_ns;
    if (!watched.has_answered) watched.has_answered = watched.subject.device->has_answered();
    if (!watched.subject.device->connected()) {
      if (!watched.disconnected_since_ns) {
        watched.disconnected_since_ns = time_ns;
        watched.cause = watched.acting_faults > 0 ? watched.fault : nullptr;
      }
      if (watched.cause != nullptr && watched.acting_faults == 0) {
        keep(watched, time_ns);
        watched.disconnected_since_ns = time_ns;
        watched.cause = nullptr;
      }
      if (is_loss(watched, time_ns) && !watched.subject.may_be_lost && watched.cause == nullptr)
        outputs_must_be_safe_ = true;
      continue;
    }
    keep(watched, time_ns);
    watched.disconnected_since_ns.reset();
    watched.cause = nullptr;
  }
}

std::vector<report::Loss> LossWatch::losses(std::int64_t end_ns, std::span<const ProcessExit> exits) const {
  std::vector<report::Loss> all;
  for (const ProcessExit& exit : exits) {
    if (!exit.ended_early || exit.safe_on_exit) continue;
    all.push_back({.what = "process " + exit.name,
                   .begin_ns = exit.ended_at_ns,
                   .duration_ns = end_ns - exit.ended_at_ns,
                   .to_the_end = true,
                   .permitted = exit.may_be_lost || !exit.fault.empty(),
                   .fault = exit.fault,
                   .cause = exit.exit});
  }
  for (const Watched& watched : watched_) {
    const auto add = [&](Interval interval, bool to_the_end) {
      all.push_back({.what = watched.subject.name,
                     .begin_ns = interval.begin_ns,
                     .duration_ns = interval.end_ns - interval.begin_ns,
                     .to_the_end = to_the_end,
                     .permitted = watched.subject.may_be_lost || interval.fault != nullptr,
                     .fault = interval.fault == nullptr ? std::string() : *interval.fault,
                     .cause = to_the_end ? watched.subject.device->fault() : std::string()});
    };
    if (never_answered(watched)) {
      add({*watched.first_check_ns, end_ns, nullptr}, true);
      continue;
    }
    for (std::size_t i = 0; i < watched.kept_count; ++i)
      add(watched.kept[i], false);
    if (is_loss(watched, end_ns)) add({*watched.disconnected_since_ns, end_ns, watched.cause}, true);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& left, const auto& right) { return left.begin_ns < right.begin_ns; });
  return all;
}

std::uint64_t LossWatch::not_listed() const noexcept {
  std::uint64_t count = 0;
  for (const Watched& watched : watched_)
    count += watched.not_kept;
  return count;
}

}  // namespace hil::run
