#include "rtstdb/standing/follower.hpp"

#include <pthread.h>

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/standing/copy_version_job.hpp"
#include "rtstdb/standing/membership_watch.hpp"
#include "rtstdb/standing/nearest_watch.hpp"
#include "rtstdb/threads/signals_blocked.hpp"

namespace rtstdb::standing {
namespace {

constexpr const char* no_memory = "no memory was left to follow it";

std::string error_prefix(const StandingOptions& options) {
  return "standing query '" + options.name + "': ";
}

}  // namespace

/// The user's object. Its destructor unregisters the watch and then destroys it.
class Follower::Handle final : public StandingQuery {
 public:
  Handle(Follower& follower, std::unique_ptr<Watch> watch) : follower_(follower), watch_(std::move(watch)) {}
  ~Handle() override {
    if (!registered) return;
    Command command{.kind = Command::Kind::remove, .watch = watch_.get()};
    follower_.execute(command);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  std::size_t next_events(std::span<StandingEvent> events) noexcept override {
    return watch_->next_events(events);
  }
  Progress progress() const noexcept override { return watch_->progress(); }
  StandingStatus status() const noexcept override { return watch_->status(); }
  std::string reason() const override { return watch_->reason(); }
  std::uint64_t lost() const noexcept override { return watch_->lost(); }

  bool registered = false;

 private:
  Follower& follower_;
  std::unique_ptr<Watch> watch_;
};

std::vector<std::uint32_t> Follower::used_positions(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.positions_m.size(), false);
  for (const glm::uvec3& triangle : mesh.triangles)
    used[triangle.x] = used[triangle.y] = used[triangle.z] = true;
  std::vector<std::uint32_t> positions;
  for (std::uint32_t k = 0; k < used.size(); ++k)
    if (used[k]) positions.push_back(k);
  return positions;
}

Follower::Follower(transaction::Engine& engine, const FollowerOptions& options)
    : engine_(engine),
      options_(options),
      mirror_(options.max_entities),
      feed_(options.max_geometries, wake_up_) {}

Follower::~Follower() {
  RTSTDB_REQUIRE(counts().queries == 0, "Database's destructor",
                 "a standing query outlives its database; destroy it first");
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_release);
  wake_up_.notify();
  thread_.join();
  if (!closed_) engine_.listen(nullptr);
}

// ---- any thread

void Follower::start_thread() {
  const std::lock_guard lock(setup_mutex_);
  if (thread_.joinable()) return;
  feed_.make_space(options_.feed_capacity);
  engine_.listen(&feed_);
  // A thread inherits signal mask and priority of its creator. Signals are for the program's threads, and
  // real-time priority is for the tick.
  const threads::SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb follower");
  const sched_param ordinary{};
  pthread_setschedparam(thread_.native_handle(), SCHED_OTHER, &ordinary);
}

Result<std::unique_ptr<StandingQuery>> Follower::watch(const QuerySpec& spec,
                                                       const StandingOptions& options) {
  if (options.ring_capacity < 2 || options.ring_capacity > max_standing_events) {
    return Error{ErrorCode::bad_input, error_prefix(options) + "ring_capacity is " +
                                           std::to_string(options.ring_capacity) + "; 2 to " +
                                           std::to_string(max_standing_events) + " are allowed"};
  }
  start_thread();
  std::unique_ptr<Watch> made;
  if (spec.kind == QuerySpec::Kind::nearest) {
    made = std::make_unique<NearestWatch>(spec, options, mirror_, wake_up_, work_);
  } else {
    made = std::make_unique<MembershipWatch>(spec, options, mirror_, wake_up_, work_);
  }
  Command command{.kind = Command::Kind::add, .watch = made.get(), .latest = engine_.latest().version};
  auto handle = std::make_unique<Handle>(*this, std::move(made));
  execute(command);
  const auto unknown = [&](const char* what, EntityId id) {
    return Error{ErrorCode::bad_input, error_prefix(options) + what + " " + std::to_string(id.index) + "." +
                                           std::to_string(id.generation) + " does not exist"};
  };
  switch (command.reply) {
    case Command::Reply::done:
      break;
    case Command::Reply::unknown_carrier:
      return unknown("its carrier", spec.carrier);
    case Command::Reply::unknown_excluded:
      return unknown("the excluded entity", spec.excluded);
    case Command::Reply::out_of_memory:
      return Error{ErrorCode::out_of_memory, error_prefix(options) + no_memory};
  }
  handle->registered = true;
  return std::unique_ptr<StandingQuery>(std::move(handle));
}

void Follower::execute(Command& command) noexcept {
  {
    const std::lock_guard lock(commands_mutex_);
    *last_command_ = &command;
    last_command_ = &command.next;
  }
  wake_up_.notify();
  command.done.wait_while(0);
}

void Follower::close() noexcept {
  if (!thread_.joinable()) return;
  Command command{.kind = Command::Kind::close};
  execute(command);
}

void Follower::wait_until_evaluated(Version version) noexcept {
  evaluation_waiters_.fetch_add(1, std::memory_order_seq_cst);
  for (std::uint32_t seen = evaluations_.load(std::memory_order_seq_cst);
       evaluated_.load(std::memory_order_seq_cst) < version;
       seen = evaluations_.load(std::memory_order_seq_cst))
    threads::futex_wait(evaluations_, seen);
  evaluation_waiters_.fetch_sub(1, std::memory_order_relaxed);
}

StandingCounts Follower::counts() const noexcept {
  return {.queries = queries_.load(std::memory_order_relaxed),
          .versions = versions_.load(std::memory_order_relaxed),
          .rows = rows_.load(std::memory_order_relaxed),
          .examinations = work_.examinations.load(std::memory_order_relaxed),
          .events = work_.events.load(std::memory_order_relaxed),
          .gaps = gaps_.load(std::memory_order_relaxed),
          .skipped_versions = feed_.skipped()};
}

// ---- the follower's thread

void Follower::run() noexcept {
  while (!ending_.load(std::memory_order_acquire)) {
    const std::uint32_t count = wake_up_.count();
    if (!work_once()) wake_up_.wait(count);
  }
}

bool Follower::work_once() noexcept {
  bool worked = false;
  try {
    if (feed_active_) {
      worked = follow_one_version();
      if (!worked && feed_.in_gap()) {
        catch_up();
        worked = true;
      }
    }
  } catch (const std::bad_alloc&) {
    fail_all(no_memory);
  }
  worked |= execute_next_command();
  if (worked || !options_.is_virtual) {
    for (Watch* watch : watches_)
      watch->publish_list();
  }
  publish_evaluated();
  return worked;
}

void Follower::publish_evaluated() noexcept {
  const Version evaluated = feed_active_ ? mirror_.version().version : no_query;
  if (evaluated == evaluated_.load(std::memory_order_relaxed)) return;
  evaluated_.store(evaluated, std::memory_order_seq_cst);
  evaluations_.fetch_add(1, std::memory_order_seq_cst);
  if (evaluation_waiters_.load(std::memory_order_seq_cst) != 0) threads::futex_wake_all(&evaluations_);
}

template <class Use>
void Follower::for_each_followed(Use use) noexcept {
  for (Watch* watch : watches_) {
    if (!watch->follows()) continue;
    try {
      use(*watch);
    } catch (const std::bad_alloc&) {
      watch->fail(no_memory);
    }
  }
}

bool Follower::follow_one_version() {
  if (!feed_.take_version(changes_)) return false;
  const VersionInfo version = changes_.front().version;
  if (version.version <= mirror_.version().version) return true;  // already included
  for_each_followed([&](Watch& watch) { watch.advance(version); });
  mirror_.apply(changes_, changed_);
  for_each_followed([&](Watch& watch) { watch.follow(changed_, EventCause::write); });
  versions_.fetch_add(1, std::memory_order_relaxed);
  rows_.fetch_add(changes_.size(), std::memory_order_relaxed);
  return true;
}

void Follower::catch_up() {
  CopyVersionJob job(feed_, options_.max_entities);
  engine_.execute_job(job);
  if (feed_active_) {
    gaps_.fetch_add(1, std::memory_order_relaxed);
    mirror_.compare(job.rows(), job.shapes(), changed_);
    for_each_followed([&](Watch& watch) {
      watch.invalidate(changed_);
      watch.advance(job.version());
    });
  }
  mirror_.replace(job.version(), job.rows(), job.shapes());
  for_each_followed([&](Watch& watch) { watch.follow(changed_, EventCause::gap); });
  feed_active_ = true;
}

bool Follower::execute_next_command() noexcept {
  Command* command = nullptr;
  {
    const std::lock_guard lock(commands_mutex_);
    command = first_command_;
    if (command == nullptr) return false;
    // The first list of members must not be older than the latest version that the caller could know.
    const bool waits =
        command->kind == Command::Kind::add && feed_active_ && command->latest > mirror_.version().version;
    if (waits) return false;
    first_command_ = command->next;
    if (first_command_ == nullptr) last_command_ = &first_command_;
  }
  switch (command->kind) {
    case Command::Kind::add:
      command->reply = add(*command->watch);
      break;
    case Command::Kind::remove:
      remove(*command->watch);
      break;
    case Command::Kind::close:
      fail_all("the database was closed");
      closed_ = true;
      break;
  }
  command->done.set_and_wake(1);  // afterwards the command may be destroyed
  return true;
}

Follower::Command::Reply Follower::add(Watch& watch) noexcept {
  try {
    watches_.reserve(watches_.size() + 1);
    if (!feed_active_) catch_up();
    const QuerySpec& spec = watch.spec();
    const bool point_on_body = spec.carrier.valid() && mirror_.find(spec.carrier) == nullptr;
    const bool excludes = spec.excluded.valid() && mirror_.find(spec.excluded) == nullptr;
    if (point_on_body || excludes) {
      if (watches_.empty()) stop_feed();
      return point_on_body ? Command::Reply::unknown_carrier : Command::Reply::unknown_excluded;
    }
    watch.begin();
    watch.publish_list();
  } catch (const std::bad_alloc&) {
    if (watches_.empty()) stop_feed();
    return Command::Reply::out_of_memory;
  }
  watches_.push_back(&watch);
  queries_.store(watches_.size(), std::memory_order_relaxed);
  publish_evaluated();
  return Command::Reply::done;
}

void Follower::remove(Watch& watch) noexcept {
  std::erase(watches_, &watch);
  queries_.store(watches_.size(), std::memory_order_relaxed);
  if (watches_.empty()) stop_feed();
}

void Follower::stop_feed() noexcept {
  if (closed_) return;
  engine_.call([this] { feed_.stop(); });
  feed_.clear();
  feed_active_ = false;
}

void Follower::fail_all(const char* why) noexcept {
  for (Watch* watch : watches_)
    if (watch->follows()) watch->fail(why);
  stop_feed();
}

}  // namespace rtstdb::standing
