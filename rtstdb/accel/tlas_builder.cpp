#include "rtstdb/accel/tlas_builder.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/tree_levels.hpp"

namespace rtstdb::accel {
namespace {

enum PassIndex : std::size_t {
  centers_pass,
  codes_pass,
  leaves_pass,
  merge_pass,
  root_pass,
  count_pass,
  queue_pass,
};

constexpr gpu::ShaderId pass_shaders[] = {
    gpu::ShaderId::tlas_centers, gpu::ShaderId::tlas_codes, gpu::ShaderId::tlas_leaves,
    gpu::ShaderId::tlas_merge,   gpu::ShaderId::tlas_root,  gpu::ShaderId::tlas_count,
    gpu::ShaderId::tlas_queue,
};

/// Levels that are recorded at once: each is two dispatches more, also where the tree does not have it; a deeper
/// tree takes another submission.
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
  builder.capacity_ = capacity;
  const std::size_t n = capacity;
  const std::size_t nodes = wide_node_bound(capacity, 1);
  const std::size_t offsets = std::max(n, RadixSort::count_words(n));
  const std::size_t state_bytes = 4 * shared::blas_state_words;
  const std::pair<gpu::Buffer*, gpu::BufferOptions> wanted[] = {
      {&builder.keys_, {.name = "TLAS keys", .size_bytes = 2 * 8 * n}},
      {&builder.values_, {.name = "TLAS values", .size_bytes = 2 * 4 * n}},
      {&builder.offsets_, {.name = "TLAS offsets", .size_bytes = 4 * offsets}},
      {&builder.box_lo_, {.name = "TLAS boxes, low", .size_bytes = 2 * 12 * n}},
      {&builder.box_hi_, {.name = "TLAS boxes, high", .size_bytes = 2 * 12 * n}},
      {&builder.binary_, {.name = "TLAS binary", .size_bytes = 16 * n}},
      {&builder.arrivals_, {.name = "TLAS arrivals", .size_bytes = 4 * n}},
      {&builder.costs_, {.name = "TLAS costs", .size_bytes = 16 * n}},
      {&builder.queue_, {.name = "TLAS queue", .size_bytes = 16 * nodes}},
      {&builder.children_, {.name = "TLAS children", .size_bytes = 32 * nodes}},
      {&builder.state_, {.name = "TLAS state", .size_bytes = state_bytes, .indirect = true}},
      {&builder.state_readback_,
       {.name = "TLAS state readback", .size_bytes = state_bytes, .memory = gpu::Memory::readback}},
  };
  for (const auto& [buffer, options] : wanted) {
    auto made = device.create_buffer(options);
    if (!made) return made.error();
    *buffer = std::move(made).value();
  }
  return builder;
}

Result<TlasBuilder::Bound> TlasBuilder::bind(gpu::Device& device, const gpu::Buffer& bounds,
                                             const gpu::Buffer& nodes) const {
  // In the order of tree_scratch.glsl.
  const gpu::Buffer* buffers[] = {&bounds,  &nodes,     &keys_, &values_, &offsets_, &box_lo_, &box_hi_,
                                  &binary_, &arrivals_, &keys_, &costs_,  &queue_,   &state_,  &children_};
  Bound bound;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto bindings = device.create_bindings(pipelines_[i], buffers);
    if (!bindings) return bindings.error();
    bound.passes[i] = std::move(bindings).value();
  }
  auto sort = sort_.bind(device, keys_, values_, offsets_);
  if (!sort) return sort.error();
  bound.sort = std::move(sort).value();
  return bound;
}

void TlasBuilder::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  // No instances, no levels: every pass finds nothing to do.
  recorder.fill(state_, 0, 4 * shared::blas_state_words, 0);
  recorder.barrier();
  for (std::size_t i = 0; i < pass_count; ++i) {
    recorder.dispatch(pipelines_[i], bound.passes[i], shared::BlasArgs{}, 1);
    recorder.barrier();
  }
  sort_.record_warm_up(bound.sort, recorder);
}

void TlasBuilder::record_tree(const shared::BlasArgs& args, RadixSort::Words words, const Bound& bound,
                              gpu::Recorder& recorder) const {
  const auto dispatch = [&](PassIndex pass, std::uint32_t groups) {
    recorder.dispatch(pipelines_[pass], bound.passes[pass], args, groups);
    recorder.barrier();
  };
  const std::uint32_t tiles = groups_of(args.count, shared::blas_tile);
  recorder.barrier();
  recorder.fill(state_, 0, 4 * shared::blas_state_words, 0);
  recorder.barrier();
  dispatch(centers_pass, tiles);
  dispatch(codes_pass, tiles);
  sort_.record(args.count, args.half_size, words, bound.sort, recorder);
  dispatch(leaves_pass, tiles);
  dispatch(merge_pass, groups_of(args.count, 64 * shared::blas_run));
  dispatch(root_pass, 1);
}

void TlasBuilder::record_levels(shared::BlasArgs args, std::uint32_t levels, const Bound& bound,
                                gpu::Recorder& recorder) const {
  for (args.level = 0; args.level < levels; ++args.level) {
    const std::size_t groups = 4 * level_word(args.level, shared::blas_level_groups);
    for (const PassIndex pass : {count_pass, queue_pass}) {
      recorder.dispatch_indirect(pipelines_[pass], bound.passes[pass], args, state_, groups);
      recorder.barrier();
    }
  }
  recorder.copy(state_, 0, state_readback_, 0, 4 * shared::blas_state_words);
}

bool TlasBuilder::run(std::uint32_t count, const Bound& bound, Submit& submit,
                      std::vector<std::uint32_t>& levels) {
  shared::BlasArgs args{};
  args.count = count;
  args.half_size = capacity_;
  gpu::Recorder& recorder = submit.recorder();
  record_tree(args, words_, bound, recorder);
  const std::uint32_t recorded = levels_recorded(count);
  levels.clear();
  while (true) {
    record_levels(args, recorded, bound, recorder);
    if (!submit.run()) return false;
    const auto state = state_readback_.host_as<const std::uint32_t>();
    if (state[shared::blas_disorder] != 0) {
      // The next tree of such a world is not tried without.
      words_ = RadixSort::Words::both;
      submit.begin();
      record_tree(args, words_, bound, recorder);
      continue;
    }
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
    // On from the level behind the last that was recorded.
    submit.begin();
    recorder.fill(state_, 4 * shared::blas_levels, 4 * (shared::blas_state_words - shared::blas_levels), 0);
    recorder.barrier();
    recorder.copy(state_readback_, 4 * level_word(recorded, 0), state_, 4 * level_word(0, 0),
                  4 * shared::blas_level_words);
    recorder.barrier();
  }
}

}  // namespace rtstdb::accel
