#include "runtime/run/fault_switches.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "runtime/run/fault_kinds.hpp"

namespace hil::run {
namespace {

using config::FaultSection;
using config::FaultTarget;

class BusSwitch final : public injection::FaultSwitch {
 public:
  BusSwitch(RunBuses& buses, const BusFault& fault, const Wiring& wiring)
      : buses_(buses), fault_(fault), wiring_(wiring), name_(name_of(fault)) {}
  void set(bool active) noexcept override { buses_.set_fault(fault_, name_, active); }
  injection::FaultOutcome outcome() const override {
    const io::FaultTarget& target = buses_.fault_target(fault_.bus);
    const std::uint64_t count = target.fault_count(fault_.number);
    injection::FaultOutcome outcome{.took_effect = target.fault_effects(fault_.number) > 0, .frames = count};
    if (*outcome.took_effect) return outcome;
    if (const auto other = target.fault_stopped_by(fault_.number)) {
      const auto found = std::ranges::find_if(wiring_.bus_faults, [&](const BusFault& one) {
        return one.bus == fault_.bus && one.number == *other;
      });
      outcome.missing = "fault '" + name_of(*found) + "' let no frame of it through in that time";
    } else {
      outcome.missing = count == 0
                            ? "no frame or request came in that time"
                            : "it made no difference to the frames or requests that came in that time (" +
                                  std::to_string(count) + ")";
    }
    return outcome;
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
        effect_(dynamic_cast<const ProcessFault&>(*section.effect)),
        buses_(buses),
        connected_buses_(std::move(connected_buses)) {}

  void set(bool active) noexcept override {
    if (processes_.is_killed(process_)) return;  // it does not come back
    was_running_ = true;
    for (const std::size_t bus : connected_buses_)
      buses_.set_away(bus, processes_.process_at(process_), section_.name.text, active);
    effect_.set(processes_, process_, section_.name.text, active);
  }
  injection::FaultOutcome outcome() const override {
    if (was_running_) return {};
    return {.took_effect = false, .missing = "another fault had killed the process before"};
  }

 private:
  ProcessWatch& processes_;
  const std::size_t process_;
  const FaultSection& section_;
  const ProcessFault& effect_;
  RunBuses& buses_;
  const std::vector<std::size_t> connected_buses_;
  bool was_running_ = false;  ///< when it began
};

class TaskSwitch final : public injection::FaultSwitch {
 public:
  TaskSwitch(std::unique_ptr<injection::FaultSwitch> of_kind, RunBuses& buses)
      : of_kind_(std::move(of_kind)), buses_(buses) {}
  void set(bool active) noexcept override {
    of_kind_->set(active);
    buses_.set_task_fault(active);
  }
  injection::FaultOutcome outcome() const override { return of_kind_->outcome(); }

 private:
  const std::unique_ptr<injection::FaultSwitch> of_kind_;
  RunBuses& buses_;
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
    if (section.target == FaultTarget::task) {
      for (std::size_t task = 0; task < scenario.tasks.size(); ++task) {
        if (scenario.tasks[task].module.text == section.subject.text)
          add(i,
              std::make_unique<TaskSwitch>(
                  dynamic_cast<const TaskFault&>(*section.effect)
                      .make_switch(*tasks[task], scenario.base_period_ns * scenario.tasks[task].every_ticks),
                  buses));
      }
    } else if (section.target == FaultTarget::process) {
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
