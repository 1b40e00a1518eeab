#include "rtstdb/standing/follower.hpp"

#include <pthread.h>

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/standing/membership_watch.hpp"
#include "rtstdb/standing/nearest_watch.hpp"
#include "rtstdb/standing/version_job.hpp"
#include "rtstdb/threads/signals_blocked.hpp"

namespace rtstdb::standing {
namespace {

constexpr const char* no_memory = "no memory was left to follow it";

std::string named(const StandingOptions& options) {
  return "standing query '" + options.name + "': ";
}

}  // namespace

/// What the user has: lets go of the watch before that goes.
class Follower::Handle final : public StandingQuery {
 public:
  Handle(Follower& follower, std::unique_ptr<Watch> watch) : follower_(follower), watch_(std::move(watch)) {}
  ~Handle() override {
    if (!registered) return;
    Command command{.kind = Command::Kind::remove, .watch = watch_.get()};
    follower_.give(command);
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
      feed_(options.max_geometries, bell_) {}

Follower::~Follower() {
  RTSTDB_REQUIRE(counts().queries == 0, "Database's destructor",
                 "a standing query outlives its database; destroy it first");
  if (!thread_.joinable()) return;
  ending_.store(true, std::memory_order_release);
  bell_.ring();
  thread_.join();
  if (!closed_) engine_.listen(nullptr);
}

// ---- any thread

void Follower::begin_thread() {
  const std::lock_guard lock(setup_mutex_);
  if (thread_.joinable()) return;
  feed_.make_room(options_.feed_capacity);
  engine_.listen(&feed_);
  // It inherits what its creator has: signals are the program's business, and priority the tick's.
  const threads::SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "rtstdb follower");
  const sched_param ordinary{};
  pthread_setschedparam(thread_.native_handle(), SCHED_OTHER, &ordinary);
}

Result<std::unique_ptr<StandingQuery>> Follower::watch(const Question& question,
                                                       const StandingOptions& options) {
  if (options.ring_capacity < 2 || options.ring_capacity > max_standing_events) {
    return Error{ErrorCode::bad_input, named(options) + "ring_capacity is " +
                                           std::to_string(options.ring_capacity) + "; 2 to " +
                                           std::to_string(max_standing_events) + " are possible"};
  }
  begin_thread();
  std::unique_ptr<Watch> made;
  if (question.kind == Question::Kind::nearest) {
    made = std::make_unique<NearestWatch>(question, options, mirror_, bell_, work_);
  } else {
    made = std::make_unique<MembershipWatch>(question, options, mirror_, bell_, work_);
  }
  Command command{.kind = Command::Kind::add, .watch = made.get(), .latest = engine_.latest().version};
  auto handle = std::make_unique<Handle>(*this, std::move(made));
  give(command);
  const auto dead = [&](const char* what, EntityId id) {
    return Error{ErrorCode::bad_input, named(options) + what + " " + std::to_string(id.index) + "." +
                                           std::to_string(id.generation) + " does not live"};
  };
  switch (command.reply) {
    case Command::Reply::done:
      break;
    case Command::Reply::dead_carrier:
      return dead("its carrier", question.carrier);
    case Command::Reply::dead_excluded:
      return dead("the excluded entity", question.excluded);
    case Command::Reply::out_of_memory:
      return Error{ErrorCode::out_of_memory, named(options) + no_memory};
  }
  handle->registered = true;
  return std::unique_ptr<StandingQuery>(std::move(handle));
}

void Follower::give(Command& command) noexcept {
  {
    const std::lock_guard lock(commands_mutex_);
    *last_command_ = &command;
    last_command_ = &command.next;
  }
  bell_.ring();
  command.done.wait_while(0);
}

void Follower::close() noexcept {
  if (!thread_.joinable()) return;
  Command command{.kind = Command::Kind::close};
  give(command);
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
    const std::uint32_t heard = bell_.heard();
    if (!work_once()) bell_.sleep_unless_rung(heard);
  }
}

bool Follower::work_once() noexcept {
  bool worked = false;
  try {
    if (fed_) {
      worked = follow_one_version();
      if (!worked && feed_.in_gap()) {
        catch_up();
        worked = true;
      }
    }
  } catch (const std::bad_alloc&) {
    fail_all(no_memory);
  }
  worked |= carry_out_command();
  for (Watch* watch : watches_)
    watch->pump();
  return worked;
}

template <class Use>
void Follower::each(Use use) noexcept {
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
  if (version.version <= mirror_.version().version) return true;  // read whole before
  each([&](Watch& watch) { watch.advance(version); });
  mirror_.apply(changes_, changed_);
  each([&](Watch& watch) { watch.follow(changed_, EventCause::write); });
  versions_.fetch_add(1, std::memory_order_relaxed);
  rows_.fetch_add(changes_.size(), std::memory_order_relaxed);
  return true;
}

void Follower::catch_up() {
  VersionJob job(feed_, options_.max_entities);
  engine_.execute_job(job);
  if (fed_) {
    gaps_.fetch_add(1, std::memory_order_relaxed);
    mirror_.compare(job.rows(), job.shapes(), changed_);
    each([&](Watch& watch) {
      watch.forget(changed_);
      watch.advance(job.version());
    });
  }
  mirror_.replace(job.version(), job.rows(), job.shapes());
  each([&](Watch& watch) { watch.follow(changed_, EventCause::gap); });
  fed_ = true;
}

bool Follower::carry_out_command() noexcept {
  Command* command = nullptr;
  {
    const std::lock_guard lock(commands_mutex_);
    command = first_command_;
    if (command == nullptr) return false;
    // Who asks knows a version; what it looks at is not older.
    const bool waits =
        command->kind == Command::Kind::add && fed_ && command->latest > mirror_.version().version;
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
  command->done.set_and_wake(1);  // from here on it may be gone
  return true;
}

Follower::Command::Reply Follower::add(Watch& watch) noexcept {
  try {
    watches_.reserve(watches_.size() + 1);
    if (!fed_) catch_up();
    const Question& question = watch.question();
    const bool carried = question.carrier.valid() && mirror_.find(question.carrier) == nullptr;
    const bool excludes = question.excluded.valid() && mirror_.find(question.excluded) == nullptr;
    if (carried || excludes) {
      if (watches_.empty()) rest();
      return carried ? Command::Reply::dead_carrier : Command::Reply::dead_excluded;
    }
    watch.begin();
    watch.pump();
  } catch (const std::bad_alloc&) {
    if (watches_.empty()) rest();
    return Command::Reply::out_of_memory;
  }
  watches_.push_back(&watch);
  queries_.store(watches_.size(), std::memory_order_relaxed);
  return Command::Reply::done;
}

void Follower::remove(Watch& watch) noexcept {
  std::erase(watches_, &watch);
  queries_.store(watches_.size(), std::memory_order_relaxed);
  if (watches_.empty()) rest();
}

void Follower::rest() noexcept {
  if (closed_) return;
  engine_.call([this] { feed_.stop(); });
  feed_.clear();
  fed_ = false;
}

void Follower::fail_all(const char* why) noexcept {
  for (Watch* watch : watches_)
    if (watch->follows()) watch->fail(why);
  rest();
}

}  // namespace rtstdb::standing
