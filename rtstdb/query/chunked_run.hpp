#pragma once
// One run of the executor: structures brought to the version, then the batches in chunks, two of which are under way at
// a time, so that the device finds the next one when it is done with one. Between them others may run, for whom the one that has just begun
// is halted at once. Where somebody waits for a gap and a chunk takes longer than was thought, it is halted as well. The next one begins
// with what it left.

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/chunk_pace.hpp"
#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

/// What runs share.
struct Structures {
  gpu::Device& device;
  accel::GeometryPool& pool;
  accel::Tlas& tlas;
  std::uint64_t runs = 0;  ///< begun so far: another one may have taken a slot, or a place for a shape
};

/// What one run submits with; a chunk takes one of the two.
using Lanes = std::array<accel::Submit, 2>;

class ChunkedRun {
 public:
  ChunkedRun(Structures& structures, Lanes& lanes, const RowSource& rows, std::span<const Request> requests,
             const TimeSpan& times, ExecutorCallbacks* callbacks) noexcept
      : structures_(structures),
        lanes_(lanes),
        rows_(rows),
        requests_(requests),
        times_(times),
        callbacks_(callbacks),
        pace_(chunk_ns()),
        whole_for_(usual_whole_for()) {}

  /// What is under way of others has been waited for: this writes what the device reads.
  RunReport run() noexcept;

 private:
  /// Of the device's time, one part in so many may be thrown away so that others wait less.
  static constexpr std::int64_t spared_part = 5;

  enum class Pass : std::uint8_t { all, again };
  /// Before an element of a request; behind all of them is {requests, 0}.
  struct Cursor {
    std::size_t request = 0;
    std::uint32_t element = 0;
  };
  struct Chunk {
    Cursor begin, end;
    std::uint32_t elements = 0;
    bool halted = false;        // it was meant to end later
    double predicted_ns = 0.0;  // what it should take; 0: no matter, structures are brought up with it
  };

  /// Begins the lane. False: the device is lost.
  bool bring_up(accel::Submit& lane) noexcept;
  /// What ended the run; none when all chunks of the pass are done.
  std::optional<RunStatus> run_pass(Pass pass) noexcept;
  ExecutorCallbacks::Continuation let_others_run(Pass pass) noexcept;
  /// All passes that ask again what is incomplete.
  std::optional<RunStatus> next_retry_batch() noexcept;
  /// The next stage of every query that has one. False: there is none.
  bool begin_next_stage() noexcept;
  /// Before each retry pass and each later stage.
  std::optional<RunStatus> gap_between_passes() noexcept;
  /// Between two chunks of a pass. `next` is the lane that the next chunk takes, if there is one; `under_way` the chunk in the other.
  std::optional<RunStatus> gap(accel::Submit& next, bool more, accel::Submit& other,
                               std::optional<Chunk>& under_way, Pass pass) noexcept;
  Chunk take(Cursor& next, Pass pass) const noexcept;
  /// What was started last in this lane is done, or halted: then the chunk ends where it was. `behind`: what was started after it, if
  /// anything was, which is halted with it. False: the device is lost.
  bool finish(accel::Submit& lane, Chunk& chunk, Pass pass, accel::Submit* behind) noexcept;
  /// Of the chunk only the elements before this one were answered.
  void cut(Chunk& chunk, std::uint32_t first_unstarted, Pass pass) noexcept;
  /// That chunk, of so many elements, has been halted and cut. If none came to an end the next one gets more time, for fewer.
  void follow_halt(const Chunk& chunk, std::uint32_t asked) noexcept;
  void learn(const Chunk& chunk, double took_ns, bool completed_before_wait, Pass pass) noexcept;
  /// Past requests that nothing is left of.
  void pass_over(Cursor& next, Pass pass) const noexcept;
  std::int64_t chunk_ns() const noexcept {
    return requests_.empty() ? 0 : requests_.front().chunk_time.count();
  }
  /// Whether what is halted early for others has cost no more of the device's time than there is for that. Where answers come from a second
  /// dispatch, or elements are dear, it leaves little that stands.
  bool spares_others() const noexcept { return thrown_away_ns_ * spared_part <= gpu_ns_; }
  /// A chunk that takes so long may be halted.
  std::chrono::nanoseconds usual_whole_for() const noexcept {
    return std::chrono::nanoseconds((spares_others() ? 1 : 2) * chunk_ns());
  }
  bool at_end(const Cursor& next) const noexcept { return next.request == requests_.size(); }
  /// So many or, where fewer would spare the device nothing, more.
  std::uint32_t at_least(std::uint32_t elements, std::size_t request, Pass pass) const noexcept;
  std::uint32_t total(std::size_t request, Pass pass) const noexcept;
  std::uint32_t per_chunk(std::size_t request, Pass pass) const noexcept;
  /// Of these, so much is a chunk.
  double share(std::size_t request) const noexcept;
  void record(const Chunk& chunk, Pass pass, accel::Submit& lane) noexcept;
  void unpack(const Chunk& chunk, Pass pass) noexcept;
  /// What it has of a request's places; misuse where the request is not between its first and its last.
  PlaceRange part(const Chunk& chunk, std::size_t request, Pass pass) const noexcept;
  template <class Each>
  void each_part(const Chunk& chunk, Pass pass, Each each) noexcept;
  GpuQuery& query(std::size_t request) const noexcept {
    return *static_cast<GpuQuery*>(requests_[request].query);
  }

  Structures& structures_;
  Lanes& lanes_;
  const RowSource& rows_;
  const std::span<const Request> requests_;
  const TimeSpan times_;
  ExecutorCallbacks* const callbacks_;
  accel::TlasView view_;
  std::optional<std::uint32_t> slot_;  // of the view, once there is one
  bool begun_ = false;                 // the next lane, by bring_up
  bool brought_up_ = false;            // with structures that did not stand
  bool in_later_stage_ = false;        // some query is in a stage after its first
  ChunkPace pace_;
  std::int64_t gpu_ns_ = 0, thrown_away_ns_ = 0;  // the second is part of the first
  double element_ns_ = 0.0;                       // in the last chunk that was whole
  std::chrono::nanoseconds whole_for_;
  std::uint32_t undivided_per_chunk_ = 0;  // 0: those that are not to be divided are not
  std::size_t known_ = 0;  // requests of the pass that a chunk was learnt from, and all before them
};

}  // namespace rtstdb::query
