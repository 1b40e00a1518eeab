#include "timed_disk.hpp"

#include <algorithm>

namespace hil::long_test {

using rtstdb::ClockTime;
using rtstdb::Nanoseconds;
using rtstdb::log::DiskFault;
using rtstdb::log::DiskFile;
using rtstdb::log::DiskLock;
using rtstdb::log::DiskResult;

Nanoseconds DiskTime::total(ClockTime now) const noexcept {
  const std::int64_t finished_ns = finished_ns_;
  const std::int64_t begun_ns = begun_ns_;
  const std::int64_t now_ns = now.time_since_epoch().count();
  return Nanoseconds(finished_ns + (begun_ns != 0 ? std::max<std::int64_t>(now_ns - begun_ns, 0) : 0));
}

void DiskTime::begin_call(ClockTime now) noexcept {
  begun_ns_ = now.time_since_epoch().count();
}

void DiskTime::end_call(ClockTime now) noexcept {
  finished_ns_ += now.time_since_epoch().count() - begun_ns_;
  begun_ns_ = 0;
}

class TimedDisk::File final : public DiskFile {
 public:
  File(std::unique_ptr<DiskFile> file, const Timer& timer) : file_(std::move(file)), timer_(timer) {}
  DiskFault write(std::uint64_t offset, std::span<const std::byte> bytes) override {
    return timer_([&] { return file_->write(offset, bytes); });
  }
  DiskFault preallocate(std::uint64_t bytes) override {
    return timer_([&] { return file_->preallocate(bytes); });
  }
  DiskFault sync() override {
    return timer_([&] { return file_->sync(); });
  }
  DiskResult<std::size_t> read(std::uint64_t offset, std::span<std::byte> bytes) override {
    return timer_([&] { return file_->read(offset, bytes); });
  }
  DiskResult<std::uint64_t> size() override {
    return timer_([&] { return file_->size(); });
  }

 private:
  std::unique_ptr<DiskFile> file_;
  Timer timer_;
};

DiskResult<std::unique_ptr<DiskFile>> TimedDisk::create(std::string_view name) {
  auto file = timer_([&] { return disk_->create(name); });
  if (!file) return file;
  return std::unique_ptr<DiskFile>(std::make_unique<File>(std::move(file.value()), timer_));
}

DiskResult<std::unique_ptr<DiskFile>> TimedDisk::open(std::string_view name) {
  auto file = timer_([&] { return disk_->open(name); });
  if (!file) return file;
  return std::unique_ptr<DiskFile>(std::make_unique<File>(std::move(file.value()), timer_));
}

DiskResult<std::vector<std::string>> TimedDisk::list() {
  return timer_([&] { return disk_->list(); });
}

DiskFault TimedDisk::rename(std::string_view from, std::string_view to) {
  return timer_([&] { return disk_->rename(from, to); });
}

DiskFault TimedDisk::remove(std::string_view name) {
  return timer_([&] { return disk_->remove(name); });
}

DiskFault TimedDisk::sync_directory() {
  return timer_([&] { return disk_->sync_directory(); });
}

DiskResult<std::unique_ptr<DiskLock>> TimedDisk::lock(std::string_view name) {
  return timer_([&] { return disk_->lock(name); });
}

}  // namespace hil::long_test
