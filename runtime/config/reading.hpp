#pragma once
// What the readers of a scenario's sections share, those of bus types (runtime/buses) included.
//
// Values come from check_tree and may be incomplete. Each reader skips what is not whole, since its mistake
// is already reported, and reads the rest, so that one mistake hides no other.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/check.hpp"
#include "runtime/config/scenario.hpp"

namespace hil::config {

struct BaseRate {
  double hz = 0.0;
  std::int64_t period_ns = 0;
};

/// The state that the readers share.
struct ReaderContext {
  Diagnostics& diagnostics;
  const ScenarioTypes& types;
  std::optional<BaseRate> base{};  ///< empty: it was a mistake; rates are then not checked
  ClockKind clock = ClockKind::realtime;
  std::int64_t duration_ns = 0;  ///< of the run; 0: it is not known
  /// The names of all buses by the key of their type, also of sections with mistakes.
  std::map<std::string, std::vector<std::string>> bus_names{};
};

/// Names that must be unique. A second one is a mistake that names the line of the first, and its file when
/// it is another one (--set).
class UniqueNames {
 public:
  /// `what`: "module", "bus", ...
  UniqueNames(std::string what, Diagnostics& diagnostics)
      : what_(std::move(what)), diagnostics_(diagnostics) {}
  void add(const Word& name);

 private:
  std::string what_;
  Diagnostics& diagnostics_;
  std::map<std::string, Place> first_;
};

Word word_of(const Value& text);
/// The text field of a record, if it is there.
std::optional<Word> word_in(const Value& record, const std::string& field);
/// The list or map field, if it is there.
const Value* part_of(const Value& record, const std::string& field);

/// A list whose schema promises three numbers.
std::array<double, 3> three_numbers(const Value& list);

/// The base rate divided by `rate`; empty with a mistake (naming the nearest rates that do) when that is no
/// whole number. Without a base rate: empty, no mistake.
std::optional<std::uint32_t> ticks_between(const Value& rate, const ReaderContext& reading);

/// `duration` / `unit_ns`; empty with a mistake when that is no whole number. `unit_name`: "the base period".
std::optional<std::int64_t> multiple_of(const Value& duration, std::int64_t unit_ns, const std::string& field,
                                        const std::string& unit_name, Diagnostics& diagnostics);

}  // namespace hil::config
