#pragma once
// A prepared query as the GPU executor sees it: pack what the caller filled in, record its dispatch, unpack
// the answers.

#include <memory>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/executor.hpp"
#include "rtstdb/query/prepared_queries.hpp"

namespace rtstdb::query {

class GpuQuery : public PreparedQuery {
 public:
  /// Connects to the pool and the slots; again whenever the pool's generation changed. Setup.
  virtual Result<void> bind(gpu::Device& device, const accel::GeometryPool& pool,
                            const accel::Tlas& tlas) = 0;
  /// A dispatch that answers nothing, on the first slot: drivers compile at the first dispatch.
  virtual void record_warm_up(gpu::Recorder& recorder) noexcept = 0;
  /// The first `count` elements, which have passed check, to device form; and the dispatch that answers them.
  virtual void record(std::uint32_t count, const RowSource& rows, const accel::Tlas& tlas,
                      const accel::TlasView& view, gpu::Recorder& recorder) noexcept = 0;
  /// Answers to the caller's span.
  virtual void unpack(std::uint32_t count, const accel::TlasView& view) noexcept = 0;

  // On lavapipe the elements of a group share one allowance of work, so that whether an element finishes
  // could depend on its neighbours in the batch. Those left incomplete are asked again, each in a group of
  // its own.
  virtual bool has_incomplete() const noexcept = 0;
  /// Records the dispatch that does it, after unpack.
  virtual void record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept = 0;
  virtual void unpack_again(const accel::TlasView& view) noexcept = 0;

  /// Whether at least one answer of the batch is incomplete or overflowed.
  virtual bool truncated() const noexcept = 0;

  /// Setup. From then on it is one of `queries`, until leave.
  void join(std::shared_ptr<PreparedQueries> queries) {
    queries_ = std::move(queries);
    queries_->join(*this);
  }

  std::uint32_t bound_generation = 0;
  bool bound = false;

 protected:
  /// The first thing that the destructor of every query does: nobody may connect one that is half gone.
  void leave() noexcept {
    if (queries_) queries_->leave(*this);
  }

 private:
  std::shared_ptr<PreparedQueries> queries_;
};

}  // namespace rtstdb::query
