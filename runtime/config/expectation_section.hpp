#pragma once
// The section `expectations` of a scenario, and the port between a scenario and a kind of expectation. What a
// kind claims is read by the kind itself (runtime/expectations), so that this folder names none.
//
// Threads: immutable once loaded; any thread may read.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/bus_section.hpp"
#include "runtime/config/expression.hpp"

namespace hil::config {

struct Scenario;
struct ReaderContext;
struct ScenarioTypes;

/// What an expectation claims. A kind derives its own from it.
class Claim {
 public:
  virtual ~Claim() = default;
};

/// The ticks on which an expectation is judged: from the first tick at `from_ns` or later on which `after` is
/// true, up to `to_ns`, and before the first later tick on which `until` is true.
struct WindowSection {
  Place place;
  std::optional<std::int64_t> from_ns, to_ns;
  std::optional<Expression> after, until;
};

struct Expectation {
  std::string name;
  Place place;
  double coverage = 0.95;                 ///< least share of its ticks on which it has to be evaluated
  std::optional<WindowSection> window{};  ///< empty: the whole run
  std::shared_ptr<const Claim> claim;
};

/// What a reader of a claim knows besides the entry.
struct ClaimContext {
  std::int64_t duration_ns = 0;  ///< of the run; 0: it has a mistake
  std::int64_t period_ns = 0;    ///< of the base tick; 0: it has a mistake
  Diagnostics& diagnostics;
};

/// A kind of expectation: the key that an entry has exactly one of.
struct ExpectationKind {
  std::string key;
  std::string about;
  Schema (*schema)(std::span<const BusSectionType> buses) = nullptr;
  /// Of a whole entry. Empty with mistakes.
  std::shared_ptr<const Claim> (*read)(const Value& entry, const ClaimContext& context) = nullptr;
};

/// What a signal has to be at an instant, by a test table (test_table_file.hpp).
struct InstantCheck {
  std::int64_t time_ns = 0;  ///< run time of a tick
  Expression value;          ///< a constant, or a value name of the signal
  std::optional<Expression> tolerance{};
};

/// Makes the claims of test tables.
struct TableClaims {
  /// The signal is within the tolerance of the value at each instant. The times of the checks are strictly
  /// increasing.
  std::shared_ptr<const Claim> (*at_instants)(Word signal, std::vector<InstantCheck> checks) = nullptr;
};

Schema expectations_schema(const ScenarioTypes& types);
/// Adds the entries without mistakes.
void read_expectations(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
