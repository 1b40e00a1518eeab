#include "runtime/run/input_watch.hpp"

#include <utility>

#include "runtime/report/quantities.hpp"

namespace hil::run {

InputWatch::InputWatch(std::vector<Subject> subjects, std::int64_t period_ns) : period_ns_(period_ns) {
  for (Subject& subject : subjects)
    watched_.push_back(
        {.subject = std::move(subject), .silenced_ns = {}, .missing_ns = {}, .before = {}, .after = {}});
}

void InputWatch::set_fault(std::size_t subject, bool active) noexcept {
  active ? ++watched_[subject].acting_faults : --watched_[subject].acting_faults;
}

void InputWatch::set_task_fault(bool active) noexcept {
  active ? ++acting_task_faults_ : --acting_task_faults_;
}

void InputWatch::check(std::int64_t time_ns, std::span<const State> states) noexcept {
  const bool skips_ticks = acting_task_faults_ > 0 && last_ns_ && time_ns - *last_ns_ > period_ns_;
  last_ns_ = time_ns;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    Watched& watched = watched_[i];
    const auto [is_fresh, is_faulted, is_permitted_loss] = states[i];
    const bool is_silenced = watched.acting_faults > 0 || is_faulted || is_permitted_loss || skips_ticks;
    if (is_silenced) watched.silenced_ns = time_ns;
    const bool recovers =
        watched.silenced_ns && time_ns - *watched.silenced_ns <= watched.subject.recovery_ns;
    watched.has_sent |= is_fresh || is_faulted;
    watched.has_come |= is_fresh;
    if (is_fresh && !is_silenced) watched.silenced_ns.reset();
    if (is_silenced || (recovers && !is_fresh)) continue;
    Figures& figures = watched.has_sent ? watched.after : watched.before;
    ++figures.ticks;
    if (is_fresh) continue;
    ++figures.not_fresh;
    if (watched.has_sent && !watched.missing_ns) watched.missing_ns = time_ns;
  }
}

InputWatch::Figures InputWatch::figures(std::size_t subject) const noexcept {
  const Watched& watched = watched_[subject];
  return watched.has_sent ? watched.after : watched.before;
}

std::vector<std::string> InputWatch::failures(std::size_t subject, const io::RejectedFrames& rejected) const {
  const Watched& watched = watched_[subject];
  const std::string& name = watched.subject.name;
  const Figures all = figures(subject);
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& sentence) { sentences.push_back(report::to_ascii(sentence)); };
  const double share = static_cast<double>(all.not_fresh) / static_cast<double>(all.ticks);
  if (watched.subject.has_to_come && !watched.has_come && all.not_fresh > 0) {
    add("no value of " + name + " came" +
        (rejected.count == 0 ? std::string()
                             : ": " + (rejected.count == 1 ? "its only frame was refused"
                                                           : "all its " + report::count_text(rejected.count) +
                                                                 " frames were refused")) +
        "; 'optional: true' permits that");
  } else if (watched.subject.has_to_come && watched.has_come && share > max_missing_share) {
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
