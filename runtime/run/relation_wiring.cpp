#include "runtime/run/relation_wiring.hpp"

#include <algorithm>

#include <hil/world/relation.hpp>

#include "runtime/config/parse.hpp"
#include "runtime/modules/registry.hpp"

namespace hil::run {
namespace {

constexpr const char* relation_task_name = "relations";

bool computes_relations(const config::TaskSection& section) {
  return !modules::find_module_type(section.type.text)->computes.empty();
}

const modules::ModuleType& relations_type() {
  return *std::ranges::find_if(modules::module_types(),
                               [](const modules::ModuleType& type) { return !type.computes.empty(); });
}

/// Null: the scenario has no such task.
WiredModule* find_relation_task(Wiring& wiring, config::Diagnostics& diagnostics) {
  WiredModule* found = nullptr;
  for (WiredModule& wired : wiring.modules) {
    if (!computes_relations(*wired.section)) continue;
    if (found == nullptr) {
      found = &wired;
      continue;
    }
    diagnostics.add(wired.section->module.place, "the task of module " + found->section->module.text +
                                                     " computes the relations of bodies already; a scenario "
                                                     "has one such task");
  }
  return found;
}

/// A crossing becomes final with a later commit.
void warn_of_open_crossings(const config::Scenario& scenario, const signals::RelationSignals& relations,
                            config::Diagnostics& diagnostics) {
  if (std::ranges::any_of(scenario.tasks, [](const config::TaskSection& section) {
        return modules::find_module_type(section.type.text)->writes;
      }))
    return;
  for (const expression::Relation& relation : relations.relations) {
    if (relation.function->kind == expression::RelationKind::crossed_at)
      diagnostics.warn(relation.first.place,
                       expression::relation_name(relation) +
                           " is never known: no task writes to the world, so no crossing "
                           "becomes final; add a task that moves a body");
  }
}

WiredModule& add_relation_task(config::Scenario& scenario, const signals::RelationSignals& relations,
                               Wiring& wiring, config::Diagnostics& diagnostics) {
  const config::Place& place = relations.relations.front().first.place;
  for (const config::TaskSection& task : scenario.tasks) {
    if (task.module.text != relation_task_name) continue;
    diagnostics.add(task.module.place,
                    "the name 'relations' is that of the task that computes the relations of "
                    "bodies; give this module another name");
  }
  scenario.tasks.push_back(
      {.module = {relation_task_name, place},
       .type = {relations_type().name, place},
       .rate_hz = scenario.base_rate_hz,
       .deadline_ns = scenario.base_period_ns,
       .thread = {},
       .parameters = *config::parse_text(relation_task_name, "{}", relations_type().parameters, diagnostics),
       .inputs = {}});
  wiring.modules.push_back({.section = &scenario.tasks.back(), .module = nullptr, .links = {}});
  return wiring.modules.back();
}

}  // namespace

std::string relations_module(const config::Scenario& scenario) {
  const auto task = std::ranges::find_if(scenario.tasks, computes_relations);
  return task == scenario.tasks.end() ? relation_task_name : task->module.text;
}

void wire_relations(config::Scenario& scenario, const signals::RelationSignals& relations, Wiring& wiring,
                    config::Diagnostics& diagnostics) {
  WiredModule* wired = find_relation_task(wiring, diagnostics);
  if (wired == nullptr && relations.relations.empty()) return;
  if (wired == nullptr) wired = &add_relation_task(scenario, relations, wiring, diagnostics);
  modules::TaskParameters task = task_parameters(scenario, *wired->section);
  const modules::Relations computed{relations.relations, scenario.world.regions, scenario.world.beams};
  task.relations = &computed;
  wired->module = relations_type().create(wired->section->parameters, task, diagnostics);
  wired->links.outputs = relations.signals;
  for (const config::InputLink& input : wired->section->inputs)
    diagnostics.add(input.port.place, "module " + wired->section->module.text + " has no inputs");
  warn_of_open_crossings(scenario, relations, diagnostics);
  if (relations.relations.empty())
    diagnostics.warn(wired->section->module.place,
                     "no expression reads a relation of bodies, as distance(a, b), so module " +
                         wired->section->module.text + " computes nothing");
}

}  // namespace hil::run
