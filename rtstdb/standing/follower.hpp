#pragma once
// The thread that follows what is committed, for all standing queries of a database. It begins with the first of them and rests while
// there is none.
//
// Threads: watch and counts are any's; the destructor is after all queries and before the engine.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <rtstdb/result.hpp>
#include <rtstdb/standing.hpp>

#include "rtstdb/standing/change_feed.hpp"
#include "rtstdb/standing/mirror.hpp"
#include "rtstdb/standing/watch.hpp"
#include "rtstdb/threads/bell.hpp"
#include "rtstdb/threads/futex.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::standing {

struct FollowerOptions {
  std::uint32_t max_entities = 4096;
  std::uint32_t max_geometries = 1024;
  std::uint32_t feed_capacity = 1u << 14;  ///< row changes that wait
};

class Follower {
 public:
  /// The engine outlives it and is not closed before.
  Follower(transaction::Engine& engine, const FollowerOptions& options);
  ~Follower();
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  /// Once the question has been checked. Errors: bad_input for options out of range, or when carrier or excluded do not live in the
  /// latest version; out_of_memory. Throws std::bad_alloc on the caller's side.
  Result<std::unique_ptr<StandingQuery>> watch(const Question& question, const StandingOptions& options);

  void make_room_for_geometry() { mirror_.make_room_for_geometry(); }
  /// Inside Engine::call, or before anybody follows: a geometry that has been added there, in the order of their ids. So nobody reads
  /// a version that knows more of them.
  void add_geometry(const Bounds& bounds, bool deforms) { mirror_.add_geometry(bounds, deforms); }
  /// And behind that one that deforms, with the positions that its triangles use.
  static std::vector<std::uint32_t> used_positions(const TriangleMesh& mesh);
  void keep_bounds(GeometryId id, std::vector<std::uint32_t> used_positions) noexcept {
    feed_.keep_bounds(id, std::move(used_positions));
  }

  /// Nothing is followed from here on, and the engine not called: queries fail, and say so. watch is misuse then.
  void close() noexcept;

  StandingCounts counts() const noexcept;

 private:
  struct Command {
    enum class Kind : std::uint8_t { add, remove, close } kind = Kind::add;
    Watch* watch = nullptr;
    enum class Reply : std::uint8_t { done, dead_carrier, dead_excluded, out_of_memory } reply = Reply::done;
    Version latest = 0;  ///< when it was given
    threads::FutexCell done{0};
    Command* next = nullptr;
  };
  class Handle;

  void begin_thread();
  /// And waits until it has been carried out.
  void give(Command& command) noexcept;
  void run() noexcept;
  bool work_once() noexcept;
  bool carry_out_command() noexcept;
  Command::Reply add(Watch& watch) noexcept;
  void remove(Watch& watch) noexcept;
  bool follow_one_version();
  /// Reads the latest version whole, and goes on from there.
  void catch_up();
  void rest() noexcept;
  /// Watches that run out of memory fail; the others go on.
  template <class Use>
  void each(Use use) noexcept;
  void fail_all(const char* why) noexcept;

  transaction::Engine& engine_;
  const FollowerOptions options_;
  threads::Bell bell_;
  Work work_;
  Mirror mirror_;
  ChangeFeed feed_;

  std::mutex setup_mutex_;  ///< the thread begins once
  std::mutex commands_mutex_;
  Command* first_command_ = nullptr;
  Command** last_command_ = &first_command_;

  // The follower's thread alone.
  std::vector<Watch*> watches_;
  std::vector<Change> changes_;
  std::vector<std::uint32_t> changed_;
  bool fed_ = false;
  bool closed_ = false;

  std::atomic<std::uint64_t> queries_{0}, versions_{0}, rows_{0}, gaps_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace rtstdb::standing
