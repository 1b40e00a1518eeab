#include "runtime/run/input_watch.hpp"

#include <utility>

#include "runtime/config/shared_schemas.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::run {

InputWatch::InputWatch(std::vector<InputRule> rules, std::int64_t period_ns) : period_ns_(period_ns) {
  for (InputRule& rule : rules)
    inputs_.push_back({.rule = std::move(rule), .missing_ns = {}, .before = {}, .after = {}});
}

void InputWatch::set_fault(std::size_t input, bool active) noexcept {
  active ? ++inputs_[input].active_faults : --inputs_[input].active_faults;
}

void InputWatch::set_task_fault(bool active) noexcept {
  active ? ++active_task_faults_ : --active_task_faults_;
}

void InputWatch::check(std::int64_t time_ns, std::span<const State> states) noexcept {
  const std::int64_t step_ns = time_ns - last_ns_.value_or(time_ns - period_ns_);
  const bool skips_ticks = active_task_faults_ > 0 && step_ns > period_ns_;
  last_ns_ = time_ns;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    InputState& input = inputs_[i];
    const auto [is_fresh, has_come, is_faulted, is_permitted_loss] = states[i];
    const bool is_silenced = input.active_faults > 0 || is_permitted_loss || skips_ticks;
    const bool was_fresh = std::exchange(input.was_fresh, is_fresh);
    if (has_come || is_faulted)
      input.silent_ns = 0;
    else if (!is_fresh && !is_silenced)
      input.silent_ns += step_ns;
    const bool has_time = input.silent_ns <= input.rule.recovery_ns;
    const bool is_reason = is_faulted || is_permitted_loss || (is_silenced && (is_fresh || was_fresh));
    const bool goes_on = input.is_excused && (!has_come || is_silenced);
    input.is_excused = has_time && (is_reason || goes_on);
    input.was_sent |= is_fresh || is_faulted;
    input.was_received |= is_fresh;
    const bool counts = is_fresh ? !is_silenced && !is_faulted : !input.is_excused && !is_permitted_loss;
    if (!counts) continue;
    Figures& figures = input.was_sent ? input.after : input.before;
    ++figures.ticks;
    if (is_fresh) continue;
    ++figures.not_fresh;
    if (input.was_sent && !input.missing_ns) input.missing_ns = time_ns;
  }
}

InputWatch::Figures InputWatch::figures(std::size_t number) const noexcept {
  const InputState& input = inputs_[number];
  return input.was_sent ? input.after : input.before;
}

bool InputWatch::is_missing(std::size_t number) const noexcept {
  const InputState& input = inputs_[number];
  const Figures all = figures(number);
  if (!input.rule.has_to_come || all.not_fresh == 0) return false;
  const double share = static_cast<double>(all.not_fresh) / static_cast<double>(all.ticks);
  return !input.was_received || share > config::max_missing_share;
}

std::vector<std::string> InputWatch::failures(std::size_t number, const io::RejectedFrames& rejected) const {
  const InputState& input = inputs_[number];
  if (input.rule.group && is_missing(*input.rule.group)) return {};
  const std::string& name = input.rule.name;
  const std::string permission = input.rule.group ? "'optional: true' at its message" : "'optional: true'";
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& sentence) { sentences.push_back(report::to_ascii(sentence)); };
  if (is_missing(number) && !input.was_received) {
    add("no value of " + name + " came" +
        (rejected.count == 0 ? std::string()
                             : ": " + (rejected.count == 1 ? "its only frame was rejected"
                                                           : "all its " + report::count_text(rejected.count) +
                                                                 " frames were rejected")) +
        "; " + permission + " permits that");
  } else if (is_missing(number)) {
    const Figures all = figures(number);
    const double share = static_cast<double>(all.not_fresh) / static_cast<double>(all.ticks);
    add(name + " was not fresh on " + report::count_text(all.not_fresh) + " of " +
        report::counted(all.ticks, "tick", "ticks") + " after its first value (" + report::percent(share, 1) +
        ", first at " + report::instant(*input.missing_ns) + "); " +
        report::percent(config::max_missing_share, 0) + " are permitted, " + permission + " permits more");
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
