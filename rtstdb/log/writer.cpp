#include "rtstdb/log/writer.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <utility>
#include <vector>

#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/prune.hpp"

namespace rtstdb::log {
namespace {

Error describe(const DiskError& fault) {
  return {ErrorCode::file, fault.describe()};
}

}  // namespace

Writer::Writer(Disk& disk, const Clock& clock, Ring& ring, WorldSource& source, const WriterOptions& options,
               const LogStart& start)
    : disk_(disk),
      clock_(clock),
      ring_(ring),
      options_(options),
      database_id_(start.database_id),
      next_segment_(start.next_segment),
      group_number_(start.next.group),
      link_(start.next.link),
      group_(ring.capacity()),
      retry_(options.first_retry, options.longest_retry),
      checkpointer_(disk, source, start.database_id, start.next_checkpoint, options.rows_per_slice, retry_),
      bytes_since_checkpoint_(start.replayed_bytes),
      synced_{start.newest_version, start.added},
      waits_for_checkpoint_(start.version_of_groups < start.version),
      needed_version_(start.version) {
  group_.begin_at(start.version, start.added);
}

Result<std::unique_ptr<Writer>> Writer::start(Disk& disk, const Clock& clock, Ring& ring, WorldSource& source,
                                              const WriterOptions& options, const LogStart& start) {
  RTSTDB_ASSERT(start.database_id != 0, "the database has no id");
  auto listing = list_log(disk);
  if (!listing) return describe(listing.error());
  // Unfinished files are ignored by readers, so a failed removal does not matter.
  for (const std::uint64_t number : listing.value().unfinished_segments)
    disk.remove(unfinished_segment_name(number));
  for (const std::uint64_t number : listing.value().unfinished_checkpoints)
    disk.remove(unfinished_checkpoint_name(number));

  // The renames must be on disk before the log continues, since new groups reuse the group numbers that these
  // checkpoints refer to.
  for (const std::uint64_t number : start.abandoned_checkpoints) {
    if (auto fault = disk.rename(checkpoint_name(number), abandoned_checkpoint_name(number)))
      return describe(*fault);
  }
  if (!start.abandoned_checkpoints.empty()) {
    if (auto fault = disk.sync_directory()) return describe(*fault);
  }

  std::unique_ptr<Writer> writer(new Writer(disk, clock, ring, source, options, start));
  if (auto fault = writer->begin(start)) return describe(*fault);
  writer->move_watermark();
  return writer;
}

// ---- segments and groups

DiskFault Writer::open_segment(std::span<const std::byte> first_groups) {
  auto segment = SegmentFile::create(disk_,
                                     {.database_id = database_id_,
                                      .number = next_segment_++,
                                      .first_group = group_number_,
                                      .link = link_,
                                      .version_before = synced_.version},
                                     first_groups, options_.segment_bytes);
  if (!segment) return segment.error();
  segment_ = std::move(segment.value());
  const std::lock_guard lock(statistics_mutex_);
  ++statistics_.segments;
  return std::nullopt;
}

DiskFault Writer::begin(const LogStart& start) {
  std::vector<std::byte> first_groups;
  if (start.last) {
    auto file = disk_.open(segment_name(start.last->segment));
    if (!file) return file.error();
    first_groups.resize(start.last_bytes);  // zeros where the file ends within the padding of the group
    auto read = file.value()->read(start.last->offset, first_groups);
    if (!read) return read.error();
  }
  // The gap record must be part of the new segment's first write, since that segment replaces the one that
  // contained the gap.
  const bool has_gap = start.version_of_groups < start.version;
  std::span<const std::byte> gap_group;
  if (has_gap) {
    std::array<std::byte, gap_bytes> record;
    encode_gap(start.version_of_groups + 1, start.version, record);
    group_.take(record);
    gap_group = group_.seal({.database_id = database_id_, .number = group_number_, .link = link_}, 0);
    first_groups.insert(first_groups.end(), gap_group.begin(), gap_group.end());
  }
  const std::uint64_t number_after = std::exchange(group_number_, start.last.value_or(start.next).group);
  const std::uint64_t link_after = std::exchange(link_, start.last.value_or(start.next).link);
  auto fault = open_segment(first_groups);
  group_number_ = number_after;
  link_ = link_after;
  if (!fault && has_gap) group_is_on_disk(gap_group.size(), Nanoseconds(0));
  records_on_disk_ = 0;  // the gap record did not come from the ring
  return fault;
}

void Writer::gather() noexcept {
  while (const std::size_t taken = group_.take(ring_.view()))
    ring_.release(taken);
}

bool Writer::group_is_due(ClockTime now) noexcept {
  if (group_.empty()) return false;
  if (options_.flush_interval.count() == 0 || group_.space() < ring_.capacity() / 2) return true;
  if (flush_soon_.exchange(false, std::memory_order_relaxed)) return true;
  return last_flush_ == ClockTime::min() || now - last_flush_ >= options_.flush_interval;
}

DiskFault Writer::write_group(std::int64_t real_time_ns) {
  try {
    return write_group_or_throw(real_time_ns);
  } catch (const std::bad_alloc&) {
    return no_memory();
  }
}

DiskFault Writer::write_group_or_throw(std::int64_t real_time_ns) {
  const auto bytes =
      group_.seal({.database_id = database_id_, .number = group_number_, .link = link_}, real_time_ns);
  // A group that is larger than a segment gets a segment of its own.
  const bool full = segment_ != nullptr && segment_->offset() > sector_bytes &&
                    segment_->offset() + bytes.size() > options_.segment_bytes;
  if (segment_ == nullptr || full) {
    if (auto fault = open_segment()) return fault;
  }
  const ClockTime begun = clock_.now();
  last_flush_ = begun;
  if (auto fault = segment_->append(bytes)) return fault;
  group_is_on_disk(bytes.size(), clock_.now() - begun);
  return std::nullopt;
}

void Writer::group_is_on_disk(std::size_t bytes, Nanoseconds took) {
  ++group_number_;
  link_ = group_.next_link();
  synced_ = {std::max(synced_.version, group_.newest_version()), group_.added()};
  bytes_since_checkpoint_ += bytes;
  records_on_disk_.fetch_add(group_.records(), std::memory_order_release);
  last_write_failed_ = false;
  const bool has_gap = group_.gap_to() != 0;
  if (has_gap) {
    waits_for_checkpoint_ = true;
    needed_version_ = std::max(needed_version_, group_.gap_to());
  }
  group_.clear();
  retry_.succeeded();
  move_watermark();
  const std::lock_guard lock(statistics_mutex_);
  ++statistics_.groups;
  statistics_.bytes += bytes;
  statistics_.all_writes += took;
  statistics_.longest_write = std::max(statistics_.longest_write, took);
  if (has_gap) ++statistics_.gaps;
}

void Writer::segment_failed(const DiskError& fault, ClockTime now) {
  segment_.reset();
  checkpointer_.abandon();  // a checkpoint that begins after the failure is needed
  waits_for_checkpoint_ = true;
  last_write_failed_ = true;
  retry_.failed(now);
  note_fault(fault);
}

void Writer::note_fault(const DiskError& fault) {
  const std::lock_guard lock(statistics_mutex_);
  ++statistics_.faults;
  try {
    statistics_.last_fault = fault.describe();
  } catch (const std::bad_alloc&) {
    statistics_.last_fault = "out of memory";  // short enough to need no allocation
  }
}

void Writer::move_watermark() noexcept {
  if (!waits_for_checkpoint_) durable_.store(synced_.version, std::memory_order_release);
}

// ---- checkpoints

bool Writer::checkpoint_is_due(ClockTime now) const noexcept {
  if (segment_ == nullptr || !checkpointer_.may_begin(now)) return false;
  // The pending group discards a version whose commit may be in an earlier group, before the checkpoint's
  // position: the checkpoint would contain it.
  if (group_.newest_version() > group_.newest_valid()) return false;
  const bool many_bytes =
      options_.checkpoint_every_bytes != 0 && bytes_since_checkpoint_ >= options_.checkpoint_every_bytes;
  return waits_for_checkpoint_ || many_bytes || checkpoint_soon_.load(std::memory_order_relaxed);
}

bool Writer::step_checkpoint(ClockTime now, std::int64_t real_time_ns) {
  Checkpointer::Step step;
  if (checkpointer_.in_progress()) {
    step = checkpointer_.advance(synced_, now);
  } else if (checkpoint_is_due(now)) {
    step = checkpointer_.begin({segment_->number(), segment_->offset(), group_number_, link_},
                               group_.newest_valid(), now, real_time_ns);
    if (step.progress == Checkpointer::Progress::something) {
      bytes_since_checkpoint_ = 0;
      checkpoint_soon_.store(false, std::memory_order_relaxed);
    }
  }
  if (step.progress == Checkpointer::Progress::finished) checkpoint_is_on_disk(step.version);
  const bool again =
      step.progress == Checkpointer::Progress::failed || step.progress == Checkpointer::Progress::abandoned;
  if (again) checkpoint_soon_.store(true, std::memory_order_relaxed);
  if (step.fault) {
    note_fault(*step.fault);
    if (waits_for_checkpoint_) last_write_failed_ = true;
  }
  return step.progress != Checkpointer::Progress::nothing && step.progress != Checkpointer::Progress::failed;
}

void Writer::checkpoint_is_on_disk(Version version) {
  if (version >= needed_version_) waits_for_checkpoint_ = last_write_failed_ = false;
  move_watermark();
  {
    const std::lock_guard lock(statistics_mutex_);
    ++statistics_.checkpoints;
  }
  if (options_.prune) prune();
}

void Writer::prune() {
  auto pruned = prune_log(disk_);
  if (!pruned) return note_fault(pruned.error());
  const std::lock_guard lock(statistics_mutex_);
  statistics_.pruned_segments += pruned.value();
}

// ---- called by the thread that drives it

Writer::Step Writer::step(std::int64_t real_time_ns) {
  Step step;
  const ClockTime now = clock_.now();
  gather();
  if (now >= retry_.at() && group_is_due(now)) {
    const auto fault = write_group(real_time_ns);
    if (fault) segment_failed(*fault, now);
    step.worked = !fault;
  }
  if (step_checkpoint(now, real_time_ns)) step.worked = true;
  step.wake_at = step.worked ? now : wake_at();
  step.has_records = !group_.empty();
  return step;
}

ClockTime Writer::wake_at() const noexcept {
  ClockTime at = ClockTime::max();
  if (!group_.empty()) at = std::min(at, std::max(retry_.at(), last_flush_ + options_.flush_interval));
  if (waits_for_checkpoint_ && segment_ != nullptr && !checkpointer_.in_progress())
    at = std::min(at, checkpointer_.retry_at());
  return at;
}

Result<void> Writer::close(std::int64_t real_time_ns) {
  flush_soon();
  do {
    gather();
    if (group_.empty()) break;
    if (auto fault = write_group(real_time_ns)) {
      segment_failed(*fault, clock_.now());
      return describe(*fault);
    }
  } while (ring_.used() != 0);
  if (segment_ == nullptr) {
    if (auto fault = open_segment()) return describe(*fault);
  }
  checkpointer_.try_now();
  while (waits_for_checkpoint_) {
    if (!step_checkpoint(clock_.now(), real_time_ns))
      return Error{ErrorCode::file, "the checkpoint that the log needs has failed"};
  }
  checkpointer_.abandon();
  group_.make_closing();
  auto fault = write_group(real_time_ns);
  segment_.reset();
  if (fault) return describe(*fault);
  return {};
}

WriterStatistics Writer::statistics() const {
  WriterStatistics statistics;
  {
    const std::lock_guard lock(statistics_mutex_);
    statistics = statistics_;
  }
  statistics.waits_for_checkpoint = waits_for_checkpoint_;
  statistics.ring_high_water = ring_.high_water();
  statistics.ring_bytes = ring_.capacity();
  return statistics;
}

}  // namespace rtstdb::log
