#include "runtime/injection/signal_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/injection/delay_line.hpp"
#include "runtime/injection/random_numbers.hpp"
#include "runtime/modules/splitmix64.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::injection {
namespace {

using FaultKind = config::FaultSection::Kind;
using signals::SignalId;
using signals::SignalValue;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

/// What the value of a fault is in.
struct ValueUnit {
  std::string symbol;
  double factor = 1.0;  ///< to the unit of the signal
};
ValueUnit value_unit(FaultKind kind, const std::string& unit) {
  if (kind == FaultKind::gain) return {};
  if (kind == FaultKind::stuck) return {unit};
  const units::DifferenceUnit difference = units::difference_unit(unit);
  if (kind != FaultKind::drift) return {difference.symbol, difference.factor};
  return {difference.symbol.empty() ? "1/s" : difference.symbol + "/s", difference.factor};
}

std::string kind_text(const config::FaultSection& section) {
  switch (section.kind) {
    case FaultKind::stuck_at_last:
      return "stuck at its last value";
    case FaultKind::stuck:
      return "stuck at " + section.value->text();
    case FaultKind::offset:
      return "offset by " + section.value->text();
    case FaultKind::gain:
      return "multiplied by " + section.value->text();
    case FaultKind::noise:
      return "noise of " + section.value->text();
    case FaultKind::drift:
      return "drift of " + section.value->text();
    case FaultKind::delay:
      return "delayed by " + report::to_ascii(report::chosen_time(section.delay_ns));
    case FaultKind::dropout:
      return "without value in " + report::shortest(100.0 * section.dropout) + " % of the ticks";
  }
  return {};
}

}  // namespace

struct SignalFaults::Fault {
  const config::FaultSection* section = nullptr;
  Chain* chain = nullptr;
  SignalId active;  ///< the signal "fault.NAME"
  std::optional<Activation> activation;
  std::optional<signals::SignalExpression> value;
  double value_factor = 1.0;  ///< of the value, to the unit of the signal
  std::uint64_t seed = 0;
  RandomNumbers random{0};
  std::optional<DelayLine> line;
  modules::EventLog::Kind begins, ends;

  // Of this tick.
  double number = 0.0;  ///< the value, with the noise drawn
  bool is_dropped = false;
  bool takes_last = false;  ///< the value at the next follow() is the one that it is stuck at
  SignalValue last;

  void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
    if (value) number = value->evaluate(table, time_ns) * value_factor;
    // Drawn in each tick, so that one fault's numbers do not depend on when it is active.
    if (section->kind == FaultKind::noise) number *= random.normal();
    if (section->kind == FaultKind::dropout) is_dropped = random.uniform() < section->dropout;
  }

  void act_on(SignalValue& signal, std::int64_t time_ns) noexcept {
    if (!activation->is_active()) return;
    switch (section->kind) {
      case FaultKind::stuck_at_last:
        if (std::exchange(takes_last, false)) last = signal;
        signal = {last.value, signal.time_ns, true};
        break;
      case FaultKind::stuck:
        signal = {number, signal.time_ns, true};
        break;
      case FaultKind::offset:
      case FaultKind::noise:
        signal.value += number;
        break;
      case FaultKind::gain:
        signal.value *= number;
        break;
      case FaultKind::drift:
        signal.value += number * 1e-9 * static_cast<double>(time_ns - activation->began_ns());
        break;
      case FaultKind::delay:
        signal = line->at(time_ns - section->delay_ns, signal);
        break;
      case FaultKind::dropout:
        if (is_dropped) signal = {no_value, signal.time_ns, false};
        break;
    }
  }
};

/// The faults of one signal.
class SignalFaults::Chain final : public signals::WriteFollower {
 public:
  SignalId signal, faulted;
  std::vector<Fault*> faults;
  bool has_readers = false;

  void open(signals::SignalTable& table) {
    table_ = &table;
    table.set_follower(signal, *this);
  }
  void begin_tick(std::int64_t time_ns) noexcept {
    time_ns_ = time_ns;
    follow(signal);
  }
  void follow(SignalId /*signal*/) noexcept override {
    SignalValue value = table_->read(signal);
    for (Fault* fault : faults)
      fault->act_on(value, time_ns_);
    table_->write(faulted, value);
  }
  /// Delays keep what comes to them at the end of a tick.
  void end_tick() noexcept {
    SignalValue value = table_->read(signal);
    for (Fault* fault : faults) {
      if (fault->line) fault->line->keep(value, time_ns_);
      fault->act_on(value, time_ns_);
    }
  }

 private:
  signals::SignalTable* table_ = nullptr;
  std::int64_t time_ns_ = 0;
};

SignalFaults::SignalFaults() = default;
SignalFaults::SignalFaults(SignalFaults&&) noexcept = default;
SignalFaults& SignalFaults::operator=(SignalFaults&&) noexcept = default;
SignalFaults::~SignalFaults() = default;

void SignalFaults::declare(const config::Scenario& scenario, signals::KnownSignals& known,
                           config::Diagnostics& diagnostics) {
  signals::SignalTable& table = known.table();
  for (const config::FaultSection& section : scenario.faults) {
    auto fault = std::make_unique<Fault>();
    fault->section = &section;
    fault->seed = modules::splitmix64(scenario.seed ^ (0xFA17u + faults_.size()) * modules::splitmix64_step);
    fault->random = RandomNumbers(fault->seed);
    fault->active = table.add({.name = "fault." + section.name.text, .unit = "", .writer = "faults"});
    if (section.kind == FaultKind::delay)
      fault->line.emplace(static_cast<std::size_t>(section.delay_ns / scenario.base_period_ns) + 2);
    faults_.push_back(std::move(fault));
    const auto is_variable = [&](const config::VariableSection& one) {
      return one.name.text == section.signal.text;
    };
    if (std::ranges::any_of(scenario.variables, is_variable)) {
      diagnostics.add(section.signal.place,
                      "'" + section.signal.text +
                          "' is a variable; a fault acts on a signal of a module, a bus "
                          "or a stimulus");
      continue;
    }
    const SignalId signal = known.find(section.signal, diagnostics);
    if (!signal.valid()) continue;
    auto chain = std::ranges::find(chains_, signal, [](const auto& one) { return one->signal; });
    if (chain == chains_.end()) {
      signals::SignalInfo info = table.info(signal);
      info.name += ".faulted";
      info.writer = "faults";
      if (table.find(info.name)) {
        diagnostics.add(section.signal.place,
                        "there is a signal '" + info.name + "' already, which would be the faulted one");
        continue;
      }
      chains_.push_back(std::make_unique<Chain>());
      chain = chains_.end() - 1;
      (*chain)->signal = signal;
      (*chain)->faulted = table.add(std::move(info));
    }
    (*chain)->faults.push_back(faults_.back().get());
    faults_.back()->chain = chain->get();
  }
}

void SignalFaults::redirect(std::span<const Reader> readers, config::Diagnostics& diagnostics) {
  for (const auto& chain : chains_) {
    const std::vector<config::Word>& named = chain->faults.front()->section->readers;
    const auto texts = [](const std::vector<config::Word>& words) {
      std::vector<std::string> names;
      for (const config::Word& word : words)
        names.push_back(word.text);
      std::ranges::sort(names);
      return names;
    };
    for (const Fault* fault : chain->faults) {
      if (texts(fault->section->readers) == texts(named)) continue;
      diagnostics.add(fault->section->name.place, "the faults of '" + fault->section->signal.text +
                                                      "' name different readers; all have the same ones");
    }
    std::vector<std::string> reading;
    std::vector<SignalId*> redirected;
    std::vector<bool> is_found(named.size());
    for (const Reader& reader : readers) {
      if (*reader.signal != chain->signal) continue;
      reading.push_back(reader.owner);
      bool is_named = named.empty();
      for (std::size_t i = 0; i < named.size(); ++i) {
        if (named[i].text != reader.owner && named[i].text != reader.name) continue;
        is_named = is_found[i] = true;
      }
      if (is_named) redirected.push_back(reader.signal);
    }
    const config::FaultSection& section = *chain->faults.front()->section;
    for (std::size_t i = 0; i < named.size(); ++i) {
      if (is_found[i]) continue;
      diagnostics.add(named[i].place, "'" + named[i].text + "' does not read '" + section.signal.text + "'" +
                                          config::suggestion(named[i].text, reading));
    }
    if (reading.empty()) {
      diagnostics.add(section.signal.place, "no module and no bus reads '" + section.signal.text +
                                                "', so a fault of it has no effect");
    }
    for (SignalId* signal : redirected)
      *signal = chain->faulted;
  }
}

void SignalFaults::compile(const config::Scenario& scenario, const signals::KnownSignals& known,
                           config::Diagnostics& diagnostics) {
  for (const auto& fault : faults_) {
    const std::uint64_t seed = modules::splitmix64(fault->seed);
    fault->activation =
        Activation::compile(fault->section->activation, known, scenario.base_period_ns, seed, diagnostics);
    if (!fault->section->value || fault->chain == nullptr) continue;
    const std::string& unit = known.table().info(fault->chain->signal).unit;
    const ValueUnit wanted = value_unit(fault->section->kind, unit);
    fault->value_factor = wanted.factor;
    fault->value = signals::SignalExpression::compile(
        *fault->section->value, known,
        {.unit = wanted.symbol, .what = "the value of fault '" + fault->section->name.text + "'"},
        {.period_ns = scenario.base_period_ns, .seed = modules::splitmix64(seed)}, diagnostics);
  }
}

void SignalFaults::open(signals::SignalTable& table, modules::EventLog& events) {
  table_ = &table;
  events_ = &events;
  for (const auto& chain : chains_)
    chain->open(table);
  for (const auto& fault : faults_) {
    const std::string text = "fault " + fault->section->name.text + " ";
    const std::string what = fault->section->signal.text + " " + kind_text(*fault->section);
    fault->begins = events.add_kind(text + "begins: " + what);
    fault->ends = events.add_kind(text + "ends");
  }
}

void SignalFaults::begin_tick(std::int64_t time_ns) noexcept {
  for (const auto& fault : faults_) {
    fault->begin_tick(*table_, time_ns);
    const Activation::Change change = fault->activation->update(*table_, time_ns);
    if (change == Activation::Change::none) continue;
    const bool begins = change == Activation::Change::begins;
    fault->takes_last = begins;
    events_->note(begins ? fault->begins : fault->ends, time_ns);
  }
  // All activations have read the same signals.
  for (const auto& fault : faults_)
    table_->write(fault->active, fault->activation->is_active() ? 1.0 : 0.0, time_ns);
  for (const auto& chain : chains_)
    chain->begin_tick(time_ns);
}

void SignalFaults::end_tick(std::int64_t /*time_ns*/) noexcept {
  for (const auto& chain : chains_)
    chain->end_tick();
}

void SignalFaults::fill(std::int64_t end_ns, report::RunRecord& record) const {
  for (const auto& fault : faults_) {
    record.faults.push_back({.name = fault->section->name.text,
                             .signal = fault->section->signal.text,
                             .effect = kind_text(*fault->section),
                             .begins = fault->activation->begins(),
                             .first_begin_ns = fault->activation->first_begin_ns(),
                             .active_ns = fault->activation->active_ns(end_ns)});
  }
}

}  // namespace hil::injection
