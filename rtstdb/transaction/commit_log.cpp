#include "rtstdb/transaction/commit_log.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <new>
#include <utility>

#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/log_start.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/threads/signals_blocked.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {
namespace {

/// How often the thread checks whether the engine has made its copy of the world, or the disk accepts writes
/// again.
constexpr Nanoseconds check_interval{1'000'000};

std::int64_t real_time_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Nanoseconds>(now).count();
}

Error file_error(const log::DiskError& fault) {
  if (fault.call == log::DiskCall::lock && fault.number == EWOULDBLOCK)
    return {ErrorCode::file, "another database has this log open"};
  return {ErrorCode::file, fault.describe()};
}

Error does_not_fit(const char* what, std::size_t there, std::size_t space) {
  return {ErrorCode::capacity, "the log contains " + std::to_string(there) + " " + what +
                                   ", and the options of the database allow " + std::to_string(space)};
}

Recovery public_form(const log::Recovered& recovered) {
  const log::RecoveryReport& report = recovered.report;
  Recovery recovery;
  recovery.found = report.database_id != 0;
  recovery.version = recovered.world.latest.version;
  recovery.checkpoint = report.checkpoint_version;
  recovery.commits = report.versions;
  recovery.closed = report.log.end == log::LogEnd::closed;
  recovery.torn = report.log.end == log::LogEnd::torn;
  recovery.salvaged = report.log.end == log::LogEnd::damaged;
  recovery.duration = report.duration;
  recovery.summary = report.describe();
  return recovery;
}

}  // namespace

CommitLog::CommitLog(std::shared_ptr<log::Disk> disk, const CommitLogOptions& options)
    : ring_(options.durability.ring_bytes),
      options_(options),
      clock_(options.clock != nullptr ? *options.clock : monotonic_clock_),
      disk_(std::move(disk)),
      recorder_(ring_),
      world_copy_(options.max_entities) {}

Result<std::unique_ptr<CommitLog>> CommitLog::open(std::shared_ptr<log::Disk> disk,
                                                   const CommitLogOptions& options) {
  std::unique_ptr<CommitLog> opened(new CommitLog(std::move(disk), options));
  auto lock = opened->disk_->lock(log::lock_name);
  if (!lock) return file_error(lock.error());
  opened->lock_ = std::move(lock.value());
  if (auto recovered = opened->recover(); !recovered) return recovered.error();
  if (auto started = opened->start_writer(); !started) return started.error();
  return opened;
}

Result<void> CommitLog::recover() {
  auto recovered = log::recover(*disk_, {.salvage = options_.durability.salvage, .clock = &clock_});
  if (!recovered) return recovered.error();
  recovered_ = std::move(recovered).value();
  recovery_ = public_form(*recovered_);
  const log::World& world = recovered_->world;
  if (world.rows.size() > options_.max_entities)
    return does_not_fit("entities at once", world.rows.size(), options_.max_entities);
  if (world.geometries.size() > options_.max_geometries)
    return does_not_fit("geometries", world.geometries.size(), options_.max_geometries);
  for (const log::WorldGeometry& geometry : world.geometries)
    world_copy_.add(geometry.logged, geometry.mesh.positions_m.size());
  for (const log::LoggedMaterial& material : world.materials)
    world_copy_.add(material);
  for (const log::LoggedLight& light : world.lights)
    world_copy_.add(light);
  if (!recovered_->listing.geometries.empty())
    next_geometry_file_ = recovered_->listing.geometries.back() + 1;
  return {};
}

Result<void> CommitLog::start_writer() {
  const DurabilityOptions& durability = options_.durability;
  log::WriterOptions options;
  options.segment_bytes = durability.segment_bytes;
  options.checkpoint_every_bytes = durability.checkpoint_every_bytes;
  options.prune = durability.prune;
  // In the other modes a transaction waits for the disk: it is written at once.
  if (mode() == DurabilityMode::async) options.flush_interval = durability.flush_interval;
  const bool has_damaged_checkpoint = !recovered_->report.damaged_checkpoints.empty();
  const log::LogStart start = log::start_after(*recovered_, log::new_database_id());
  database_id_ = start.database_id;
  auto writer = log::Writer::start(*disk_, clock_, ring_, world_copy_, options, start);
  if (!writer) return writer.error();
  writer_ = std::move(writer).value();
  // A new checkpoint replaces the damaged ones.
  if (has_damaged_checkpoint) writer_->checkpoint_soon();
  return {};
}

void CommitLog::restore(store::Store& store) {
  recovered_->world.restore(store);
  recovered_.reset();
}

void CommitLog::start(LogOwner& owner, const Clock& deadline_clock) {
  owner_ = &owner;
  deadline_clock_ = &deadline_clock;
  world_copy_.attach(&owner);
  is_driven_ = options_.driver != nullptr;
  if (is_driven_) return;
  const threads::SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run_thread(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb log");
  const sched_param ordinary{};
  pthread_setschedparam(thread_.native_handle(), SCHED_OTHER, &ordinary);
}

CommitLog::~CommitLog() {
  static_cast<void>(close());
}

Result<void> CommitLog::close() noexcept {
  if (std::exchange(is_driven_, false)) end_log();
  if (!thread_.joinable()) return closed_;
  closing_.store(true, std::memory_order_release);
  wake_up_.notify_now();
  thread_.join();
  return closed_;
}

// ---- the engine thread

std::optional<RefusedBy> CommitLog::refuses(const store::WriteSet& set) const noexcept {
  if (mode() == DurabilityMode::async) return std::nullopt;
  // In sync mode the engine would wait for a checkpoint, which needs the engine.
  const bool would_deadlock = mode() == DurabilityMode::sync && writer_->waits_for_checkpoint();
  if (writer_->last_write_failed() || would_deadlock) return RefusedBy::log_fault;
  if (!recorder_.has_space_for(set)) return RefusedBy::log_full;
  return std::nullopt;
}

void CommitLog::record(const store::WriteSet& set) noexcept {
  if (mode() == DurabilityMode::async && recorder_.collect(set)) return;
  if (!recorder_.record(set)) in_gap_.store(true, std::memory_order_release);
  if (mode() == DurabilityMode::async) notify_thread();  // else hold() notifies it
}

void CommitLog::hand_over() noexcept {
  if (recorder_.flush()) notify_thread();
}

void CommitLog::notify_thread() noexcept {
  if (ring_.used() > ring_.capacity() / 2) {
    wake_up_.notify_now();
  } else {
    wake_up_.notify();
  }
}

void CommitLog::hold(TransactionImpl& transaction) noexcept {
  held_.hold(transaction);
  wake_up_.notify_now();
}

bool CommitLog::write_through(const store::WriteSet& set) noexcept {
  const bool recorded = recorder_.record(set);
  RTSTDB_ASSERT(recorded, "the log refused a commit after refuses() returned nothing");
  wake_up_.notify_now();
  wait_until([&] { return durable() >= set.version || writer_->waits_for_checkpoint(); });
  return durable() >= set.version;
}

bool CommitLog::take_back(Version version) noexcept {
  recorder_.discard(version);
  wake_up_.notify_now();
  const auto on_disk = [&] { return writer_->records_on_disk() >= recorder_.records(); };
  wait_until([&] { return on_disk() || writer_->last_write_failed(); });
  return on_disk();
}

void CommitLog::end_gap_if_possible() noexcept {
  if (!in_gap_.load(std::memory_order_relaxed)) return;
  recorder_.maintain();
  if (recorder_.in_gap()) return;
  in_gap_.store(false, std::memory_order_relaxed);
  wake_up_.notify_now();
}

bool CommitLog::has_space_for(const log::LoggedGeometry& geometry) const noexcept {
  return recorder_.has_space_for(geometry);
}

void CommitLog::record_geometry(const log::LoggedGeometry& geometry, std::size_t positions) {
  const bool recorded = recorder_.record(geometry);
  RTSTDB_ASSERT(recorded, "the log refused a geometry after has_space_for() returned true");
  world_copy_.add(geometry, positions);
  wake_up_.notify_now();
}

template <class Value>
void CommitLog::record_definition(const log::LoggedDefinition<Value>& definition) {
  const bool recorded = recorder_.record(definition);
  RTSTDB_ASSERT(recorded, "the log refused a definition after has_space_for() returned true");
  world_copy_.add(definition);
  wake_up_.notify_now();
}

template void CommitLog::record_definition(const log::LoggedMaterial&);
template void CommitLog::record_definition(const log::LoggedLight&);

// ---- setup, any thread

Result<log::LoggedGeometry> CommitLog::write_geometry(const TriangleMesh& mesh, std::string_view name,
                                                      const GeometryOptions& options) {
  if (name.size() > log::max_name_bytes)
    return Error{ErrorCode::bad_input, "the name has " + std::to_string(name.size()) +
                                           " bytes; the log allows at most " +
                                           std::to_string(log::max_name_bytes)};
  log::LoggedGeometry geometry;
  geometry.name = name;
  geometry.options = options;
  geometry.file = next_geometry_file_++;  // also when writing fails: the file may remain
  auto checksum = log::write_geometry_file(*disk_, database_id_, geometry.file, mesh, options);
  if (!checksum) return file_error(checksum.error());
  geometry.file_checksum = checksum.value();
  return geometry;
}

bool CommitLog::wait_until_durable(Version version, Nanoseconds at_most) noexcept {
  const ClockTime begun = monotonic_clock_.now();
  const ClockTime end = at_most < ClockTime::max() - begun ? begun + at_most : ClockTime::max();
  while (true) {
    const std::uint32_t seen = progress_.load(std::memory_order_seq_cst);
    if (durable() >= version) return true;
    const Nanoseconds left = end - monotonic_clock_.now();
    if (left <= Nanoseconds(0)) return false;
    writer_->flush_soon();
    wake_up_.notify_now();
    waiters_.fetch_add(1, std::memory_order_seq_cst);
    threads::futex_wait_for(progress_, seen, left);
    waiters_.fetch_sub(1, std::memory_order_relaxed);
  }
}

template <class Condition>
void CommitLog::wait_until(Condition holds) noexcept {
  while (true) {
    const std::uint32_t seen = progress_.load(std::memory_order_seq_cst);
    if (holds()) return;
    if (is_driven_) {
      options_.driver->log_is_waited_for();
      continue;
    }
    waiters_.fetch_add(1, std::memory_order_seq_cst);
    threads::futex_wait(progress_, seen);
    waiters_.fetch_sub(1, std::memory_order_relaxed);
  }
}

Durability CommitLog::state() const {
  const log::WriterStatistics statistics = writer_->statistics();
  Durability state;
  state.mode = mode();
  state.database_id = database_id_;
  state.durable = durable();
  state.last_write_failed = writer_->last_write_failed();
  state.waits_for_checkpoint = statistics.waits_for_checkpoint;
  state.faults = statistics.faults;
  state.last_fault = statistics.last_fault;
  state.gaps = statistics.gaps;
  state.commits_in_gaps = recorder_.gap_versions();
  state.ring_bytes = statistics.ring_bytes;
  state.ring_high_water = statistics.ring_high_water;
  state.groups = statistics.groups;
  state.bytes = statistics.bytes;
  state.segments = statistics.segments;
  state.pruned_segments = statistics.pruned_segments;
  state.checkpoints = statistics.checkpoints;
  state.longest_write = statistics.longest_write;
  state.all_writes = statistics.all_writes;
  return state;
}

// ---- the log's thread, or the driver

void CommitLog::run_thread() noexcept {
  while (!closing_.load(std::memory_order_acquire)) {
    const LogWakeUp::Counts seen = wake_up_.counts();
    const log::Writer::Step step = work();
    if (!step.worked) sleep(seen, step);
  }
  end_log();
}

log::Writer::Step CommitLog::work() noexcept {
  const log::Writer::Step step = writer_->step(real_time_ns());
  publish_progress();
  return_held();
  if (in_gap_.load(std::memory_order_acquire) && ring_.used() <= ring_.capacity() / 2) owner_->end_gap_soon();
  return step;
}

void CommitLog::sleep(LogWakeUp::Counts seen, const log::Writer::Step& step) noexcept {
  const bool polls = world_copy_.under_way() || in_gap_.load(std::memory_order_acquire);
  if (step.wake_at == ClockTime::max() && !polls) return wake_up_.sleep(seen);
  const ClockTime now = clock_.now();
  const Nanoseconds at_most = polls || step.wake_at <= now ? check_interval : step.wake_at - now;
  // The next attempt, a checkpoint's, may be far off: a commit wakes the thread before that.
  if (!polls && !step.has_records) return wake_up_.sleep(seen, at_most);
  wake_up_.sleep_until_notified_now(seen, at_most);
}

void CommitLog::publish_progress() noexcept {
  const Progress now{writer_->durable(), writer_->records_on_disk(), writer_->last_write_failed(),
                     writer_->waits_for_checkpoint()};
  if (now == published_) return;
  published_ = now;
  // Pairs with wait_until: either the waiter sees the new number, or this thread sees the waiter.
  progress_.fetch_add(1, std::memory_order_seq_cst);
  if (waiters_.load(std::memory_order_seq_cst) != 0) threads::futex_wake_all(&progress_);
}

void CommitLog::return_held() noexcept {
  while (TransactionImpl* const held =
             held_.release(published_.durable, published_.refused, *deadline_clock_))
    owner_->return_held(*held);
}

void CommitLog::end_log() noexcept {
  // The engine thread has ended: its side of the ring belongs to this thread.
  recorder_.flush();
  try {
    closed_ = close_writer();
  } catch (const std::bad_alloc&) {
    closed_ = Error{ErrorCode::file, "out of memory"};  // short enough to allocate nothing
  }
  publish_progress();
  published_.refused = true;  // the rest of what is held will not become durable
  return_held();
}

Result<void> CommitLog::close_writer() {
  while (recorder_.in_gap() && !writer_->last_write_failed()) {
    writer_->flush_soon();
    writer_->step(real_time_ns());
    recorder_.maintain();
  }
  if (recorder_.in_gap())
    return Error{ErrorCode::file, "the last commits are not in the log: " + state().last_fault};
  return writer_->close(real_time_ns());
}

}  // namespace rtstdb::transaction
