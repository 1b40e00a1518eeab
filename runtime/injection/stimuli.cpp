#include "runtime/injection/stimuli.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <hil/quantity.hpp>
#include <hil/splitmix64.hpp>

#include "runtime/config/run_end.hpp"
#include "runtime/injection/activity_signal.hpp"

namespace hil::injection {
namespace {

/// Why nothing can drive it: there is no such input, or it is a signal that a module or a bus writes.
std::string no_target(const std::string& driven, const signals::SignalTable& table,
                      std::span<const Target> targets) {
  std::vector<std::string> names;
  for (const Target& one : targets)
    names.push_back(one.name);
  const auto written = table.find(driven);
  if (!written)
    return "there is no input of a module and no output of a bus '" + driven + "'" +
           config::suggestion(driven, names);
  // Those of the same module or bus first.
  const std::string prefix = driven.substr(0, driven.rfind('.') + 1);
  std::stable_partition(names.begin(), names.end(),
                        [&](const std::string& name) { return name.starts_with(prefix); });
  return "'" + driven + "' is written by " + table.info(*written).writer +
         "; a stimulus drives an input of a module or an output of a bus" +
         (names.empty() ? ", and there is none" : config::suggestion("", names));
}

}  // namespace

void Stimuli::declare(const config::Scenario& scenario, signals::KnownSignals& known,
                      std::span<const Target> targets, config::Diagnostics& diagnostics) {
  signals::SignalTable& table = known.table();
  for (const config::StimulusSection& section : scenario.stimuli) {
    Stimulus& stimulus = stimuli_.emplace_back(Stimulus{.section = &section});
    stimulus.active = add_activity_signal("stimulus", section.name, "stimuli", table, diagnostics);
    if (!stimulus.active.valid()) continue;
    const std::string& driven = section.drives.text;
    if (known.is_undeclared(driven)) continue;
    const auto target = std::ranges::find(targets, driven, &Target::name);
    if (target == targets.end()) {
      diagnostics.add(section.drives.place, no_target(driven, table, targets));
      continue;
    }
    if (const auto there = table.find(driven)) {
      const std::string& writer = table.info(*there).writer;
      const std::string name = driven.substr(driven.rfind('.') + 1);
      diagnostics.add(section.drives.place,
                      writer.starts_with("stimulus ")
                          ? "'" + driven + "' is driven by " + writer + " already"
                          : writer + " also has an output '" + name + "'; give one of the two another name");
      continue;
    }
    stimulus.driven = table.add({.name = driven,
                                 .unit = target->unit,
                                 .writer = "stimulus " + section.name.text,
                                 .initial = target->initial});
  }
}

void Stimuli::connect(std::span<const Target> targets, signals::SignalTable& table,
                      config::Diagnostics& diagnostics) {
  for (Stimulus& stimulus : stimuli_) {
    if (!stimulus.driven.valid()) continue;
    const auto target = std::ranges::find(targets, stimulus.section->drives.text, &Target::name);
    if (target->signal->valid()) {
      diagnostics.add(stimulus.section->drives.place,
                      "'" + target->name + "' has a signal already; a stimulus drives what has none");
      continue;
    }
    *target->signal = stimulus.driven;
    const auto* const segments =
        std::get_if<std::vector<config::StimulusSegment>>(&stimulus.section->profile);
    stimulus.effect = std::make_unique<StimulusEffect>(segments == nullptr ? 0 : segments->size());
    stimulus.effect->set(false, target->initial, 0);
    stimulus.reader_period_ns = target->period_ns;
    table.add_read_observer(stimulus.driven, *stimulus.effect);
  }
}

void Stimuli::compile(const config::Scenario& scenario, const signals::KnownSignals& known,
                      config::Diagnostics& diagnostics) {
  for (std::size_t i = 0; i < stimuli_.size(); ++i) {
    Stimulus& stimulus = stimuli_[i];
    const config::StimulusSection& section = *stimulus.section;
    const std::uint64_t seed = modules::splitmix64(scenario.seed ^ (0x57130u + i) * modules::splitmix64_step);
    stimulus.activation =
        Activation::compile(section.activation, known, scenario.base_period_ns, seed, diagnostics);
    if (!stimulus.driven.valid()) continue;
    if (const auto* segments = std::get_if<std::vector<config::StimulusSegment>>(&section.profile)) {
      auto compiled = Segments::compile(*segments, section.repeat, known, known.table().info(stimulus.driven),
                                        scenario.base_period_ns, modules::splitmix64(seed), diagnostics);
      if (compiled) stimulus.segments = std::make_unique<Segments>(std::move(*compiled));
    } else {
      const auto& file = std::get<config::StimulusFile>(section.profile);
      auto profile =
          signals::CsvProfile::read(file.path, file.place, file.column, file.is_linear, diagnostics);
      if (!profile) continue;
      const std::int64_t first_ns =
          section.activation.earliest_begin_ns(scenario.base_period_ns) + profile->begin_ns();
      const std::string reason =
          config::reason_without_tick(first_ns, scenario.base_period_ns, scenario.duration_ns);
      if (!reason.empty()) {
        diagnostics.add(profile->begin_place(), "the time of the first row is " +
                                                    config::format_duration(first_ns) + " of the run, which" +
                                                    reason);
      }
      stimulus.file = std::make_unique<signals::CsvProfile>(std::move(*profile));
    }
  }
}

void Stimuli::open(signals::SignalTable& table, modules::EventLog& events) {
  table_ = &table;
  events_ = &events;
  for (Stimulus& stimulus : stimuli_) {
    const std::string name = "stimulus " + stimulus.section->name.text;
    stimulus.begins = events.add_kind(name + " begins");
    stimulus.ends = events.add_kind(name + " ends");
    if (const auto* segments =
            std::get_if<std::vector<config::StimulusSegment>>(&stimulus.section->profile)) {
      for (const config::StimulusSegment& segment : *segments) {
        stimulus.parts.emplace_back();
        if (!segment.name.empty())
          stimulus.parts.back() = events.add_kind(name + ": " + segment.name + " begins");
      }
    }
  }
}

void Stimuli::begin_tick(std::int64_t time_ns) noexcept {
  for (Stimulus& stimulus : stimuli_) {
    const Activation::Change change = stimulus.activation->update(*table_, time_ns);
    if (change == Activation::Change::ends) events_->note(stimulus.ends, time_ns);
    if (change != Activation::Change::begins) continue;
    events_->note(stimulus.begins, time_ns);
    stimulus.began_ns = time_ns;
    if (stimulus.segments)
      stimulus.segments->begin(table_->value(stimulus.driven), time_ns);
    else
      stimulus.file->rewind();
  }
  // All activations have read the same signals.
  for (Stimulus& stimulus : stimuli_) {
    const bool is_active = stimulus.activation->is_active();
    table_->write(stimulus.active, is_active ? 1.0 : 0.0, time_ns);
    double value = table_->value(stimulus.driven);
    if (is_active) {
      if (stimulus.segments) {
        value = stimulus.segments->value(*table_, time_ns);
        const auto began = stimulus.segments->began();
        if (began && stimulus.parts[*began]) events_->note(*stimulus.parts[*began], time_ns);
      } else {
        value = stimulus.file->at(time_ns - stimulus.began_ns);
      }
    }
    table_->write(stimulus.driven, value, time_ns);
    stimulus.effect->set(is_active, value, stimulus.segments ? stimulus.segments->part() : 0);
  }
}

std::string Stimuli::missing_effect(const Stimulus& stimulus) {
  const StimulusEffect& effect = *stimulus.effect;
  const std::string reader = "'" + stimulus.section->drives.text + "' (read every " +
                             config::format_duration(stimulus.reader_period_ns) + ")";
  const auto replaced = [&](std::string_view fault, const std::string& of) {
    return "fault '" + std::string(fault) + "' replaced each value of " + of + " for " + reader;
  };
  if (!effect.took_effect() && effect.was_unknown())
    return "its value was unknown whenever " + reader + " was read";
  if (!effect.took_effect())
    return effect.replaced_by().empty() ? reader + " was not read in that time"
                                        : replaced(effect.replaced_by(), "it");
  const auto* const segments = std::get_if<std::vector<config::StimulusSegment>>(&stimulus.section->profile);
  for (std::size_t i = 0; segments != nullptr && i < segments->size(); ++i) {
    const std::string& name = (*segments)[i].name;
    if (name.empty() || effect.was_read(i)) continue;
    if (!effect.has_begun(i)) return "its part '" + name + "' never began";
    return effect.replaced_by(i).empty() ? reader + " was not read during its part '" + name + "'"
                                         : replaced(effect.replaced_by(i), "its part '" + name + "'");
  }
  return {};
}

void Stimuli::fill(std::int64_t end_ns, report::RunRecord& record) const {
  for (const Stimulus& stimulus : stimuli_) {
    record.stimuli.push_back({.name = stimulus.section->name.text,
                              .target = stimulus.section->drives.text,
                              .effect = "",
                              .begins = stimulus.activation->begins(),
                              .first_begin_ns = stimulus.activation->first_begin_ns(),
                              .active_ns = stimulus.activation->active_ns(end_ns),
                              .test_table = stimulus.section->test_table});
    if (stimulus.activation->has_begun()) {
      record.stimuli.back().missing_effect = missing_effect(stimulus);
      record.stimuli.back().took_effect = stimulus.effect->took_effect();
    } else {
      record.stimuli.back().missing_effect = stimulus.activation->lost_draws();
    }
    for (const Activation::Span& span : stimulus.activation->spans())
      record.stimuli.back().spans.push_back({span.begin_ns, std::min(span.end_ns, end_ns)});
  }
}

}  // namespace hil::injection
