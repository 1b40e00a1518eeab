#pragma once
// Finds the losses of a run. A device is lost when it is not connected for longer than its time-out
// (io::Device::loss_timeout_ns), counted from the first tick on. A device that has a time-out and never
// answered is lost, too, however short the run is. A process is lost when it ends before the run and its
// end does not end the run.
//
// A loss that begins while a fault of the scenario acts on the device is caused by that fault. After the end
// of the fault the device has its time-out to come back; a loss that goes on for longer is one of its own.
//
// Threads: set_fault, check and outputs_must_be_safe from the base thread; losses after the run.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/process_watch.hpp"

namespace hil::run {

class LossWatch {
 public:
  struct Subject {
    const io::Device* device = nullptr;  ///< outlives the watch
    std::string name;                    ///< with the noun of its type: "CAN bus car"
    bool may_be_lost = false;            ///< its loss does not make the run fail
  };
  explicit LossWatch(std::vector<Subject> subjects);

  /// To be called after the inputs of a tick are latched. Neither allocates nor blocks.
  void check(std::int64_t time_ns) noexcept;
  /// A fault acts on a device, by its place in the list of subjects, or does so no more. The name outlives
  /// the watch. Neither allocates nor blocks.
  void set_fault(std::size_t subject, const std::string& name, bool active) noexcept;
  /// True while a device is lost whose loss is neither permitted nor caused by a fault.
  bool outputs_must_be_safe() const noexcept { return outputs_must_be_safe_; }

  /// All losses in the order of their beginning; of each device the first 100 that ended. A loss that goes on
  /// lasts until `end_ns`, and the device's fault is its cause. `exits`: all processes of the run.
  std::vector<report::Loss> losses(std::int64_t end_ns, std::span<const ProcessExit> exits) const;
  /// The number of further losses of devices.
  std::uint64_t not_listed() const noexcept;

 private:
  struct Interval {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    const std::string* fault = nullptr;  ///< that caused the loss; null: none
  };
  struct Watched {
    Subject subject;
    std::optional<std::int64_t> disconnected_since_ns;
    std::optional<std::int64_t> first_check_ns;
    bool has_answered = false;
    std::array<Interval, 100> kept{};
    std::size_t kept_count = 0;
    std::uint64_t not_kept = 0;
    const std::string* fault = nullptr;  ///< acting now, the latest one
    std::uint32_t acting_faults = 0;
    const std::string* cause = nullptr;  ///< the fault in which the device was disconnected
  };
  static void keep(Watched& watched, std::int64_t end_ns) noexcept;
  static bool never_answered(const Watched& watched) noexcept;
  static bool is_loss(const Watched& watched, std::int64_t until_ns) noexcept;

  std::vector<Watched> watched_;
  bool outputs_must_be_safe_ = false;
};

}  // namespace hil::run
