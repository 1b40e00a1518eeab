#pragma once
// The work of the device on slots: creates and binds their buffers, uploads rows, and records the passes that
// compute instances, trees, node boxes and costs.
//
// Threads: one. create, create_slot and bind are setup; the other functions are called in the tick and do not
// allocate.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas_slot.hpp"

namespace rtstdb::accel {

class TlasPasses {
 public:
  /// Errors: capacity, out_of_memory, device_lost, here and in create_slot and bind.
  static Result<TlasPasses> create(gpu::Device& device, std::uint32_t max_entities);
  Result<void> create_slot(gpu::Device& device, TlasSlot& slot, const std::string& name) const;
  Result<void> bind(gpu::Device& device, const GeometryPool& pool, TlasSlot& slot);
  /// Records an empty dispatch of every pass.
  void record_warm_up(const TlasSlot& slot, gpu::Recorder& recorder) const;

  std::uint32_t max_entities() const noexcept { return max_entities_; }
  std::uint32_t late_base() const noexcept { return late_base_; }

  /// A new batch begins: all uploads of the previous one have been copied.
  void begin_batch() noexcept { uploaded_ = 0; }
  /// The number of rows that the batch can still upload.
  std::size_t upload_capacity() const noexcept { return max_entities_ - uploaded_; }
  /// Uploads the rows of `entities` to the slot, whose tree becomes invalid if instances appear or disappear.
  /// Returns the number of rows.
  std::uint32_t upload(TlasSlot& slot, std::span<const std::uint32_t> entities, const store::RowSource& rows,
                       gpu::Recorder& recorder);
  /// The places of the instances that record_instances() and patch() process when they are listed.
  std::span<std::uint32_t> listed_places() const noexcept { return listed_places_.host_as<std::uint32_t>(); }
  /// Computes `count` instances from `first` on, or the listed ones.
  void record_instances(const TlasSlot& slot, std::uint32_t first, std::uint32_t count, bool listed,
                        gpu::Recorder& recorder) const;
  /// Computes the boxes above the listed instances.
  void patch(TlasSlot& slot, std::uint32_t listed, gpu::Recorder& recorder) const;
  void find_parents(TlasSlot& slot, std::uint32_t first, std::uint32_t count, gpu::Recorder& recorder) const {
    patch_.find_parents(first, count, slot.patch, recorder);
  }
  /// Computes the boxes of all nodes, level by level, or of some nodes of one level.
  void refit(const TlasSlot& slot, gpu::Recorder& recorder) const;
  void refit_nodes(const TlasSlot& slot, std::uint32_t first, std::uint32_t count,
                   gpu::Recorder& recorder) const;
  /// Builds the tree. Large trees submit and begin `submit` again. False: the device is lost.
  bool build(TlasSlot& slot, Submit& submit);
  /// Estimates the cost of the tree for TlasSlot::growth().
  void find_cost(const TlasSlot& slot, gpu::Recorder& recorder) const;
  /// The builder of large trees, which build() also uses; only if max_entities is at least min_made_ahead.
  TlasBuilder& large_build() noexcept { return *large_build_; }
  bool is_large(const TlasSlot& slot) const noexcept { return slot.visible_count > shared::small_build_max; }

 private:
  std::uint32_t max_entities_ = 0;
  std::uint32_t late_base_ = 0;
  std::uint32_t uploaded_ = 0;  // rows in changed_rows_ of the current batch
  gpu::Buffer changed_rows_, listed_places_;
  gpu::Buffer bounds_;  // of the tree being built
  BuildScratch small_scratch_;
  std::optional<TlasBuilder> large_build_;  // absent when every possible world is small
  TlasPatch patch_;
  gpu::Pipeline apply_rows_, instances_pass_, small_build_, refit_, cost_;
};

}  // namespace rtstdb::accel
