#pragma once
// Prepares the slot for the window after a long one while that window lasts. Each batch of the last part of
// the window records a share, so that the slot is ready in time and no batch waits for the whole. The new
// slot copies the tree of the slot in use, or, if that tree has degraded, gets one that is built over the
// instances at the end of the window in use. It then gets instances and boxes for its own window. Rows are
// copied over several batches. Rows that change in between are uploaded again by each batch, so that the
// copied rows are always those of one version, which may be one that was discarded.
//
// Threads: one, in the tick; nothing allocates.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/accel/tlas_passes.hpp"
#include "rtstdb/accel/tlas_slot.hpp"

namespace rtstdb::accel {

class TlasNextSlot {
 public:
  TlasNextSlot() = default;
  /// `enabled`: false prepares nothing.
  TlasNextSlot(bool enabled, std::uint32_t max_entities);

  bool enabled() const noexcept { return enabled_; }
  /// The numbers of slots prepared so far, and of those with a tree of their own.
  std::uint64_t prepared() const noexcept { return prepared_; }
  std::uint64_t built() const noexcept { return built_; }

  /// Takes the results of earlier submissions, which have finished: the levels of a built tree, or the cost
  /// that decides whether the prepared slot is used.
  void collect(TlasPasses& passes) noexcept;
  /// Records a part of the preparation of the slot that follows `used`, which serves a batch without having
  /// been filled for it. Submits nothing. Returns the number of uploaded rows.
  std::uint64_t prepare(TlasSlot& used, const store::RowSource& rows, const TlasRequest& request,
                        TlasSlots& slots, TlasPasses& passes, gpu::Recorder& recorder) noexcept;
  /// A slot is filled for a request: abandons a preparation that uses it.
  void note_fill(const TlasSlot& slot) noexcept;
  /// A long window begins without preparation.
  void note_long_window() noexcept;
  /// The builder of large trees is used for another tree: abandons a build.
  void abandon_build() noexcept;
  /// Stops using a prepared slot, in favour of the slots that it replaced. False: it replaced none.
  bool retire(const TlasSlot& prepared, TlasSlots& slots) noexcept;

 private:
  /// Where the tree of the slot comes from.
  enum class TreeSource : std::uint8_t { copied, built };
  enum class Step : std::uint8_t { build, tree, rows, instances, boxes, parents, cost, verdict };
  /// The preparation in progress.
  struct Preparation {
    TlasSlot* slot = nullptr;    ///< null: nothing is being prepared
    TlasSlot* source = nullptr;  ///< the slot whose window ends
    WorldTime begun{}, due{};
    Step step = Step::tree;
    std::uint32_t row_count = 0;
    TreeSource tree = TreeSource::copied;
    std::uint32_t next = 0;  ///< first element that the current step has not processed
    std::size_t level = 0;   ///< level whose boxes are computed
    std::uint64_t done = 0;  ///< work recorded so far
    std::uint64_t total = 0;
  };

  /// Whether to begin preparing the successor of this slot, and with which tree.
  std::optional<TreeSource> tree_to_begin(TlasSlot& used, const store::RowSource& rows,
                                          const TlasRequest& request) const noexcept;
  void begin(TlasSlot& used, TlasSlot& slot, const store::RowSource& rows, const TlasRequest& request,
             TreeSource tree, TlasSlots& slots, TlasPasses& passes) noexcept;
  void abandon() noexcept;
  /// Notes that preparing the successor of `source` failed, since too many rows changed during it.
  void note_failure(TlasSlot& source) noexcept;
  /// Remaining work once the slot has its tree, and all of the work, in the weights of tlas_next_slot.cpp.
  static std::uint64_t work_with_tree(const TlasSlot& slot, std::uint32_t row_count) noexcept;
  static std::uint64_t total_work(const TlasSlot& used, std::uint32_t row_count, TreeSource tree) noexcept;
  /// The work that a batch at `now` has to do.
  std::uint64_t due_work(WorldTime now) const noexcept;
  /// Records about `max_work`, at most the rest of the current step. Returns the recorded work.
  std::uint64_t record_step(std::uint64_t max_work, const store::RowSource& rows, TlasPasses& passes,
                            gpu::Recorder& recorder) noexcept;
  void copy_rows(std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) noexcept;
  /// Brings the rows that have been copied to the version of `rows`. False: too many changed, and the
  /// preparation was abandoned.
  bool catch_up(const store::RowSource& rows, TlasPasses& passes, gpu::Recorder& recorder) noexcept;
  void take_tree(TlasPasses& passes) noexcept;
  void judge() noexcept;

  bool enabled_ = false;
  Preparation current_;
  std::vector<std::uint32_t> changed_;
  double lead_fraction_ = 1.0;         // of a window, before its end, at which preparation begins
  std::uint32_t windows_to_skip_ = 0;  // before the next preparation, after failed ones
  std::uint64_t uploaded_rows_ = 0;    // by the current call of prepare()
  std::uint64_t prepared_ = 0, built_ = 0;
};

}  // namespace rtstdb::accel
