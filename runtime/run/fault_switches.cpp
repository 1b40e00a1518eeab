#include "runtime/run/fault_switches.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <hil/quantity.hpp>

namespace hil::run {
namespace {

using config::FaultSection;
using FaultKind = config::FaultSection::Kind;

class BusSwitch final : public injection::FaultSwitch {
 public:
  BusSwitch(RunBuses& buses, const BusFault& fault, const Wiring& wiring)
      : buses_(buses), fault_(fault), wiring_(wiring), name_(name_of(fault)) {}
  void set(bool active) noexcept override { buses_.set_fault(fault_, name_, active); }
  injection::FaultEffect effect() const override {
    const std::uint64_t count = buses_.fault_count(fault_);
    injection::FaultEffect effect{.took_effect = buses_.fault_effects(fault_) > 0, .frames = count};
    if (*effect.took_effect) return effect;
    if (const auto other = buses_.fault_stopped_by(fault_)) {
      const auto found = std::ranges::find_if(wiring_.bus_faults, [&](const BusFault& one) {
        return one.bus == fault_.bus && one.number == *other;
      });
      effect.missing = "fault '" + name_of(*found) + "' let no frame of it through in that time";
    } else {
      effect.missing = count == 0
                           ? "no frame or request came in that time"
                           : "it made no difference to the frames or requests that came in that time (" +
                                 std::to_string(count) + ")";
    }
    return effect;
  }

 private:
  const std::string& name_of(const BusFault& fault) const {
    return wiring_.scenario->faults[fault.fault].name.text;
  }

  RunBuses& buses_;
  const BusFault& fault_;
  const Wiring& wiring_;
  const std::string& name_;
};

class ProcessSwitch final : public injection::FaultSwitch {
 public:
  ProcessSwitch(ProcessWatch& processes, std::size_t process, const FaultSection& section, RunBuses& buses,
                std::vector<std::size_t> connected_buses)
      : processes_(processes),
        process_(process),
        section_(section),
        buses_(buses),
        connected_buses_(std::move(connected_buses)) {}

  void set(bool active) noexcept override {
    if (processes_.is_killed(process_)) return;  // it does not come back
    was_running_ = true;
    for (const std::size_t bus : connected_buses_)
      buses_.set_away(bus, processes_.process_at(process_), section_.name.text, active);
    if (section_.kind == FaultKind::paused) {
      processes_.set_paused(process_, active);
    } else if (active) {
      processes_.kill_for_fault(process_, section_.name.text);
    }
  }
  injection::FaultEffect effect() const override {
    if (was_running_) return {};
    return {.took_effect = false, .missing = "another fault had killed the process before"};
  }

 private:
  ProcessWatch& processes_;
  const std::size_t process_;
  const FaultSection& section_;
  RunBuses& buses_;
  const std::vector<std::size_t> connected_buses_;
  bool was_running_ = false;  ///< when it began
};

class TaskSwitch final : public injection::FaultSwitch {
 public:
  TaskSwitch(ModuleTask& task, RunBuses& buses, std::int64_t period_ns, std::int64_t added_ns)
      : task_(task), buses_(buses), period_ns_(period_ns), added_ns_(added_ns) {}
  void set(bool active) noexcept override {
    // While this fault is active, every lengthened step is lengthened by it, also when other faults of the
    // task are active.
    if (!active) longer_steps_ += task_.longer_steps() - longer_before_;
    longer_before_ = task_.longer_steps();
    is_active_ = active;
    task_.add_duration(active ? added_ns_ : -added_ns_);
    buses_.set_task_fault(active);
  }
  injection::FaultEffect effect() const override {
    const std::uint64_t longer = longer_steps_ + (is_active_ ? task_.longer_steps() - longer_before_ : 0);
    if (longer > 0) return {.took_effect = true};
    return {.took_effect = false,
            .missing =
                "no step of the task was in that time (every " + config::format_duration(period_ns_) + ")"};
  }

 private:
  ModuleTask& task_;
  RunBuses& buses_;
  const std::int64_t period_ns_, added_ns_;
  bool is_active_ = false;
  std::uint64_t longer_steps_ = 0, longer_before_ = 0;
};

}  // namespace

std::vector<std::size_t> buses_in(const config::ProcessSection& process, const Wiring& wiring) {
  std::vector<std::size_t> buses;
  for (std::size_t i = 0; i < wiring.buses.size(); ++i) {
    const config::BusSection& section = *wiring.buses[i].section;
    bool is_named = false;
    for (const config::CommandWord& word : process.command) {
      for (const config::CommandWord::Placeholder& placeholder : word.placeholders)
        is_named |= placeholder.section == section.type->key && placeholder.name == section.name.text;
    }
    if (is_named) buses.push_back(i);
  }
  return buses;
}

FaultSwitches::FaultSwitches(const Wiring& wiring, RunBuses& buses, ProcessWatch& processes,
                             std::span<const std::unique_ptr<ModuleTask>> tasks)
    : by_fault_(wiring.scenario->faults.size(), nullptr) {
  const config::Scenario& scenario = *wiring.scenario;
  const auto add = [&](std::size_t fault, std::unique_ptr<injection::FaultSwitch> made) {
    by_fault_[fault] = made.get();
    switches_.push_back(std::move(made));
  };
  for (const BusFault& fault : wiring.bus_faults)
    add(fault.fault, std::make_unique<BusSwitch>(buses, fault, wiring));
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const FaultSection& section = scenario.faults[i];
    if (section.target == FaultSection::Target::task) {
      for (std::size_t task = 0; task < scenario.tasks.size(); ++task) {
        if (scenario.tasks[task].module.text == section.subject.text)
          add(i, std::make_unique<TaskSwitch>(*tasks[task], buses,
                                              scenario.base_period_ns * scenario.tasks[task].every_ticks,
                                              section.duration_ns));
      }
    } else if (section.target == FaultSection::Target::process) {
      std::size_t started = 0;  // by which the watch counts
      for (const config::ProcessSection& process : scenario.processes) {
        if (!process.enabled) continue;
        if (process.name.text == section.subject.text)
          add(i,
              std::make_unique<ProcessSwitch>(processes, started, section, buses, buses_in(process, wiring)));
        ++started;
      }
    }
  }
}

}  // namespace hil::run
