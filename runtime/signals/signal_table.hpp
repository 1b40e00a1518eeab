#pragma once
// The signals of a run: named scalars with one writer each. The table is filled while the run is configured;
// after the first tick only values change.
//
// Threads: one thread configures. Only the base thread reads and writes values; tasks on other threads use
// copies that the executive latches and publishes for them (executive/task.hpp).

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <hil/signal_value.hpp>
#include <hil/unit.hpp>

namespace hil::signals {

/// NAME.faulted is the signal of what the readers of the signal NAME get while a fault acts on it.
inline constexpr std::string_view faulted_suffix = ".faulted";

struct SignalId {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  bool valid() const noexcept { return index != std::numeric_limits<std::uint32_t>::max(); }
  bool operator==(const SignalId&) const = default;
};

struct SignalInfo {
  std::string name;    ///< dotted, unique in the run: "ego.speed", "can.car.BrakeCommand.Deceleration"
  std::string unit;    ///< SI symbol, "" when dimensionless
  std::string writer;  ///< name of the module or device that writes it
  double initial = 0.0;
  bool arrives = false;         ///< received from a device: unknown while not fresh
  std::int64_t timeout_ns = 0;  ///< if `arrives`: time for which its value stays fresh; 0: without limit
  std::map<std::string, double> named_values = {};  ///< value names, as a bus describes them
  units::ValueKind value_kind = units::ValueKind::as_unit;
};

/// Keeps something in step with a signal.
class WriteFollower {
 public:
  virtual ~WriteFollower() = default;
  /// The signal has been written. Neither allocates nor blocks; may write other signals.
  virtual void follow(SignalId signal) noexcept = 0;
};

enum class ReadBy : std::uint8_t {
  task,         ///< of a module or a bus
  expectation,  ///< which judges the tick
};

/// Is notified when a task or an expectation reads the signal.
class ReadObserver {
 public:
  virtual ~ReadObserver() = default;
  /// Base thread, in the tick of the read, with the table as it is then. Neither allocates
  /// nor blocks.
  virtual void note_read(ReadBy by) noexcept = 0;
  /// The same, but a fault replaces the value that would have been taken. `fault`: its name, which outlives
  /// the run.
  virtual void note_replaced(std::string_view fault) noexcept { static_cast<void>(fault); }
};

class SignalTable {
 public:
  /// Adds a signal. Misuse (asserts): a second signal of the same name. Callers check with find() first,
  /// since two writers of one signal are a mistake of the user that is reported with its place.
  SignalId add(SignalInfo info);

  /// Adds another name for find(); does nothing if the name is in use.
  void add_alias(const std::string& name, SignalId id) { by_name_.try_emplace(name, id.index); }
  void set_named_values(SignalId id, std::map<std::string, double> values) {
    infos_[id.index].named_values = std::move(values);
  }

  /// By name or alias.
  std::optional<SignalId> find(std::string_view name) const;
  /// The names of all signals, without aliases, in the order they were added.
  std::vector<std::string> names() const;

  std::size_t size() const noexcept { return infos_.size(); }
  const SignalInfo& info(SignalId id) const noexcept { return infos_[id.index]; }

  const SignalValue& read(SignalId id) const noexcept { return values_[id.index]; }
  /// Whether the value is known: a received signal is fresh, or the task of an output has published it.
  bool is_known(SignalId id) const noexcept { return values_[id.index].fresh; }
  /// For modules, stimuli, faults and the recording: as is_known, but an output has its initial value before
  /// it is published.
  bool is_readable(SignalId id) const noexcept {
    return !infos_[id.index].arrives || values_[id.index].fresh;
  }
  double value(SignalId id) const noexcept { return values_[id.index].value; }
  void write(SignalId id, double value, std::int64_t time_ns) noexcept {
    write(id, SignalValue{value, time_ns, true});
  }
  void write(SignalId id, const SignalValue& value) noexcept {
    values_[id.index] = value;
    if (id.index < followers_.size() && followers_[id.index] != nullptr) followers_[id.index]->follow(id);
  }

  /// `follower` is called after each write of the signal, from then on. One for each signal; it outlives the
  /// table's last write.
  void set_follower(SignalId id, WriteFollower& follower) {
    followers_.resize(infos_.size());
    followers_[id.index] = &follower;
  }

  /// While the run is wired. Each reader of the signal calls note_read(). `observer` outlives the last tick.
  void add_read_observer(SignalId id, ReadObserver& observer) {
    read_observers_[id.index].push_back(&observer);
  }
  /// The observers of these signals, each once. Allocates.
  std::vector<ReadObserver*> read_observers(std::span<const SignalId> ids) const;

  /// A table of the same signals and values. Nothing follows or observes it.
  SignalTable copy() const;
  /// Takes the values of a table with the same signals.
  void copy_values(const SignalTable& from) noexcept {
    std::copy(from.values_.begin(), from.values_.end(), values_.begin());
  }

  /// All values, in the order in which the signals were added: for recording and comparing.
  std::span<const SignalValue> values() const noexcept { return values_; }

 private:
  std::vector<SignalInfo> infos_;
  std::vector<SignalValue> values_;
  std::unordered_map<std::string, std::uint32_t> by_name_;
  std::vector<WriteFollower*> followers_;                               ///< by signal; may be shorter
  std::map<std::uint32_t, std::vector<ReadObserver*>> read_observers_;  ///< by index of the signal
};

}  // namespace hil::signals
