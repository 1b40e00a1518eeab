#pragma once
// The port between a run and a type of bus. A type is one folder beside this file and one line of table.def;
// config, run, report and cli iterate over the types and name none.
//
// Calls for each bus of a scenario, in this order:
// 1. `create` and `read_entry`: the section reads its keys (config/bus_section.hpp).
// 2. `wire`: makes the BusWiring. `hil check` ends here: nothing is opened.
// 3. `describe_signals`, after the signals of all inputs are declared; then `connect` and `fault_problem`.
// 4. `make_device`, for a run, and `add_fault`.
// 5. `io::Device::start`, before the programs of the run or after them (`start_phase`).
// 6. `all_programs_connected`, called repeatedly until it returns true.
// 7. The tick (io/device.hpp).
// 8. After the device is stopped: `record`, `playback`, `log_file`, `log_fault`.
//
// Threads: the ordinary thread that wires and opens the run, except for load.

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "io/frame_sink.hpp"
#include "runtime/config/bus_section.hpp"
#include "runtime/config/scenario.hpp"
#include "runtime/contribution/bus_record.hpp"
#include "runtime/contribution/frame_format.hpp"
#include "runtime/signals/known_signals.hpp"
#include "runtime/signals/links.hpp"

namespace hil::buses {

using signals::KnownSignals;
using signals::Source;

/// When a run starts a device.
enum class StartPhase : std::uint8_t {
  before_programs,  ///< programs of the run connect to it
  after_programs,   ///< it connects to programs of the run
};

/// A fault of a bus in a run.
struct InjectedFault {
  std::shared_ptr<const config::FaultEffect> effect;  ///< of any kind, of another type of bus as well
  std::string message{};                              ///< whose frames have it; empty: the bus has it
  std::uint64_t seed = 0;                             ///< of random numbers of the fault
};

/// The run that a device is made for. Passed to make_device.
struct RunEnvironment {
  const config::Scenario& scenario;         ///< outlives the device
  std::filesystem::path directory;          ///< for its files
  std::function<void()> on_thread_start{};  ///< to be called first in the device's thread: name and priority
  /// Set by the user. While it is set, io::Device::start throws io::DeviceError instead of waiting. Outlives
  /// the device.
  const std::atomic<bool>& stop_requested;
  io::FrameSink* frames = nullptr;  ///< of a type with frames: gets each one; null: none. Outlives the device
};

/// The programs that the run has started. Passed to all_programs_connected.
struct StartedPrograms {
  /// The id of a process, by its name in the scenario, and of its process group; -1: there is none.
  std::function<pid_t(const std::string& name)> process_of;
  std::int64_t waited_ns = 0;  ///< since they were started
};

/// A log whose frames a device sends.
struct PlaybackRecord {
  std::string file;
  std::uint64_t passes = 0;                      ///< that have begun
  std::optional<std::int64_t> first_begin_ns{};  ///< of the first frame; empty: none was sent
  std::optional<std::int64_t> end_ns{};          ///< of the last frame; empty: still playing at the end
  std::uint64_t frames = 0;                      ///< that were sent
};

/// A bus in a run.
class BusDevice {
 public:
  virtual ~BusDevice() = default;

  virtual io::Device& device() noexcept = 0;
  /// Before the start, without a BusWiring::fault_problem(): adds a fault, which is not active, to the
  /// io::FaultTarget of the device. The first one has number 0.
  virtual void add_fault(const InjectedFault& fault) { static_cast<void>(fault); }
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
  /// Empty: the bus plays no log.
  virtual std::optional<PlaybackRecord> playback() const { return std::nullopt; }
  /// The name of the log that it writes into the directory of the run; empty: none.
  virtual std::string log_file() const { return {}; }
  /// Why that log is incomplete, in a sentence; empty: it is complete.
  virtual std::string log_fault() const { return {}; }
};

/// What a run that passes requires of a group of inputs (io::InputGroup).
struct InputRule {
  bool has_to_come = true;         ///< and to be fresh
  std::uint64_t max_rejected = 0;  ///< rejected frames, without those that the scenario made
};

/// A bus of a scenario, connected to the signals of a run.
class BusWiring {
 public:
  virtual ~BusWiring() = default;

  /// The channels that make_device will have. Never started.
  virtual const io::Device& channels() const noexcept = 0;
  /// Adds what a channel can not express: alternative names, value names, whether an input never becomes
  /// stale. `prefix`: the beginning of the names of its signals, "can.car.".
  virtual void describe_signals(const std::string& prefix, KnownSignals& known) const {
    static_cast<void>(prefix), static_cast<void>(known);
  }
  /// `group`: an index into input_groups() of the channels.
  virtual InputRule input_rule(std::size_t group) const = 0;
  /// Sets the source of each output, by channel index. On entry each is a constant with its safe value.
  virtual void connect(const KnownSignals& known, std::vector<Source>& outputs,
                       config::Diagnostics& diagnostics) const = 0;
  /// Why the bus can not have a fault, as a clause for the user; empty: it can.
  virtual std::string fault_problem(const InjectedFault& fault) const {
    static_cast<void>(fault);
    return "this device has no such fault";
  }
  /// The device of a run, not started. Throws io::DeviceError.
  virtual std::unique_ptr<BusDevice> make_device(RunEnvironment environment) const = 0;
};

/// A kind of file that a type reads besides the scenario, for the documentation of keys.
struct FileFormat {
  std::string title;  ///< "Register map files"
  config::Schema schema;
};

/// What this machine offers a type of bus, as a line of `hil doctor`.
struct DoctorLine {
  std::string topic;
  std::string text;
};

struct BusType {
  config::BusSectionType section;
  std::string title;                               ///< of its table on the page: "CAN"
  std::vector<contribution::BusColumn> columns{};  ///< of that table
  std::size_t max_descriptors = 8;                 ///< that one bus opens, an upper bound
  /// Its devices use RunEnvironment::frames. Empty: it has no frames.
  std::optional<contribution::FrameFormat> frames{};
  std::vector<FileFormat> files{};
  /// Null, with mistakes in `diagnostics`, when the bus can not be used. The section outlives the bus.
  std::unique_ptr<BusWiring> (*wire)(const config::BusSection& section,
                                     config::Diagnostics& diagnostics) = nullptr;
  std::vector<DoctorLine> (*doctor_lines)() = nullptr;  ///< may be null
};

/// All types of the program (table.def), in its order: that of their sections, tasks and tables.
const std::vector<BusType>& bus_types();
/// The parts of them that a scenario needs, in the same order.
const std::vector<config::BusSectionType>& section_types();
/// The type of a section that was read with section_types().
const BusType& type_of(const config::BusSection& section);

/// For each type the group of its records, still empty.
std::vector<contribution::BusGroup> empty_groups();

}  // namespace hil::buses
