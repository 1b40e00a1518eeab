#pragma once
// The follower: the thread that evaluates all standing queries of a database after each commit. It is created
// with the first query and sleeps while there is none.
//
// Threads: any thread calls watch, wait_until_evaluated and counts. Destroyed after all queries and before
// the engine.

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>
#include <rtstdb/standing.hpp>

#include "rtstdb/standing/change_feed.hpp"
#include "rtstdb/standing/mirror.hpp"
#include "rtstdb/standing/watch.hpp"
#include "rtstdb/threads/event_count.hpp"
#include "rtstdb/threads/futex.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::standing {

struct FollowerOptions {
  std::uint32_t max_entities = 4096;
  std::uint32_t max_geometries = 1024;
  std::uint32_t feed_capacity = standing_queue_capacity;  ///< row changes in the queue
  /// A list of members that follows lost events comes with the next version, so that all events are a
  /// function of the commits and of the calls of next_events between them.
  bool is_virtual = false;
};

class Follower {
 public:
  /// The engine must outlive the follower and must not be closed before it.
  Follower(transaction::Engine& engine, const FollowerOptions& options);
  ~Follower();
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  /// Registers a checked query. Errors: bad_input for options outside their range, or if the carrier or the
  /// excluded entity does not exist in the latest version; out_of_memory. Throws std::bad_alloc if memory
  /// runs out in the calling thread.
  Result<std::unique_ptr<StandingQuery>> watch(const QuerySpec& spec, const StandingOptions& options);

  void make_space_for_geometry() { mirror_.make_space_for_geometry(); }
  /// Adds a geometry, in the order of ids. To be called inside Engine::call together with the addition
  /// itself, or before the first query, so that no version with the geometry is read before.
  void add_geometry(const Bounds& bounds, bool deforms) { mirror_.add_geometry(bounds, deforms); }
  /// Registers a deforming geometry after add_geometry, with the positions that its triangles use.
  static std::vector<std::uint32_t> used_positions(const TriangleMesh& mesh);
  void keep_bounds(GeometryId id, std::vector<std::uint32_t> used_positions) noexcept {
    feed_.keep_bounds(id, std::move(used_positions));
  }

  /// Blocks until all queries have been evaluated for the version, or until there is none. The version is
  /// published.
  void wait_until_evaluated(Version version) noexcept;

  /// Stops the evaluation: all queries fail with a reason, and the engine is not called any more. Afterwards
  /// watch is misuse.
  void close() noexcept;

  StandingCounts counts() const noexcept;

 private:
  struct Command {
    enum class Kind : std::uint8_t { add, remove, close } kind = Kind::add;
    Watch* watch = nullptr;
    enum class Reply : std::uint8_t {
      done,
      unknown_carrier,
      unknown_excluded,
      out_of_memory
    } reply = Reply::done;
    Version latest = 0;  ///< latest version when the command was issued
    threads::FutexCell done{0};
    Command* next = nullptr;
  };
  class Handle;

  void start_thread();
  /// Queues a command and waits until the follower has executed it.
  void execute(Command& command) noexcept;
  void run() noexcept;
  bool work_once() noexcept;
  bool execute_next_command() noexcept;
  Command::Reply add(Watch& watch) noexcept;
  void remove(Watch& watch) noexcept;
  bool follow_one_version();
  /// Copies the latest version whole and continues from there.
  void catch_up();
  void stop_feed() noexcept;
  /// Wakes the threads that wait for the version up to which queries have been evaluated.
  void publish_evaluated() noexcept;
  /// Calls use(watch) for each query that is followed. A query that runs out of memory fails; the others
  /// continue.
  template <class Use>
  void for_each_followed(Use use) noexcept;
  void fail_all(const char* why) noexcept;

  transaction::Engine& engine_;
  const FollowerOptions options_;
  threads::EventCount wake_up_;
  WorkCounts work_;
  Mirror mirror_;
  ChangeFeed feed_;

  std::mutex setup_mutex_;  ///< for the creation of the thread
  std::mutex commands_mutex_;
  Command* first_command_ = nullptr;
  Command** last_command_ = &first_command_;

  // Accessed by the follower's thread only.
  std::vector<Watch*> watches_;
  std::vector<Change> changes_;
  std::vector<std::uint32_t> changed_;
  bool feed_active_ = false;
  bool closed_ = false;

  std::atomic<std::uint64_t> queries_{0}, versions_{0}, rows_{0}, gaps_{0};
  static constexpr Version no_query = std::numeric_limits<Version>::max();
  std::atomic<Version> evaluated_{no_query};   ///< all queries have been evaluated for this version
  std::atomic<std::uint32_t> evaluations_{0};  ///< changes of evaluated_, on which threads sleep
  std::atomic<std::uint32_t> evaluation_waiters_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace rtstdb::standing
