#pragma once
// A scenario with the block "plant" and the block "control", its stimuli and faults, stepped tick by tick of
// 1 ms as a run does it.

#include <cmath>
#include <string>
#include <vector>

#include "runtime/modules/run_events.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::injection::test {

class InjectionFixture : public run::test::WiringFixture {
 protected:
  static constexpr std::int64_t ms = 1'000'000;

  /// `plant.x` is what `set()` writes; `control` reads it as x and has the free inputs u and t.
  void open(const std::string& sections) {
    wiring_ = wired(
        "scenario: s\nbase_rate: 1 kHz\nduration: 1 s\ntasks:\n"
        "  - {module: plant, type: block, rate: 1 kHz, parameters: {states: {x: {unit: m}}}}\n"
        "  - module: control\n    type: block\n    rate: 1 kHz\n    inputs: {x: plant.x, w: plant.x}\n"
        "    parameters:\n      inputs: {x: mm, w: m, u: {unit: m, initial: 5}, t: {unit: degC, initial: "
        "20}}\n"
        "      outputs: {y: x + u, z: t, x: x - w}\n" +
        sections);
    if (!wiring_) throw std::runtime_error(diagnostics_.to_text());
    wiring_->stimuli.open(wiring_->signals, events_);
    wiring_->faults.open(wiring_->signals, events_);
  }

  double value(const std::string& signal) const {
    return wiring_->signals.value(*wiring_->signals.find(signal));
  }
  /// Of the signal that an input of `control` reads.
  const signals::SignalValue& read(const std::string& input) const {
    const run::WiredModule& control = wiring_->modules[1];
    for (std::size_t i = 0; i < control.module->ports().inputs.size(); ++i)
      if (control.module->ports().inputs[i].name == input)
        return wiring_->signals.read(control.links.inputs[i].signal);
    throw std::runtime_error("no input " + input);
  }
  /// The begin of the tick, then the step of `plant`, which writes `x`, in the tick at `time_ns`.
  void tick(double x) {
    wiring_->stimuli.begin_tick(time_ns_);
    wiring_->faults.begin_tick(time_ns_);
    wiring_->signals.write(*wiring_->signals.find("plant.x"), x, time_ns_);
    seen_ns_ = time_ns_;
    time_ns_ += ms;
  }
  void end_tick() {
    wiring_->faults.end_tick(seen_ns_);
    wiring_->variables.update(wiring_->signals, seen_ns_);
  }
  /// Ticks up to this one, whose values of x are the numbers of the ticks; the last one is not ended.
  void run_to(std::int64_t tick_ms) {
    while (time_ns_ <= tick_ms * ms) {
      if (time_ns_ > 0) end_tick();
      const std::int64_t number = time_ns_ / ms;
      tick(static_cast<double>(number));
    }
  }
  std::vector<std::string> events() const {
    std::vector<std::string> texts;
    for (const modules::RunEvents::Event& event : events_.events())
      texts.push_back(std::to_string(event.time_ns / ms) + ": " + event.text);
    return texts;
  }

  std::optional<run::Wiring> wiring_;
  modules::RunEvents events_;
  std::int64_t time_ns_ = 0, seen_ns_ = 0;
};

}  // namespace hil::injection::test
