#include "runtime/injection/faults.hpp"

#include <algorithm>
#include <utility>

#include <hil/quantity.hpp>
#include <hil/require.hpp>
#include <hil/splitmix64.hpp>

#include "runtime/config/text_lists.hpp"
#include "runtime/injection/activity_signal.hpp"
#include "runtime/injection/faulty_signal.hpp"

namespace hil::injection {

using config::FaultSection;
using signals::SignalId;

struct Faults::Fault {
  const FaultSection* section = nullptr;
  SignalId active{};  ///< the signal "fault.NAME"
  std::optional<Activation> activation{};
  std::uint64_t seed = 0;
  std::unique_ptr<SignalEffect> effect{};  ///< of a signal
  FaultSwitch* target = nullptr;           ///< of anything else
  modules::EventLog::Kind begins{}, ends{};
};

Faults::Faults() = default;
Faults::Faults(Faults&&) noexcept = default;
Faults& Faults::operator=(Faults&&) noexcept = default;
Faults::~Faults() = default;

void Faults::declare(const config::Scenario& scenario, signals::KnownSignals& known,
                     config::Diagnostics& diagnostics) {
  for (const FaultSection& section : scenario.faults) {
    auto fault = std::make_unique<Fault>();
    fault->section = &section;
    fault->seed = modules::splitmix64(scenario.seed ^ (0xFA17u + faults_.size()) * modules::splitmix64_step);
    fault->active = add_activity_signal("fault", section.name, "faults", known.table(), diagnostics);
    faults_.push_back(std::move(fault));
    if (section.target == config::FaultTarget::signal)
      declare_signal(scenario, *faults_.back(), known, diagnostics);
  }
}

void Faults::declare_signal(const config::Scenario& scenario, Fault& fault, signals::KnownSignals& known,
                            config::Diagnostics& diagnostics) {
  const FaultSection& section = *fault.section;
  const auto is_variable = [&](const config::VariableSection& one) {
    return one.name.text == section.subject.text;
  };
  if (std::ranges::any_of(scenario.variables, is_variable)) {
    return diagnostics.add(section.subject.place,
                           "'" + section.subject.text +
                               "' is a variable; a fault acts on a signal of a module, a bus or a stimulus");
  }
  const SignalId signal = known.find(section.subject, diagnostics);
  if (!signal.valid()) return;
  auto faulty = std::ranges::find(faulty_, signal, [](const auto& one) { return one->signal; });
  if (faulty == faulty_.end()) {
    signals::SignalInfo info = known.table().info(signal);
    info.name += signals::faulted_suffix;
    info.writer = "faults";
    if (const auto other = known.table().find(info.name)) {
      return diagnostics.add(section.subject.place,
                             "the signal '" + info.name + "' is already written by " +
                                 known.table().info(*other).writer +
                                 ", but a fault writes the faulted value there; rename one of the two");
    }
    faulty_.push_back(std::make_unique<FaultySignal>(signal, known.table().add(std::move(info))));
    faulty = faulty_.end() - 1;
    known.table().add_read_observer((*faulty)->faulted, **faulty);
  }
  fault.effect = std::make_unique<SignalEffect>(section);
  (*faulty)->sections.push_back(&section);
  (*faulty)->effects.push_back(fault.effect.get());
}

void Faults::redirect(std::span<const Reader> readers, config::Diagnostics& diagnostics) {
  for (const auto& faulty : faulty_) {
    const std::vector<config::Word>& named = faulty->sections.front()->readers;
    const auto texts = [](const std::vector<config::Word>& words) {
      std::vector<std::string> names;
      for (const config::Word& word : words)
        names.push_back(word.text);
      std::ranges::sort(names);
      return names;
    };
    for (const FaultSection* section : faulty->sections) {
      if (texts(section->readers) == texts(named)) continue;
      diagnostics.add(section->name.place, "the faults of '" + section->subject.text +
                                               "' name different readers; all have the same ones");
    }
    std::vector<std::string> reading;
    std::vector<SignalId*> redirected;
    std::vector<bool> is_found(named.size());
    const auto add_reader = [&](const Reader& reader) {
      faulty->readers.push_back(reader.name + " every " + config::format_duration(reader.period_ns));
    };
    for (const Reader& reader : readers) {
      if (*reader.signal == faulty->faulted) add_reader(reader);
      if (*reader.signal != faulty->signal) continue;
      reading.push_back(reader.owner);
      bool is_named = named.empty();
      for (std::size_t i = 0; i < named.size(); ++i) {
        if (named[i].text != reader.owner && named[i].text != reader.name) continue;
        is_named = is_found[i] = true;
      }
      if (!is_named) continue;
      redirected.push_back(reader.signal);
      add_reader(reader);
    }
    const FaultSection& section = *faulty->sections.front();
    for (std::size_t i = 0; i < named.size(); ++i) {
      if (is_found[i]) continue;
      diagnostics.add(named[i].place, "'" + named[i].text + "' does not read '" + section.subject.text + "'" +
                                          config::suggestion(named[i].text, reading));
    }
    for (SignalId* signal : redirected)
      *signal = faulty->faulted;
  }
}

void Faults::add_reading_expectation(const std::string& name, std::span<const SignalId> read,
                                     const signals::SignalTable& table) {
  const std::vector<signals::ReadObserver*> observers = table.read_observers(read);
  for (const auto& faulty : faulty_) {
    if (std::ranges::find(observers, faulty.get()) != observers.end())
      faulty->readers.push_back("expectation '" + name + "'");
  }
}

void Faults::check_readers(config::Diagnostics& diagnostics) const {
  for (const auto& faulty : faulty_) {
    const FaultSection& section = *faulty->sections.front();
    if (!faulty->readers.empty() || !section.readers.empty()) continue;
    diagnostics.add(section.subject.place, "no module and no bus reads '" + section.subject.text +
                                               "', so a fault of it has no effect");
  }
}

void Faults::compile(const config::Scenario& scenario, const signals::KnownSignals& known,
                     config::Diagnostics& diagnostics) {
  for (const auto& fault : faults_) {
    const FaultSection& section = *fault->section;
    const std::uint64_t seed = modules::splitmix64(fault->seed);
    fault->activation =
        Activation::compile(section.activation, known, scenario.base_period_ns, seed, diagnostics);
    if (fault->effect == nullptr) continue;
    const auto* const effect = dynamic_cast<const SignalFault*>(section.effect.get());
    config::require(effect != nullptr, "the fault of a signal has an effect of a kind in table.def");
    fault->effect->set_action(
        effect->make({.section = section,
                      .signal = known.table().info(*known.table().find(section.subject.text)),
                      .known = known,
                      .base_period_ns = scenario.base_period_ns,
                      .seed = fault->seed,
                      .expression_seed = modules::splitmix64(seed),
                      .diagnostics = diagnostics}));
  }
}

void Faults::open(signals::SignalTable& table, modules::EventLog& events,
                  std::span<FaultSwitch* const> switches) {
  table_ = &table;
  events_ = &events;
  for (const auto& faulty : faulty_)
    faulty->open(table);
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    Fault& fault = *faults_[i];
    if (i < switches.size()) fault.target = switches[i];
    const std::string text = "fault " + fault.section->name.text + " ";
    fault.begins = events.add_kind(text + "begins: " + fault.section->subject.text + " " +
                                   fault.section->effect->sentence());
    fault.ends = events.add_kind(text + "ends");
  }
}

void Faults::begin_tick(std::int64_t time_ns) noexcept {
  for (const auto& fault : faults_) {
    if (fault->effect) fault->effect->begin_tick(*table_, time_ns);
    const Activation::Change change = fault->activation->update(*table_, time_ns);
    if (change == Activation::Change::none) continue;
    const bool begins = change == Activation::Change::begins;
    if (fault->effect) begins ? fault->effect->begin(time_ns) : fault->effect->end();
    if (fault->target != nullptr) fault->target->set(begins);
    events_->note(begins ? fault->begins : fault->ends, time_ns);
  }
  // All activations have read the same signals.
  for (const auto& fault : faults_)
    table_->write(fault->active, fault->activation->is_active() ? 1.0 : 0.0, time_ns);
  for (const auto& faulty : faulty_)
    faulty->begin_tick(time_ns);
}

void Faults::end_tick(std::int64_t /*time_ns*/) noexcept {
  for (const auto& faulty : faulty_)
    faulty->end_tick();
}

/// Of one that began.
FaultOutcome Faults::outcome_of(const Fault& fault) const {
  if (fault.target != nullptr) return fault.target->outcome();
  if (!fault.effect) return {};
  if (fault.effect->took_effect()) return {.took_effect = true};
  const auto faulty = std::ranges::find_if(faulty_, [&](const auto& one) {
    return std::ranges::find(one->effects, fault.effect.get()) != one->effects.end();
  });
  const std::string readers = " (" + config::text_list((*faulty)->readers) + ")";
  const SignalEffect& effect = *fault.effect;
  return {.took_effect = false,
          .missing = !effect.was_read() ? "none of its readers took a value in that time" + readers
                     : !effect.replaced_by().empty()
                         ? "fault '" + std::string(effect.replaced_by()) + "' replaced what it did"
                     : effect.was_unknown() && !effect.has_acted()
                         ? "its value was unknown whenever its readers took one" + readers
                     : effect.has_acted()
                         ? "each value that its readers took in that time was the true one" + readers
                         : "it dropped none of the values that its readers took in that time" + readers};
}

void Faults::fill(std::int64_t end_ns, report::RunRecord& record) const {
  for (const auto& fault : faults_) {
    FaultOutcome outcome;
    if (fault->activation->has_begun()) {
      outcome = outcome_of(*fault);
    } else {
      if (fault->target != nullptr) outcome.frames = fault->target->outcome().frames;
      outcome.missing = fault->activation->lost_draws();
    }
    record.faults.push_back({.name = fault->section->name.text,
                             .target = fault->section->subject.text,
                             .effect = fault->section->effect->sentence(),
                             .begins = fault->activation->begins(),
                             .first_begin_ns = fault->activation->first_begin_ns(),
                             .active_ns = fault->activation->active_ns(end_ns),
                             .frames = outcome.frames,
                             .took_effect = outcome.took_effect,
                             .missing_effect = std::move(outcome.missing),
                             .test_table = fault->section->test_table});
    for (const Activation::Span& span : fault->activation->spans())
      record.faults.back().spans.push_back({span.begin_ns, std::min(span.end_ns, end_ns)});
  }
}

}  // namespace hil::injection
