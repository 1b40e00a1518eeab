#include "runtime/run/input_watch.hpp"

#include <algorithm>
#include <utility>

#include "runtime/report/quantities.hpp"

namespace hil::run {

InputWatch::InputWatch(std::vector<Subject> subjects, std::int64_t period_ns) : period_ns_(period_ns) {
  for (Subject& subject : subjects)
    watched_.push_back({.subject = std::move(subject),
                        .silenced_ns = {},
                        .first_ns = {},
                        .missing_ns = {},
                        .before = {},
                        .after = {}});
}

void InputWatch::set_fault(std::size_t subject, bool active, std::int64_t delay_ns) noexcept {
  Watched& watched = watched_[subject];
  active ? ++watched.acting_faults : --watched.acting_faults;
  if (!active) watched.ended_delay_ns = std::max(watched.ended_delay_ns, delay_ns);
}

void InputWatch::set_task_fault(bool active) noexcept {
  active ? ++acting_task_faults_ : --acting_task_faults_;
}

void InputWatch::check(std::int64_t time_ns, std::span<const State> states) noexcept {
  const bool skips_ticks = acting_task_faults_ > 0 && last_ns_ && time_ns - *last_ns_ > period_ns_;
  last_ns_ = time_ns;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    Watched& watched = watched_[i];
    if (const std::int64_t delay_ns = std::exchange(watched.ended_delay_ns, 0); delay_ns > 0)
      watched.delayed_until_ns = std::max(watched.delayed_until_ns.value_or(0), time_ns + delay_ns);
    const bool is_silenced = watched.acting_faults > 0 || states[i].is_permitted_loss || skips_ticks ||
                             (watched.delayed_until_ns && time_ns <= *watched.delayed_until_ns);
    if (is_silenced) watched.silenced_ns = time_ns;
    const bool recovers =
        watched.silenced_ns && time_ns - *watched.silenced_ns <= watched.subject.recovery_ns;
    const bool is_fresh = states[i].is_fresh;
    if (is_fresh && !watched.first_ns) watched.first_ns = time_ns;
    if (is_fresh && !is_silenced) watched.silenced_ns.reset();
    if (is_silenced || (recovers && !is_fresh)) continue;
    Figures& figures = watched.first_ns ? watched.after : watched.before;
    ++figures.ticks;
    if (is_fresh) continue;
    ++figures.not_fresh;
    if (watched.first_ns && !watched.missing_ns) watched.missing_ns = time_ns;
  }
}

InputWatch::Figures InputWatch::figures(std::size_t subject) const noexcept {
  const Watched& watched = watched_[subject];
  return watched.first_ns ? watched.after : watched.before;
}

std::vector<std::string> InputWatch::failures(std::size_t subject, const io::RejectedFrames& rejected) const {
  const Watched& watched = watched_[subject];
  const std::string& name = watched.subject.name;
  const Figures all = figures(subject);
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& sentence) { sentences.push_back(report::to_ascii(sentence)); };
  const double share = static_cast<double>(all.not_fresh) / static_cast<double>(all.ticks);
  if (watched.subject.has_to_come && !watched.first_ns && all.not_fresh > 0) {
    add("no value of " + name + " came" +
        (rejected.count == 0 ? std::string()
                             : ": " + (rejected.count == 1 ? "its only frame was refused"
                                                           : "all its " + report::count_text(rejected.count) +
                                                                 " frames were refused")) +
        "; 'optional: true' permits that");
  } else if (watched.subject.has_to_come && watched.first_ns && share > max_missing_share) {
    add(name + " was not fresh on " + report::count_text(all.not_fresh) + " of " +
        report::counted(all.ticks, "tick", "ticks") + " after its first value (" + report::percent(share, 1) +
        ", first at " + report::instant(*watched.missing_ns) + "); more than 5 % need 'optional: true'");
  }
  const std::uint64_t not_made = rejected.count - rejected.by_scenario;
  if (not_made > watched.subject.max_rejected) {
    add(report::counted(not_made, "frame", "frames") + " of " + name + (not_made == 1 ? " was" : " were") +
        " refused for a wrong checksum, counter or format; max_rejected is " +
        std::to_string(watched.subject.max_rejected));
  }
  return sentences;
}

}  // namespace hil::run
