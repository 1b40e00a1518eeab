#include "rtstdb/log/checkpointer.hpp"

#include <new>
#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::log {

Checkpointer::Step Checkpointer::begin(const Position& position, Version not_before, ClockTime now,
                                       std::int64_t real_time_ns) {
  RTSTDB_ASSERT(may_begin(now), "a checkpoint may not begin now");
  if (!request_) request_ = {position, not_before};
  try {
    return begin_file(now, real_time_ns);
  } catch (const std::bad_alloc&) {
    return failed(no_memory(), now);
  }
}

Checkpointer::Step Checkpointer::begin_file(ClockTime now, std::int64_t real_time_ns) {
  auto head = source_.begin(request_->not_before);
  if (!head) return {};
  source_has_begun_ = true;
  if (head->version.version < request_->not_before) {  // the version not_before is being discarded
    abandon();
    return {Progress::abandoned, 0, std::nullopt};
  }
  auto file = CheckpointFile::create(disk_,
                                     {.database_id = database_id_,
                                      .number = next_number_++,
                                      .position = request_->position,
                                      .real_time_ns = real_time_ns,
                                      .rows_per_slice = rows_per_slice_},
                                     std::move(*head));
  if (!file) return failed(file.error(), now);
  file_ = std::move(file.value());
  request_.reset();
  written_ = false;
  return {Progress::something, 0, std::nullopt};
}

Checkpointer::Step Checkpointer::advance(const Synced& synced, ClockTime now) {
  RTSTDB_ASSERT(in_progress(), "no checkpoint is in progress");
  try {
    return advance_writing(synced, now);
  } catch (const std::bad_alloc&) {
    return failed(no_memory(), now);
  }
}

Checkpointer::Step Checkpointer::advance_writing(const Synced& synced, ClockTime now) {
  if (!written_) {
    auto progress = file_->write_slice(source_);
    if (!progress) return failed(progress.error(), now);
    if (progress.value() == CheckpointFile::Progress::not_kept) {
      abandon();
      return {Progress::abandoned, 0, std::nullopt};
    }
    written_ = progress.value() == CheckpointFile::Progress::written;
    return {Progress::something, 0, std::nullopt};
  }
  if (synced.version < file_->version() || !synced.added.contains(file_->added())) return {};
  if (auto fault = file_->publish()) return failed(*fault, now);
  const Version version = file_->version();
  abandon();
  retry_.succeeded();
  return {Progress::finished, version, std::nullopt};
}

void Checkpointer::abandon() noexcept {
  // A version that the source delivers later belongs to the next request, or is older than that requires.
  request_.reset();
  file_.reset();
  if (std::exchange(source_has_begun_, false)) source_.end();
}

Checkpointer::Step Checkpointer::failed(const DiskError& fault, ClockTime now) {
  abandon();
  retry_.failed(now);
  return {Progress::failed, 0, fault};
}

}  // namespace rtstdb::log
