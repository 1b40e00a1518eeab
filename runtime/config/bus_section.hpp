#pragma once
// The port between a scenario and a type of bus: what every bus has in a scenario, and what the scenario's
// reader, schema and checks need to know of a type. A type's own keys are read by a class of the type
// (runtime/buses), so that this folder names no type.
//
// Threads: immutable once loaded; any thread may read.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/schema.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/config/fault_section.hpp"

namespace hil::config {

struct ReaderContext;
struct BusSectionType;

/// One bus of a scenario: an entry of the list under its type's key. A type derives its own section from it.
class BusSection {
 public:
  virtual ~BusSection() = default;

  const BusSectionType* type = nullptr;  ///< outlives the section
  Word name;
  double rate_hz = 0.0;
  std::uint32_t every_ticks = 1;
  std::int64_t period_ns = 0;  ///< of the rate; 0 only while a scenario with a mistake in it is read
  std::optional<int> thread_priority;
  bool may_be_lost = false;  ///< its loss does not make the run fail

  /// "can.car": the name of its task; with a dot the beginning of its signals' names.
  std::string full_name() const;

  /// Reads the keys of the type. Called after the members above are read. An entry with a mistake is still
  /// read, so that all its mistakes are reported, and is then discarded.
  virtual void read_entry(const Value& entry, ReaderContext& reading) = 0;
  /// Checks the section against the commands of the processes. `is_in_a_command`: a command contains the
  /// placeholder of this bus.
  virtual void check_commands(bool is_in_a_command, Diagnostics& diagnostics) const {
    static_cast<void>(is_in_a_command), static_cast<void>(diagnostics);
  }
  /// Whether a program connected to this bus receives the run time under the virtual clock.
  virtual bool gives_run_time() const { return true; }
};

using BusSections = std::vector<std::shared_ptr<const BusSection>>;

/// What a scenario may contain of a type of bus.
struct BusSectionType {
  std::string key;           ///< of the list in a scenario, and the first word of its signals' names: "can"
  std::string about;         ///< of that list, for the documentation: "The CAN buses."
  std::string name_key;      ///< of an entry's name, by which --set finds the entry: "bus"
  std::string noun;          ///< one of them, in sentences: "CAN bus"
  std::string plural;        ///< "CAN buses"
  std::string input_noun{};  ///< a group of its inputs: "message", "register"
  /// Of an entry: a record with `name_key`, `rate` and `may_be_lost`, and perhaps `priority`, of the schemas
  /// in shared_schemas.hpp.
  Schema entry;
  bool has_address = true;  ///< its placeholder stands for an address in the command of a process
  /// A condition that follows the placeholder in a sentence: "of a unit with run_time". Empty: all buses of
  /// the type give the run time.
  std::string run_time_condition{};
  /// The noun of one arrival ("frame"), for devices that keep arrivals (io::ArrivalSource). Empty:
  /// the device keeps none, so the newest value of each tick is judged.
  std::string arrival_noun{};
  /// Its record counts the ticks whose outputs were not sent (contribution/bus_record.hpp), which
  /// realtime.max_lost limits.
  bool counts_dropped_releases = false;
  /// The faults of its messages and devices.
  std::vector<FaultKind> faults{};

  std::unique_ptr<BusSection> (*create)() = nullptr;
  /// Adds the mistakes of sections that exclude each other. `sections`: all of the type that are whole. May
  /// be null.
  void (*check)(std::span<const std::shared_ptr<const BusSection>> sections,
                ReaderContext& reading) = nullptr;

  /// "{can.BUS}"
  std::string placeholder() const;
};

/// The placeholders of the types that have addresses: "{can.BUS} and {modbus.UNIT}".
std::string address_placeholders(std::span<const BusSectionType> types);
/// The same and {clock}: "{can.BUS}, {modbus.UNIT} and {clock}".
std::string all_placeholders(std::span<const BusSectionType> types);
/// Those by which a process receives the run time: "{clock}, {can.BUS} and {modbus.UNIT} of a unit with
/// run_time".
std::string run_time_placeholders(std::span<const BusSectionType> types);

/// Those sections that are of this class, in their order.
template <class Section>
std::vector<const Section*> sections_of(std::span<const std::shared_ptr<const BusSection>> sections) {
  std::vector<const Section*> found;
  for (const std::shared_ptr<const BusSection>& section : sections) {
    if (const auto* const typed = dynamic_cast<const Section*>(section.get())) found.push_back(typed);
  }
  return found;
}

}  // namespace hil::config
