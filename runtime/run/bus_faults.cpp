#include "runtime/run/bus_faults.hpp"

#include <hil/splitmix64.hpp>

namespace hil::run {
namespace {

using config::FaultSection;
using config::FaultTarget;

/// The bus of a message or device; the number of buses with a mistake: there is none.
std::size_t bus_of(const FaultSection& section, std::span<const FaultyBus> buses,
                   config::Diagnostics& diagnostics) {
  const bool is_message = section.target == FaultTarget::message;
  const std::string& name = section.subject.text;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < buses.size(); ++i) {
    const std::string& bus = buses[i].full_name;
    if (is_message ? name.starts_with(bus + ".") : name == bus) return i;
    names.push_back(bus);
  }
  diagnostics.add(section.subject.place,
                  is_message
                      ? "'" + name + "' is no message of a bus; it begins with the bus, as in 'can.car.M'"
                      : "there is no bus and no unit '" + name + "'" + config::suggestion(name, names));
  return buses.size();
}

template <class Named, class NameOf>
void check_name(const FaultSection& section, const std::string& noun, const std::vector<Named>& all,
                const NameOf& name_of, config::Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const Named& one : all) {
    if (name_of(one) == section.subject.text) return;
    names.push_back(name_of(one));
  }
  diagnostics.add(section.subject.place, "there is no " + noun + " '" + section.subject.text + "'" +
                                             config::suggestion(section.subject.text, names));
}

}  // namespace

std::vector<BusFault> bus_faults(const config::Scenario& scenario, std::span<const FaultyBus> buses,
                                 config::Diagnostics& diagnostics) {
  std::vector<BusFault> faults;
  std::vector<std::size_t> counts(buses.size(), 0);
  for (std::size_t i = 0; i < scenario.faults.size(); ++i) {
    const FaultSection& section = scenario.faults[i];
    const bool is_message = section.target == FaultTarget::message;
    if (!is_message && section.target != FaultTarget::device) continue;
    const std::size_t bus = bus_of(section, buses, diagnostics);
    if (bus == buses.size()) continue;
    const std::string& name = section.subject.text;
    buses::InjectedFault injected{
        .effect = section.effect,
        .message = is_message ? name.substr(buses[bus].full_name.size() + 1) : std::string(),
        .seed = modules::splitmix64(scenario.seed ^ (0xB05u + i) * modules::splitmix64_step)};
    if (const std::string problem = buses[bus].wiring->fault_problem(injected); !problem.empty()) {
      diagnostics.add(section.place, "fault '" + section.name.text + "' of '" + name + "': " + problem);
      continue;
    }
    faults.push_back({.fault = i, .bus = bus, .number = counts[bus]++, .injected = std::move(injected)});
  }
  return faults;
}

void check_fault_targets(const config::Scenario& scenario, config::Diagnostics& diagnostics) {
  for (const FaultSection& section : scenario.faults) {
    if (section.target == FaultTarget::process) {
      check_name(
          section, "process", scenario.processes,
          [](const config::ProcessSection& process) { return process.name.text; }, diagnostics);
      for (const config::ProcessSection& process : scenario.processes) {
        if (process.name.text == section.subject.text && !process.enabled)
          diagnostics.add(section.subject.place, "the run does not start process '" + section.subject.text +
                                                     "' (enabled: false), so a fault of it has no effect");
      }
    } else if (section.target == FaultTarget::task) {
      check_name(
          section, "task of a module", scenario.tasks,
          [](const config::TaskSection& task) { return task.module.text; }, diagnostics);
    }
  }
}

}  // namespace hil::run
