#include "runtime/run/input_watch.hpp"

#include <utility>

#include "runtime/config/shared_schemas.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::run {

InputWatch::InputWatch(std::vector<InputGroupRule> rules, std::int64_t period_ns) : period_ns_(period_ns) {
  for (InputGroupRule& rule : rules)
    inputs_.push_back(
        {.rule = std::move(rule), .excused_ns = {}, .missing_ns = {}, .before = {}, .after = {}});
}

void InputWatch::set_fault(std::size_t group, bool active) noexcept {
  active ? ++inputs_[group].active_faults : --inputs_[group].active_faults;
}

void InputWatch::set_task_fault(bool active) noexcept {
  active ? ++active_task_faults_ : --active_task_faults_;
}

void InputWatch::check(std::int64_t time_ns, std::span<const State> states) noexcept {
  const bool skips_ticks = active_task_faults_ > 0 && last_ns_ && time_ns - *last_ns_ > period_ns_;
  last_ns_ = time_ns;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    InputState& input = inputs_[i];
    const auto [is_fresh, is_faulted, is_permitted_loss] = states[i];
    const bool is_excused = input.active_faults > 0 || is_faulted || is_permitted_loss || skips_ticks;
    if (is_excused) input.excused_ns = time_ns;
    const bool recovers = input.excused_ns && time_ns - *input.excused_ns <= input.rule.recovery_ns;
    input.was_sent |= is_fresh || is_faulted;
    input.was_received |= is_fresh;
    if (is_fresh && !is_excused) input.excused_ns.reset();
    if (is_excused || (recovers && !is_fresh)) continue;
    Figures& figures = input.was_sent ? input.after : input.before;
    ++figures.ticks;
    if (is_fresh) continue;
    ++figures.not_fresh;
    if (input.was_sent && !input.missing_ns) input.missing_ns = time_ns;
  }
}

InputWatch::Figures InputWatch::figures(std::size_t group) const noexcept {
  const InputState& input = inputs_[group];
  return input.was_sent ? input.after : input.before;
}

std::vector<std::string> InputWatch::failures(std::size_t group, const io::RejectedFrames& rejected) const {
  const InputState& input = inputs_[group];
  const std::string& name = input.rule.name;
  const Figures all = figures(group);
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& sentence) { sentences.push_back(report::to_ascii(sentence)); };
  const double share = static_cast<double>(all.not_fresh) / static_cast<double>(all.ticks);
  if (input.rule.has_to_come && !input.was_received && all.not_fresh > 0) {
    add("no value of " + name + " came" +
        (rejected.count == 0 ? std::string()
                             : ": " + (rejected.count == 1 ? "its only frame was rejected"
                                                           : "all its " + report::count_text(rejected.count) +
                                                                 " frames were rejected")) +
        "; 'optional: true' permits that");
  } else if (input.rule.has_to_come && input.was_received && share > config::max_missing_share) {
    add(name + " was not fresh on " + report::count_text(all.not_fresh) + " of " +
        report::counted(all.ticks, "tick", "ticks") + " after its first value (" + report::percent(share, 1) +
        ", first at " + report::instant(*input.missing_ns) + "); " +
        report::percent(config::max_missing_share, 0) + " are permitted, 'optional: true' permits more");
  }
  const std::uint64_t unexcused = rejected.count - rejected.by_scenario;
  if (unexcused > input.rule.max_rejected) {
    add(report::counted(unexcused, "frame", "frames") + " of " + name + (unexcused == 1 ? " was" : " were") +
        " rejected for a wrong checksum, counter or format; max_rejected is " +
        std::to_string(input.rule.max_rejected));
  }
  return sentences;
}

}  // namespace hil::run
