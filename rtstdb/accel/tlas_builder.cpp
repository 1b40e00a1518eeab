#include "rtstdb/accel/tlas_builder.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/tree_buffers.hpp"
#include "rtstdb/accel/tree_levels.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr gpu::ShaderId pass_shaders[] = {
    gpu::ShaderId::tlas_centers, gpu::ShaderId::tlas_codes, gpu::ShaderId::tlas_leaves,
    gpu::ShaderId::tlas_merge,   gpu::ShaderId::tlas_root,  gpu::ShaderId::tlas_count,
    gpu::ShaderId::tlas_queue,
};

/// The work of a pass over the instances, relative to the copy of a row, and the number of instances per
/// workgroup.
struct Pass {
  std::uint32_t weight, per_group;
};
constexpr std::array visiting_passes{Pass{1, shared::blas_tile}, Pass{1, shared::blas_tile},
                                     Pass{1, shared::blas_tile}, Pass{5, 64 * shared::blas_run}};
constexpr std::uint32_t sort_steps_a_weight = 6;
/// Work per instance of all levels together.
constexpr std::uint32_t all_levels_weight = 3;

/// The number of levels recorded at once. Each level is two dispatches, even if the tree does not have it; a
/// deeper tree needs another submission.
std::uint32_t levels_recorded(std::uint32_t count) {
  return std::min<std::uint32_t>(shared::blas_levels_recorded,
                                 3 + static_cast<std::uint32_t>(std::bit_width(count)) / 3);
}

}  // namespace

Result<TlasBuilder> TlasBuilder::create(gpu::Device& device, std::uint32_t capacity) {
  TlasBuilder builder;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto pipeline = device.create_pipeline(pass_shaders[i]);
    if (!pipeline) return pipeline.error();
    builder.pipelines_[i] = std::move(pipeline).value();
  }
  auto sort = RadixSort::create(device);
  if (!sort) return sort.error();
  builder.sort_ = std::move(sort).value();
  builder.capacity_ = capacity + capacity % 2;
  const std::size_t n = builder.capacity_;
  const std::size_t nodes = wide_node_bound(capacity, 1);
  const std::size_t state_bytes = 4 * shared::blas_state_words;
  const gpu::BufferRequest wanted[] = {
      {&builder.sorted_, RadixSort::sorted_buffer("TLAS keys", n)},
      {&builder.low_words_, {.name = "TLAS words", .size_bytes = 2 * 4 * n}},
      {&builder.offsets_, RadixSort::counts_buffer("TLAS offsets", n)},
      {&builder.tree_, tree_buffer("TLAS tree", n)},
      {&builder.binary_, binary_buffer("TLAS binary", n)},
      {&builder.arrivals_, {.name = "TLAS arrivals", .size_bytes = 4 * n}},
      {&builder.queue_, {.name = "TLAS queue", .size_bytes = 16 * nodes}},
      {&builder.children_, {.name = "TLAS children", .size_bytes = 32 * nodes}},
      {&builder.state_, {.name = "TLAS state", .size_bytes = state_bytes, .indirect = true}},
      {&builder.state_readback_,
       {.name = "TLAS state readback", .size_bytes = state_bytes, .memory = gpu::Memory::readback}},
  };
  if (auto made = device.create_buffers(wanted); !made) return made.error();
  return builder;
}

Result<TlasBuilder::Bound> TlasBuilder::bind(gpu::Device& device, const gpu::Buffer& bounds,
                                             const gpu::Buffer& motion_boxes,
                                             const gpu::Buffer& nodes) const {
  // In the order of tree_scratch.glsl.
  const gpu::Buffer* buffers[] = {&bounds,  &nodes,     &sorted_, &low_words_, &offsets_, &tree_,
                                  &binary_, &arrivals_, &queue_,  &state_,     &children_};
  Bound bound;
  const auto connect = [&](std::size_t pass, gpu::Bindings& bindings) -> Result<void> {
    auto made = device.create_bindings(pipelines_[pass], buffers);
    if (!made) return made.error();
    bindings = std::move(made).value();
    return {};
  };
  for (std::size_t i = 0; i < pass_count; ++i) {
    if (auto made = connect(i, bound.passes[i]); !made) return made.error();
  }
  buffers[0] = &motion_boxes;
  for (std::size_t i = 0; i < reading_pass_count; ++i) {
    if (auto made = connect(i, bound.of_motion[i]); !made) return made.error();
  }
  auto sort = sort_.bind(device, sorted_, low_words_, offsets_);
  if (!sort) return sort.error();
  bound.sort = std::move(sort).value();
  return bound;
}

void TlasBuilder::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  // Without instances there are no levels, and every pass does nothing.
  recorder.fill(state_, 0, 4 * shared::blas_state_words, 0);
  recorder.barrier();
  for (std::size_t i = 0; i < pass_count; ++i) {
    recorder.dispatch(pipelines_[i], bound.passes[i], shared::BlasArgs{}, 1);
    recorder.barrier();
  }
  sort_.record_warm_up(bound.sort, recorder);
}

shared::BlasArgs TlasBuilder::args() const noexcept {
  shared::BlasArgs args{};
  args.count = count_;
  args.target = tree_.address();
  return args;
}

void TlasBuilder::begin(std::uint32_t count) noexcept {
  count_ = count;
  stage_ = Stage::clear;
  next_ = levels_taken_ = 0;
}

std::uint64_t TlasBuilder::work(std::uint32_t count) noexcept {
  std::uint64_t each = all_levels_weight;
  for (const Pass& pass : visiting_passes)
    each += pass.weight;
  return each * count + RadixSort::steps(RadixSort::Words::upper) * (count / sort_steps_a_weight);
}

std::uint32_t TlasBuilder::passes(std::uint32_t count) noexcept {
  constexpr std::uint32_t clear_and_root = 2;
  return clear_and_root + static_cast<std::uint32_t>(visiting_passes.size()) +
         RadixSort::steps(RadixSort::Words::upper) + levels_recorded(count);
}

std::uint64_t TlasBuilder::record(std::uint64_t most, const Bound* source, const Bound& bound,
                                  gpu::Recorder& recorder) {
  switch (stage_) {
    case Stage::clear:
      recorder.barrier();
      recorder.fill(state_, 0, 4 * shared::blas_state_words, 0);
      recorder.barrier();
      stage_ = Stage::centers;
      return 1;
    case Stage::centers:
      return record_pass(centers_pass, most, Stage::codes, source, bound, recorder);
    case Stage::codes:
      return record_pass(codes_pass, most, Stage::sort, source, bound, recorder);
    case Stage::sort:
      sort_.record_step(next_, count_, capacity_, words_, bound.sort, recorder);
      if (++next_ == RadixSort::steps(words_)) go_on_with(Stage::leaves);
      return 1 + count_ / sort_steps_a_weight;
    case Stage::leaves:
      return record_pass(leaves_pass, most, Stage::merge, source, bound, recorder);
    case Stage::merge:
      return record_pass(merge_pass, most, Stage::root, source, bound, recorder);
    case Stage::root:
      recorder.dispatch(pipelines_[root_pass], bound.passes[root_pass], args(), 1);
      recorder.barrier();
      go_on_with(Stage::levels);
      return 1;
    case Stage::levels:
      record_level(bound, recorder);
      if (++next_ == levels_recorded(count_)) {
        recorder.copy(state_, 0, state_readback_, 0, 4 * shared::blas_state_words);
        go_on_with(Stage::submission);
      }
      return 1 + std::uint64_t{all_levels_weight} * count_ / levels_recorded(count_);
    case Stage::submission:
      break;
  }
  return 0;
}

std::uint64_t TlasBuilder::record_pass(PassIndex index, std::uint64_t most, Stage then, const Bound* source,
                                       const Bound& bound, gpu::Recorder& recorder) {
  const Pass& pass = visiting_passes[index];
  const bool of_motion = source != nullptr && index < reading_pass_count;
  shared::BlasArgs args = this->args();
  // A motion box contains a box at the begin of the window and one at its end.
  constexpr std::uint32_t box_words = 6;
  args.box_first = of_motion ? box_words : 0;
  args.box_stride = of_motion ? 4 * shared::motion_box_texels : box_words;
  args.first = next_;
  const std::uint32_t groups = groups_of(count_, pass.per_group);
  const std::uint64_t per_group = std::uint64_t{pass.weight} * pass.per_group;
  const auto taken =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(groups - next_, most / per_group + 1));
  recorder.dispatch(pipelines_[index], of_motion ? source->of_motion[index] : bound.passes[index], args,
                    taken);
  recorder.barrier();
  next_ += taken;
  if (next_ == groups) go_on_with(then);
  return taken * per_group;
}

void TlasBuilder::record_level(const Bound& bound, gpu::Recorder& recorder) {
  shared::BlasArgs args = this->args();
  if (next_ == 0 && levels_taken_ > 0) {
    // Continues at the level behind the last recorded one.
    recorder.fill(state_, 4 * shared::blas_levels, 4 * (shared::blas_state_words - shared::blas_levels), 0);
    recorder.barrier();
    recorder.copy(state_readback_, 4 * level_word(levels_recorded(count_), 0), state_, 4 * level_word(0, 0),
                  4 * shared::blas_level_words);
    recorder.barrier();
  }
  args.level = next_;
  const std::size_t groups = 4 * level_word(args.level, shared::blas_level_groups);
  for (const PassIndex pass : {count_pass, queue_pass}) {
    recorder.dispatch_indirect(pipelines_[pass], bound.passes[pass], args, state_, groups);
    recorder.barrier();
  }
}

bool TlasBuilder::take_levels(std::vector<std::uint32_t>& levels) {
  const auto state = state_readback_.host_as<const std::uint32_t>();
  if (state[shared::blas_disorder] != 0) {
    // Later trees of this world sort by both words from the start.
    words_ = RadixSort::Words::both;
    begin(count_);
    return false;
  }
  if (levels_taken_ == 0) levels.clear();
  const std::uint32_t recorded = levels_recorded(count_);
  for (std::uint32_t level = 0; level < recorded; ++level) {
    const std::uint32_t first = state[level_word(level, shared::blas_level_first)];
    const std::uint32_t nodes = state[level_word(level, shared::blas_level_count)];
    if (nodes != 0) levels.push_back(first);
    const std::uint32_t after = state[level_word(level + 1, shared::blas_level_count)];
    if (nodes != 0 && after == 0) {
      levels.push_back(first + nodes);
      return true;
    }
  }
  levels_taken_ += recorded;
  go_on_with(Stage::levels);
  return false;
}

bool TlasBuilder::run(std::uint32_t count, const Bound& bound, Submit& submit,
                      std::vector<std::uint32_t>& levels) {
  constexpr std::uint64_t all = std::numeric_limits<std::uint64_t>::max();
  for (begin(count);; submit.begin()) {
    while (!recorded())
      record(all, nullptr, bound, submit.recorder());
    if (!submit.run()) return false;
    if (take_levels(levels)) return true;
  }
}

}  // namespace rtstdb::accel
