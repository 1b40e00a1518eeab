#pragma once
// The port between a run and a type of bus. A type is one folder beside this file and one line of table.def;
// config, run, report and cli iterate over the types and name none.
//
// Calls for each bus of a scenario, in this order:
// - its section is created and reads its keys (config/bus_section.hpp).
// - BusType::wire makes the Bus from the section, with a device that is never started, whose channels become
//   signals. `hil check` goes this far: nothing is opened.
// - describe_signals, when the signals of its inputs are declared; connect, when all signals of the run are.
// - make_device, for a run. Then start of the io::Device, before or after the programs of the run are started
//   (start_phase); all_programs_connected until it holds; the tick, as io/device.hpp states.
// - record, log_file and log_fault, after the device is stopped.
//
// Threads: the ordinary thread that wires and opens the run, except for load.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/buses/known_signals.hpp"
#include "runtime/buses/links.hpp"
#include "runtime/config/bus_section.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/contribution/bus_record.hpp"

namespace hil::buses {

/// When a run starts a device.
enum class StartPhase : std::uint8_t {
  before_programs,  ///< programs of the run connect to it
  after_programs,   ///< it connects to programs of the run
};

/// What a device needs of its run.
struct RunFacts {
  const config::Scenario& scenario;         ///< outlives the device
  std::filesystem::path directory;          ///< for its files
  std::function<void()> on_thread_start{};  ///< to be called first in the device's thread: name and priority
};

/// The programs that the run has started, while it waits for those that connect to its buses.
struct StartedPrograms {
  /// The id of a process, by its name in the scenario, and of its process group; -1: there is none.
  std::function<pid_t(const std::string& name)> process_of;
  std::int64_t waited_ns = 0;  ///< since they were started
};

/// A bus in a run.
class BusDevice {
 public:
  virtual ~BusDevice() = default;

  virtual io::Device& device() noexcept = 0;
  virtual StartPhase start_phase() const noexcept = 0;
  /// Stands for {section.name} in the command of a process, for a type with addresses. Known before the
  /// device is started.
  virtual std::string address() const { return {}; }
  /// Whether all programs that have its address have connected. Throws io::DeviceError when one of them takes
  /// longer than its start_timeout.
  virtual bool all_programs_connected(const StartedPrograms& programs) const {
    static_cast<void>(programs);
    return true;
  }
  /// The fraction of the bit rate in use now, for the live line; empty: not measured. Any thread.
  virtual std::optional<double> load() const { return std::nullopt; }

  /// What the report shows of it. The fields that BusType::columns names are in each record of the type.
  virtual contribution::BusRecord record() const = 0;
  /// The name of the log that it writes into the directory of the run; empty: none.
  virtual std::string log_file() const { return {}; }
  /// Why that log is incomplete, in a sentence; empty: it is complete.
  virtual std::string log_fault() const { return {}; }
};

/// A bus of a scenario, connected to the signals of a run.
class Bus {
 public:
  virtual ~Bus() = default;

  /// The channels that make_device will have. Never started.
  virtual const io::Device& channels() const noexcept = 0;
  /// Adds to the signals of its inputs what their channels do not say: further names, names of values, lack
  /// of a time-out. `prefix`: the beginning of their names, "can.car.".
  virtual void describe_signals(const std::string& prefix, KnownSignals& known) const {
    static_cast<void>(prefix), static_cast<void>(known);
  }
  /// Connects the outputs, by channel. Each is at its safe value as a constant before the call.
  virtual void connect(const KnownSignals& known, std::vector<Source>& outputs,
                       config::Diagnostics& diagnostics) const = 0;
  /// The device of a run, not started. Throws io::DeviceError.
  virtual std::unique_ptr<BusDevice> make_device(RunFacts facts) const = 0;
};

/// A kind of file that a type reads besides the scenario, for the documentation of keys.
struct FileFormat {
  std::string title;  ///< "Register map files"
  config::Schema schema;
};

/// What this machine offers a type of bus, as a line of `hil doctor`.
struct MachineFact {
  std::string topic;
  std::string text;
};

struct BusType {
  config::BusSectionType section;
  std::string title;                               ///< of its table on the page: "CAN"
  std::vector<contribution::BusColumn> columns{};  ///< of that table
  std::size_t max_descriptors = 8;                 ///< that one bus opens, an upper bound
  std::vector<FileFormat> files{};
  /// Null with mistakes when nothing of the bus can be used. The section outlives the bus.
  std::unique_ptr<Bus> (*wire)(const config::BusSection& section, config::Diagnostics& diagnostics) = nullptr;
  std::vector<MachineFact> (*machine_facts)() = nullptr;  ///< may be null
};

/// All types of the program (table.def), in its order: that of their sections, tasks and tables.
const std::vector<BusType>& bus_types();
/// The parts of them that a scenario needs, in the same order.
const std::vector<config::BusSectionType>& section_types();
/// The type of a section that was read with section_types().
const BusType& type_of(const config::BusSection& section);

/// For each type the group of its records, still empty.
std::vector<contribution::BusGroup> empty_groups();

/// The index of the output with this name; the number of outputs: there is none.
std::size_t output_index(const io::Device& device, const std::string& channel);

}  // namespace hil::buses
