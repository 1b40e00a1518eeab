#pragma once
// The signals of a run while it is wired, and their properties that only wiring needs. Mistakes carry the
// place in the scenario at which the signal is named.
//
// Threads: the one that wires the run.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/unit.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/expression/relation.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::signals {

/// The relations of bodies (expression/relation.hpp) that expressions of a run read, each with its signal.
struct RelationSignals {
  std::string writer;  ///< of the signals
  std::vector<expression::Relation> relations;
  std::vector<SignalId> signals;  ///< by relation
};

class KnownSignals {
 public:
  /// The table outlives it. `relations`: gets the relations that expressions read; each has a signal, which
  /// is added to the table when the first expression reads it (also by const functions, which change only
  /// what this refers to). It outlives this too. Null: there are none.
  explicit KnownSignals(SignalTable& table, RelationSignals* relations = nullptr)
      : table_(table), relations_(relations) {}

  SignalTable& table() noexcept { return table_; }
  const SignalTable& table() const noexcept { return table_; }

  /// Whether a signal of this name may be one of a part with a mistake (add_undeclared).
  bool is_undeclared(std::string_view name) const;

  /// The signals whose names begin with `prefix` ("can.car.") could not be declared, since their part has a
  /// mistake; so a reference to one of them adds no second mistake.
  void add_undeclared(std::string prefix) { undeclared_.push_back(std::move(prefix)); }
  bool has_undeclared() const noexcept { return !undeclared_.empty(); }
  /// A double can not represent all values of the signal. `reason` follows its name: "has 64 bits; ...".
  void set_imprecise(SignalId signal, std::string reason) {
    imprecise_.emplace(signal.index, std::move(reason));
  }
  /// A received signal to which nothing gives a time-out.
  void set_never_stale(SignalId signal) { never_stale_.insert(signal.index); }
  bool is_never_stale(SignalId signal) const { return never_stale_.contains(signal.index); }

  /// A variable that has this value in every step.
  void set_constant(SignalId signal, double value) { constants_.emplace(signal.index, value); }
  std::optional<double> constant(SignalId signal) const {
    const auto found = constants_.find(signal.index);
    return found == constants_.end() ? std::nullopt : std::optional(found->second);
  }

  /// A variable that is another signal: `source` is a name of it.
  void set_source(const std::string& variable, const std::string& source) {
    sources_.emplace(variable, source_of(source));
  }
  /// The name of the signal that the name stands for, also by way of variables; the name itself if there is
  /// none.
  std::string source_of(std::string_view name) const;

  /// Adds the new relations that the expression reads to those given, and their signals to the table.
  void add_relations(const config::Expression& expression) const;

  /// By the name of a signal, or a relation as an expression writes it. Invalid with a mistake when there is
  /// no such signal; without one when its part has a mistake.
  SignalId find(const config::Word& name, config::Diagnostics& diagnostics) const;

  /// How values of a signal are converted for its reader (a channel of a device, an input of a module). A
  /// mistake where the units are of different kinds. Without a unit, values are in the SI; beside a unit that
  /// is not of the SI that adds a warning. Values of an invalid signal are not converted.
  units::Conversion conversion_for(SignalId signal, const std::string& reader,
                                   const std::string& unit_of_reader, const config::Place& place,
                                   config::Diagnostics& diagnostics) const;

 private:
  SignalId find_relation(const config::Word& text, config::Diagnostics& diagnostics) const;

  SignalTable& table_;
  RelationSignals* relations_;
  std::vector<std::string> undeclared_;
  std::map<std::uint32_t, std::string> imprecise_;  ///< by index of the signal
  std::set<std::uint32_t> never_stale_;             ///< by index of the signal
  std::map<std::uint32_t, double> constants_;       ///< by index of the signal
  std::map<std::string, std::string> sources_;      ///< by variable
};

/// The value with this name; empty with a mistake when there is none, or several (NaN). `signal`: the name of
/// what the value belongs to.
std::optional<double> value_named(const std::map<std::string, double>& values, const config::Word& name,
                                  const std::string& signal, config::Diagnostics& diagnostics);

}  // namespace hil::signals
