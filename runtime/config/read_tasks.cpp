#include <hil/quantity.hpp>

#include "runtime/config/section_readers.hpp"

namespace hil::config {
namespace {

std::vector<std::string> names_of(const SchemaOfModules& modules) {
  std::vector<std::string> names;
  names.reserve(modules.size());
  for (const auto& [name, schema] : modules)
    names.push_back(name);
  return names;
}

/// The second parse of the parameters, done even when the rest of the task is wrong.
std::optional<Value> read_parameters(const Value& task, ReaderContext& reading) {
  const std::optional<Word> type = word_in(task, "type");
  if (!type) return std::nullopt;
  const auto known = reading.types.modules.find(type->text);
  if (known == reading.types.modules.end()) {
    reading.diagnostics.add(type->place, "unknown type of module " + in_quotes(type->text) +
                                             suggestion(type->text, names_of(reading.types.modules)));
    return std::nullopt;
  }
  if (!task.has("parameters")) return std::nullopt;
  return check_any(task["parameters"], known->second, reading.diagnostics);
}

Overrun overrun_of(const std::string& word) {
  if (word == "queue") return Overrun::queue;
  return word == "abort" ? Overrun::abort : Overrun::skip;
}

void read_offset(const Value& value, TaskSection& task, const BaseRate& base, Diagnostics& diagnostics) {
  const std::optional<std::int64_t> ticks =
      multiple_of(value, base.period_ns, "offset", "the base period", diagnostics);
  if (!ticks) return;
  if (*ticks >= task.every_ticks) {
    diagnostics.add(value.place(), "'offset': " + format_duration(value.duration_ns()) +
                                       " has to be less than the task's period of " +
                                       format_duration(task.every_ticks * base.period_ns));
    return;
  }
  task.offset_ticks = static_cast<std::uint32_t>(*ticks);
}

void read_deadline(const Value& value, TaskSection& task, const BaseRate& base, Diagnostics& diagnostics) {
  const std::int64_t period_ns = task.every_ticks * base.period_ns;
  task.deadline_ns = value.duration_ns();
  if (task.deadline_ns > period_ns) {
    diagnostics.add(value.place(), "'deadline': " + format_duration(task.deadline_ns) +
                                       " is longer than the task's period of " + format_duration(period_ns));
  } else if (!task.thread.empty()) {
    multiple_of(value, base.period_ns, "deadline", "the base period (the task has a thread of its own)",
                diagnostics);
  }
}

void read_budget(const Value& value, TaskSection& task, Diagnostics& diagnostics) {
  task.budget_ns = value.duration_ns();
  if (task.budget_ns > task.deadline_ns) {
    diagnostics.add(value.place(), "'budget': " + format_duration(task.budget_ns) +
                                       " is longer than the deadline of " +
                                       format_duration(task.deadline_ns));
  }
}

void read_timing(const Value& value, TaskSection& task, const ReaderContext& reading) {
  const std::optional<std::uint32_t> ticks = ticks_between(value["rate"], reading);
  if (!ticks || !reading.base) return;
  task.every_ticks = *ticks;
  task.rate_hz = reading.base->hz / *ticks;
  task.deadline_ns = task.every_ticks * reading.base->period_ns;
  read_offset(value["offset"], task, *reading.base, reading.diagnostics);
  if (value.has("deadline")) read_deadline(value["deadline"], task, *reading.base, reading.diagnostics);
  if (value.has("budget")) read_budget(value["budget"], task, reading.diagnostics);
}

std::vector<InputLink> read_inputs(const Value& map) {
  std::vector<InputLink> links;
  for (std::size_t i = 0; i < map.entries().size(); ++i) {
    const auto& [port, signal] = map.entries()[i];
    links.push_back({{port, map.key_place(i)}, word_of(signal)});
  }
  return links;
}

}  // namespace

void read_tasks(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "tasks");
  if (list == nullptr) return;
  UniqueNames names("module", reading.diagnostics);
  for (const Value& value : list->items()) {
    if (const std::optional<Word> name = word_in(value, "module")) names.add(*name);
    const std::optional<Value> parameters = read_parameters(value, reading);
    if (!is_whole(value)) continue;
    TaskSection task{
        .module = word_of(value["module"]),
        .type = word_of(value["type"]),
        .overrun = overrun_of(value["overrun"].text()),
        .warmup_runs = static_cast<std::uint32_t>(value["warmup"].integer()),
        .thread = value.has("thread") ? value["thread"].text() : "",
        .firm_at = value["transactions"].text() == "firm" ? std::optional(value["transactions"].place())
                                                          : std::nullopt,
        .parameters = parameters ? *parameters : value["parameters"],
        .inputs = read_inputs(value["inputs"]),
    };
    read_timing(value, task, reading);
    if (task.overrun == Overrun::abort && task.thread.empty()) {
      reading.diagnostics.add(value["overrun"].place(),
                              "'overrun': abort needs a thread of its own, since nothing can stop a run on "
                              "the base thread; add 'thread', or choose skip or queue");
    }
    scenario.tasks.push_back(std::move(task));
  }
}

}  // namespace hil::config
