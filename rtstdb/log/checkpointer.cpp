#include "rtstdb/log/checkpointer.hpp"

#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::log {

Checkpointer::Step Checkpointer::begin(const Position& position, Version not_before, ClockTime now,
                                       std::int64_t real_time_ns) {
  RTSTDB_ASSERT(may_begin(now));
  if (!asked_) asked_ = {position, not_before};
  auto head = source_.begin(asked_->not_before);
  if (!head) return {};
  const Asked asked = *std::exchange(asked_, std::nullopt);
  if (head->version.version < asked.not_before) {  // that version is being taken back
    source_.end();
    return {Did::given_up, 0, std::nullopt};
  }
  auto file = CheckpointFile::create(disk_,
                                     {.database_id = database_id_,
                                      .number = next_number_++,
                                      .position = asked.position,
                                      .real_time_ns = real_time_ns,
                                      .rows_per_slice = rows_per_slice_},
                                     std::move(*head));
  if (!file) {
    source_.end();
    return failed(file.error(), now);
  }
  file_ = std::move(file.value());
  written_ = false;
  return {Did::something, 0, std::nullopt};
}

Checkpointer::Step Checkpointer::go_on(const Synced& synced, ClockTime now) {
  RTSTDB_ASSERT(under_way());
  if (!written_) {
    auto progress = file_->write_slice(source_);
    if (!progress) return failed(progress.error(), now);
    if (progress.value() == CheckpointFile::Progress::not_kept) {
      give_up();
      return {Did::given_up, 0, std::nullopt};
    }
    written_ = progress.value() == CheckpointFile::Progress::written;
    return {Did::something, 0, std::nullopt};
  }
  if (synced.version < file_->version() || synced.geometries < file_->geometries()) return {};
  if (auto fault = file_->publish()) return failed(*fault, now);
  const Version version = file_->version();
  give_up();
  retry_.succeeded();
  return {Did::finished, version, std::nullopt};
}

void Checkpointer::give_up() noexcept {
  // What the source may be about to give goes with the place of the next one, or is older than that asks for.
  asked_.reset();
  if (file_ == nullptr) return;
  file_.reset();
  source_.end();
}

Checkpointer::Step Checkpointer::failed(const DiskError& fault, ClockTime now) {
  give_up();
  retry_.failed(now);
  return {Did::failed, 0, fault};
}

}  // namespace rtstdb::log
