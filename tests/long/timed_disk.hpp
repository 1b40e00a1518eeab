#pragma once
// A disk that measures the time in the calls of another disk. The time may be in memory that another
// process reads after this one is killed.
//
// Threads: one calls at a time; any thread reads the time.

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include <rtstdb/time.hpp>

#include "rtstdb/log/disk.hpp"

namespace hil::long_test {

class DiskTime {
 public:
  /// The time in completed calls and in the current one.
  rtstdb::Nanoseconds total(rtstdb::ClockTime now) const noexcept;
  void begin_call(rtstdb::ClockTime now) noexcept;
  void end_call(rtstdb::ClockTime now) noexcept;

 private:
  std::atomic<std::int64_t> finished_ns_{0};
  std::atomic<std::int64_t> begun_ns_{0};  ///< of the current call; 0: none
};

class TimedDisk final : public rtstdb::log::Disk {
 public:
  /// The time and the clock outlive the disk and its files.
  TimedDisk(std::unique_ptr<rtstdb::log::Disk> disk, DiskTime& time, const rtstdb::Clock& clock)
      : disk_(std::move(disk)), timer_{time, clock} {}

  template <class T>
  using Result = rtstdb::log::DiskResult<T>;
  using Fault = rtstdb::log::DiskFault;
  Result<std::unique_ptr<rtstdb::log::DiskFile>> create(std::string_view name) override;
  Result<std::unique_ptr<rtstdb::log::DiskFile>> open(std::string_view name) override;
  Result<std::vector<std::string>> list() override;
  Fault rename(std::string_view from, std::string_view to) override;
  Fault remove(std::string_view name) override;
  Fault sync_directory() override;
  Result<std::unique_ptr<rtstdb::log::DiskLock>> lock(std::string_view name) override;

 private:
  struct Timer {
    DiskTime& time;
    const rtstdb::Clock& clock;
    template <class Call>
    auto operator()(const Call& call) const {
      time.begin_call(clock.now());
      auto result = call();
      time.end_call(clock.now());
      return result;
    }
  };
  class File;

  std::unique_ptr<rtstdb::log::Disk> disk_;
  Timer timer_;
};

}  // namespace hil::long_test
